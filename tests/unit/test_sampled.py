"""The loop with a computer and a drive: closed forms, its equations by scipy, and the continuous loop as its limit."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from itertools import pairwise

import numpy as np
import pytest
from sampled_response import response
from scipy.integrate import solve_ivp
from scipy.signal import lsim, zpk2ss

from design.anti_windup.compensator import AntiWindup, second_order
from design.blocks.block import Block, plant_block
from design.blocks.state_space import realize
from design.chapters_3_4.design_extended import design_extended
from design.design_file import Design
from experiments.drive.compiled_steps import _step
from experiments.drive.difference_equations import METHODS, sample_block
from experiments.drive.sampled_loop import Drive, SampledRun, simulate_sampled
from experiments.engine.simulate import DivergenceError, simulate
from experiments.runs.design_loop import design_loop
from experiments.runs.references import Reference, SampledReference, sinusoid
from experiments.thesis.printed_choices import thesis_reference
from experiments.thesis.studies.sampled_rates import sampled_rates_tables
from identification.base.errors import InputError
from identification.model.additive_bound import AdditiveBound
from identification.model.model_file import IdentifiedModel
from identification.model.modes import Mode
from identification.model.plant import PlantModel
from identification.model.pulse_response import pulse_response

FREE = (-math.inf, math.inf)
OTHER = PlantModel(-0.4, (Mode(20.0, 0.03),), (Mode(32.0, 0.02),), 0.06)
TRUE = PlantModel(-0.42, (Mode(20.5, 0.03),), (Mode(31.5, 0.02),), 0.066)
REFERENCE = sinusoid(1.0, 0.5, 0.3, 0.2)


@pytest.fixture(scope="module")
def other_design(implied: IdentifiedModel) -> Design:
    bound = AdditiveBound.printed_form(0.002, 2.0, 30.0, 0.02)
    return design_extended(IdentifiedModel(OTHER, bound), [0.5], 1.5, [(1.0, 0.25)])


def compensator(design: Design, name: str) -> AntiWindup | None:
    return None if name == "none" else design.compensator(name)


def proportional(design: Design, gain: float, plant: PlantModel) -> Design:
    """The design's kind with u = gain (r - y) as its controller."""
    return dataclasses.replace(design, plant=plant, blocks={**design.blocks, "K": Block(gain), "T_so": Block(0.0)})


# Closed forms


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("delay_s", [0.0, 0.03, 0.1, 0.2375])
def test_integrator_with_a_dead_time_under_a_held_input(extended_design: Design, method: str, delay_s: float) -> None:
    """y(t_k) = y(t_{k-1}) + g (the two commands that reach the plant, each for its share of the sample)."""
    g, gain, T = 2.5, 0.7, 0.1
    design = proportional(extended_design, gain, PlantModel(g, (), (), delay_s))
    run = simulate_sampled(
        design, Reference((0.0,), (0.0,), (0.0,), 3.0), None, Drive(1 / T, method, (-1.5, 2.0)), 4.0, form="thesis"
    )
    late = math.floor(delay_s / T + 1e-9)
    share = delay_s / T - late
    y, m = np.zeros(41), np.zeros(41)
    for k in range(41):
        new, old = (m[j] if j >= 0 else 0.0 for j in (k - 1 - late, k - 2 - late))
        y[k] = y[k - 1] + g * T * ((1 - share) * new + share * old) if k else 0.0
        m[k] = np.clip(gain * (3.0 - y[k]), -1.5, 2.0)
    np.testing.assert_allclose(run.output, y, rtol=0, atol=1e-13)
    np.testing.assert_allclose(run.saturated_control, m, rtol=0, atol=1e-13)
    np.testing.assert_allclose(run.time_s, T * np.arange(41), rtol=0, atol=1e-14)


def test_a_slewing_actuator_in_closed_form(extended_design: Design) -> None:
    """Under a command that stays at the limit L the output is g slew t^2/2 until t = L/slew, then a line."""
    g, slew, limit, T, late = 2.0, 3.0, 5.0, 0.13, 0.37
    design = proportional(extended_design, 1.0, PlantModel(g, (), (), 0.21))
    reference = Reference((0.0,), (0.0,), (0.0,), 1e6)
    run = simulate_sampled(
        design, reference, None, Drive(1 / T, "exact", (-limit, limit), 0.0, slew, late), 6.0, form="thesis"
    )

    def since(delay_s: float) -> np.ndarray:
        return np.clip(run.time_s - delay_s, 0, None)

    np.testing.assert_allclose(run.saturated_control, np.minimum(slew * since(late), limit), atol=1e-12)
    t, full = since(late + 0.21), limit / slew
    area = np.where(t < full, slew * t**2 / 2, limit * full / 2 + limit * (t - full))
    np.testing.assert_allclose(run.output, g * area, rtol=1e-13, atol=1e-12)
    assert run.control[0] == pytest.approx(1e6)


