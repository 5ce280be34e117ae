"""From rest a signal may begin with any power of t: the engine's first steps against closed forms and other methods."""

from __future__ import annotations

import dataclasses
import math
from functools import lru_cache

import numpy as np
import pytest
from collocation import collocated_run
from hypothesis import given, settings
from hypothesis import strategies as st

from data.thesis import model_named
from design.anti_windup.compensator import from_one_plus
from design.blocks.block import Block
from design.chapter_2.design_delay_free import design_delay_free
from design.chapters_3_4.design_extended import design_extended
from design.design_file import Design
from experiments.engine.brief_dead_times import present_of
from experiments.engine.compiled_loop import compile_loop
from experiments.engine.saturated_loop import SaturatedLoop
from experiments.engine.simulate import simulate
from experiments.runs.design_loop import design_loop
from experiments.runs.references import Reference, SampledReference, sinusoid
from identification.model.additive_bound import AdditiveBound
from identification.model.model_file import IdentifiedModel
from identification.model.modes import Mode
from identification.model.plant import PlantModel

FREE = (-np.inf, np.inf)


def chain(order: int, rate: float, delay_s: float, fastest: float) -> SaturatedLoop:
    """u = (rate t)^order/order!, by integrators in a row, and beside it a pole at -fastest that sets the step.

    Behind the saturation lies an integrator whose output is seen one dead time later and drives nothing that u sees.
    """
    n = order + 3
    A, C = np.zeros((n, n)), np.zeros(n)
    for i in range(1, order + 1):
        A[i, i - 1] = rate
    C[order] = 1.0
    A[order + 1, order + 1] = -fastest
    B, Z, D = np.zeros(n), np.zeros((1, n)), np.zeros((n, 1))
    B[order + 2], Z[0, order + 2], D[order + 1, 0] = rate, 1.0, fastest
    x0 = np.zeros(n)
    x0[0] = 1.0
    outputs = {"end": (C, np.zeros(1)), "late": (np.zeros(n), np.ones(1))}
    return SaturatedLoop(A, B, C, D, np.zeros(1), Z, np.array([delay_s]), x0, outputs)


@settings(max_examples=60, deadline=None)
@given(
    order=st.integers(0, 12),
    time_unit=st.integers(-9, 9),
    delay=st.floats(0.02, 2.0),
    fastest=st.floats(0.5, 80.0),
    cut=st.floats(0.05, 0.95),
)
def test_a_signal_that_begins_with_any_power_of_time_is_that_power(
    order: int, time_unit: int, delay: float, fastest: float, cut: float
) -> None:
    unit = 10.0**time_unit
    loop = chain(order, 1 / unit, delay * unit, fastest / unit)
    step = compile_loop(loop).step
    time_s = step * np.array([cut / 8, cut, 1.0, 1.0 + cut, 2.0, 2.0 + cut, 7.3])
    run = simulate(loop, FREE, time_s)

    def power(p: int, t: np.ndarray) -> np.ndarray:
        return (np.maximum(t, 0.0) / unit) ** p / math.factorial(p)

    np.testing.assert_allclose(run.control, power(order, time_s), rtol=1e-12)
    np.testing.assert_allclose(run.outputs["end"], power(order, time_s), rtol=1e-12)
    # read behind its dead time: to rounding of the difference of the two times
    np.testing.assert_allclose(
        run.outputs["late"],
        power(order + 1, time_s - delay * unit),
        rtol=1e-9,
        atol=1e-14 * power(order + 1, step * 7.3),
    )


BOUND = AdditiveBound.printed_form(0.1, 10.0, 150.0, 0.02)


def integrator(delay_s: float) -> PlantModel:
    """7.1/s and a dead time: the simplest plant of the class."""
    return PlantModel(7.1, (), (), delay_s)


@lru_cache
def rolled_off() -> Design:
    """T_so rolls off by three poles: the path from r to u begins with t^3."""
    return design_extended(IdentifiedModel(integrator(0.05), BOUND), [1.5], 4.0, [(2.0, 1.0)], robust_level=0.9)


@pytest.mark.parametrize(
    ("kind", "row"),
    [
        (kind, row)
        for kind, rows in {
            # t, y, u: Runge-Kutta of order 4 with Hermite interpolation of the past, steps of 1e-5 s
            "corrected": [
                (0.01, 0.0, 0.5491325), (0.02, 0.0, 3.3244663), (0.03, 0.0, 8.5150336), (0.05, 0.0, 39.1530576),
                (0.07, 0.1324792, 44.8951107), (0.5, 34.6748935, -0.9148186), (1.0, 3.7097564, -13.064969),
                (10.0, -37.9800561, -6.2491192),
            ],
            "none": [
                (0.01, 0.0, 0.5491325), (0.02, 0.0, 3.3244663), (0.03, 0.0, 8.5150336), (0.05, 0.0, 22.905597),
                (0.07, 0.1324792, 36.9639976), (0.5, 36.257415, 30.5375845), (1.0, 39.6092141, -31.7335245),
                (10.0, -62.1765322, -29.9569734),
            ],
        }.items()
        for row in rows
    ],
)  # fmt: skip
def test_a_loop_that_begins_with_the_third_power(kind: str, row: tuple[float, float, float]) -> None:
    zeros = (0j, -0.3000000115173831 + 149.98818175944186j, -0.3000000115173831 - 149.98818175944186j)
    given = from_one_plus(Block(1.0, zeros, (-4.0, -149.99999999999997, -149.99999999999997)))
    loop = design_loop(rolled_off(), sinusoid(50.0, 1.5, np.pi / 2, 0.0), None if kind == "none" else given)
    run = simulate(loop, (-12.0, 12.0), np.array([row[0] / 2, row[0]]))
    # what is printed is rounded to 1e-7, and halved steps of the method that made it agree to 1e-6 of the amplitude
    assert run.outputs["output"][-1] == pytest.approx(row[1], abs=5e-6)
    assert run.control[-1] == pytest.approx(row[2], abs=5e-6)


