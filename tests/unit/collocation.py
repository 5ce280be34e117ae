"""A slow, converged reference for saturated loops with dead times: spectral collocation by the method of steps.

It shares nothing with the engine but the loop's matrices. Between mesh points (the images of t = 0, of every event and
of every reset under all dead times) the loop is linear with a smooth input, and its states are interpolated at
Chebyshev's points tau in [-1, 1]:

    X = 1 x(a)' + length/2 J (X M' + W N' + 1 f'),        J = the integral of the interpolant from -1 to every node,

one linear system for all nodes and states: Sylvester's equation, solved with Schur's forms of the balanced M and of J's
inverse. The delayed signals W are read off the interpolants of earlier intervals.
"""

from __future__ import annotations

import heapq
from bisect import bisect_right
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import NDArray
from scipy.linalg import matrix_balance, schur
from scipy.linalg.lapack import ztrsyl
from scipy.optimize import brentq

from experiments.engine.saturated_loop import SaturatedLoop

Array = NDArray[Any]

NODES = 24
REACH = 3.0  # the fastest eigenvalue times half an interval, at most
GENERATIONS = 10  # images of a kink that are put on the mesh: each dead time makes it smoother by one order
SAME_S = 1e-12  # mesh points closer than this are one
NOISE = 1e-14  # of u, relative to the largest of its terms
MOST_EVENTS = 100_000


class _Basis:
    """Chebyshev's points in increasing order, and what turns values there into coefficients and integrals."""

    def __init__(self, count: int) -> None:
        self.count = count
        self.nodes = -np.cos(np.pi * np.arange(count) / (count - 1))
        self.coefficients = np.linalg.inv(chebyshev.chebvander(self.nodes, count - 1))
        integrals = np.stack([chebyshev.chebint(row, lbnd=-1) for row in np.eye(count)], axis=1)
        self.J = chebyshev.chebvander(self.nodes, count) @ integrals @ self.coefficients
        self.slopes, self.turned = schur(np.linalg.inv(self.J[1:, 1:]), output="complex")
        self.fine = np.cos(np.pi * np.arange(4 * count, -1, -1) / (4 * count))
        self.to_fine = self.at(self.fine) @ self.coefficients

    def at(self, tau: Array) -> Array:
        """Chebyshev's polynomials at tau (s,) in [-1, 1], shape (s, count)."""
        return np.cos(np.outer(np.arccos(np.clip(tau, -1, 1)), np.arange(self.count)))

    def first_exit(self, values: Array, noise: float) -> float | None:
        """The first tau at which the polynomial with these values (count,) at the nodes becomes negative.

        Where an event has been located it starts with either sign, by 1000 times ``noise`` at most. Between extremes it
        is monotonous: a sign change is one root there, and no pair of roots is overlooked, however close, that leaves
        it below -``noise`` in between.
        """
        fine = self.to_fine @ values
        middle, radius = (fine.max() + fine.min()) / 2, (fine.max() - fine.min()) / 2
        # of degree d, between M + 1 of Chebyshev's points: at most 1/cos(pi d/(2 M)) times as large as there
        if middle - radius / np.cos(np.pi / 8) > noise:
            return None
        series = self.coefficients @ values
        slope = chebyshev.chebtrim(chebyshev.chebder(series), 1e-15 * np.abs(series).max())
        roots = chebyshev.chebroots(slope) if len(slope) > 1 else np.zeros(0)
        extremes = roots.real[(np.abs(roots.imag) < 0.01) & (np.abs(roots.real) < 1)]
        points = np.union1d(self.fine, extremes)
        heights = chebyshev.chebval(points, series)
        first = int(np.argmax(heights >= 0)) if heights.max() >= 0 else len(heights)
        if first > 0 and heights[:first].min() < -1000 * noise:
            return -1.0
        outside = first + np.flatnonzero(heights[first:] < -noise)
        if len(outside) == 0:
            return None
        inside = outside[0] - 1
        if heights[inside] <= 0:
            return float(points[inside])
        edges = float(points[inside]), float(points[inside + 1])
        return float(brentq(chebyshev.chebval, *edges, args=(series,), xtol=1e-16, rtol=1e-15))


_basis = lru_cache(_Basis)


