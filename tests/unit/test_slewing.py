"""Actuators with a rate limit: closed forms, a brute-force march without modes, and what theta2 makes of them."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.linalg import expm
from scipy.optimize import brentq

from design.design_file import Design
from experiments.drive.sampled_loop import Drive, simulate_sampled
from experiments.engine.ready_loop import ready_loop
from experiments.engine.saturated_loop import Resets, SaturatedLoop
from experiments.engine.simulate import simulate
from experiments.runs.design_loop import design_loop
from experiments.runs.references import sinusoid
from experiments.thesis.printed_choices import thesis_reference
from identification.base.errors import InputError

FREE = (-np.inf, np.inf)
STEP_S = 1e-3


def marched(
    loop: SaturatedLoop, limits: tuple[float, float], rate: float, steps: int
) -> tuple[NDArray[Any], NDArray[Any]]:
    """u and m every STEP_S: m goes to u as far as limits and rate allow, x' = A x + B m + D w by straight lines."""
    n, late = len(loop.x0), np.rint(loop.delays / STEP_S).astype(int)
    known = np.zeros(n) if loop.B_limits is None else loop.B_limits
    inputs = np.column_stack([loop.B - known, known, loop.D])
    q = inputs.shape[1]
    whole = np.zeros((n + 2 * q, n + 2 * q))
    whole[:n, :n], whole[:n, n : n + q], whole[n : n + q, n + q :] = loop.A, inputs, np.eye(q) / STEP_S
    F = expm(whole * STEP_S)
    free, after = F[:n, :n], F[:n, n + q :]
    before = F[:n, n : n + q] - after
    Zx = np.tile(loop.Z @ loop.x0, (steps + 1, 1))
    u, m, x = np.empty(steps + 1), np.empty(steps + 1), loop.x0.copy()

    def delayed(i: int) -> NDArray[Any]:
        return np.asarray(Zx[np.maximum(i - late, 0), np.arange(len(late))])

    m[0], u[0] = np.clip(0.0, *limits), loop.C @ x + loop.E @ delayed(0)
    for i in range(steps):
        x = free @ x + before @ [m[i], np.clip(u[i], *limits), *delayed(i)] + after[:, 2:] @ delayed(i + 1)
        both = np.full(2, m[i])  # m and sat(u), of which u depends little
        for _ in range(6):
            both[1] = np.clip(loop.C @ (x + after[:, :2] @ both) + loop.E @ delayed(i + 1), *limits)
            both[0] = np.clip(both[1], m[i] - rate * STEP_S, m[i] + rate * STEP_S)
        x, m[i + 1] = x + after[:, :2] @ both, both[0]
        for value in loop.resets.values[np.abs(loop.resets.times_s - (i + 1) * STEP_S) < STEP_S / 2]:
            x[: len(value)] = np.where(np.isnan(value), x[: len(value)], value)
        Zx[i + 1], u[i + 1] = loop.Z @ x, loop.C @ x + loop.E @ delayed(i + 1)
    return u, m


def random_loop(rng: np.random.Generator) -> SaturatedLoop:
    """Three generated states, of which the first jumps, and five others, with two dead times."""
    own = rng.normal(size=(5, 5))
    A = np.zeros((8, 8))
    A[1, 2] = rng.uniform(1, 6)
    A[2, 1] = -A[1, 2]
    A[3:, :3] = rng.normal(size=(5, 3))
    A[3:, 3:] = own - (np.abs(np.linalg.eigvals(own).real).max() + 0.2) * np.eye(5)
    jumps = np.sort(rng.choice(np.arange(200, 2800), 2, replace=False)) * STEP_S
    return SaturatedLoop(
        A=A,
        B=np.append(np.zeros(3), rng.normal(size=5)),
        C=2 * rng.normal(size=8),
        D=np.vstack([np.zeros((3, 2)), rng.normal(size=(5, 2))]),
        E=rng.normal(size=2),
        Z=np.hstack([np.zeros((2, 3)), rng.normal(size=(2, 5)) / 2]),
        delays=rng.integers(100, 900, size=2) * STEP_S,
        x0=np.append(rng.normal(size=3), np.zeros(5)),
        outputs={},
        resets=Resets(jumps, np.column_stack([rng.normal(size=2), np.full((2, 2), np.nan)])),
        B_limits=np.append(np.zeros(3), rng.normal(size=5)),
    )


