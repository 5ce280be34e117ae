"""The engine against closed forms, an independent integrator, and its own refinement."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from oracle import reference_run

from design.design_file import Design
from experiments.engine import compiled_loop
from experiments.engine.crossings import first_exit
from experiments.engine.saturated_loop import Resets, SaturatedLoop
from experiments.engine.simulate import DivergenceError, simulate
from experiments.runs.design_loop import design_loop
from experiments.runs.references import sinusoid
from experiments.thesis.printed_choices import thesis_reference
from experiments.thesis.studies.pid import PidBenchmark, pid_loop
from identification.base.errors import InputError

FREE = (-np.inf, np.inf)


def scalar_loop(a: float, feedback: float, delay_s: float, x0: float) -> SaturatedLoop:
    """x' = a x + m, u = -feedback x(t - delay), y = x; x(t < 0) = x0."""
    return SaturatedLoop(
        A=np.array([[a]]),
        B=np.ones(1),
        C=np.zeros(1),
        D=np.zeros((1, 1)),
        E=np.array([-feedback]),
        Z=np.ones((1, 1)),
        delays=np.array([delay_s]),
        x0=np.array([x0]),
        outputs={"x": (np.ones(1), np.zeros(1)), "delayed": (np.zeros(1), np.ones(1))},
    )


def method_of_steps(gain: float, delay: float, t: np.ndarray) -> np.ndarray:
    """x' = -gain x(t - delay), x = 1 for t <= 0: sum_k (-gain)^k (t - (k-1) delay)^k / k! while t > (k-1) delay."""
    value = np.ones_like(t)
    factorial = 1.0
    for k in range(1, 60):
        factorial *= k
        value += np.where(t > (k - 1) * delay, (-gain) ** k * np.clip(t - (k - 1) * delay, 0, None) ** k / factorial, 0)
    return value


@pytest.mark.parametrize(("gain", "delay"), [(1.0, 0.5), (1.5, 0.9), (3.0, 0.3)])
def test_delayed_integrator_is_the_closed_form(gain: float, delay: float) -> None:
    t = np.linspace(0, 8 * delay, 301)
    run = simulate(scalar_loop(0.0, gain, delay, 1.0), FREE, t)
    np.testing.assert_allclose(run.outputs["x"], method_of_steps(gain, delay, t), rtol=0, atol=1e-13)
    np.testing.assert_allclose(run.outputs["delayed"], method_of_steps(gain, delay, t - delay), rtol=0, atol=1e-13)


def test_saturated_integrator_switches_where_the_closed_form_says() -> None:
    # u = -x(t - h) from x = 3 under |u| <= 1: x falls at the rate 1 until x(t - h) = 1, that is until t = 2 + h
    h = 0.25
    t = np.linspace(0, 2 + h, 91)
    run = simulate(scalar_loop(0.0, 1.0, h, 3.0), (-1.0, 1.0), np.append(t, 6.0))
    np.testing.assert_allclose(run.outputs["x"][:-1], 3 - t, rtol=0, atol=1e-13)
    assert run.events_s[0] == pytest.approx(2 + h, abs=1e-13)
    assert list(run.modes[:1]) == [0]


def test_undelayed_loop_is_the_exponential() -> None:
    t = np.linspace(0, 3, 50)
    run = simulate(scalar_loop(0.5, 2.0, 0.0, 1.0), FREE, t)
    np.testing.assert_allclose(run.outputs["x"], np.exp(-1.5 * t), rtol=0, atol=1e-14)


def test_a_grazing_touch_is_no_event_and_a_hair_more_is_two() -> None:
    # an oscillator drives u = sin t open loop; the limit is its peak
    loop = SaturatedLoop(
        A=np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 0.0]]),
        B=np.array([0.0, 0.0, 1.0]),
        C=np.array([1.0, 0.0, 0.0]),
        D=np.zeros((3, 0)),
        E=np.zeros(0),
        Z=np.zeros((0, 3)),
        delays=np.zeros(0),
        x0=np.array([0.0, 1.0, 0.0]),
        outputs={"integral": (np.array([0.0, 0.0, 1.0]), np.zeros(0))},
    )
    t = np.linspace(0, 4.0, 11)
    assert len(simulate(loop, (-2.0, 1.0 + 1e-9), t).events_s) == 0
    run = simulate(loop, (-2.0, 1.0 - 1e-9), t)
    half_width = np.arccos(1 - 1e-9)
    np.testing.assert_allclose(run.events_s, np.pi / 2 + np.array([-1, 1]) * half_width, atol=1e-7)
    # m = min(sin, 1/2): its integral in closed form
    run = simulate(loop, (-2.0, 0.5), t)
    np.testing.assert_allclose(run.events_s, [np.pi / 6, 5 * np.pi / 6], atol=1e-14)
    assert run.outputs["integral"][-1] == pytest.approx(1 - 2 * np.cos(np.pi / 6) + np.pi / 3 - np.cos(4.0), abs=1e-13)