class _Linear:
    """x' = M x + forcing, by collocation."""

    def __init__(self, M: Array, basis: _Basis) -> None:
        balanced, (self.scale, _) = matrix_balance(M, permute=False, separate=True)
        self.T, self.Q = schur(balanced, output="complex")
        self.M, self.basis = M, basis

    def solve(self, length: float, start: Array, forcing: Array) -> Array:
        """States (count, n) at the nodes, from the start (n,) and the forcing (count, n)."""
        step = length / 2 * self.basis.J
        right = start + step @ forcing
        states = self._solve(length / 2, right)
        # Schur's coordinates mix states of all sizes: once more, for what is left in the states' own coordinates
        return states + self._solve(length / 2, right - states + step @ (states @ self.M.T))

    def _solve(self, half: float, right: Array) -> Array:
        """X of X - half J X M' = right: Sylvester's equation for all nodes but the first, at which J is 0."""
        z = (right / self.scale) @ self.Q.conj()
        first = np.outer(self.basis.J[1:, 0], self.T @ z[0])
        known = self.basis.slopes @ (self.basis.turned.conj().T @ (z[1:] / half + first))
        found, scale, _ = ztrsyl(self.basis.slopes / half, self.T.conj(), known, tranb="C", isgn=-1)
        z[1:] = self.basis.turned @ found / scale
        return np.asarray((z @ self.Q.T).real * self.scale)


class _History:
    """Z x of all intervals so far; before t = 0 as it is at t = 0."""

    def __init__(self, rest: Array, basis: _Basis) -> None:
        self.rest, self.basis = rest, basis
        self.starts: list[float] = []
        self.lengths: list[float] = []
        self.series: list[Array] = []

    def append(self, start: float, length: float, values: Array) -> None:
        self.starts.append(start)
        self.lengths.append(length)
        self.series.append(self.basis.coefficients @ values)

    def read(self, times: Array) -> Array:
        """The signals at increasing times (count,) of one interval; at its ends, as from within."""
        middle, reach = (times[0] + times[-1]) / 2, (times[-1] - times[0]) / 4
        inner = times + np.clip(middle - times, -min(SAME_S, reach), min(SAME_S, reach))
        values = np.tile(self.rest, (len(times), 1))
        first = int(np.searchsorted(inner, 0.0))
        while first < len(times):
            piece = bisect_right(self.starts, inner[first]) - 1
            after = self.starts[piece + 1] if piece + 1 < len(self.starts) else np.inf
            last = int(np.searchsorted(inner, after))
            tau = (times[first:last] - self.starts[piece]) / self.lengths[piece] * 2 - 1
            values[first:last] = self.basis.at(tau) @ self.series[piece]
            first = last
        return values


class _Mesh:
    """The mesh points to come: (time, generation) with their images."""

    def __init__(self, delays: Array, generations: int) -> None:
        self.delays, self.generations = np.unique(delays), generations
        self.queue: list[tuple[float, int]] = []

    def images(self, t: float, generation: int) -> None:
        if generation < self.generations:
            for delay in self.delays:
                heapq.heappush(self.queue, (t + float(delay), generation + 1))

    def reach(self, t: float) -> None:
        """Take out what has been reached, its images in."""
        found = []
        while self.queue and self.queue[0][0] <= t + SAME_S:
            found.append(heapq.heappop(self.queue)[1])
        if found:
            self.images(t, min(found))


class _Modes:
    """The loop with zero dead times substituted: how it moves in each mode, and where u leaves the mode."""

    def __init__(self, loop: SaturatedLoop, limits: tuple[float, float], basis: _Basis) -> None:
        now, later = loop.delays == 0, loop.delays > 0

        def substituted(x: Array, w: Array) -> tuple[Array, Array]:
            return x + w[..., now] @ loop.Z[now], w[..., later]

        self.low, self.high, self.basis = float(limits[0]), float(limits[1]), basis
        self.delays, self.Z, self.B = loop.delays[later], loop.Z[later], loop.B
        (A, self.D), (self.C, self.E) = substituted(loop.A, loop.D), substituted(loop.C, loop.E)
        free = A + np.outer(self.B, self.C)
        self.free_D = self.D + np.outer(self.B, self.E)
        self.saturated, self.unsaturated = _Linear(A, basis), _Linear(free, basis)
        self.fastest = float(max(np.abs(np.linalg.eigvals(M)).max() for M in (A, free)))
        rows = [(self.C, self.E), *(substituted(x, w) for x, w in loop.outputs.values())]
        self.to_x, self.to_w = np.stack([x for x, _ in rows], axis=1), np.stack([w for _, w in rows], axis=1)

    def states(self, mode: int, length: float, x: Array, w: Array) -> Array:
        """States (count, n) at the nodes from x (n,), with the delayed signals w (count, k)."""
        if mode == 0:
            return self.unsaturated.solve(length, x, w @ self.free_D.T)
        return self.saturated.solve(length, x, w @ self.D.T + self.B * (self.high if mode == 1 else self.low))

    def noise(self, x: Array, w: Array) -> float:
        """Of u, at x (n,) and w (k,)."""
        return NOISE * float(np.abs(self.C) @ np.abs(x) + np.abs(self.E) @ np.abs(w))

    def after_jump(self, mode: int, x: Array, w: Array) -> int:
        """The mode that u is in at x (n,) and w (k,), this one if it has not clearly left it."""
        u, noise = float(self.C @ x + self.E @ w), self.noise(x, w)
        lowest, highest = {1: (self.high, np.inf), -1: (-np.inf, self.low), 0: (self.low, self.high)}[mode]
        if lowest - noise <= u <= highest + noise:
            return mode
        return 1 if u > self.high else -1 if u < self.low else 0

    def exit(self, mode: int, states: Array, w: Array) -> tuple[float, int] | None:
        """The first tau at which u leaves the mode, and the mode that it enters."""
        u, noise = states @ self.C + w @ self.E, self.noise(states[0], w[0])
        ways = {1: [(u - self.high, 0)], -1: [(self.low - u, 0)], 0: [(self.high - u, 1), (u - self.low, -1)]}[mode]
        found = [(self.basis.first_exit(margin, noise), entered) for margin, entered in ways if np.isfinite(margin[0])]
        return min(((tau, entered) for tau, entered in found if tau is not None), default=None)


