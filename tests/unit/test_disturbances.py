"""Disturbances and noise: the loop's response to them is that of its transfer functions, in both simulations."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from design.blocks.block import plant_block
from design.design_file import Design
from experiments.drive.sampled_loop import Drive, simulate_sampled
from experiments.engine.simulate import simulate
from experiments.runs.design_loop import design_loop
from experiments.runs.disturbances import Disturbances, noise, steps
from experiments.runs.references import Reference, SampledReference, sinusoid
from experiments.runs.simulate_design import simulate_design
from identification.base.errors import InputError

REST = sinusoid(0.0, 1.5)
FREE = (-np.inf, np.inf)


def parts(design: Design, omega: float) -> tuple[complex, complex]:
    """P exp(-h s) and C of the linear loop at s = j omega."""
    s = np.array([1j * omega])
    forward, feedback = (block(s) for block in design.controller_parts())
    late = np.exp(-s * design.loop_plant.delay_s)
    return complex(plant_block(design.loop_plant)(s)[0]), complex((forward / (1 - feedback * late))[0])


@pytest.mark.parametrize("where", ["input", "output", "noise"])
@pytest.mark.parametrize("omega", [0.7, 6.0])
def test_a_sinusoid_comes_out_as_the_transfer_functions_say(extended_design: Design, where: str, omega: float) -> None:
    amplitude, phase = 0.8, 0.6
    signal = Reference((amplitude,), (omega,), (phase,), 0.0)
    loop = design_loop(extended_design, REST, "corrected", disturbances=Disturbances(**{where: signal}))
    times = np.linspace(0.0, 36.0, 1201)
    run = simulate(loop, FREE, times)
    P, C = parts(extended_design, omega)
    gain = {"input": P, "output": 1.0, "noise": -P * C}[where] / (1 + P * C)
    late = times > 32.0  # the slowest roots are two at -1
    expected = (amplitude * gain * np.exp(1j * (omega * times + phase))).imag
    np.testing.assert_allclose(run.outputs["output"][late], expected[late], atol=1e-7 * amplitude)
    np.testing.assert_allclose(run.outputs["error"], -run.outputs["output"], atol=1e-12)
    if where == "noise":
        np.testing.assert_allclose(run.outputs["measured"], run.outputs["output"] + signal(times), atol=1e-9)


def test_steps_jump_where_they_should_and_one_within_reach_is_held(extended_design: Design) -> None:
    at_output = steps([(-2.0, 1.25), (3.0, 0.5)])
    run = simulate_design(
        extended_design,
        (-8.0, 9.0),
        SampledReference(np.zeros(1), np.zeros(1)),
        until_s=20.0,
        samples=20001,
        rate_limit=50.0,
        disturbances=Disturbances(input=steps([(4.0, 0.2)]), output=at_output),
    )
    y, before = run.outputs["output"], np.array([499, 1249])
    np.testing.assert_allclose((y[before + 1] - y[before]), [3.0, -5.0], atol=0.1)
    assert np.abs(np.diff(run.saturated_control)).max() <= 50.0 * 1e-3 * (1 + 1e-9)
    assert run.saturated_control[-1] == pytest.approx(-4.0, abs=1e-3)
    assert np.abs(y[-1]) < 1e-3


DISTURBANCES = {
    "input": Disturbances(input=steps([(2.0, 0.0), (-1.0, 0.3)])),
    "all": Disturbances(sinusoid(2.0, 3.0, 0.5), steps([(1.0, 0.3)]), noise(0.1, 200.0, 3, 1.0)),
}


@pytest.mark.parametrize("disturbances", DISTURBANCES.values(), ids=DISTURBANCES)
def test_a_sampled_loop_tends_to_the_continuous_one(extended_design: Design, disturbances: Disturbances) -> None:
    reference, limits, errors = sinusoid(20.0, 1.5, 0.3), (-8.0, 9.0), []
    for rate in (1000.0, 4000.0):
        run = simulate_sampled(
            extended_design, reference, "corrected", Drive(rate, "tustin", limits), 1.0, disturbances=disturbances
        )
        loop = design_loop(extended_design, reference, "corrected", disturbances=disturbances)
        exact = simulate(loop, limits, run.time_s)
        errors.append(np.abs(run.output - exact.outputs["output"]).max())
        if disturbances.noise:
            assert run.measured is not None
            np.testing.assert_allclose(run.measured - run.output, disturbances.noise(run.time_s), atol=1e-12)
    assert errors[1] < 0.3 * errors[0] < 0.01


@pytest.mark.parametrize("input_delay_s", [0.0, 0.0004, 0.0123])
def test_a_disturbance_passes_the_plants_dead_time_and_not_the_drives(
    extended_design: Design, input_delay_s: float
) -> None:
    """Until the control comes back the samples are those of the plant alone, without a controller."""
    plant = replace(extended_design.plant, delay_s=0.05)
    drive = Drive(2000.0, "tustin", (-8.0, 9.0), input_delay_s=input_delay_s)
    disturbances = Disturbances(input=steps([(2.0, 0.0), (-3.0, 0.0102)]))
    run = simulate_sampled(extended_design, REST, None, drive, 0.12, plant, disturbances=disturbances)
    loop = design_loop(extended_design, REST, None, plant, disturbances)
    exact = simulate(replace(loop, C=np.zeros(len(loop.C)), E=np.zeros(3)), (-8.0, 9.0), run.time_s)
    # the computer answers at the earliest one dead time after it sees a thing
    early = run.time_s < 0.0999 + input_delay_s
    assert np.abs(exact.outputs["output"][early]).max() > 1e-3
    np.testing.assert_allclose(run.output[early], exact.outputs["output"][early], atol=1e-10)


def test_noise_is_straight_lines_between_normal_samples_of_its_seed() -> None:
    found = noise(0.5, 100.0, 7, 100.0)
    assert found.values.std() == pytest.approx(0.5, rel=0.03)
    middle = found(found.time_s[:-1] + 0.005)
    np.testing.assert_allclose(middle, (found.values[1:] + found.values[:-1]) / 2, atol=1e-9)
    np.testing.assert_array_equal(noise(0.5, 100.0, 7, 1.0).values, found.values[:101])
    assert np.any(noise(0.5, 100.0, 8, 1.0).values != found.values[:101])


@pytest.mark.parametrize(
    ("levels", "part"),
    [([(1.0, -1.0)], ">= 0"), ([(np.nan, 1.0)], "finite"), ([(1.0, 2.0), (3.0, 2.0)], "two levels")],
)
def test_steps_that_are_none(levels: list[tuple[float, float]], part: str) -> None:
    with pytest.raises(InputError, match=part):
        steps(levels)


@pytest.mark.parametrize(
    "arguments", [(-1.0, 1.0, 0, 1.0), (1.0, 0.0, 0, 1.0), (1.0, 1.0, -1, 1.0), (1.0, 1e9, 0, 1.0)]
)
def test_noise_that_is_none(arguments: tuple[float, float, int, float]) -> None:
    with pytest.raises(InputError, match="the noise has"):
        noise(*arguments)


@pytest.mark.parametrize("rate_limit", [np.inf, 200.0])
def test_a_true_plant_that_jumps_a_dead_time_later(extended_design: Design, rate_limit: float) -> None:
    """With as many zeros as poles: the transfer functions' response without limits, the sampled loop's under them."""
    plant = replace(extended_design.plant, real_zeros=(900.0,) * extended_design.plant.relative_degree)
    reference, disturbances = sinusoid(20.0, 1.5, 0.3), Disturbances(input=steps([(2.0, 0.2)]))
    loop, errors = design_loop(extended_design, reference, "corrected", plant, disturbances), []
    for rate in (1000.0, 16000.0):
        drive = Drive(rate, "tustin", (-8.0, 9.0), rate_limit=rate_limit)
        run = simulate_sampled(extended_design, reference, "corrected", drive, 0.7, plant, disturbances=disturbances)
        exact = simulate(loop, (-8.0, 9.0), run.time_s, rate=rate_limit)
        errors.append(np.quantile(np.abs(run.output - exact.outputs["output"]), 0.95))
    assert np.abs(exact.control).max() > 9.0
    assert errors[1] < 0.2 * errors[0] < 0.02

    omega, times = 2.0, np.linspace(0.0, 36.0, 1201)
    loop = design_loop(extended_design, REST, None, plant, Disturbances(input=sinusoid(1.0, omega)))
    late, s = times > 32.0, np.array([1j * omega])
    C, P = parts(extended_design, omega)[1], complex(plant(s)[0])
    expected = (P / (1 + P * C) * np.exp(1j * omega * times)).imag
    np.testing.assert_allclose(simulate(loop, FREE, times).outputs["output"][late], expected[late], atol=1e-7)
