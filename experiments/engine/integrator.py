"""The integrator of saturated loops with dead times: Taylor series between events, compiled with numba.

    x'(t) = A x + B m + D w        u = C x + E w        m = sat(u)        w_j(t) = Z_j x(t - h_j)

Between events the loop is linear, so that on a step every signal is a polynomial in tau = (t - t_k)/step up to
rounding, the delayed signals w being earlier polynomials shifted. A whole step is one product with a table, see
:mod:`experiments.engine.step_table`; one that is cut short is summed term by term. Where nothing happens a step is
twice as long, its polynomials about its middle, -1 <= tau <= 1.
"""

from __future__ import annotations

import numpy as np

from experiments.engine import endings
from experiments.engine.compiled_loop import CompiledLoop
from experiments.engine.crossings import stays
from experiments.engine.kinks import BEYOND, Past, across, drop, images, read_piece
from experiments.engine.signals import AT_ONCE, change, driven, fill, find_used, gain, lowest_rows, read_samples, unfold
from experiments.engine.slewing import direction, leaves_actuator_mode, place
from experiments.engine.step_table import NEGLIGIBLE, NOTHING, cut_short, times
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
        and m there; COMPLETE, DIVERGED, ENDLESS (too many steps), CROWDED (too little room), EVENTFUL, UNSETTLED (a
        brief dead time is too long) or STOPPED; the time reached; the number of steps; the largest last term of a
        signal's polynomial, as a share of the largest that the signal was.
    """
    unsaturated, saturated, slewing, stopped, tables, delays, brief, x0, step, groups, reads, _, _ = loop
    slews, slope = rate < np.inf, rate * step
    n, k, room = len(x0), len(delays), bounds.room
    limit = max(abs(low) if np.isfinite(low) else 0.0, abs(high) if np.isfinite(high) else 0.0)
    most_u, most_x = (endings.DIVERGENT * limit, endings.ENORMOUS) if limit > 0 else (np.inf, endings.DIVERGENT)
    indptr, indices, data = saturated  # what is not yet there is read of a standing actuator
    signals = len(indptr) - 1 - n
    gains, centres, polynomials, series, magnitudes, influence = tables
    lanes = magnitudes.shape[2]
    most = polynomials.shape[2] // lanes - 1
    values, sample = np.zeros((1 + len(reads), samples.shape[1])), np.zeros(len(samples), np.int64)
    events, modes, places = np.empty(bounds.events), np.empty(bounds.events, np.int64), np.empty(bounds.events)
    # the sources of the delayed signals, one polynomial a step, the step p at p % room, and where each dead time reads
    starts, lates, radii, degrees, pieces = np.zeros(room), np.zeros(room), np.empty(room), np.empty(room, np.int64), 0
    history, aheads = np.empty((room, k, most + 1)), np.zeros(room)
    wrap, cursor, filled, event_count = room - 1, np.zeros(k, np.int64), np.zeros(k, np.int64), 0
    queue, queued = np.empty(room), 0  # mesh points to come: the images of kinks
    # until when a brief dead time reaches back beyond a kink, and to what
    fresh, past, some_brief = np.zeros(k), np.zeros((k, most + 1)), brief.any()
    wide, work = gains.shape[1], np.zeros((2, most + 1))
    z, P, W = np.zeros(wide), np.zeros((1 + k, most + 1)), np.zeros(most + 1)
    sizes, used, none = np.zeros(wide), np.zeros(wide, np.uint64), np.zeros(wide, np.uint64)
    lows = lowest_rows(n, k, wide, lanes)
    coefficients, rounding, states = np.zeros((most + 1) * lanes), np.zeros(lanes), np.zeros(gains.shape[2])
    terms, later, negligible = np.zeros(n), np.zeros(n), np.zeros(1 + k)
    before, U, V = np.zeros(1 + k), P[0], np.zeros((most + 1, n + 1 + k))
    V[0, :n], V[0, n] = x0, min(max(0.0, low), high)
    rest = np.array([times(indptr, indices, data, n + 1 + j, V, 0) for j in range(k)])
    remembered = Past(starts, lates, aheads, degrees, history, rest, queue)
    V[0, n + 1 :] = np.where(brief, 0.0, rest)
    x, scale, size, last = x0.copy(), np.abs(x0), np.zeros(1 + k), np.zeros(1 + k)
    size[1:] = np.abs(rest)
    seen, shown, tops = (
        np.zeros(signals),
        np.zeros((len(values) + 2, max(most + 1, AT_ONCE))),
        np.zeros(len(values), np.int64),
    )
    u = times(indptr, indices, data, n, V, 0)
    mode = 0 if slews else (1 if u > high else (-1 if u < low else 0))
    kink, on_limit, roots, standing, single = True, 0, 0, 0, 0
    for g in range(len(samples)):  # before zero, as at zero
        sample[g] = np.searchsorted(samples[g], 0.0)
        for o in range(groups[g], groups[g + 1]):
            values[1 + o, : sample[g]] = times(indptr, indices, data, n + reads[o], V, 0)
    V[0, n] = 0.0
    t, late, reset, status, steps, usual = 0.0, 0.0, 0, endings.COMPLETE, 0, 0  # the time is t + late, lest it drifts
    while t < horizon:
        if steps == bounds.steps:
            status = endings.ENDLESS
            break
        steps += 1
        watch[REACHED] = t
        if watch[STOP] != 0.0:
            status = endings.STOPPED
            break
        ahead = 0.0 if slews or some_brief or kink or on_limit != 0 or standing > 0 or single > 0 else 1.0
        single = max(single - 1, 0)
        for s in range(1 + k):
            before[s] = size[s]
        while True:
            length = (1.0 + ahead) * step
            t_next = min(t + length, horizon)
            if queued > 0 and queue[0] - t < length * (1 + 1e-9):
                t_next = min(queue[0], horizon)
            if reset < len(reset_times) and reset_times[reset] < t_next:
                t_next = reset_times[reset]
            resets_within = reset < len(reset_times) and reset_times[reset] <= t + length
            if ahead > 0 and (resets_within or abs(t_next - t - length) > 1e-15 * (step + t)):
                ahead = 0.0
                continue
            for j in range(k):
                if brief[j] and kink and delays[j] > 1e-13 * (step + t):
                    fresh[j] = t + delays[j]
                if brief[j] and t < fresh[j]:
                    t_next = min(t_next, fresh[j])
            known, degree = 0, 0
            for j in range(k):
                for i in range(filled[j] + 1):
                    z[n + 1 + k * i + j] = 0.0
                filled[j] = 0
                start = t - delays[j]
                middle = start + 0.5 * (t_next - t)  # decides the piece: the ends may lie on a kink
                while cursor[j] > 0 and starts[cursor[j] & wrap] > middle:
                    cursor[j] -= 1
                while cursor[j] + 1 < pieces and starts[(cursor[j] + 1) & wrap] <= middle:
                    cursor[j] += 1
                if brief[j] and t >= fresh[j]:
                    continue
                piece = cursor[j] & wrap
                aligned = aheads[piece] == 1.0 and abs(start - starts[piece] + (late - lates[piece])) <= 4e-16 * (
                    step + t
                )
                if ahead > 0 and t_next > delays[j] and not aligned:
                    degree = across(
                        starts, lates, aheads, degrees, history, rest, j, cursor[j], pieces, start, late, step,
                        NEGLIGIBLE * size[1 + j], work, W,
                    )  # fmt: skip
                    if degree < 0:
                        break
                elif middle < 0:
                    W[0], degree = rest[j], 0
                else:
                    degree, t_next = read_piece(
                        starts, lates, aheads, radii, degrees, history, j, piece, start + ahead * step, late, delays[j],
                        t_next, step, work, W,
                    )  # fmt: skip
                if brief[j]:
                    past[j] = 0.0
                    for i in range(degree + 1):
                        past[j, i] = W[i]
                    continue
                radius = min(1.0, (t_next - t) / step + BEYOND)
                filled[j] = fill(z, n, k, j, W, degree, radius, NEGLIGIBLE * size[1 + j])
                known = max(known, filled[j])
            if ahead > 0 and degree < 0:
                ahead, single = 0.0, 1
                continue

            side = direction(mode)
            beyond = mode - 3 * side  # which limit u is
            which = abs(beyond) + 2 * abs(side)
            if slews:
                x[n - 2] = side * rate
            for r in range(n):
                z[r] = x[r]
            z[n] = 0.0 if beyond == 0 else (high if beyond == 1 else low)
            radius = min(1.0, (t_next - t) / step + BEYOND)
            if ahead > 0:
                count = find_used(z, n + 1 + k * (known + 1), sizes, used)
                gain(centres, which, z, used, count, none, states, z[:n])
            settled = not some_brief
            for trial in range(endings.TRIALS):
                degree, power, made, count = unfold(
                    polynomials, series, magnitudes, influence, which, k, z, sizes, used, lows, none, known, radius,
                    usual, size, negligible, coefficients, rounding, states, P, terms,
                )  # fmt: skip
                if settled:
                    break
                settled = True
                for j in range(k):
                    if brief[j]:
                        ago = delays[j] / step if t >= fresh[j] else 0.0  # before a kink's image, what it was is known
                        moves = change(z, n, k, j, past[j], ago, P[1 + j], degree, radius, size[1 + j], filled, W, work)
                        settled = settled and moves <= endings.SETTLED * negligible[1 + j]
                known = filled.max()
                if trial == endings.TRIALS - 1:
                    status = endings.UNSETTLED
            if ahead > 0 and (degree == most or not stays(P, degree, size, mode, low, high)):
                ahead, single = 0.0, 2
                for s in range(1 + k):
                    size[s] = before[s]
                continue
            break
        if status == endings.UNSETTLED:
            break
        usual = degree
        if degree == most:  # a delayed signal may have terms beyond
            for s in range(1 + k):
                if abs(P[s, most]) * power > negligible[s]:
                    last[s] = max(last[s], abs(P[s, most]) * power)

        whole = ahead > 0 or abs(t_next - t - step) <= 1e-15 * (step + t)
        if ahead == 0 and reset < len(reset_times) and t_next == reset_times[reset]:
            whole = False  # it ends there to the last digit
        reach = 1.0 if whole else max((t_next - t - late) / step, 0.0)
        exit_at, entered, crossed, left = -1.0, mode, 0, 0
        if ahead == 0:
            exit_at, entered, crossed, left = leaves_actuator_mode(
                U, degree, mode, on_limit, roots, standing > 2, low, high, reach, x[n - 1], slope, size[0]
            )
        late_next = 0.0
        if exit_at >= 0 or whole:
            reach = exit_at if exit_at >= 0 else 1.0
            t_next = t + (late + (ahead + reach) * step)
            late_next = (late + (ahead + reach) * step) - (t_next - t)

        if reach > 0 and k > 0:
            piece = pieces & wrap
            if pieces - cursor.min() >= room - 4 or queued + k > room:
                status = endings.CROWDED
                break
            starts[piece], lates[piece], radii[piece], degrees[piece], aheads[piece] = t, late, radius, degree, ahead
            for j in range(k):
                for i in range(degree + 1):
                    history[piece, j, i] = P[1 + j, i]
            if kink:
                queued = images(remembered, pieces, queued, delays, brief, step, negligible, W, work)
                kink = False
            pieces += 1

        until = t_next if t_next < horizon else np.inf
        read_samples(
            polynomials, series, influence, which, groups, reads, z, used, count, lows, none, degree, made, most,
            coefficients, rounding, states, terms, later, seen, shown, tops, U, samples, sample, t, late, ahead, step,
            until, values,
        )  # fmt: skip
        m = place(U, degree, mode, low, high, x[n - 1], slope, reach) if slews and reach > 0 else x[n - 1]
        if reach == 1.0:
            if ahead > 0:
                x[:] = z[:n]
            gain(gains, which, z, used, count, none, states, x)
        elif reach > 0:
            rows = (unsaturated if which == 0 else saturated) if side == 0 else (slewing if which == 2 else stopped)
            matter = driven(z, n, filled, size, reach)
            cut_short(rows, influence[which, signals:], V, z, n, k, known, matter, most, scale, step, reach, x)
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
    tail = np.max(last / np.maximum(size, 1e-300))
    return values, events[:event_count], modes[:event_count], places[:event_count], status, t, steps, tail
