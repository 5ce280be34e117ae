"""The integrator of saturated loops with dead times: Taylor series between events, compiled with numba.

    x'(t) = A x + B m + D w        u = C x + E w        m = sat(u)        w_j(t) = Z_j x(t - h_j)

Between events the loop is linear, so that on a step every signal is a polynomial in tau = (t - t_k)/step up to
rounding, the delayed signals w being earlier polynomials shifted. A whole step is one product with a table, see
:mod:`experiments.propagator`; a step that a mesh point or an event cuts short is summed term by term.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from experiments.crossings import BINOMIAL, leave
from experiments.propagator import LANES, Rows, dot, times

Array = NDArray[Any]

NEGLIGIBLE = 1e-14  # a term, or a kink, relative to the largest value of its signal so far
NOTHING = 1e-30  # what is smaller than this share of the largest value of its signal so far is zero
DIVERGENT = 1e100  # a loop whose state passes this diverges

COMPLETE, DIVERGED, ENDLESS, CROWDED = 0, 1, 2, 3


@njit(cache=True, nogil=True)
def _shift(c: Array, degree: int, delta: float) -> None:
    """Replace the coefficients of p(tau) by those of p(tau + delta)."""
    power = np.empty(degree + 1)
    power[0] = 1.0
    for i in range(degree):
        power[i + 1] = power[i] * delta
    for m in range(degree + 1):
        value = 0.0
        for i in range(m, degree + 1):
            value += BINOMIAL[i, m] * power[i - m] * c[i]
        c[m] = value


@njit(cache=True, nogil=True)
def _insert(queue: Array, queued: int, t: float) -> int:
    """Insert a time into the sorted queue, unless it is there already, to rounding; its new length."""
    k = queued
    while k > 0 and queue[k - 1] > t:
        k -= 1
    near = 1e-13 * (1.0 + abs(t))
    if (k > 0 and t - queue[k - 1] <= near) or (k < queued and queue[k] - t <= near):
        return queued
    for q in range(queued, k, -1):
        queue[q] = queue[q - 1]
    queue[k] = t
    return queued + 1


@njit(cache=True, nogil=True)
def _series(
    rows: Rows, V: Array, n: int, known: int, most: int, scale: Array, step: float, reach: float, x: Array
) -> None:
    """x at tau = reach, term by term.

    V (most + 1, n + 1 + k) holds the terms of (x, m, w): V[0] and the delayed signals, to the degree ``known``, are
    given. The sum ends where a term is negligible against ``scale``, or after ``most``.
    """
    indptr, indices, data = rows
    power = 1.0
    for r in range(n):
        x[r] = V[0, r]
    for i in range(most):
        factor = step / (i + 1)
        power *= reach
        negligible = i >= known
        for r in range(n):
            term = factor * times(indptr, indices, data, r, V, i)
            V[i + 1, r] = term
            term *= power
            x[r] += term
            if negligible and abs(term) > NEGLIGIBLE * scale[r]:
                negligible = False
        if negligible:
            break


@njit(cache=True, nogil=True)
def _polynomial(
    polynomials: Array, which: int, signal: int, signals: int, z: Array, columns: int, known: int, most: int,
    size: Array, at: int, c: Array,
) -> int:  # fmt: skip
    """Fill c with a signal's coefficients until they are negligible against its ``size[at]`` so far; the degree."""
    quiet = 0
    for degree in range(most + 1):
        c[degree] = dot(polynomials, which, signals * degree + signal, z, columns)
        size[at] = max(size[at], abs(c[degree]))
        quiet = quiet + 1 if degree > known and abs(c[degree]) <= NEGLIGIBLE * size[at] else 0
        if quiet == 2:
            return degree
    return most


