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

from experiments.crossings import leave

Array = NDArray[Any]

ORDER = 40  # of a series at most; it ends where two terms in a row are negligible
NEGLIGIBLE = 1e-13  # a term, relative to the largest value of its state so far
GENERATIONS = 12  # a kink's image after this many dead times is smooth to the order of the series
REACH = 1.5  # a polynomial is read up to this many steps from where it starts

MOST = 1e100  # a loop whose state passes this diverges

COMPLETE, DIVERGED, CROWDED = 0, 1, 2


@njit(cache=True)
def _horner(c: Array, degree: int, tau: float) -> float:
    """sum c_i tau^i."""
    value = 0.0
    for i in range(degree, -1, -1):
        value = value * tau + c[i]
    return value


@njit(cache=True)
def _row(indptr: Array, indices: Array, data: Array, row: int, v: Array) -> float:
    """A row of a sparse matrix times v."""
    value = 0.0
    for q in range(indptr[row], indptr[row + 1]):
        value += data[q] * v[indices[q]]
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
def _shift(c: Array, degree: int, delta: float) -> None:
    """Replace the coefficients of p(tau) by those of p(tau + delta), by repeated synthetic division."""
    for i in range(degree):
        for m in range(degree - 1, i - 1, -1):
            c[m] += delta * c[m + 1]


@njit(cache=True)
def _series(
    indptr: Array, indices: Array, data: Array, V: Array, U: Array, n: int, known: int, scale: Array, step: float,
    level: float,
) -> int:  # fmt: skip
    """Fill V[1:, :n + 1] and U (ORDER + 1,) and return the degree.

    V (ORDER + 1, n + 1 + k) holds the terms of (x, m, w), V[0, :n] and the delayed signals to the degree ``known``
    are given, m is constant; the first n rows of the sparse matrix make x', the next one u.
    """
    negligible, power = False, 1.0
    for i in range(ORDER + 1):
        now = V[i]
        U[i] = _row(indptr, indices, data, n, now)
        now[n] = level if i == 0 else 0.0
        if i == ORDER:
            break
        factor = step / (i + 1)
        power *= REACH
        before, negligible = negligible, i + 1 > known
        following = V[i + 1]
        for r in range(n):
            term = 0.0
            for q in range(indptr[r], indptr[r + 1]):
                term += data[q] * now[indices[q]]
            term *= factor
            following[r] = term
            if negligible and abs(term) * power > NEGLIGIBLE * scale[r]:
                negligible = False
        if before and negligible:
            U[i + 1] = _row(indptr, indices, data, n, following)
            return i + 1
    return ORDER