def test_levels_are_the_nearest_ones_within_the_limits(extended_design: Design) -> None:
    design = proportional(extended_design, 1.0, PlantModel(1.0, (), (), 0.05))
    run = simulate_sampled(
        design, sinusoid(20.0, 3.0, 0.4, 0.0), None, Drive(40.0, "exact", (-13.0, 7.0), 2.0), 9.0, form="thesis"
    )
    assert set(np.unique(run.saturated_control)) <= set(np.arange(-12.0, 7.0, 2.0))
    assert {-12.0, 6.0} <= set(run.saturated_control)  # and not -14 or 8
    inside = (run.control > -12) & (run.control < 6)
    assert np.abs(run.saturated_control - run.control)[inside].max() <= 1.0
    whole = Drive(40.0, "exact", (-0.3, 0.3), 0.1)
    assert whole.levels == (-3.0, 3.0)


@pytest.mark.parametrize("name", ["none", "corrected"])
def test_an_input_delay_is_a_dead_time_of_the_plant(other_design: Design, name: str) -> None:
    later = dataclasses.replace(TRUE, delay_s=TRUE.delay_s + 0.0123)
    runs = [
        simulate_sampled(other_design, REFERENCE, compensator(other_design, name), drive, 10.0, plant)
        for drive, plant in (
            (Drive(150.0, "tustin", (-2.0, 2.0), 0.01, 30.0, 0.0123), TRUE),
            (Drive(150.0, "tustin", (-2.0, 2.0), 0.01, 30.0), later),
        )
    ]
    np.testing.assert_allclose(runs[0].output, runs[1].output, rtol=0, atol=1e-12)
    np.testing.assert_allclose(runs[0].control, runs[1].control, rtol=0, atol=1e-12)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("omega", [1.5, 4.0])
def test_the_linear_steady_state_is_the_frequency_response(extended_design: Design, method: str, omega: float) -> None:
    """e = (1 - T_so z^-d)/(1 - T_so z^-d + K P) r with P's pulse response, found another way."""
    rate, late = 700.0, 0.4e-3
    plant, z = extended_design.plant, np.exp(1j * np.array([omega]) / rate)
    K, T_so = extended_design.controller_parts()
    inner = 1 - response(sample_block(realize(T_so), [plant.delay_s], 1 / rate, method), z)[0, 0]
    loop = response(sample_block(realize(K), [0.0], 1 / rate, method), z)[0, 0]
    loop *= pulse_response(dataclasses.replace(plant, delay_s=plant.delay_s + late), 1 / rate, [omega])[0]
    S = inner / (inner + loop)
    run = simulate_sampled(
        extended_design,
        sinusoid(3.0, omega, 0.3, 0.0),
        None,
        Drive(rate, method, FREE, input_delay_s=late),
        30.0,
        form="thesis",
    )
    steady = np.imag(3.0 * S * np.exp(1j * (omega * run.time_s + 0.3)))
    last = run.time_s > 26
    np.testing.assert_allclose(run.error[last], steady[last], rtol=0, atol=1e-8)


def test_the_model_of_the_reference_moves_by_the_order_of_the_method(extended_design: Design) -> None:
    """|1 - T_so exp(-h s)|, 0 in continuous time, is omega T_s/2 with a held input and of order T_s^2 by Tustin's rule.

    The dead time ends in the middle of a sample at every rate, so that the straight line's share is the same.
    """
    omega, delay_s, block = 1.5, extended_design.plant.delay_s, realize(extended_design.blocks["T_so"])
    rates = (2.0 ** np.arange(1, 6) + 0.5) / delay_s
    found = np.zeros((2, len(rates)))
    for k, rate in enumerate(rates):
        for j, method in enumerate(METHODS):
            sampled = sample_block(block, [delay_s], 1 / rate, method)
            found[j, k] = abs(1 - response(sampled, np.exp(1j * np.array([omega]) / rate))[0, 0])
    np.testing.assert_allclose(found[METHODS.index("exact")], omega / rates / 2, rtol=0.02)
    coarse, *finer = found[METHODS.index("tustin")] * rates**2
    np.testing.assert_allclose(finer, coarse, rtol=1e-3)