def collocated_run(
    loop: SaturatedLoop,
    limits: tuple[float, float],
    time_s: Array,
    nodes: int = NODES,
    reach: float = REACH,
    generations: int = GENERATIONS,
) -> tuple[Array, dict[str, Array], Array, Array]:
    """Simulate a loop from t = 0, any dead times, zero and none included.

    Parameters
    ----------
    loop, limits, time_s
        As of :func:`experiments.engine.simulate.simulate`.
    nodes, reach, generations
        See the constants of this module; more nodes, a shorter reach and more generations are more accurate.

    Returns
    -------
    u (s,), outputs (name -> (s,)), events_s (e,), modes (e,)
        A state's jump that takes u across a limit is an event at the jump. At a jump the samples are as after it.
    """
    basis = _basis(nodes)
    modes = _Modes(loop, limits, basis)
    horizon = float(time_s[-1])
    longest = min([horizon, 2 * reach / modes.fastest if modes.fastest > 0 else horizon, *modes.delays])
    history, mesh = _History(modes.Z @ loop.x0, basis), _Mesh(modes.delays, generations)
    mesh.images(0.0, 0)
    for reset in loop.resets.times_s:
        heapq.heappush(mesh.queue, (float(reset), 0))
    resets = list(zip(loop.resets.times_s.tolist(), loop.resets.values, strict=True))[::-1]

    def delayed(start: float, stop: float) -> Array:
        times, w = start + (stop - start) * (basis.nodes + 1) / 2, np.empty((nodes, len(modes.delays)))
        for delay in mesh.delays:
            at = modes.delays == delay
            w[:, at] = history.read(times - delay)[:, at]
        return w

    values = np.empty((len(time_s), 1 + len(loop.outputs)))
    events: list[tuple[float, int]] = []
    t, x, mode, jumped = 0.0, loop.x0.astype(float), 0, True
    while t < horizon:
        stop = min([horizon, *(time for time, _ in mesh.queue[:1])])
        if resets and abs(resets[-1][0] - stop) <= SAME_S:
            stop = resets[-1][0]
        if (pieces := np.ceil((stop - t) / longest * (1 - 1e-12))) > 1:
            stop = t + (stop - t) / pieces
        w = delayed(t, stop)
        if jumped and (after := modes.after_jump(mode, x, w[0])) != mode:
            mode = after
            if t > 0:
                events.append((t, mode))
                mesh.images(t, 0)
        jumped = False
        states, entered = modes.states(mode, stop - t, x, w), mode
        found = modes.exit(mode, states, w)
        if found is not None:
            stop, entered = t + (stop - t) * (found[0] + 1) / 2, found[1]
            events.append((stop, entered))
            mesh.images(stop, 0)
            if len(events) > MOST_EVENTS:
                raise RuntimeError(f"the loop chatters at t = {stop:.6g} s")
            if stop <= t:
                mode = entered
                continue
            w = delayed(t, stop)
            states = modes.states(mode, stop - t, x, w)
        inside = slice(*np.searchsorted(time_s, [t, stop if stop < horizon else np.inf]))
        at = basis.at((time_s[inside] - t) / (stop - t) * 2 - 1) @ basis.coefficients
        values[inside] = at @ (states @ modes.to_x + w @ modes.to_w)
        history.append(t, stop - t, states @ modes.Z.T)
        t, x, mode = stop, states[-1].copy(), entered
        # a jump of states that are read with a dead time arrives later, at any mesh point
        jumped = found is None and len(loop.resets.times_s) > 0
        mesh.reach(t)
        while resets and resets[-1][0] <= t + SAME_S:
            value = resets.pop()[1]
            x[: len(value)], jumped = value, True
    times, entries = np.array([e for e, _ in events]), np.array([mode for _, mode in events], dtype=np.int64)
    return values[:, 0], dict(zip(loop.outputs, values[:, 1:].T, strict=True)), times, entries
