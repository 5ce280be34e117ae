"""A slow, independent integrator of saturated loops with dead times: scipy's DOP853 by the method of steps.

It shares nothing with the engine but the loop's matrices: no Taylor series, no exact event polynomials. Every step
between mesh points (dead times' images of 0 and of every event) is one solve_ivp call with located events.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.integrate import solve_ivp

from experiments.engine.saturated_loop import SaturatedLoop


def reference_run(
    loop: SaturatedLoop, limits: tuple[float, float], time_s: np.ndarray, tolerance: float = 1e-11
) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """u, and the outputs that are functions of the state alone, of a loop with positive dead times."""
    low, high = limits
    horizon, shortest = float(time_s[-1]), float(loop.delays.min())
    pieces: list[tuple[float, float, Callable[[float], np.ndarray]]] = []
    rest = loop.Z @ loop.x0

    def delayed(t: float) -> np.ndarray:
        w = rest.copy()
        for j, delay in enumerate(loop.delays):
            past = t - delay
            if past > 0:
                _, end, dense = next(piece for piece in reversed(pieces) if piece[0] <= past)
                w[j] = loop.Z[j] @ dense(min(past, end))  # past the end by rounding only
        return w

    def control(t: float, x: np.ndarray) -> float:
        return float(loop.C @ x + loop.E @ delayed(t))

    mesh = {0.0}
    t, x = 0.0, loop.x0.copy()
    u = control(t, x)
    mode = 1 if u > high else -1 if u < low else 0
    u_out, states = np.empty(len(time_s)), np.empty((len(time_s), len(x)))
    while t < horizon:
        images = [m + k * d for m in mesh for d in loop.delays for k in range(1, 9)]
        end = min([horizon, t + shortest, *(image for image in images if image > t + 1e-12)])

        def right_side(t: float, x: np.ndarray, mode: int = mode) -> np.ndarray:
            w = delayed(t)
            u = loop.C @ x + loop.E @ w
            m = u if mode == 0 else high if mode == 1 else low
            return loop.A @ x + loop.B * m + loop.D @ w

        def upper(t: float, x: np.ndarray) -> float:
            return control(t, x) - high

        def lower(t: float, x: np.ndarray) -> float:
            return control(t, x) - low

        guards = [guard for guard, limit in ((upper, high), (lower, low)) if np.isfinite(limit)]
        for guard in guards:
            guard.terminal = True  # type: ignore[attr-defined]
        upper.direction = -1.0 if mode == 1 else 1.0  # type: ignore[attr-defined]
        lower.direction = 1.0 if mode == -1 else -1.0  # type: ignore[attr-defined]
        solution = solve_ivp(
            right_side, (t, end), x, method="DOP853", rtol=tolerance, atol=tolerance, dense_output=True, events=guards
        )
        stop = float(solution.t[-1])
        pieces.append((t, stop, solution.sol))
        pieces = [piece for piece in pieces if piece[1] >= stop - loop.delays.max() - shortest]
        inside = (time_s >= t) & (time_s <= stop)
        for k in np.flatnonzero(inside):
            states[k] = solution.sol(time_s[k])
            u_out[k] = control(time_s[k], states[k])
        if solution.status == 1:
            rose = mode == 0 and len(solution.t_events[guards.index(upper)]) > 0
            mode = 0 if mode != 0 else 1 if rose else -1
            mesh = {m for m in mesh if m > stop - 8 * loop.delays.max()} | {stop}
        t, x = stop, solution.y[:, -1]
    return u_out, {name: states @ x for name, (x, w) in loop.outputs.items() if not np.any(w)}