# The loop's equations, by scipy


def answers(block: Block, delay_s: float, T: float, method: str) -> Callable[[np.ndarray], np.ndarray]:
    """A block's answer at the samples by scipy: of lines between the samples (Tustin), or of a held input.

    lsim carries the state exactly. Tustin's rule is the trapezoidal one in s = 2/T (z - 1)/(z + 1) and not lsim's, so
    that it is written out with the block's poles; its dead time is a straight line between samples.
    """
    whole, rest = int(delay_s / T + 1e-9), delay_s / T - int(delay_s / T + 1e-9)

    def held(given: np.ndarray) -> np.ndarray:
        parts = 20  # of a sample: the dead time is a whole number of them
        system = zpk2ss(block.zeros, block.poles, block.gain)
        late = round(delay_s / T * parts)
        assert math.isclose(late, delay_s / T * parts, abs_tol=1e-9)
        fine = np.repeat(given, parts)
        _, y, _ = lsim(system, fine, T / parts * np.arange(len(fine)), interp=False)
        return np.concatenate([np.zeros(late), y])[: len(fine)][::parts]

    def tustin(given: np.ndarray) -> np.ndarray:
        A, B, C, D = zpk2ss(block.zeros, block.poles, block.gain)
        y, x, before = np.zeros(len(given)), np.zeros(len(A)), 0.0
        for k, now in enumerate(given):  # x[k] - x[k-1] = T/2 (x'[k] + x'[k-1])
            right = x + T / 2 * (A @ x + B[:, 0] * (before + now))
            x, before = np.linalg.solve(np.eye(len(A)) - T / 2 * A, right), now
            y[k] = (C @ x)[0] + D[0, 0] * now
        padded = np.concatenate([np.zeros(whole + 1), y])
        return (1 - rest) * padded[1 : len(y) + 1] + rest * padded[: len(y)]

    if not block.poles:
        return lambda given: block.gain * given
    return held if method == "exact" else tustin


def driven(run: SampledRun, drive: Drive, plant: PlantModel) -> tuple[np.ndarray, np.ndarray]:
    """The actuator's and the plant's output at the samples, from u: rounding, lateness, slewing, and solve_ivp."""
    T, (low, high) = 1 / drive.rate_hz, drive.limits
    command = np.clip(run.control, low, high)
    if drive.quantum:
        command = drive.quantum * np.round(command / drive.quantum)
    times, values = [0.0], [0.0]  # corners of the actuator's output
    for k, wanted in enumerate(command):
        start, end = k * T + drive.input_delay_s, (k + 1) * T + drive.input_delay_s
        times += [start, min(start + abs(wanted - values[-1]) / drive.rate_limit, end)]
        moved = np.clip(wanted - values[-1], -drive.rate_limit * T, drive.rate_limit * T)
        values += [values[-1], values[-1] + moved]
    block = plant_block(plant)
    A, B, C, _ = zpk2ss(block.zeros, block.poles, block.gain)
    instants = run.time_s - plant.delay_s
    stops = np.unique(np.concatenate([times, instants[instants > 0]]))
    y, x = {0.0: 0.0}, np.zeros(len(A))
    for begin, stop in pairwise(stops):

        def rate(t: float, x: np.ndarray, begin: float = begin, stop: float = stop) -> np.ndarray:
            return A @ x + B[:, 0] * np.interp(t, [begin, stop], np.interp([begin, stop], times, values))

        x = solve_ivp(rate, (begin, stop), x, method="DOP853", rtol=1e-11, atol=1e-12).y[:, -1]
        y[stop] = (C @ x)[0]
    output = np.array([y[t] if t > 0 else 0.0 for t in instants])
    return np.interp(run.time_s, times, values), output


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize(
    ("name", "samples", "limit"),
    [("none", 3.75, 6.0), ("thesis", 5.5, 1.5), ("corrected", 3.75, 1.5), ("corrected", 0.4, 1.5)],
)
def test_the_run_solves_the_loops_equations(
    other_design: Design, method: str, name: str, samples: float, limit: float
) -> None:
    """With another true plant and every fault of a drive; ``samples`` is the model's dead time in sample times.

    At less than a sample, theta2 takes part in the algebraic loop by Tustin's rule.
    """
    T = OTHER.delay_s / samples
    kind = compensator(other_design, name)
    drive = Drive(1 / T, method, (-limit, limit - 0.25), 0.0625, 30.0, 0.3 * T)
    run = simulate_sampled(other_design, REFERENCE, kind, drive, 60 * T, TRUE, form="thesis")
    actuator, output = driven(run, drive, TRUE)
    np.testing.assert_allclose(run.saturated_control, actuator, rtol=0, atol=1e-9)
    np.testing.assert_allclose(run.output, output, rtol=0, atol=1e-8 * np.abs(output).max())

    u_tilde = run.control - np.clip(run.control, *drive.limits)
    assert np.any(u_tilde != 0)
    assert np.any(u_tilde == 0)
    forward, feedback = other_design.controller_parts()
    theta1 = y_d = np.zeros(61)
    if kind is not None:
        theta1 = answers(kind.theta1_tilde, 0.0, T, method)(u_tilde)
        y_d = answers(kind.theta2(OTHER).without_delay(), OTHER.delay_s, T, method)(u_tilde)
    v = run.control + theta1
    expected = answers(forward, 0.0, T, method)(run.error - y_d)
    expected = expected + answers(feedback, OTHER.delay_s, T, method)(v)
    np.testing.assert_allclose(v, expected, rtol=0, atol=1e-7 * np.abs(v).max())