@pytest.mark.parametrize("seed", range(4))
def test_a_march_without_modes_comes_as_near_as_its_steps(seed: int) -> None:
    rng = np.random.default_rng([seed, 17])
    loop, rate = random_loop(rng), float(np.exp(rng.uniform(0, 2.5)))
    limits = [(-0.7, 2.0), FREE, (0.3, 1.5), (-np.inf, 0.5)][seed % 4]
    times = STEP_S * np.arange(3001)
    run = simulate(loop, limits, times, rate=rate)
    u, m = marched(loop, limits, rate, 3000)
    assert np.isin([3, -3], run.modes).any()
    assert np.abs(np.diff(run.saturated_control)).max() <= rate * STEP_S * (1 + 1e-9)
    np.testing.assert_allclose(run.saturated_control, m, rtol=0, atol=6 * rate * STEP_S)
    away = np.abs(np.subtract.outer(times, loop.resets.times_s)).min(axis=1) > STEP_S
    np.testing.assert_allclose(run.control[away], u[away], rtol=0, atol=0.03 * np.abs(u).max() * rate**0.5)


def integrator(height: float, dead_time_s: float) -> SaturatedLoop:
    """x' = m read ``dead_time_s`` later; u steps from ``height`` to -height at t = 1."""
    return SaturatedLoop(
        A=np.zeros((2, 2)),
        B=np.array([0.0, 1.0]),
        C=np.array([1.0, 0.0]),
        D=np.zeros((2, 1)),
        E=np.zeros(1),
        Z=np.array([[0.0, 1.0]]),
        delays=np.array([dead_time_s]),
        x0=np.array([height, 0.0]),
        outputs={"output": (np.zeros(2), np.ones(1))},
        resets=Resets(np.array([1.0]), np.array([[-height]])),
    )


@pytest.mark.parametrize("limits", [(-1.5, 2.0), FREE])
def test_a_jump_is_a_ramp_and_its_integral_comes_a_dead_time_later(limits: tuple[float, float]) -> None:
    rate, delay_s, times = 5.0, 0.3, np.linspace(0.0, 3.0, 301)
    low, high = max(limits[0], -3.0), min(limits[1], 3.0)
    run = simulate(integrator(3.0, delay_s), limits, times, rate=rate)
    knots = [0.0, high / rate, 1.0, 1.0 + (high - low) / rate, 3.0]
    levels = np.array([0.0, high, high, low, low])
    np.testing.assert_allclose(run.saturated_control, np.interp(times, knots, levels), atol=1e-13)
    last = np.append(np.diff(run.events_s) > 0, True)  # of the events at one time, as the jump across a limit
    np.testing.assert_allclose(run.events_s[last], knots[:4], atol=1e-14)
    np.testing.assert_array_equal(run.modes[last], [3, 0, -3, 0] if limits == FREE else [4, 1, -4, -1])
    areas = np.append(0.0, np.cumsum(np.diff(knots) * (levels[1:] + levels[:-1]) / 2))
    for at, expected in zip(knots[1:4], areas[1:4], strict=True):
        assert np.interp(at + delay_s, times, run.outputs["output"]) == pytest.approx(expected, abs=1e-4)
    assert run.outputs["output"][-1] == pytest.approx(areas[3] + (2.7 - knots[3]) * low, abs=1e-12)


