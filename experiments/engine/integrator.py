"""The integrator of saturated loops with dead times: Taylor series between events, compiled with numba.

    x'(t) = A x + B m + D w        u = C x + E w        m = sat(u)        w_j(t) = Z_j x(t - h_j)

Between events the loop is linear, so that on a step every signal is a polynomial in tau = (t - t_k)/step up to
rounding, the delayed signals w being earlier polynomials shifted. A whole step is one product with a table, see
:mod:`experiments.engine.step_table`; a step that a mesh point or an event cuts short is summed term by term.
"""

from __future__ import annotations

import numpy as np

from experiments.engine import endings
from experiments.engine.compiled_loop import CompiledLoop
from experiments.engine.kinks import BEYOND, Past, agrees, drop, images, shift
from experiments.engine.signals import AT_ONCE, derive, driven, evaluate, expand, fill, unfold
from experiments.engine.slewing import direction, leaves_actuator_mode, place
from experiments.engine.step_table import NEGLIGIBLE, NOTHING, advance, dot, times, whole_lanes
from experiments.engine.watched import REACHED, STOP
from identification.base.arrays import Array
from identification.base.compiled import njit


@njit(nogil=True)
def integrate(
    loop: CompiledLoop, reset_times: Array, resets: Array, low: float, high: float, rate: float, samples: Array,
    horizon: float, bounds: endings.Bounds, watch: Array,
) -> tuple[Array, Array, Array, Array, int, float, int, float]:  # fmt: skip
    """Integrate one loop from rest of its delayed signals, w_j(t < 0) = Z_j x0.

    Parameters
    ----------
    loop
        Its equations as tables.
    reset_times, resets
        Shapes (b,), (b, g): times at which the first g states take given values; where NaN, none.
    low, high, rate
        Saturation limits and the most that m changes in a second, may be infinite; with a rate the last two states
        are m' while m slews, and m.
    samples
        Shape (g, s): each group of what is watched is sampled at the sorted times samples[i] <= horizon; before zero
        it is as at zero. u is sampled with the first group.
    horizon
        End time in seconds.
    bounds
        Where to give up.
    watch
        Of :func:`experiments.engine.watched.watched`: the time reached, and whether to stop there.

    Returns
    -------
    values (1 + o, s), events (e,), modes (e,), places (e,), status, end, steps, tail
        u and what is watched at the samples; event times with the mode entered (:mod:`experiments.engine.slewing`)
        and m there; COMPLETE, DIVERGED, ENDLESS (too many steps), CROWDED (too little room), EVENTFUL or
        STOPPED; the time reached; the number of steps; the largest last term of a
        signal's polynomial, as a share of the largest that the signal was.
    """
    rows, tables, delays, brief, x0, derived, step, groups, reads, _, _ = loop
    slews, slope = rate < np.inf, rate * step
    n, k, room = len(x0), len(delays), bounds.room
    limit = max(abs(low) if np.isfinite(low) else 0.0, abs(high) if np.isfinite(high) else 0.0)
    most_u, most_x = (endings.DIVERGENT * limit, endings.ENORMOUS) if limit > 0 else (np.inf, endings.DIVERGENT)
    increments, polynomials = tables.increments, tables.polynomials
    indptr, indices, data = rows
    signals, standard = tables.magnitudes.shape[1], len(increments) // (1 + len(brief))  # modes
    saturated = n + signals  # the first of its rows: what is not yet there is read of a standing actuator
    most = polynomials.shape[1] // signals - 1
    values, sample = np.zeros((1 + len(reads), samples.shape[1])), np.zeros(len(samples), np.int64)
    events, modes, event_count = np.empty(bounds.events), np.empty(bounds.events, np.int64), 0
    places = np.empty(bounds.events)

    # not literal, and loops instead of arrays' sums: numba would compile several seconds longer
    pieces = queued = on_limit = roots = usual = int(np.int64(0))
    # the sources of the delayed signals, one polynomial a step, the step p at p % room, and where each dead time reads
    starts, lates, radii, degrees = np.empty(room), np.empty(room), np.empty(room), np.empty(room, np.int64)
    history = np.empty((room, k, most + 1))
    wrap = room - 1
    cursor, filled = np.zeros(k, np.int64), np.zeros(k, np.int64)
    queue = np.empty(room)  # mesh points to come: the images of kinks

    z, P, W = np.zeros(increments.shape[2]), np.zeros((signals, most + 1)), np.zeros(most + 1)
    sizes, terms, later, negligible = np.zeros(len(z)), np.zeros(n), np.zeros(n), np.zeros(1 + k)
    work = np.zeros((2, most + 1))
    U, V = P[0], np.zeros((most + 1, n + 1 + k))
    x, scale, rest, size, last = np.zeros(n), np.zeros(n), np.zeros(k), np.zeros(signals), np.zeros(1 + k)
    for r in range(n):
        V[0, r], x[r], scale[r] = x0[r], x0[r], abs(x0[r])
    V[0, n] = min(max(0.0, low), high)
    for j in range(k):
        rest[j] = times(indptr, indices, data, saturated + n + 1 + j, V, 0)
        size[1 + j] = abs(rest[j])
    for j in range(k):
        V[0, n + 1 + j] = rest[j]
    remembered = Past(starts, lates, degrees, history, rest, queue)
    tops, unfolded = np.zeros(signals, np.int64), np.zeros(signals, np.int64)  # degrees, and in which step
    taus, found = np.zeros(AT_ONCE), np.zeros(AT_ONCE)
    u = times(indptr, indices, data, saturated + n, V, 0)
    mode = 0 if slews else (1 if u > high else (-1 if u < low else 0))
    kink, standing = True, 0
    level, longest = 0, brief[-1] if len(brief) > 0 else 0.0
    for g in range(len(samples)):
        while sample[g] < samples.shape[1] and samples[g, sample[g]] < 0:
            for o in range(groups[g], groups[g + 1]):
                values[1 + o, sample[g]] = times(indptr, indices, data, saturated + n + reads[o], V, 0)
            sample[g] += 1
    V[0, n] = 0.0
    t, late, reset, status, steps = 0.0, 0.0, 0, endings.COMPLETE, 0  # the time is t + late, lest it drifts

    while t < horizon:
        if steps == bounds.steps:
            status = endings.ENDLESS
            break
        steps += 1
        watch[REACHED] = t
        if watch[STOP] != 0.0:
            status = endings.STOPPED
            break
        t_next = min(t + step, horizon)
        if queued > 0 and queue[0] - t < step * (1 + 1e-9):
            t_next = min(queue[0], horizon)
        if reset < len(reset_times) and reset_times[reset] < t_next:
            t_next = reset_times[reset]

        side = direction(mode)
        beyond = mode - 3 * side  # which limit u is
        if slews:
            x[n - 2] = side * rate
        for r in range(n):
            z[r] = x[r]
        z[n] = 0.0 if beyond == 0 else (high if beyond == 1 else low)
        settled, planned = (0 if kink else level), t_next
        for level in range(len(brief), -1, -1):  # as many brief dead times as may be are taken for the present
            present = brief[level - 1] if level > 0 else 0.0
            t_next = min(planned, t + brief[level]) if level < len(brief) else planned
            known = 0
            for j in range(k):
                for i in range(filled[j] + 1):
                    z[n + 1 + k * i + j] = 0.0
                filled[j] = 0
                start = t - delays[j]
                middle = start + 0.5 * (t_next - t)  # decides the piece: the ends may lie on a kink
                while cursor[j] + 1 < pieces and starts[(cursor[j] + 1) & wrap] <= middle:
                    cursor[j] += 1
                if delays[j] <= present:
                    continue
                if middle < 0:
                    W[0], degree = rest[j], 0
                else:
                    piece = cursor[j] & wrap
                    if starts[piece] + radii[piece] * step + delays[j] < t_next - 1e-9 * step:
                        t_next = starts[piece] + radii[piece] * step + delays[j]
                    degree = degrees[piece]
                    for i in range(degree + 1):
                        W[i] = history[piece, j, i]
                    moved = start - starts[piece] + (late - lates[piece])
                    if abs(moved) > 4e-16 * (step + t):  # else the same time, to rounding
                        shift(W, degree, moved / step, work)
                radius = min(1.0, (t_next - t) / step + BEYOND)
                filled[j] = fill(z, n, k, j, W, degree, radius, NEGLIGIBLE * size[1 + j])
                known = max(known, filled[j])
            which = level * standard + abs(beyond) + 2 * abs(side)
            if level > 0:
                known = derive(z, n, k, derived[which], filled)
            radius = min(1.0, (t_next - t) / step + BEYOND)
            degree, power = unfold(tables, which, k, z, sizes, known, radius, usual, size, negligible, P, terms)
            if level <= settled or agrees(
                remembered, pieces, delays, present, t, late, step, P, degree, negligible, W, work
            ):
                break
        columns = whole_lanes(n + 1 + k * (known + 1))
        usual = degree
        if degree == most:  # a delayed signal may have terms beyond
            for s in range(1 + k):
                if abs(P[s, most]) * power > negligible[s]:
                    last[s] = max(last[s], abs(P[s, most]) * power)

        whole = abs(t_next - t - step) <= 1e-15 * (step + t)
        if reset < len(reset_times) and t_next == reset_times[reset]:
            whole = False  # it ends there to the last digit
        reach = 1.0 if whole else max((t_next - t - late) / step, 0.0)
        exit_at, entered, crossed, left = leaves_actuator_mode(
            U, degree, mode, on_limit, roots, standing > 2, low, high, reach, x[n - 1], slope, size[0]
        )
        late_next = 0.0
        if exit_at >= 0 or whole:
            reach = exit_at if exit_at >= 0 else 1.0
            t_next = t + (late + reach * step)
            late_next = (late + reach * step) - (t_next - t)

        if reach > 0 and k > 0:
            piece = pieces & wrap
            if pieces - cursor.min() >= room or queued + k > room:
                status = endings.CROWDED
                break
            starts[piece], lates[piece], radii[piece], degrees[piece] = t, late, radius, degree
            for j in range(k):
                for i in range(degree + 1):
                    history[piece, j, i] = P[1 + j, i]
            if kink:
                queued = images(remembered, pieces, queued, delays, present, longest, step, negligible, W, work)
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
                signal = 0 if o < 0 else reads[o]
                if signal <= k:
                    tops[signal] = degree
                elif unfolded[signal] < steps:
                    unfolded[signal] = steps
                    tops[signal] = expand(tables, which, signal, k, z, sizes, known, degree, terms, later, size, P)
            for at in range(begin, until, AT_ONCE):
                several = min(AT_ONCE, until - at)
                for q in range(several):
                    taus[q] = (samples[g, at + q] - t - late) / step
                for o in range(-1 if g == 0 else groups[g], groups[g + 1]):
                    signal = 0 if o < 0 else reads[o]
                    evaluate(P, signal, tops[signal], taus, found)
                    for q in range(several):
                        values[1 + o, at + q] = found[q]

        m = place(U, degree, mode, low, high, x[n - 1], slope, reach) if slews and reach > 0 else x[n - 1]
        if reach == 1.0:
            for r in range(n):
                x[r] += dot(increments, which, r, z, columns)
        elif reach > 0:
            for i in range(known + 1):
                for j in range(k):
                    V[i, n + 1 + j] = z[n + 1 + k * i + j]
            for c in range(n + 1):
                V[0, c] = z[c]
            matter = driven(z, n, filled, size, reach)
            first = which * (n + signals)
            advance(rows, first, tables.influence[which, signals:], V, n, matter, most, scale, step, reach, x)
            V[: known + 1, n + 1 :] = 0.0
        if slews:
            x[n - 1] = m
        for r in range(n):
            scale[r] = max(scale[r], abs(x[r]))
            if abs(x[r]) < NOTHING * scale[r]:  # lest it decay to numbers that the processor is slow with
                x[r] = 0.0
            if not abs(x[r]) < most_x:
                status = endings.DIVERGED
        if not abs(U[0]) < most_u:
            status = endings.DIVERGED
        standing = standing + 1 if reach == 0 else 0
        t, late = t_next, late_next
        if status == endings.DIVERGED:
            break

        on_limit, roots = crossed, left
        if exit_at >= 0:
            if event_count == bounds.events:
                status = endings.EVENTFUL
                break
            mode, kink = entered, True
            events[event_count], modes[event_count], places[event_count] = t, mode, m
            event_count += 1
        elif reset < len(reset_times) and t == reset_times[reset]:
            for g in range(resets.shape[1]):
                x[g] = x[g] if np.isnan(resets[reset, g]) else resets[reset, g]
            reset, kink = reset + 1, True
        if queued > 0 and queue[0] <= t + 1e-13 * (step + t):
            queued, kink = drop(queue, queued, t + 1e-13 * (step + t)), True
    tail = 0.0
    for s in range(1 + k):
        if size[s] > 0:
            tail = max(tail, last[s] / size[s])
    return values, events[:event_count], modes[:event_count], places[:event_count], status, t, steps, tail