@pytest.mark.parametrize("method", METHODS)
def test_without_dead_time_too(delay_free_design: Design, method: str) -> None:
    """Chapter 2, saturated from the first sample on: y_d is in the algebraic loop by Tustin's rule."""
    kind = delay_free_design.compensator("corrected")
    plant = delay_free_design.loop_plant
    reference = thesis_reference("delay-free", delay_free_design.reference_omegas)
    drive = Drive(1000.0, method, (-8.0, 8.0))
    run = simulate_sampled(delay_free_design, reference, kind, drive, 0.8)
    u_tilde = run.control - np.clip(run.control, -8.0, 8.0)
    assert np.count_nonzero(u_tilde) > 50
    theta1, y_d = (answers(block, 0.0, 1e-3, method)(u_tilde) for block in (kind.theta1_tilde, kind.theta2(plant)))
    forward, _ = delay_free_design.controller_parts()
    v = answers(forward, 0.0, 1e-3, method)(run.error - y_d)
    np.testing.assert_allclose(run.control + theta1, v, rtol=0, atol=1e-7 * np.abs(v).max())


# The continuous loop is the limit


Case = tuple[str, str, float, PlantModel | None, float, float]
SMOOTH: list[Case] = [  # design, anti-windup, limit, true plant, seconds, lowest rate
    ("extended", "none", math.inf, None, 3.0, 4000.0),
    ("delay-free", "none", math.inf, None, 6.0, 1000.0),
    ("other", "corrected", math.inf, None, 16.0, 800.0),
    ("other", "thesis", math.inf, TRUE, 16.0, 800.0),
]
SATURATED: list[Case] = [
    ("extended", "none", 12.0, None, 3.0, 4000.0),
    ("extended", "corrected", 40.0, None, 3.0, 16000.0),
    ("delay-free", "thesis", 8.0, None, 6.0, 4000.0),
    ("other", "corrected", 2.0, None, 16.0, 800.0),
    ("other", "corrected", 2.0, TRUE, 16.0, 800.0),
    ("other", "none", 3.0, TRUE, 16.0, 800.0),
]


def convergence(designs: dict[str, Design], case: Case, method: str) -> tuple[np.ndarray, np.ndarray]:
    """The largest differences of y from the continuous run at common times: at four rates, and extrapolated."""
    name, kind, limit, plant, horizon, lowest = case
    design = designs[name]
    reference = REFERENCE if name == "other" else thesis_reference(name, design.reference_omegas)
    anti_windup = compensator(design, kind)
    t = 0.1 * np.arange(round(10 * horizon) + 1)
    run = simulate(design_loop(design, reference, anti_windup, plant), (-limit, limit), t)
    assert (len(run.events_s) > 0) == math.isfinite(limit)
    outputs = []
    for rate in lowest * 2.0 ** np.arange(4):
        sampled = simulate_sampled(design, reference, anti_windup, Drive(rate, method, (-limit, limit)), horizon, plant)
        outputs.append(sampled.output[:: round(rate / 10)])
    plain = [np.abs(y - run.outputs["output"]).max() for y in outputs]
    extrapolated = [np.abs(2 * fine - coarse - run.outputs["output"]).max() for coarse, fine in pairwise(outputs)]
    return np.array(plain), np.array(extrapolated)