def test_a_sinusoid_that_is_too_fast_is_left_where_it_is_and_met_again() -> None:
    """Under the rate 1/2 m leaves sin(t) where |cos(t)| = 1/2, on a straight line which meets it later."""
    zero = np.zeros(3)
    loop = SaturatedLoop(
        A=np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], zero]),
        B=np.array([0.0, 0.0, 1.0]),
        C=np.array([1.0, 0.0, 0.0]),
        D=np.zeros((3, 0)),
        E=np.zeros(0),
        Z=np.zeros((0, 3)),
        delays=np.zeros(0),
        x0=np.array([0.0, 1.0, 0.0]),
        outputs={"area": (np.array([0.0, 0.0, 1.0]), np.zeros(0))},
    )
    run = simulate(loop, FREE, np.linspace(0.0, 12.0, 7), rate=0.5)
    expected: list[tuple[float, int]] = []
    left, place, side = 0.0, 0.0, 1
    while left < 12.0:
        expected.append((left, 3 * side))

        def ahead(t: float, left: float = left, place: float = place, side: int = side) -> float:
            return float(side * (np.sin(t) - place) - (t - left) / 2)

        grid = left + np.arange(1, 500) / 100
        first = grid[np.argmax([ahead(t) < 0 for t in grid])]
        left, side = float(brentq(ahead, first - 0.01, first, xtol=1e-15)), -side
        if abs(np.cos(left)) < 0.5:
            expected.append((left, 0))
            left = np.pi * (np.ceil(left / np.pi - 2 / 3) + 2 / 3)
        place = float(np.sin(left))
    expected = [event for event in expected if event[0] < 12.0]
    np.testing.assert_array_equal(run.modes, [mode for _, mode in expected])
    np.testing.assert_allclose(run.events_s, [time for time, _ in expected], atol=1e-12)


@pytest.mark.parametrize("kind", ["none", "corrected"])
def test_it_is_the_loop_of_a_computer_that_does_not_know_the_slewing(extended_design: Design, kind: str) -> None:
    reference, errors = sinusoid(50.0, 1.5, 0.4), []
    loop = design_loop(extended_design, reference, kind)
    for rate_hz in (2000.0, 16000.0):
        drive = Drive(rate_hz, "tustin", (-9.0, 12.0), rate_limit=60.0)
        sampled = simulate_sampled(extended_design, reference, kind, drive, 2.0)
        run = simulate(loop, (-9.0, 12.0), sampled.time_s, rate=60.0)
        errors.append(np.abs(run.outputs["output"] - sampled.output).max())
    slewing = np.abs(run.modes) > 1
    assert slewing.sum() >= 2
    assert errors[1] < 0.5 * errors[0] < 0.03


def test_a_rate_that_nothing_needs_changes_nothing(extended_design: Design) -> None:
    loop, times = design_loop(extended_design, sinusoid(50.0, 1.5), "corrected"), np.linspace(0.0, 5.0, 501)
    fast, free = (simulate(loop, (-12.0, 12.0), times, rate=rate) for rate in (1e8, np.inf))
    np.testing.assert_allclose(fast.outputs["output"], free.outputs["output"], atol=1e-5)


@pytest.mark.parametrize("rate", [0.0, -1.0, float("nan")])
def test_a_rate_that_is_none(rate: float) -> None:
    with pytest.raises(InputError, match="the rate limit is"):
        simulate(integrator(1.0, 0.1), FREE, np.array([0.0, 1.0]), rate=rate)


@pytest.mark.parametrize("rate", [math.inf, 300.0])
def test_a_loop_made_ready_once_runs_with_any_limits_from_any_state(extended_design: Design, rate: float) -> None:
    loop = design_loop(extended_design, thesis_reference("extended", [1.5]), "thesis")
    ready, time_s = ready_loop(loop, rate), np.linspace(0.0, 0.3, 31)
    for limits, moved in (((-12.0, 12.0), 0.0), ((3.0, 5.0), 0.1)):
        again = simulate(ready.starting_from(loop.x0 + moved), limits, time_s)
        anew = simulate(replace(loop, x0=loop.x0 + moved), limits, time_s, rate=rate)
        np.testing.assert_array_equal(again.control, anew.control)
        np.testing.assert_array_equal(again.saturated_control, anew.saturated_control)