@njit(cache=True)
def integrate(
    indptr: Array, indices: Array, data: Array, indptr_m: Array, indices_m: Array, data_m: Array, delays: Array,
    x0: Array, low: float, high: float, horizon: float, step: float, samples: Array, most_events: int,
) -> tuple[Array, Array, Array, float, int, float]:  # fmt: skip
    """Integrate one loop from rest of its delayed signals, w_j(t < 0) = Z_j x0.

    Parameters
    ----------
    indptr, indices, data
        A matrix in compressed rows over (x (n,), m, w (k,)): n rows [A + B C, 0, D + B E], the loop without saturation,
        a row [C 0 E], k rows [Z 0 0], and a row for each signal to sample besides u.
    indptr_m, indices_m, data_m
        The same with n rows [A B D]: the saturated loop.
    delays, x0
        Shapes (k,), (n,); delays positive.
    low, high
        Saturation limits, may be infinite.
    horizon, step
        End time and nominal step in seconds, step <= min(delays).
    samples
        Sorted times (s,) in [0, horizon].
    most_events
        Capacity for events.

    Returns
    -------
    values (s, 1 + m), events (e,), modes (e,), tail, status, end
        u and the outputs at the samples; event times with the mode entered (-1, 0, 1); the largest that the last
        term of a series of full order was, as a share of the largest that its state was in the whole run (a state that
        starts from zero has only high terms at first); COMPLETE, DIVERGED or CROWDED; the time reached.
    """
    n, k = len(x0), len(delays)
    outputs = len(indptr) - 2 - n - k
    values = np.zeros((len(samples), 1 + outputs))
    events, modes, event_count = np.empty(most_events), np.empty(most_events, np.int64), 0

    # the delayed signals' sources, one polynomial a step, and where each dead time reads
    starts, degrees, pieces = np.empty(1024), np.empty(1024, np.int64), 0
    history = np.empty((1024, k, ORDER + 1))
    cursor, filled = np.zeros(k, np.int64), np.zeros(k, np.int64)
    longest = np.max(delays) if k > 0 else 0.0

    # mesh points to come: images of kinks
    queue, generation, queued = np.empty(64), np.empty(64, np.int64), 0
    for j in range(k):
        queue, generation, queued = _insert(queue, generation, queued, delays[j], 1)

    V, U = np.zeros((ORDER + 1, n + 1 + k)), np.zeros(ORDER + 1)
    V[0, :n] = x0
    rest = np.array([_row(indptr, indices, data, n + 1 + j, V[0]) for j in range(k)])
    V[0, n + 1 :] = rest
    x, scale, last = x0.copy(), np.abs(x0), np.zeros(n)
    size, W, Y = np.abs(rest), np.zeros(ORDER + 1), np.zeros(ORDER + 1)
    u = _row(indptr, indices, data, n, V[0])
    mode = 1 if u > high else (-1 if u < low else 0)
    on_limit, standing = 0, 0
    t, sample, status = 0.0, 0, COMPLETE

    while t < horizon:
        t_next = min(t + step, horizon)
        if queued > 0 and queue[0] - t < step * (1 + 1e-9):
            t_next = min(queue[0], horizon)
        reach = (t_next - t) / step

        known = 0
        for j in range(k):
            for i in range(filled[j] + 1):
                V[i, n + 1 + j] = 0.0
            filled[j] = 0
            start = t - delays[j]
            middle = start + 0.5 * (t_next - t)  # decides the piece: the ends may lie on a kink
            if middle < 0:
                V[0, n + 1 + j] = rest[j]
                continue
            while cursor[j] + 1 < pieces and starts[cursor[j] + 1] <= middle:
                cursor[j] += 1
            piece = cursor[j]
            degree = degrees[piece]
            for i in range(degree + 1):
                W[i] = history[piece, j, i]
            moved = start - starts[piece]
            if abs(moved) > 4e-16 * (1.0 + t):  # else the same time, to rounding
                _shift(W, degree, moved / step)
            power = REACH**degree
            while degree > 0 and abs(W[degree]) * power <= NEGLIGIBLE * size[j]:
                degree -= 1
                power /= REACH
            for i in range(degree + 1):
                V[i, n + 1 + j] = W[i]
            known, filled[j] = max(known, degree), degree

        V[0, :n] = x
        if mode == 0:
            degree = _series(indptr, indices, data, V, U, n, known, scale, step, 0.0)
        else:
            level = high if mode == 1 else low
            degree = _series(indptr_m, indices_m, data_m, V, U, n, known, scale, step, level)
        exit_at, entered, crossed = leave(U, degree, mode, on_limit, standing > 2, low, high, reach)
        if exit_at >= 0:
            reach = exit_at
            t_next = t + exit_at * step

        if reach > 0 and k > 0:
            if pieces == len(starts):  # forget what no dead time reaches any more, or make room
                first = 0
                while first + 1 < pieces and starts[first + 1] < t - longest - step:
                    first += 1
                room = len(starts) if first > pieces // 2 else 2 * len(starts)
                kept, kept_degrees = np.empty(room), np.empty(room, np.int64)
                kept_history = np.empty((room, k, ORDER + 1))
                kept[: pieces - first], kept_degrees[: pieces - first] = starts[first:pieces], degrees[first:pieces]
                kept_history[: pieces - first] = history[first:pieces]
                starts, degrees, history, pieces = kept, kept_degrees, kept_history, pieces - first
                cursor -= first
            starts[pieces], degrees[pieces] = t, degree
            for j in range(k):
                for i in range(degree + 1):
                    history[pieces, j, i] = _row(indptr, indices, data, n + 1 + j, V[i])
                size[j] = max(size[j], abs(history[pieces, j, 0]))
            pieces += 1

        if sample < len(samples) and (samples[sample] < t_next or t_next >= horizon):
            until = sample
            while until < len(samples) and (samples[until] < t_next or t_next >= horizon):
                values[until, 0] = _horner(U, degree, (samples[until] - t) / step)
                until += 1
            for row in range(outputs):
                for i in range(degree + 1):
                    Y[i] = _row(indptr, indices, data, n + 1 + k + row, V[i])
                for at in range(sample, until):
                    values[at, 1 + row] = _horner(Y, degree, (samples[at] - t) / step)
            sample = until

        for r in range(n):
            x[r] = V[degree, r]
        for i in range(degree - 1, -1, -1):
            for r in range(n):
                x[r] = x[r] * reach + V[i, r]
        for r in range(n):
            scale[r] = max(scale[r], abs(x[r]))
            if degree == ORDER:
                last[r] = max(last[r], abs(V[ORDER, r]) * REACH**ORDER)
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