@pytest.fixture(scope="module")
def designs(extended_design: Design, delay_free_design: Design, other_design: Design) -> dict[str, Design]:
    return {"extended": extended_design, "delay-free": delay_free_design, "other": other_design}


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("case", SMOOTH, ids=lambda case: f"{case[0]}-{case[1]}")
def test_the_continuous_loop_is_the_limit(designs: dict[str, Design], case: Case, method: str) -> None:
    """First order in the sample time; extrapolated to no sample time, second order."""
    plain, extrapolated = convergence(designs, case, method)
    assert np.all(np.abs(np.log2(plain[:-1] / plain[1:]) - 1) < 0.05)
    assert np.all(extrapolated < plain[1:] / 5)
    assert 1.6 < np.log2(extrapolated[0] / extrapolated[-1]) / 2 < 2.6


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("case", SATURATED, ids=lambda case: f"{case[0]}-{case[1]}-{case[2]:g}-{bool(case[3])}")
def test_the_continuous_loop_is_the_limit_under_saturation(designs: dict[str, Design], case: Case, method: str) -> None:
    """First order still, and extrapolated of second order on the whole.

    Where in a sample u crosses a limit changes with the rate, which makes the second order's factor uneven: it is taken
    over two doublings. An excursion shorter than a sample may not be seen at all, and the order holds only from the
    rate on that sees it: chapter 2 without anti-windup, fitted, leaves +-8 for 64 us. The thesis's theta1~ keeps u
    chattering about the limits for long; its order shows at rates that are higher still.
    """
    plain, extrapolated = convergence(designs, case, method)
    assert np.all(np.abs(np.log2(plain[:-1] / plain[1:]) - 1) < 0.2)
    assert np.all(extrapolated < plain[1:] / 2)
    assert 1.4 < np.log2(extrapolated[0] / extrapolated[-1]) / 2 < 3


@pytest.mark.parametrize("name", ["none", "corrected"])
def test_a_perfect_actuator_is_the_limit_of_a_poor_one(other_design: Design, name: str) -> None:
    """As the levels close up, and as the slewing becomes fast: of first order in 1/slew."""
    kind = compensator(other_design, name)

    def output(quantum: float, slew: float) -> np.ndarray:
        drive = Drive(200.0, "tustin", (-2.0, 2.0), quantum, slew)
        return simulate_sampled(other_design, REFERENCE, kind, drive, 16.0, TRUE).output

    perfect = output(0.0, math.inf)
    levels = [np.abs(output(quantum, math.inf) - perfect).max() for quantum in (0.1, 1e-3, 1e-5, 1e-7)]
    assert np.all(np.array(levels[1:]) < np.array(levels[:-1]) / 10)
    slews = [np.abs(output(0.0, slew) - perfect).max() for slew in (4e3, 8e3, 16e3, 32e3)]
    np.testing.assert_allclose(np.array(slews[:-1]) / slews[1:], 2.0, rtol=0.1)


# References, refusals, speed


def test_a_sampled_reference_is_read_at_the_instants(other_design: Design) -> None:
    t = np.linspace(0, 5, 41)
    reference = SampledReference(t, REFERENCE(t))
    run = simulate_sampled(other_design, reference, None, Drive(64.0, "tustin", FREE), 6.0)
    np.testing.assert_allclose(run.reference, np.interp(run.time_s, t, REFERENCE(t)), rtol=0, atol=1e-15)
    np.testing.assert_array_equal(run.error, run.reference - run.output)


def test_a_rate_that_is_too_low_diverges(other_design: Design) -> None:
    with pytest.raises(DivergenceError, match="diverges") as caught:
        simulate_sampled(other_design, REFERENCE, None, Drive(1.0, "tustin", FREE), 4000.0)
    assert 0 < caught.value.time_s < 4000


def test_an_algebraic_loop_without_one_solution_is_refused(other_design: Design) -> None:
    kind = second_order(0.01, 0.02, -30.0)  # theta1~(2/T) < -1 at low rates
    with pytest.raises(InputError, match=r"at 20 Hz the method tustin gives .* without one solution"):
        simulate_sampled(other_design, REFERENCE, kind, Drive(20.0, "tustin", (-1.0, 1.0)), 1.0)
    simulate_sampled(other_design, REFERENCE, kind, Drive(2000.0, "tustin", (-1.0, 1.0)), 0.1)
    simulate_sampled(other_design, REFERENCE, kind, Drive(20.0, "exact", (-1.0, 1.0)), 0.1)


