"""The integrator of saturated loops with dead times: Taylor series between events, compiled with numba.

    x'(t) = A x + B m + D w        u = C x + E w        m = sat(u)        w_j(t) = Z_j x(t - h_j)

Between events the loop is linear, so that on a step every signal is a polynomial in tau = (t - t_k)/step up to
rounding: x_{i+1} = step/(i+1) (A x_i + B m_i + D w_i), the delayed signals w being earlier polynomials shifted.
"""

from __future__ import annotations

import numpy as np
from numba import njit

ORDER = 20
GENERATIONS = 12  # a kink's image after this many dead times is smooth to the order of the series
REACH = 1.5  # a polynomial is read up to this many steps from where it starts

COMPLETE, DIVERGED, CROWDED = 0, 1, 2


def _binomials(order: int) -> np.ndarray:
    table = np.zeros((order + 1, order + 1))
    for n in range(order + 1):
        table[n, 0] = 1.0
        for k in range(1, n + 1):
            table[n, k] = table[n - 1, k - 1] + (table[n - 1, k] if k < n else 0.0)
    return table


BINOMIAL = _binomials(ORDER)


@njit(cache=True)
def _horner(c, tau):
    value = 0.0
    for i in range(len(c) - 1, -1, -1):
        value = value * tau + c[i]
    return value


@njit(cache=True)
def _sign_changes(b):
    changes, last = 0, 0
    for value in b:
        sign = 1 if value > 0 else (-1 if value < 0 else 0)
        if sign != 0:
            if last != 0 and sign != last:
                changes += 1
            last = sign
    return changes


@njit(cache=True)
def first_exit(g, length):
    """The first tau in (0, length] where the polynomial g, positive at the start, becomes negative; -1 if none.

    Bernstein coefficients decide: without a sign change there is no root, with one there is exactly one, with
    more the interval is halved. Nothing is sampled, so that a grazing crossing cannot fall between samples; a
    touch without crossing, or one narrower than 1e-12 of the step, is none.
    """
    n = len(g) - 1
    slack = g[0]
    power = 1.0
    for i in range(1, n + 1):
        power *= length
        slack -= abs(g[i]) * power
    if slack > 0:
        return -1.0
    stack = np.empty((64, n + 1))
    left = np.empty(64)
    right = np.empty(64)
    for j in range(n + 1):
        value, power = 0.0, 1.0
        for i in range(j + 1):
            value += BINOMIAL[j, i] / BINOMIAL[n, i] * g[i] * power
            power *= length
        stack[0, j] = value
    left[0], right[0] = 0.0, length
    depth = 1
    while depth > 0:
        depth -= 1
        b = stack[depth].copy()
        lo, hi = left[depth], right[depth]
        changes = _sign_changes(b)
        if changes == 0:
            if b[0] < 0 or b[n] < 0:
                return lo
            continue
        if changes == 1 and b[0] >= 0 and b[n] <= 0:
            return _root(g, lo, hi)
        if hi - lo < 1e-12 * length:
            if b[n] < 0:
                return lo
            continue
        first = np.empty(n + 1)
        for level in range(n + 1):
            first[level] = b[0]
            for j in range(n - level):
                b[j] = 0.5 * (b[j] + b[j + 1])
        # de Casteljau leaves the second half in b
        middle = 0.5 * (lo + hi)
        stack[depth] = b
        left[depth], right[depth] = middle, hi
        stack[depth + 1] = first
        left[depth + 1], right[depth + 1] = lo, middle
        depth += 2
    return -1.0


@njit(cache=True)
def _root(g, lo, hi):
    """The root of g in [lo, hi], g(lo) >= 0 >= g(hi): Newton kept inside a shrinking bracket."""
    tau = 0.5 * (lo + hi)
    for _ in range(200):
        value, slope = 0.0, 0.0
        for i in range(len(g) - 1, -1, -1):
            slope = slope * tau + value
            value = value * tau + g[i]
        if value > 0:
            lo = tau
        else:
            hi = tau
        following = tau - value / slope if slope != 0 else 0.5 * (lo + hi)
        if not (lo < following < hi):
            following = 0.5 * (lo + hi)
        if abs(following - tau) <= 1e-16 * (1 + abs(tau)) or hi - lo <= 1e-16:
            return following
        tau = following
    return tau