def test_first_exit_finds_the_first_of_close_roots() -> None:
    # (tau - 0.3)(tau - 0.3000001)(tau + 2), positive at 0
    g = np.zeros(41)
    g[:4] = np.array([0.3 * 0.3000001 * 2, 0.3 * 0.3000001 - 2 * 0.6000001, 2 - 0.6000001, 1.0])
    assert first_exit(g, 1.0) == pytest.approx(0.3, abs=1e-8)
    assert first_exit(g, 0.29) == -1.0


def test_whole_numbers_are_dead_times_too(extended_design: Design) -> None:
    loop = design_loop(extended_design, thesis_reference("extended", [1.5]), None)
    runs = [
        simulate(dataclasses.replace(loop, delays=np.full(3, zero)), (-12.0, 12.0), np.array([0.0, 0.5]))
        for zero in (0, 0.0)
    ]
    assert np.array_equal(runs[0].control, runs[1].control)


def test_extended_loop_agrees_with_the_independent_integrator(extended_design: Design) -> None:
    loop = design_loop(extended_design, thesis_reference("extended", [1.5]), extended_design.compensator("corrected"))
    # y is delayed: watch the plant's state behind it as well
    loop.outputs["p"] = (loop.Z[0], np.zeros(3))  # type: ignore[index]
    t = np.arange(0, 0.35, 0.01)
    run = simulate(loop, (-12.0, 12.0), t)
    control, outputs = reference_run(loop, (-12.0, 12.0), t)
    assert len(run.events_s) > 3
    scale = np.abs(outputs["p"]).max()
    np.testing.assert_allclose(run.outputs["p"], outputs["p"], rtol=0, atol=1e-8 * scale)
    np.testing.assert_allclose(run.control, control, rtol=0, atol=1e-7 * np.abs(control).max())


@pytest.mark.parametrize("limit", [8.0, 12.0, 20.0, 40.0])
def test_step_and_order_do_not_matter(extended_design: Design, limit: float, monkeypatch: pytest.MonkeyPatch) -> None:
    loop = design_loop(extended_design, thesis_reference("extended", [1.5]), extended_design.compensator("thesis"))
    t = np.linspace(0, 6, 601)
    coarse = simulate(loop, (-limit, limit), t).outputs["output"]
    monkeypatch.setattr(compiled_loop, "FURTHEST", compiled_loop.FURTHEST / 3.7)
    fine = simulate(loop, (-limit, limit), t).outputs["output"]
    np.testing.assert_allclose(coarse, fine, rtol=0, atol=1e-9 * np.abs(fine).max())


def test_linear_steady_state_is_the_frequency_response(extended_design: Design) -> None:
    # another frequency than the design's, where the error does not vanish: e = S r in the steady state
    omega = 4.0
    loop = design_loop(extended_design, sinusoid(3.0, omega, 0.3, 0.0), None)
    t = np.linspace(0, 30, 3001)
    error = simulate(loop, FREE, t).outputs["error"]
    s = 1j * omega
    S = 1 - complex(extended_design.blocks["T_so"](s)) * np.exp(-s * extended_design.plant.delay_s)
    steady = np.imag(3.0 * S * np.exp(1j * (omega * t + 0.3)))
    np.testing.assert_allclose(error[t > 25], steady[t > 25], rtol=0, atol=1e-8)


def test_pid_loop_settles_on_its_step() -> None:
    benchmark = PidBenchmark(1.5, 40.0, 2.0, 4.5, 0.5, 10.0, 10.0)
    run = simulate(pid_loop(benchmark, 1.0), (-10.0, 10.0), np.linspace(0, 400, 801))
    assert run.outputs["output"][-1] == pytest.approx(10.0, abs=1e-6)
    assert run.control[-1] == pytest.approx(10.0 / 1.5, abs=1e-6)  # static gain


def test_a_loop_that_has_decayed_holds_zeros() -> None:
    # exp(-40 t) is a subnormal number from t = 17.7 s on
    loop = scalar_loop(-40.0, 0.0, 0.1, 1.0)
    t = np.linspace(0.0, 40.0, 401)
    x = simulate(loop, FREE, t).outputs["x"]
    np.testing.assert_allclose(x, np.exp(-40 * t), rtol=0, atol=1e-14)
    assert np.all(x[t > 2.0] == 0.0)


def test_divergence_is_said() -> None:
    with pytest.raises(DivergenceError, match="diverges"):
        simulate(scalar_loop(40.0, 0.0, 0.1, 1.0), FREE, np.array([0.0, 10.0]))