@njit(cache=True, nogil=True)
def integrate(
    unsaturated: Rows, saturated: Rows, ends: Array, polynomials: Array, delays: Array, x0: Array, reset_times: Array,
    resets: Array, low: float, high: float, horizon: float, step: float, margin: float, samples: Array,
    groups: Array, most_steps: int, most_events: int, room: int,
) -> tuple[Array, Array, Array, int, float, int, float]:  # fmt: skip
    """Integrate one loop from rest of its delayed signals, w_j(t < 0) = Z_j x0.

    Parameters
    ----------
    unsaturated
        Over (x (n,), m, w (k,)): n rows [A + B C, 0, D + B E], the loop without saturation, a row [C 0 E], k rows
        [Z 0 0], and o rows [. 0 0] of what is watched.
    saturated
        The same with n rows [A B D].
    ends, polynomials
        Tables of the two, see :func:`experiments.propagator.tabulate`: shapes (2, n, c), (2, (1 + k + o)(d + 1), c).
    delays, x0
        Shapes (k,), (n,); delays positive.
    reset_times, resets
        Shapes (b,), (b, g): times at which the first g states take given values.
    low, high
        Saturation limits, may be infinite.
    horizon, step
        End time and the tables' step in seconds, step <= min(delays).
    margin
        How many steps a polynomial is read from where it starts, >= 1; more than 1 spares steps where the images of
        one mesh under different dead times interleave.
    samples, groups
        Shapes (g, s), (g + 1,): groups[i] ... groups[i + 1] - 1 of what is watched is sampled at the sorted times
        samples[i] <= horizon; before zero it is as at zero. u is sampled with the first group.
    most_steps, most_events, room
        Where to give up; ``room``, a power of two, is for the steps and mesh points that a dead time remembers.

    Returns
    -------
    values (1 + o, s), events (e,), modes (e,), status, end, steps, tail
        u and what is watched at the samples; event times with the mode entered (-1, 0, 1); COMPLETE, DIVERGED,
        ENDLESS (too many steps) or CROWDED (too many events, or too little room); the time reached; the number of steps;
        the largest last term of a signal's polynomial, as a share of the largest that the signal was.
    """
    n, k = len(x0), len(delays)
    indptr, indices, data = unsaturated
    signals = len(indptr) - 1 - n
    most = polynomials.shape[1] // signals - 1
    values, sample = np.zeros((signals - k, samples.shape[1])), np.zeros(len(samples), np.int64)
    events, modes, event_count = np.empty(most_events), np.empty(most_events, np.int64), 0

    # the sources of the delayed signals, one polynomial a step, the step p at p % room, and where each dead time reads
    starts, degrees, pieces = np.empty(room), np.empty(room, np.int64), 0
    history = np.empty((room, k, most + 1))
    wrap = room - 1
    cursor, filled = np.zeros(k, np.int64), np.zeros(k, np.int64)
    queue, queued = np.empty(room), 0  # mesh points to come: the images of kinks

    z, P, W = np.zeros(ends.shape[2]), np.zeros((1 + k, most + 1)), np.zeros(most + 1)
    U, V = P[0], np.zeros((most + 1, n + 1 + k))
    V[0, :n] = x0
    rest = np.array([times(indptr, indices, data, n + 1 + j, V, 0) for j in range(k)])
    V[0, n + 1 :] = rest
    x, scale, size = x0.copy(), np.abs(x0), np.zeros(1 + k)
    size[1:] = np.abs(rest)
    last = np.zeros(1 + k)
    seen = np.zeros(signals - 1 - k)  # of what is watched
    u = times(indptr, indices, data, n, V, 0)
    mode = 1 if u > high else (-1 if u < low else 0)
    kink, on_limit, standing = True, 0, 0
    for g in range(len(samples)):
        while sample[g] < samples.shape[1] and samples[g, sample[g]] < 0:
            for o in range(groups[g], groups[g + 1]):
                values[1 + o, sample[g]] = times(indptr, indices, data, n + 1 + k + o, V, 0)
            sample[g] += 1
    t, reset, status, steps = 0.0, 0, COMPLETE, 0

    while t < horizon:
        if steps == most_steps:
            status = ENDLESS
            break
        steps += 1
        t_next = min(t + step, horizon)
        if queued > 0 and queue[0] - t < step * (1 + 1e-9):
            t_next = min(queue[0], horizon)
        if reset < len(reset_times) and reset_times[reset] < t_next:
            t_next = reset_times[reset]

        known = 0
        for j in range(k):
            for i in range(filled[j] + 1):
                z[n + 1 + k * i + j] = 0.0
            filled[j] = 0
            start = t - delays[j]
            middle = start + 0.5 * (t_next - t)  # decides the piece: the ends may lie on a kink
            if middle < 0:
                z[n + 1 + j] = rest[j]
                continue
            while cursor[j] + 1 < pieces and starts[(cursor[j] + 1) & wrap] <= middle:
                cursor[j] += 1
            piece = cursor[j] & wrap
            if starts[piece] + margin * step + delays[j] < t_next - 1e-9 * step:
                t_next = starts[piece] + margin * step + delays[j]
            degree = degrees[piece]
            for i in range(degree + 1):
                W[i] = history[piece, j, i]
            moved = start - starts[piece]
            if abs(moved) > 4e-16 * (1.0 + t):  # else the same time, to rounding
                _shift(W, degree, moved / step)
            power = margin**degree
            while degree > 0 and abs(W[degree]) * power <= NEGLIGIBLE * size[1 + j]:
                degree -= 1
                power /= margin
            for i in range(degree + 1):
                z[n + 1 + k * i + j] = W[i]
            known, filled[j] = max(known, degree), degree

        which = 0 if mode == 0 else 1
        for r in range(n):
            z[r] = x[r]
        z[n] = 0.0 if mode == 0 else (high if mode == 1 else low)
        columns = -(-(n + 1 + k * (known + 1)) // LANES) * LANES
        quiet, power = 0, 1.0
        for degree in range(most + 1):
            small = degree > known
            for s in range(1 + k):
                c = dot(polynomials, which, signals * degree + s, z, columns)
                size[s] = max(size[s], abs(c)) if degree == 0 else size[s]
                P[s, degree] = c if abs(c) > NOTHING * size[s] else 0.0
                small = small and abs(c) * power <= NEGLIGIBLE * size[s]
            power *= margin
            quiet = quiet + 1 if small else 0
            if quiet == 2:
                break
        if quiet == 0:
            for s in range(1 + k):
                last[s] = max(last[s], abs(P[s, most]) * power)

        whole = abs(t_next - t - step) <= 1e-15 * (1.0 + t)
        reach = 1.0 if whole else (t_next - t) / step
        exit_at, entered, crossed = leave(U, degree, mode, on_limit, standing > 2, low, high, reach)
        if exit_at >= 0:
            reach = exit_at
            t_next = t + exit_at * step

        if reach > 0 and k > 0:
            piece = pieces & wrap
            if pieces - cursor.min() >= room or queued + k > room:
                status = CROWDED
                break
            starts[piece], degrees[piece] = t, degree
            for j in range(k):
                for i in range(degree + 1):
                    history[piece, j, i] = P[1 + j, i]
            if kink:  # its images are mesh points, unless the two sides agree as far as they are read
                for j in range(k):
                    W[:] = 0.0
                    both = degree
                    if pieces == 0:
                        W[0] = rest[j]
                    else:
                        left = (pieces - 1) & wrap
                        before = degrees[left]
                        for i in range(before + 1):
                            W[i] = history[left, j, i]
                        _shift(W, before, (t - starts[left]) / step)
                        both = max(before, degree)
                    gap, power = 0.0, 1.0
                    for i in range(both + 1):
                        gap += abs(W[i] - (P[1 + j, i] if i <= degree else 0.0)) * power
                        power *= 0.5
                    if gap > NEGLIGIBLE * size[1 + j]:
                        queued = _insert(queue, queued, t + delays[j])
                kink = False
            pieces += 1

        for g in range(len(samples)):
            begin = until = sample[g]
            while until < samples.shape[1] and (samples[g, until] < t_next or t_next >= horizon):
                until += 1
            if until == begin:
                continue
            sample[g] = until
            for o in range(-1 if g == 0 else groups[g], groups[g + 1]):
                upto = degree
                if o < 0:
                    for i in range(degree + 1):
                        W[i] = U[i]
                else:
                    upto = _polynomial(polynomials, which, 1 + k + o, signals, z, columns, known, most, seen, o, W)
                for at in range(begin, until):
                    tau, value = (samples[g, at] - t) / step, 0.0
                    for i in range(upto, -1, -1):
                        value = value * tau + W[i]
                    values[1 + o, at] = value

        if reach == 1.0:
            for r in range(n):
                x[r] = dot(ends, which, r, z, columns)
        elif reach > 0:
            for i in range(known + 1):
                for j in range(k):
                    V[i, n + 1 + j] = z[n + 1 + k * i + j]
            V[0, : n + 1] = z[: n + 1]
            _series(unsaturated if mode == 0 else saturated, V, n, known, most, scale, step, reach, x)
            V[: known + 1, n + 1 :] = 0.0
        for r in range(n):
            scale[r] = max(scale[r], abs(x[r]))
            if abs(x[r]) < NOTHING * scale[r]:  # lest it decay to numbers that the processor is slow with
                x[r] = 0.0
            if not abs(x[r]) < DIVERGENT:
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
            mode, kink = entered, True
            events[event_count], modes[event_count] = t, mode
            event_count += 1
        elif reset < len(reset_times) and t == reset_times[reset]:
            x[: resets.shape[1]] = resets[reset]
            reset, kink = reset + 1, True
        passed = 0
        while passed < queued and queue[passed] <= t + 1e-13 * (1.0 + t):
            passed, kink = passed + 1, True
        if passed > 0:
            queued -= passed
            for q in range(queued):
                queue[q] = queue[q + passed]
    tail = 0.0
    for s in range(1 + k):
        if size[s] > 0:
            tail = max(tail, last[s] / size[s])
    return values, events[:event_count], modes[:event_count], status, t, steps, tail