@lru_cache
def designs() -> dict[str, Design]:
    """Designs whose path from r to u begins with t, t^2, t^3 and more."""
    implied = model_named("implied")
    one_mode = PlantModel(2.3, (Mode(40.0, 0.05),), (Mode(60.0, 0.03),), 0.01)
    return {
        "roll-off": rolled_off(),
        "roll-off, implied": design_extended(implied, [1.5], 4.0, [(2.0, 1.0)], robust_level=0.9),
        "inverse epsilon": design_extended(
            IdentifiedModel(one_mode, BOUND), [1.5], 4.0, [(2.0, 1.0)], inverse_epsilon=0.01
        ),
        "thesis": design_extended(IdentifiedModel(one_mode, BOUND), [1.5], 4.0, [(2.0, 1.0)]),
        "delay-free": design_delay_free(IdentifiedModel(integrator(0.0), BOUND), [math.tau / 4.0], 1e-4),
    }


REFERENCES: dict[str, Reference | SampledReference] = {
    "cosine": sinusoid(50.0, 1.5, np.pi / 2, 0.0),
    "sine": sinusoid(50.0, 1.5, 0.0, 0.0),
    "ramp": Reference((0.0,), (1.5,), (0.0,), 0.0, slope=60.0),
    "file": SampledReference(np.array([0.0, 0.5, 1.0]), np.array([0.0, 30.0, -10.0])),
}


@pytest.mark.parametrize("limit", [np.inf, 0.5])
@pytest.mark.parametrize("reference", REFERENCES)
@pytest.mark.parametrize("name", ["roll-off", "roll-off, implied", "inverse epsilon", "thesis", "delay-free"])
def test_the_first_steps_are_those_of_collocation(name: str, reference: str, limit: float) -> None:
    design = designs()[name]
    loop = design_loop(design, REFERENCES[reference], design.compensator("corrected"))
    step = compile_loop(loop).step
    for steps in (1.0, 3.0, 12.0):  # each judged by its own largest value
        time_s = np.linspace(0.0, steps * step, 13)[1:]
        control, outputs, _, _ = collocated_run(loop, (-limit, limit), time_s)
        run = simulate(loop, (-limit, limit), time_s)
        for found, wanted in [(run.control, control), (run.outputs["output"], outputs["output"])]:
            assert np.abs(found - wanted).max() <= 1e-9 * np.abs(wanted).max() + 1e-300


@pytest.mark.parametrize("kind", ["none", "thesis", "corrected"])
def test_a_brief_dead_time_in_a_loop_that_saturates_at_once(kind: str) -> None:
    implied = model_named("implied")
    plant = dataclasses.replace(implied.plant, delay_s=1e-5)  # 1 % of its fastest time constant
    design = design_extended(dataclasses.replace(implied, plant=plant), [1.5], 4.0, [(2.0, 1.0)])
    anti_windup = None if kind == "none" else design.compensator(kind)
    loop = design_loop(design, REFERENCES["cosine"], anti_windup)
    assert compile_loop(loop).brief.size
    time_s = np.linspace(0.0, 0.012, 25)
    limit = float(np.abs(simulate(loop, FREE, time_s).control).max()) / 2
    control, outputs, events_s, _ = collocated_run(loop, (-limit, limit), time_s)
    run = simulate(loop, (-limit, limit), time_s)
    assert len(events_s) > 0
    np.testing.assert_allclose(run.events_s, events_s, rtol=0, atol=1e-11)
    np.testing.assert_allclose(run.control, control, rtol=0, atol=1e-11 * np.abs(control).max())
    np.testing.assert_allclose(
        run.outputs["output"], outputs["output"], rtol=0, atol=1e-11 * np.abs(outputs["output"]).max()
    )


@pytest.mark.parametrize("delays", [(3e-4, 8.1e-3), (1.5e-3, 4e-4)], ids=["one", "two"])
def test_brief_dead_times_beside_others(delays: tuple[float, float]) -> None:
    implied = model_named("implied")
    own, true = (dataclasses.replace(implied.plant, delay_s=h) for h in delays)
    design = design_extended(dataclasses.replace(implied, plant=own), [1.5], 4.0, [(2.0, 1.0)])
    loop = design_loop(design, REFERENCES["cosine"], design.compensator("corrected"), true)
    assert compile_loop(loop).brief.tolist() == sorted(h for h in delays if h < 2e-3)
    time_s = np.linspace(0.0, 0.05, 51)
    control, outputs, events_s, _ = collocated_run(loop, (-10.6, 10.6), time_s)
    run = simulate(loop, (-10.6, 10.6), time_s)
    assert len(events_s) > 0
    np.testing.assert_allclose(run.events_s, events_s, rtol=0, atol=1e-13)
    for found, wanted in [(run.control, control), (run.outputs["output"], outputs["output"])]:
        np.testing.assert_allclose(found, wanted, rtol=0, atol=1e-12 * np.abs(wanted).max())


def test_a_brief_dead_time_whose_iteration_leaves_all_bounds_sets_the_step() -> None:
    """x' = w, u = 0, w(t) = 1e12 x(t - h): the growth in h has no slow mode that the iteration finds."""
    rows, delays = np.array([[0.0, 0.0, 1.0], [0.0, 0.0, 0.0], [1e12, 0.0, 0.0]]), np.array([1e-3])
    assert present_of(rows, 1, delays, delays > 0) is None