@pytest.mark.parametrize(
    ("limits", "times", "message"),
    [((1.0, -1.0), [0.0, 1.0], "limits"), (FREE, [1.0, 0.0], "increasing"), (FREE, [0.0, np.nan], "increasing")],
)
def test_bad_arguments_are_refused(limits: tuple[float, float], times: list[float], message: str) -> None:
    with pytest.raises(InputError, match=message):
        simulate(scalar_loop(0.0, 1.0, 0.1, 1.0), limits, np.array(times))


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"A": np.array([[np.nan]])}, "A of the loop is not finite"),
        ({"x0": np.array([np.inf])}, "x0 of the loop is not finite"),
        ({"delays": np.array([-0.1])}, "dead times"),
        ({"delays": np.array([np.inf])}, "dead times"),
        ({"outputs": {"x": (np.array([np.nan]), np.zeros(1))}}, "output x"),
    ],
)
def test_loops_that_cannot_be_are_refused(changes: dict[str, object], message: str) -> None:
    with pytest.raises(InputError, match=message):
        dataclasses.replace(scalar_loop(0.0, 1.0, 0.1, 1.0), **changes)


@pytest.mark.parametrize(("times", "message"), [([-1.0], "increase"), ([1.0, 1.0], "increase"), ([np.nan], "finite")])
def test_resets_that_cannot_be_are_refused(times: list[float], message: str) -> None:
    with pytest.raises(InputError, match=message):
        Resets(np.array(times), np.zeros((len(times), 1)))


def test_dead_times_too_far_apart_are_refused() -> None:
    # one of 0.02 s makes the steps, one of 1e8 s would remember 5e9 of them
    pair = {"D": np.zeros((1, 2)), "E": np.array([-0.1, -0.1]), "Z": np.ones((2, 1)), "delays": np.array([0.02, 1e8])}
    loop = dataclasses.replace(scalar_loop(0.0, 1.0, 0.1, 1.0), outputs={}, **pair)
    with pytest.raises(InputError, match=r"near 0.1 rad.s needs steps of 39.9 s, too many to store for .* 1e\+08 s"):
        simulate(loop, FREE, np.array([0.0, 1.0]))


@pytest.mark.parametrize("unit", [2.0**-33, 1.0, 2.0**20])
def test_the_unit_of_time_does_not_matter(unit: float) -> None:
    loop = scalar_loop(0.0, 1.5, 0.9, 1.0)
    scaled = dataclasses.replace(loop, A=loop.A / unit, B=loop.B / unit, delays=loop.delays * unit)
    t = np.linspace(0.0, 7.0, 71)
    run, other = (simulate(one, (-0.5, 0.3), times) for one, times in ((loop, t), (scaled, t * unit)))
    np.testing.assert_allclose(other.outputs["x"], run.outputs["x"], rtol=0, atol=1e-13)
    np.testing.assert_allclose(other.events_s, run.events_s * unit, rtol=1e-12)


@settings(max_examples=40, deadline=None)
@given(exponent=st.floats(-13.0, math.log10(0.009)), unit=st.integers(-9, 9), horizon=st.floats(0.5, 30.0))
def test_a_brief_dead_time_is_exact_without_steps_as_short_as_it(exponent: float, unit: int, horizon: float) -> None:
    """x' = -x(t - h): of its modes exp(s t), s + exp(-s h) = 0, all but the slowest are over after some dead times."""
    scale, h = 10.0**unit, 10.0**exponent
    slow = -1.0
    for _ in range(50):
        slow -= (slow + math.exp(-slow * h)) / (1 - h * math.exp(-slow * h))
    t = np.linspace(max(40 * h, 0.3), max(40 * h, 0.3) + horizon, 23)
    run = simulate(scalar_loop(0.0, 1 / scale, h * scale, 1.0), FREE, t * scale)
    np.testing.assert_allclose(run.outputs["x"], np.exp(slow * t) / (-slow * (1 + h * slow)), rtol=0, atol=1e-13)


@pytest.mark.parametrize("h", [1e-3, 1e-5, 1e-7, 1e-10])
def test_a_brief_dead_time_behind_a_saturation(h: float) -> None:
    # as test_saturated_integrator_switches_where_the_closed_form_says, and then the mode of the loop with its past
    slow = -1.0
    for _ in range(50):
        slow -= (slow + math.exp(-slow * h)) / (1 - h * math.exp(-slow * h))
    nodes, weights = np.polynomial.legendre.leggauss(20)
    theta = h / 2 * (nodes - 1)  # before the switch, when x was 1 - h - theta
    start = 1 - h - (h / 2 * weights) @ ((1 - h - theta) * np.exp(-slow * (theta + h)))
    t = np.linspace(0.5, 8, 16)
    run = simulate(scalar_loop(0.0, 1.0, h, 3.0), (-1.0, 1.0), np.append(2 + h, 2 + h + t))
    assert run.events_s[0] == pytest.approx(2 + h, abs=1e-13)
    np.testing.assert_allclose(run.outputs["x"][1:], start / (1 + h * slow) * np.exp(slow * t), rtol=0, atol=1e-13)
