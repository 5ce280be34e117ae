"""The engine against collocation: limits, dead times, references, anti-windup; and the oracle against itself.

All errors are relative to the largest value of the signal. u and the plant's output before its dead time are held to
the same 1e-9 as y: u is continuous where it crosses a limit, so that a kink costs no more than the event's own error.
"""

from __future__ import annotations

import dataclasses
from functools import lru_cache
from itertools import product

import numpy as np
import pytest
from collocation import GENERATIONS, NODES, REACH, collocated_run
from numpy.typing import NDArray

from data.thesis import model_named
from design.anti_windup.compensator import AntiWindup
from design.chapters_3_4.design_extended import design_extended
from design.design_file import Design
from experiments.engine.saturated_loop import Resets, SaturatedLoop
from experiments.engine.simulate import Run, simulate
from experiments.runs.design_loop import design_loop
from experiments.runs.references import Reference, SampledReference, sinusoid

FREE = (-np.inf, np.inf)
TOLERANCE = 1e-9
EVENT_S = 1e-9

KINDS = ("none", "thesis", "corrected")
LIMITS = (8.0, 10.6, 12.0, 15.0, 20.0, 40.0)
DELAYS_S = (0.0, 1e-3, 8.1e-3, 50e-3)
KNOTS_S = [0.0, 0.013, 0.05, 0.0581, 0.11, 0.1100001, 0.19, 0.2345, 0.31, 0.37, 0.41, 0.48]
LEVELS = [0.0, 5.0, -20.0, 30.0, 45.0, 45.5, 50.0, -10.0, -50.0, 0.0, 40.0, 25.0]
REFERENCES: dict[str, Reference | SampledReference] = {
    "sinusoid": sinusoid(50.0, 1.5, np.pi / 2, 0.0),
    "constant": sinusoid(0.0, 1.5, 0.0, 50.0),
    "ramp": Reference((0.0,), (1.5,), (0.0,), 20.0, slope=60.0),
    "sampled": SampledReference(np.array(KNOTS_S), np.array(LEVELS)),
}
# every limit with every dead time and every reference, every dead time with every reference, every anti-windup with all
CASES = [
    (KINDS[(i + 2 * j + i // 3) % 3], limit, delay_s, list(REFERENCES)[(i + j) % 4])
    for (i, limit), (j, delay_s) in product(enumerate(LIMITS), enumerate(DELAYS_S))
]


def test_the_cases_cover_all_pairs() -> None:
    factors = [KINDS, LIMITS, DELAYS_S, REFERENCES]
    for first, second in product(range(4), repeat=2):
        if first < second:
            pairs = {(case[first], case[second]) for case in CASES}
            assert pairs == set(product(factors[first], factors[second]))


@lru_cache
def extended_at(delay_s: float) -> Design:
    """Chapter 4's design for the plant with another dead time."""
    model = model_named("implied")
    plant = dataclasses.replace(model.plant, delay_s=delay_s)
    return design_extended(dataclasses.replace(model, plant=plant), [1.5], 4.0, [(2.0, 1.0)])


def compensator(design: Design, kind: str) -> AntiWindup | None:
    return None if kind == "none" else design.compensator(kind)


def observed(loop: SaturatedLoop) -> SaturatedLoop:
    """With the plant's output before its dead time beside the other outputs."""
    p = (loop.Z[0], np.zeros(len(loop.delays)))
    return dataclasses.replace(loop, outputs={**loop.outputs, "p": p})


def error(values: NDArray[np.float64], exact: NDArray[np.float64]) -> float:
    return float(np.abs(values - exact).max() / np.abs(exact).max())


def assert_accurate(loop: SaturatedLoop, limit: float, time_s: NDArray[np.float64]) -> Run:
    """Samples, number and times of the events and the modes entered are the oracle's."""
    loop = observed(loop)
    control, outputs, events_s, modes = collocated_run(loop, (-limit, limit), time_s)
    run = simulate(loop, (-limit, limit), time_s)
    errors = {name: error(run.outputs[name], outputs[name]) for name in ("output", "p")}
    errors["control"] = error(run.control, control)
    assert max(errors.values()) < TOLERANCE, errors
    np.testing.assert_array_equal(run.modes, modes)
    np.testing.assert_allclose(run.events_s, events_s, rtol=0, atol=EVENT_S)
    return run


@pytest.mark.parametrize(("kind", "limit", "delay_s", "name"), CASES)
def test_engine_is_converged(kind: str, limit: float, delay_s: float, name: str) -> None:
    design = extended_at(delay_s)
    loop = design_loop(design, REFERENCES[name], compensator(design, kind))
    run = assert_accurate(loop, limit, np.linspace(0, 0.6, 301))
    assert np.any(run.control != run.saturated_control)


@pytest.mark.parametrize("kind", KINDS)
def test_engine_is_converged_over_three_seconds(extended_design: Design, kind: str) -> None:
    loop = design_loop(extended_design, REFERENCES["sinusoid"], compensator(extended_design, kind))
    assert len(assert_accurate(loop, 12.0, np.linspace(0, 3, 601)).events_s) > 15


@pytest.mark.parametrize(
    ("which", "delay_s", "kind", "name"),
    [
        ("extended_design", 0.0, "thesis", "sinusoid"),
        ("extended_design", 0.0123, "none", "sampled"),
        ("extended_design", 0.0123, "corrected", "constant"),
        ("delay_free_design", 0.0, "none", "sampled"),
        ("delay_free_design", 0.0, "thesis", "constant"),
        ("delay_free_design", 0.0, "corrected", "ramp"),
        ("delay_free_design", 0.001, "corrected", "sinusoid"),
    ],
)
def test_engine_is_converged_with_another_true_plant(
    request: pytest.FixtureRequest, which: str, delay_s: float, kind: str, name: str
) -> None:
    """Zero and different dead times in one loop."""
    design = request.getfixturevalue(which)
    plant = dataclasses.replace(design.loop_plant, delay_s=delay_s)
    loop = design_loop(design, REFERENCES[name], compensator(design, kind), plant)
    assert len(assert_accurate(loop, 9.0, np.linspace(0, 0.4, 201)).events_s) > 0


@pytest.mark.parametrize("name", ["ramp", "sampled"])
@pytest.mark.parametrize("kind", ["thesis", "corrected"])
@pytest.mark.parametrize("which", ["extended_design", "delay_free_design"])
def test_y_plus_y_d_is_the_linear_response_to_every_reference(
    request: pytest.FixtureRequest, which: str, kind: str, name: str
) -> None:
    design = request.getfixturevalue(which)
    loop = design_loop(design, REFERENCES[name], compensator(design, kind))
    time_s = np.linspace(0, 3, 301)
    saturated, linear = simulate(loop, (-12.0, 12.0), time_s), simulate(loop, FREE, time_s)
    assert len(saturated.events_s) > 0
    assert error(saturated.outputs["y_lin"], linear.outputs["output"]) < TOLERANCE
    assert error(saturated.outputs["v"], linear.control) < TOLERANCE


def jumping_loop(delay_s: float, echo: float) -> SaturatedLoop:
    """States (r, x): x' = -x + m + r(t - 0.3)/2, u = 3 (r - x(t - delay)) + echo r(t - 0.3), and r jumps."""
    return SaturatedLoop(
        A=np.diag([0.0, -1.0]),
        B=np.array([0.0, 1.0]),
        C=np.array([3.0, 0.0]),
        D=np.array([[0.0, 0.0], [0.0, 0.5]]),
        E=np.array([-3.0, echo]),
        Z=np.eye(2)[::-1].copy(),
        delays=np.array([delay_s, 0.3]),
        x0=np.array([1.0, 0.0]),
        outputs={"output": (np.array([0.0, 1.0]), np.zeros(2)), "delayed": (np.zeros(2), np.array([0.0, 1.0]))},
        resets=Resets(np.array([0.5, 1.25, 2.0]), np.array([[-2.0], [1.5], [0.1]])),
    )


def settled(events_s: NDArray[np.float64], modes: NDArray[np.int64]) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Of events at the same time the last: a jump across both limits may pass through the band between them."""
    last = np.diff(events_s, append=np.inf) > 1e-12
    return events_s[last], modes[last]


@pytest.mark.parametrize("echo", [0.0, 0.7], ids=["now", "and a dead time later"])
@pytest.mark.parametrize("delay_s", [0.0, 0.04, 0.3])
def test_jumps_of_the_states(delay_s: float, echo: float) -> None:
    """u jumps across both limits at once; with an echo it jumps again when the jump comes out of the dead time."""
    time_s = np.linspace(0.003, 3.003, 251)  # no sample at a jump
    loop = jumping_loop(delay_s, echo)
    control, outputs, events_s, modes = collocated_run(loop, (-1.0, 1.0), time_s)
    assert 0.5 in events_s
    run = simulate(loop, (-1.0, 1.0), time_s)
    np.testing.assert_allclose(run.control, control, rtol=0, atol=1e-12)
    for name, values in outputs.items():
        np.testing.assert_allclose(run.outputs[name], values, rtol=0, atol=1e-12)
    times, entered = settled(run.events_s, run.modes)
    np.testing.assert_array_equal(entered, modes)
    np.testing.assert_allclose(times, events_s, rtol=0, atol=1e-12)


def test_a_grazing_crossing_in_a_loop_with_dead_time(extended_design: Design) -> None:
    """The limit is found by bisection on the oracle: the greatest peak of u; a hair below it there are two events."""
    loop = design_loop(extended_design, sinusoid(50.0, 1.5, 0.0, 0.0), extended_design.compensator("corrected"))
    time_s = np.linspace(0, 0.3, 3001)
    u = collocated_run(loop, FREE, time_s)[0]
    top = int(np.argmax(u))
    assert 10 < top < 2990
    below, above = u[top] * (1 - 1e-6), u[top] * (1 + 1e-3)
    while above - below > 1e-14 * above:
        middle = (below + above) / 2
        crossed = len(collocated_run(loop, (-np.inf, middle), time_s[:: len(time_s) - 1])[2]) > 0
        below, above = (middle, above) if crossed else (below, middle)
    peak = (below + above) / 2
    curvature = (2 * u[top] - u[top - 1] - u[top + 1]) / time_s[1] ** 2
    for excess in (1e-9, 1e-11):
        assert len(simulate(loop, (-np.inf, peak * (1 + excess)), time_s).events_s) == 0
        limits = (-np.inf, peak * (1 - excess))
        run = simulate(loop, limits, time_s)
        events_s, modes = collocated_run(loop, limits, time_s)[2:]
        assert list(modes) == [1, 0]
        np.testing.assert_array_equal(run.modes, modes)
        np.testing.assert_allclose(run.events_s, events_s, rtol=0, atol=EVENT_S)
        assert np.diff(run.events_s)[0] == pytest.approx(2 * np.sqrt(2 * excess * peak / curvature), rel=1e-2)


# the oracle itself


@pytest.mark.parametrize("kind", KINDS)
def test_the_oracle_is_converged(extended_design: Design, kind: str) -> None:
    loop = observed(design_loop(extended_design, REFERENCES["sampled"], compensator(extended_design, kind)))
    time_s = np.linspace(0, 0.25, 126)
    control, outputs, events_s, modes = collocated_run(loop, (-12.0, 12.0), time_s)
    assert len(events_s) > 3
    for change in ({"nodes": 2 * NODES}, {"reach": REACH / 2}, {"generations": 2 * GENERATIONS}):
        finer = collocated_run(loop, (-12.0, 12.0), time_s, **change)  # type: ignore[arg-type]
        assert error(control, finer[0]) < 1e-11
        for name in ("output", "p", "y_lin"):
            assert error(outputs[name], finer[1][name]) < 1e-11
        np.testing.assert_allclose(events_s, finer[2], rtol=0, atol=1e-12)
        np.testing.assert_array_equal(modes, finer[3])


@pytest.mark.parametrize("kind", ["none", "corrected"])
def test_the_oracle_resets_the_reference(extended_design: Design, kind: str) -> None:
    """Without saturation the sampled reference's response is a sum of delayed responses to ramps, without a reset."""
    apart = np.array(KNOTS_S) != 0.1100001  # no steep slopes that cancel in the sum
    sampled = SampledReference(np.array(KNOTS_S)[apart], np.array(LEVELS)[apart])
    ramp = Reference((0.0,), (1.5,), (0.0,), 0.0, slope=1.0)
    time_s = np.linspace(0, 0.6, 121)
    loop = observed(design_loop(extended_design, sampled, compensator(extended_design, kind)))
    _, outputs, events_s, _ = collocated_run(loop, FREE, time_s)
    assert len(events_s) == 0
    slopes = np.diff(sampled.values, append=sampled.values[-1]) / np.diff(sampled.time_s, append=np.inf)
    summed = np.zeros_like(time_s)
    for knot, change in zip(sampled.time_s, np.diff(slopes, prepend=0.0), strict=True):
        later = time_s > knot
        response = collocated_run(observed(design_loop(extended_design, ramp, None)), FREE, time_s[later] - knot)
        summed[later] += change * response[1]["p"]
    assert error(outputs["p"], summed) < 1e-11
    assert error(outputs["reference"], sampled(time_s)) < 1e-13


def test_the_oracle_jumps_across_limits() -> None:
    """u = r jumps from 0.5 to 3, -3 and 0 under |u| <= 1; x' = m; each jump is an event, across both limits one."""
    loop = SaturatedLoop(
        A=np.zeros((2, 2)), B=np.array([0.0, 1.0]), C=np.array([1.0, 0.0]), D=np.zeros((2, 1)), E=np.zeros(1),
        Z=np.eye(2)[1:], delays=np.array([0.3]), x0=np.array([0.5, 0.0]),
        outputs={"x": (np.eye(2)[1], np.zeros(1)), "delayed": (np.zeros(2), np.ones(1))},
        resets=Resets(np.array([1.0, 1.7, 2.5]), np.array([[3.0], [-3.0], [0.0]])),
    )  # fmt: skip
    time_s = np.linspace(0.05, 3.05, 31)
    u, outputs, events_s, modes = collocated_run(loop, (-1.0, 1.0), time_s)
    assert events_s.tolist() == [1.0, 1.7, 2.5]
    assert modes.tolist() == [1, -1, 0]
    np.testing.assert_allclose(
        u, np.array([0.5, 3.0, -3.0, 0.0])[np.searchsorted(events_s, time_s, "right")], atol=1e-15
    )
    corners = [0.0, 1.0, 1.7, 2.5], [0.0, 0.5, 1.2, 0.4]
    np.testing.assert_allclose(outputs["x"], np.interp(time_s, *corners), rtol=0, atol=1e-15)
    np.testing.assert_allclose(outputs["delayed"], np.interp(time_s - 0.3, *corners), rtol=0, atol=1e-15)


@pytest.mark.parametrize("delay_s", [0.0, 0.04])
def test_the_oracle_is_exact_where_a_closed_form_is_known(delay_s: float) -> None:
    """x' = m, u = -x(t - delay), x(0) = 3, |u| <= 1: x falls at the rate 1 until t = 2 + delay; then it is linear."""
    one, zero = np.ones(1), np.zeros(1)
    loop = SaturatedLoop(
        A=np.zeros((1, 1)), B=one, C=zero, D=np.zeros((1, 1)), E=-one, Z=np.ones((1, 1)), delays=np.array([delay_s]),
        x0=3 * one, outputs={"x": (one, zero), "delayed": (zero, one)},
    )  # fmt: skip
    time_s = np.linspace(0, 2 + 2 * delay_s, 101)
    _, outputs, events_s, modes = collocated_run(loop, (-1.0, 1.0), time_s)
    after = np.clip(time_s - 2 - delay_s, 0, None)  # x' = -x(t - delay), there 1 - after
    np.testing.assert_allclose(outputs["x"], 3 - time_s + after**2 / 2, rtol=0, atol=1e-14)
    np.testing.assert_allclose(outputs["delayed"], np.interp(time_s - delay_s, [0, 3], [3, 0]), rtol=0, atol=1e-14)
    if delay_s > 0:
        np.testing.assert_allclose(events_s, [2 + delay_s], rtol=0, atol=1e-14)
        assert list(modes) == [0]
