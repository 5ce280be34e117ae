"""The integrator of saturated loops with dead times: Taylor series between events, compiled with numba.

    x'(t) = A x + B m + D w        u = C x + E w        m = sat(u)        w_j(t) = Z_j x(t - h_j)

Between events the loop is linear, so that on a step every signal is a polynomial in tau = (t - t_k)/step up to
rounding: x_{i+1} = step/(i+1) (A x_i + B m_i + D w_i), the delayed signals w being earlier polynomials shifted.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from experiments.crossings import first_exit

Array = NDArray[Any]

ORDER = 20
GENERATIONS = 12  # a kink's image after this many dead times is smooth to the order of the series
REACH = 1.5  # a polynomial is read up to this many steps from where it starts

MOST = 1e100  # a loop whose state passes this diverges

COMPLETE, DIVERGED, CROWDED = 0, 1, 2


@njit(cache=True)
def _horner(c: Array, tau: float) -> float:
    """sum c_i tau^i."""
    value = 0.0
    for i in range(len(c) - 1, -1, -1):
        value = value * tau + c[i]
    return value


@njit(cache=True)
def _dot(a: Array, b: Array) -> float:
    """sum a_i b_i; for a few terms a loop beats the call of a library."""
    value = 0.0
    for i in range(len(a)):
        value += a[i] * b[i]
    return value


@njit(cache=True)
def _insert(times: Array, generations: Array, count: int, t: float, generation: int) -> tuple[Array, Array, int]:
    """Insert a future mesh point into the sorted queue, unless one is there already."""
    for k in range(count):
        if abs(times[k] - t) <= 1e-13 * (1.0 + abs(t)):
            generations[k] = min(generations[k], generation)
            return times, generations, count
    if count == len(times):
        grown, grown_generations = np.empty(2 * count), np.empty(2 * count, np.int64)
        grown[:count], grown_generations[:count] = times, generations
        times, generations = grown, grown_generations
    k = count
    while k > 0 and times[k - 1] > t:
        times[k], generations[k] = times[k - 1], generations[k - 1]
        k -= 1
    times[k], generations[k] = t, generation
    return times, generations, count + 1


@njit(cache=True)
def _shift(c: Array, delta: float) -> None:
    """Replace the coefficients of p(tau) by those of p(tau + delta), by repeated synthetic division."""
    for i in range(len(c) - 1):
        for m in range(len(c) - 2, i - 1, -1):
            c[m] += delta * c[m + 1]


@njit(cache=True)
def _series(
    indptr: Array, indices: Array, data: Array, B: Array, D: Array, C: Array, E: Array,
    X: Array, W: Array, U: Array, step: float, saturated: bool, level: float,
) -> None:  # fmt: skip
    """Fill X[1:] (ORDER + 1, n) and U (ORDER + 1,) from the state X[0] and the delayed signals W (k, ORDER + 1)."""
    n, k = X.shape[1], len(W)
    for i in range(ORDER + 1):
        u = _dot(C, X[i])
        for j in range(k):
            u += E[j] * W[j, i]
        U[i] = u
        if i == ORDER:
            return
        if saturated:
            u = level if i == 0 else 0.0
        factor = step / (i + 1)
        for r in range(n):
            rate = B[r] * u
            for q in range(indptr[r], indptr[r + 1]):
                rate += data[q] * X[i, indices[q]]
            for j in range(k):
                rate += D[r, j] * W[j, i]
            X[i + 1, r] = factor * rate


@njit(cache=True)
def _leave(
    U: Array, mode: int, on_limit: int, stuck: bool, low: float, high: float, reach: float
) -> tuple[float, int, int]:
    """Where on (0, reach] the control leaves its mode, the mode it enters and the limit it crosses; -1 if nowhere.

    Just after an event u lies on a limit exactly; that root at tau = 0 is divided out. ``stuck`` says that the
    loop keeps returning there without moving (u touches the limit tangentially): then it is let go.
    """
    best, entered, crossed = -1.0, mode, 0
    swing, power = 0.0, 1.0  # |u(tau) - u(0)| <= swing
    for i in range(1, ORDER + 1):
        power *= reach
        swing += abs(U[i]) * power
    if on_limit == 0 and ((mode >= 0 and U[0] - high > swing) or (mode <= 0 and low - U[0] > swing)):
        return best, entered, crossed
    if on_limit == 0 and mode == 0 and high - U[0] > swing and U[0] - low > swing:
        return best, entered, crossed
    g = np.zeros(ORDER + 1)
    for side in (1, -1):
        limit = high if side == 1 else low
        if np.isinf(limit) or (mode != 0 and mode != side):
            continue
        # positive inside the mode: side (limit - u) when unsaturated, side (u - limit) when saturated
        sign = -side if mode == 0 else side
        for i in range(ORDER + 1):
            g[i] = sign * U[i]
        g[0] -= sign * limit
        if on_limit == side:
            for i in range(ORDER):
                g[i] = g[i + 1]
            g[ORDER] = 0.0
            if stuck and g[0] <= 0:
                continue
        found = 0.0 if g[0] < 0 else first_exit(g, reach)
        if found >= 0 and (best < 0 or found < best):
            best, entered, crossed = found, (side if mode == 0 else 0), side
    return best, entered, crossed


@njit(cache=True)
def integrate(
    indptr: Array, indices: Array, data: Array, B: Array, D: Array, C: Array, E: Array, Z: Array, delays: Array,
    x0: Array, low: float, high: float, horizon: float, step: float, outputs_x: Array, outputs_w: Array,
    samples: Array, most_events: int,
) -> tuple[Array, Array, Array, float, int, float]:  # fmt: skip
    """Integrate one loop from rest of its delayed signals, w_j(t < 0) = Z_j x0.

    Parameters
    ----------
    indptr, indices, data
        A (n, n) in compressed rows.
    B, D, C, E, Z, delays, x0
        Shapes (n,), (n, k), (n,), (k,), (k, n), (k,), (n,); delays positive.
    low, high
        Saturation limits, may be infinite.
    horizon, step
        End time and nominal step in seconds, step <= min(delays).
    outputs_x, outputs_w
        Shapes (m, n), (m, k): the signals to sample, besides u.
    samples
        Sorted times (s,) in [0, horizon].
    most_events
        Capacity for events.

    Returns
    -------
    values (s, 1 + m), events (e,), modes (e,), tail, status, end
        u and the outputs at the samples; event times with the mode entered (-1, 0, 1); the largest that a series'
        last term was, as a share of the largest that its state was in the whole run (a state that starts from
        zero has only high terms at first); COMPLETE, DIVERGED or CROWDED; the time reached.
    """
    n, k, outputs = len(x0), len(delays), len(outputs_x)
    values = np.zeros((len(samples), 1 + outputs))
    events, modes, event_count = np.empty(most_events), np.empty(most_events, np.int64), 0

    # the delayed signals' sources, one polynomial a step, and where each dead time reads
    starts, history, pieces = np.empty(1024), np.empty((1024, k, ORDER + 1)), 0
    cursor = np.zeros(k, np.int64)
    longest = np.max(delays) if k > 0 else 0.0
    rest = Z @ x0

    # mesh points to come: images of kinks
    queue, generation, queued = np.empty(64), np.empty(64, np.int64), 0
    for j in range(k):
        queue, generation, queued = _insert(queue, generation, queued, delays[j], 1)

    x, scale, last = x0.copy(), np.abs(x0), np.zeros(n)
    X, W, U = np.zeros((ORDER + 1, n)), np.zeros((k, ORDER + 1)), np.zeros(ORDER + 1)
    Y = np.zeros((outputs, ORDER + 1))
    u = _dot(C, x) + _dot(E, rest)
    mode = 1 if u > high else (-1 if u < low else 0)
    on_limit, standing = 0, 0
    t, sample, status = 0.0, 0, COMPLETE

    while t < horizon:
        t_next = min(t + step, horizon)
        if queued > 0 and queue[0] - t < step * (1 + 1e-9):
            t_next = min(queue[0], horizon)
        reach = (t_next - t) / step

        for j in range(k):
            start = t - delays[j]
            middle = start + 0.5 * (t_next - t)  # decides the piece: the ends may lie on a kink
            if middle < 0:
                W[j] = 0.0
                W[j, 0] = rest[j]
                continue
            while cursor[j] + 1 < pieces and starts[cursor[j] + 1] <= middle:
                cursor[j] += 1
            W[j] = history[cursor[j], j]
            _shift(W[j], (start - starts[cursor[j]]) / step)

        X[0] = x
        _series(indptr, indices, data, B, D, C, E, X, W, U, step, mode != 0, high if mode == 1 else low)
        exit_at, entered, crossed = _leave(U, mode, on_limit, standing > 2, low, high, reach)
        if exit_at >= 0:
            reach = exit_at
            t_next = t + exit_at * step

        if reach > 0 and k > 0:
            if pieces == len(starts):  # forget what no dead time reaches any more, or make room
                first = 0
                while first + 1 < pieces and starts[first + 1] < t - longest - step:
                    first += 1
                room = len(starts) if first > pieces // 2 else 2 * len(starts)
                kept, kept_history = np.empty(room), np.empty((room, k, ORDER + 1))
                kept[: pieces - first] = starts[first:pieces]
                kept_history[: pieces - first] = history[first:pieces]
                starts, history, pieces = kept, kept_history, pieces - first
                cursor -= first
            starts[pieces] = t
            for j in range(k):
                for i in range(ORDER + 1):
                    history[pieces, j, i] = _dot(Z[j], X[i])
            pieces += 1

        if sample < len(samples) and (samples[sample] < t_next or t_next >= horizon):
            for row in range(outputs):
                for i in range(ORDER + 1):
                    Y[row, i] = _dot(outputs_x[row], X[i])
                    for j in range(k):
                        Y[row, i] += outputs_w[row, j] * W[j, i]
            while sample < len(samples) and (samples[sample] < t_next or t_next >= horizon):
                tau = (samples[sample] - t) / step
                values[sample, 0] = _horner(U, tau)
                for row in range(outputs):
                    values[sample, 1 + row] = _horner(Y[row], tau)
                sample += 1

        for r in range(n):
            x[r] = X[ORDER, r]
        for i in range(ORDER - 1, -1, -1):
            for r in range(n):
                x[r] = x[r] * reach + X[i, r]
        for r in range(n):
            scale[r] = max(scale[r], abs(x[r]))
            last[r] = max(last[r], abs(X[ORDER, r]) * REACH**ORDER)
            if not abs(x[r]) < MOST:
                status = DIVERGED
        standing = standing + 1 if reach == 0 else 0
        t = t_next
        if status == DIVERGED:
            break

        on_limit = crossed
        if exit_at >= 0:
            if event_count == most_events:
                status = CROWDED
                break
            mode = entered
            events[event_count], modes[event_count] = t, mode
            event_count += 1
            for j in range(k):
                queue, generation, queued = _insert(queue, generation, queued, t + delays[j], 1)
        while queued > 0 and queue[0] <= t + 1e-13 * (1.0 + t):
            reached, depth = queue[0], generation[0]
            queue[: queued - 1] = queue[1:queued].copy()
            generation[: queued - 1] = generation[1:queued].copy()
            queued -= 1
            if depth < GENERATIONS:
                for j in range(k):
                    queue, generation, queued = _insert(queue, generation, queued, reached + delays[j], depth + 1)
    tail = 0.0
    for r in range(n):
        if scale[r] > 0:
            tail = max(tail, last[r] / scale[r])
    return values, events[:event_count], modes[:event_count], tail, status, t