@njit(cache=True)
def _insert(times, generations, count, t, generation):
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
def integrate(
    indptr,
    indices,
    data,
    B,
    D,
    C,
    E,
    Z,
    delays,
    x0,
    low,
    high,
    horizon,
    step,
    outputs_x,
    outputs_w,
    samples,
    most_events,
):
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
        u and the outputs at the samples; event times with the mode entered (-1, 0, 1); the largest share of a
        state that the series' last term had; COMPLETE, DIVERGED or CROWDED; the time reached.
    """
    n, k, outputs = len(x0), len(delays), len(outputs_x)
    values = np.zeros((len(samples), 1 + outputs))
    events, modes = np.empty(most_events), np.empty(most_events, np.int64)
    event_count = 0

    pieces = 1024
    starts = np.empty(pieces)
    history = np.empty((pieces, k, ORDER + 1))
    piece_count = 0
    cursor = np.zeros(k, np.int64)
    longest = 0.0
    for j in range(k):
        longest = max(longest, delays[j])

    queue, generation = np.empty(64), np.empty(64, np.int64)
    queued = 0
    for j in range(k):
        queue, generation, queued = _insert(queue, generation, queued, delays[j], 1)

    x = x0.copy()
    scale = np.abs(x0)
    rest = np.zeros(k)
    for j in range(k):
        for i in range(n):
            rest[j] += Z[j, i] * x0[i]

    X = np.zeros((ORDER + 1, n))
    W = np.zeros((k, ORDER + 1))
    U = np.zeros(ORDER + 1)
    g = np.zeros(ORDER + 1)
    u = 0.0
    for i in range(n):
        u += C[i] * x[i]
    for j in range(k):
        u += E[j] * rest[j]
    mode = 1 if u > high else (-1 if u < low else 0)
    on_limit = 0  # which limit u lies on exactly, just after an event
    flips = 0
    t, sample, tail = 0.0, 0, 0.0
    status = COMPLETE

    while t < horizon:
        length = step
        if queued > 0 and queue[0] - t < length * (1 + 1e-9):
            length = queue[0] - t
        if horizon - t < length:
            length = horizon - t
        reach = length / step

        for j in range(k):
            start = t - delays[j]
            middle = start + 0.5 * length
            if middle < 0:
                W[j, :] = 0.0
                W[j, 0] = rest[j]
                continue
            while cursor[j] + 1 < piece_count and starts[cursor[j] + 1] <= middle:
                cursor[j] += 1
            delta = (start - starts[cursor[j]]) / step
            coefficients = history[cursor[j], j]
            for i in range(ORDER + 1):
                W[j, i] = coefficients[i]
            if delta != 0.0:  # Taylor shift by repeated synthetic division
                for i in range(ORDER):
                    for m in range(ORDER - 1, i - 1, -1):
                        W[j, m] += delta * W[j, m + 1]

        level = high if mode == 1 else low
        X[0] = x
        for i in range(ORDER + 1):
            value = 0.0
            for r in range(n):
                value += C[r] * X[i, r]
            for j in range(k):
                value += E[j] * W[j, i]
            U[i] = value
            if i == ORDER:
                break
            m_i = value if mode == 0 else (level if i == 0 else 0.0)
            factor = step / (i + 1)
            for r in range(n):
                rate = B[r] * m_i
                for q in range(indptr[r], indptr[r + 1]):
                    rate += data[q] * X[i, indices[q]]
                for j in range(k):
                    rate += D[r, j] * W[j, i]
                X[i + 1, r] = factor * rate

        # where does u leave the mode?
        exit_at, exit_mode, exit_limit = -1.0, mode, 0
        for side in (1, -1):
            limit = high if side == 1 else low
            if np.isinf(limit) or (mode != 0 and mode != side):
                continue
            sign = -side if mode == 0 else side  # inside: side (limit - u) > 0; saturated: side (u - limit) > 0
            for i in range(ORDER + 1):
                g[i] = sign * U[i]
            g[0] -= sign * limit
            if on_limit == side:
                for i in range(ORDER):
                    g[i] = g[i + 1]
                g[ORDER] = 0.0
            if g[0] <= 0 and on_limit == side and flips >= 2:
                continue
            found = 0.0 if g[0] < 0 else first_exit(g, reach)
            if found >= 0 and (exit_at < 0 or found < exit_at):
                exit_at = found
                exit_mode = side if mode == 0 else 0
                exit_limit = side
        end = reach if exit_at < 0 else min(exit_at, reach)
        t_end = t + end * step
        if exit_at < 0 and queued > 0 and length == queue[0] - t:
            t_end = queue[0]
        if exit_at < 0 and length == horizon - t:
            t_end = horizon

        # keep the delayed signals' sources; forget what no dead time reaches any more
        if end > 0 and k > 0:
            if piece_count == pieces:
                keep = 0
                while keep + 1 < piece_count and starts[keep + 1] < t - longest - step:
                    keep += 1
                if keep < pieces // 2:
                    starts_grown, history_grown = np.empty(2 * pieces), np.empty((2 * pieces, k, ORDER + 1))
                else:
                    starts_grown, history_grown = np.empty(pieces), np.empty((pieces, k, ORDER + 1))
                starts_grown[: piece_count - keep] = starts[keep:piece_count]
                history_grown[: piece_count - keep] = history[keep:piece_count]
                starts, history, pieces = starts_grown, history_grown, len(starts_grown)
                piece_count -= keep
                for j in range(k):
                    cursor[j] = max(0, cursor[j] - keep)
            starts[piece_count] = t
            for j in range(k):
                for i in range(ORDER + 1):
                    value = 0.0
                    for r in range(n):
                        value += Z[j, r] * X[i, r]
                    history[piece_count, j, i] = value
            piece_count += 1

        while sample < len(samples) and (samples[sample] < t_end or t_end >= horizon):
            tau = (samples[sample] - t) / step
            values[sample, 0] = _horner(U, tau)
            for row in range(outputs):
                value = 0.0
                for i in range(ORDER, -1, -1):
                    term = 0.0
                    for r in range(n):
                        term += outputs_x[row, r] * X[i, r]
                    for j in range(k):
                        term += outputs_w[row, j] * W[j, i]
                    value = value * tau + term
                values[sample, 1 + row] = value
            sample += 1

        last = REACH**ORDER
        for r in range(n):
            value = 0.0
            for i in range(ORDER, -1, -1):
                value = value * end + X[i, r]
            x[r] = value
            scale[r] = max(scale[r], abs(value))
            if scale[r] > 0:
                tail = max(tail, abs(X[ORDER, r]) * last / scale[r])
            if not abs(value) < 1e100:
                status = DIVERGED
        flips = flips + 1 if end == 0 else 0
        t = t_end
        if status == DIVERGED:
            break

        if exit_at >= 0:
            if event_count == most_events:
                status = CROWDED
                break
            mode, on_limit = exit_mode, exit_limit
            events[event_count], modes[event_count] = t, mode
            event_count += 1
            for j in range(k):
                queue, generation, queued = _insert(queue, generation, queued, t + delays[j], 1)
        else:
            on_limit = 0
        while queued > 0 and queue[0] <= t + 1e-13 * (1.0 + t):
            reached, depth = queue[0], generation[0]
            for q in range(queued - 1):
                queue[q], generation[q] = queue[q + 1], generation[q + 1]
            queued -= 1
            if depth < GENERATIONS:
                for j in range(k):
                    queue, generation, queued = _insert(queue, generation, queued, reached + delays[j], depth + 1)
    return values, events[:event_count], modes[:event_count], tail, status, t