@pytest.mark.parametrize(
    ("changes", "part"),
    [
        ({"rate_hz": 0.0}, "the rate is 0 Hz"),
        ({"rate_hz": -5.0}, "the rate is -5 Hz"),
        ({"rate_hz": math.nan}, "the rate is nan"),
        ({"rate_hz": math.inf}, "the rate is inf"),
        ({"method": "euler"}, "the method is 'euler'"),
        ({"limits": (1.0, -1.0)}, "the saturation limits are 1 and -1"),
        ({"limits": (math.nan, 1.0)}, "the saturation limits are nan"),
        ({"quantum": -0.1}, "the quantum is -0.1"),
        ({"quantum": math.inf}, "the quantum is inf"),
        ({"quantum": 4.0, "limits": (1.0, 3.0)}, "no multiple of the quantum 4 lies within 1 and 3"),
        ({"rate_limit": 0.0}, "the rate limit is 0"),
        ({"rate_limit": math.nan}, "the rate limit is nan"),
        ({"input_delay_s": -1e-3}, "the input delay is -0.001 s"),
        ({"input_delay_s": math.inf}, "the input delay is inf"),
    ],
)
def test_drives_that_cannot_be_are_refused(changes: dict[str, object], part: str) -> None:
    usual: dict[str, object] = {"rate_hz": 100.0, "method": "exact", "limits": (-1.0, 1.0)}
    with pytest.raises(InputError, match=part):
        Drive(**(usual | changes))  # type: ignore[arg-type]


def test_runs_that_cannot_be_are_refused(other_design: Design) -> None:
    drive = Drive(100.0, "exact", (-1.0, 1.0))
    for until_s in (0.0, 0.009, -1.0, math.nan, math.inf):
        with pytest.raises(InputError, match="expected a finite time of one sample"):
            simulate_sampled(other_design, REFERENCE, None, drive, until_s)
    with pytest.raises(InputError, match=r"the run needs 2e\+1\d steps"):
        simulate_sampled(other_design, REFERENCE, None, Drive(2e9, "exact", (-1.0, 1.0)), 10.0)


def test_a_dead_time_longer_than_the_run(other_design: Design) -> None:
    late = dataclasses.replace(TRUE, delay_s=50.0)
    run = simulate_sampled(other_design, REFERENCE, None, Drive(100.0, "tustin", (-1.0, 1.0), 0.0, 5.0, 9.0), 4.0, late)
    assert not run.output.any()
    assert not run.saturated_control.any()


def test_a_drive_without_a_range_has_no_converter(extended_design: Design) -> None:
    with pytest.raises(InputError, match="limit is inf; expected a finite one"):
        sampled_rates_tables(extended_design, math.inf)


def test_levels_too_many_to_count_are_refused() -> None:
    with pytest.raises(InputError, match=r"quantum is 1e-300; expected 0, or no less"):
        Drive(1000.0, "tustin", (-12.0, 12.0), quantum=1e-300)


def test_an_actuator_begins_at_a_level(extended_design: Design) -> None:
    drive = Drive(1000.0, "tustin", (1.0, 12.0), quantum=0.3, input_delay_s=0.0105)
    run = simulate_sampled(extended_design, sinusoid(50.0, 1.5, 0.0, 0.0), None, drive, 0.02)
    assert run.saturated_control[0] == pytest.approx(1.2)


def test_a_dead_time_beyond_all_bounds(extended_design: Design) -> None:
    drive = Drive(1000.0, "exact", (-12.0, 12.0), input_delay_s=1e300)
    run = simulate_sampled(extended_design, sinusoid(50.0, 1.5, 0.0, 0.0), None, drive, 0.1)
    assert not run.output.any()
    assert not run.saturated_control.any()


def test_a_state_decays_to_zero_past_the_smallest_normal_number() -> None:
    """Below it numbers keep fewer digits and cost a processor many times as much: a run of an hour would crawl."""
    A, x, following = np.array([[0.9, 0.05], [-0.05, 0.9]]), np.array([1.0, -2.0]), np.empty(2)
    met = np.empty((8000, 2))
    for k in range(len(met)):
        assert _step(A, np.zeros(2), x, following, 0.0, math.inf)
        met[k] = x
    assert np.all((met == 0) | (np.abs(met) >= np.finfo(float).tiny))
    assert np.any(np.abs(met) < 1e-300)
    assert not met[-1].any()
