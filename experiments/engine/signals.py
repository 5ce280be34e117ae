"""The polynomials of a step's signals, each until a bound on what follows is negligible; compiled with numba."""

from __future__ import annotations

import numpy as np

from experiments.engine.kinks import shift
from experiments.engine.step_table import NEGLIGIBLE, NOTHING, ROUNDING, add_columns
from identification.base.arrays import Array
from identification.base.compiled import njit

AT_ONCE = 8  # samples


@njit(nogil=True)
def lowest_rows(n: int, k: int, columns: int, signals: int) -> Array:
    """The first row of each column of the polynomials that is not zero: w_i moves the coefficients from degree i on."""
    lows = np.zeros(columns, np.uint64)
    for c in range(n + 1, columns):
        lows[c] = (c - n - 1) // k * signals
    return lows


@njit(nogil=True, inline="always")
def find_used(z: Array, columns: int, sizes: Array, used: Array) -> int:
    """Put where the first ``columns`` of z are not zero into ``used``, and their sizes; how many there are."""
    count = 0
    for c in range(columns):
        sizes[c] = abs(z[c])
        if z[c] != 0.0:
            used[count] = c
            count += 1
    return count


@njit(nogil=True, inline="always")
def gain(gains: Array, which: int, z: Array, used: Array, count: int, none: Array, states: Array, x: Array) -> None:
    """Add to x what it gains in a whole step."""
    for r in range(len(states)):
        states[r] = 0.0
    add_columns(gains, which, used, count, z, none, 0, len(states), states)
    for r in range(len(x)):
        x[r] += states[r]


@njit(nogil=True, inline="always")
def state_terms(
    terms: Array, table: int, z: Array, used: Array, count: int, none: Array, states: Array, size: Array
) -> None:
    """Fill size (n,) with the absolute values of x's coefficients of one degree."""
    for r in range(len(states)):
        states[r] = 0.0
    add_columns(terms, table, used, count, z, none, 0, len(states), states)
    for r in range(len(size)):
        size[r] = abs(states[r])


@njit(nogil=True, fastmath={"contract", "reassoc"})
def following(influence: Array, which: int, signal: int, degree: int, size: Array) -> float:
    """A bound on all coefficients of a signal beyond a degree, which :func:`state_terms` of that degree gives."""
    value = 0.0
    for r in range(len(size)):
        value += influence[which, signal, r] * size[r]
    return value / (degree + 1)


@njit(nogil=True)
def fill(z: Array, n: int, k: int, j: int, c: Array, degree: int, radius: float, negligible: float) -> int:
    """Put a delayed signal's coefficients into z but for the last, negligible ones; the degree that is left."""
    power = radius**degree
    while degree > 0 and abs(c[degree]) * power <= negligible:
        degree -= 1
        power /= radius
    for i in range(degree + 1):
        z[n + 1 + k * i + j] = c[i]
    return degree


@njit(nogil=True)
def driven(z: Array, n: int, filled: Array, size: Array, reach: float) -> int:
    """The degree to which the delayed signals in z, each ``filled`` (k,) to its own, matter within ``reach`` steps."""
    degree, k = 0, len(filled)
    for j in range(k):
        top, power = filled[j], reach ** filled[j]
        while top > degree and abs(z[n + 1 + k * top + j]) * power <= NEGLIGIBLE * size[1 + j]:
            top -= 1
            power /= reach
        degree = max(degree, top)
    return degree


@njit(nogil=True)
def change(
    z: Array, n: int, k: int, j: int, past: Array, ago: float, now: Array, degree: int, radius: float, size: float,
    filled: Array, W: Array, work: Array,
) -> float:  # fmt: skip
    """Put into z what a brief dead time changes of a signal; how much that differs from what z held before.

    ``now`` (most + 1,) holds the signal's coefficients up to ``degree``. Before the dead time it was the same
    polynomial ``ago`` steps earlier or, where that is 0, ``past`` (most + 1,). ``W`` (most + 1,) and ``work``
    (2, most + 1) are room.
    """
    most = len(now) - 1
    for i in range(most + 1):
        W[i] = past[i] if ago == 0 else (now[i] if i <= degree else 0.0)
    if ago > 0:
        shift(W, degree, -ago, work)
    for i in range(degree + 1):
        W[i] -= now[i]
    for i in range(most + 1):
        work[0, i], z[n + 1 + k * i + j] = z[n + 1 + k * i + j], 0.0
    filled[j] = fill(z, n, k, j, W, most, radius, NEGLIGIBLE * size)
    difference, power = 0.0, 1.0
    for i in range(most + 1):
        difference += abs(z[n + 1 + k * i + j] - work[0, i]) * power
        power *= radius
    return difference


@njit(nogil=True, inline="always")
def unfold(
    polynomials: Array, terms: Array, magnitudes: Array, influence: Array, which: int, k: int, z: Array, sizes: Array,
    used: Array, lows: Array, none: Array, known: int, radius: float, usual: int, size: Array, negligible: Array,
    coefficients: Array, bounds: Array, states: Array, P: Array, last: Array,
) -> tuple[int, float, int, int]:  # fmt: skip
    """Fill P (1 + k, most + 1) with the coefficients of u and Z x until all that follow are negligible up to a radius.

    Parameters
    ----------
    polynomials, terms, magnitudes, influence, which
        Of all modes, and the mode's.
    z, known, radius
        What the step begins with, the highest degree of a delayed signal in it, and how many steps far the polynomials
        are read.
    sizes, used, lows, none
        Filled with abs(z), and with where z is not zero; of :func:`lowest_rows`, and zeros.
    usual
        The last step's degree, below which the end is not looked for.
    size, negligible
        The largest values of the signals so far, and what is negligible beside them; filled.
    coefficients, bounds, last
        Filled with the coefficients of all signals, degree by degree, with bounds on their sizes together, and with the
        absolute values of x's coefficients of the last degree.
    states
        Room for as many numbers as x has lanes.

    Returns
    -------
    degree, power, made, count
        Of the last coefficient, and radius to that power; of ``coefficients`` those below the degree ``made`` are
        filled; ``count`` of ``used`` are.
    """
    n, most, signals = len(last), P.shape[1] - 1, len(bounds)
    count = find_used(z, n + 1 + k * (known + 1), sizes, used)
    for s in range(signals):
        bounds[s] = 0.0
    add_columns(magnitudes, which, used, count, sizes, none, 0, signals, bounds)
    quiet, power, made = 0, 1.0, 0
    for degree in range(most + 1):
        small = degree > known
        if degree == made:
            made = 1 + min(max(usual, known + 2, degree + 1), most)
            for r in range(degree * signals, made * signals):
                coefficients[r] = 0.0
            add_columns(
                polynomials, which, used, count, z, lows, degree * signals, made * signals, coefficients
            )  # fmt: skip
        for s in range(1 + k):
            c = coefficients[signals * degree + s]
            if degree == 0:
                size[s] = max(size[s], abs(c))
                negligible[s] = max(NEGLIGIBLE * size[s], ROUNDING * bounds[s])
            P[s, degree] = c if abs(c) > NOTHING * size[s] else 0.0
            small = small and abs(c) * power <= negligible[s]
        quiet = quiet + 1 if small else 0
        if quiet > 1 and degree >= usual - 1:  # what follows may be negligible; most steps end as the last one did
            state_terms(terms, which * (most + 1) + degree, z, used, count, none, states, last)
            for s in range(1 + k):
                small = small and following(influence, which, s, degree, last) * power <= negligible[s]
            if small:
                return degree, power, made, count
        power *= radius
    for r in range(n):
        last[r] = 0.0  # what the tables leave out is below rounding
    return most, power / radius, made, count


@njit(nogil=True, inline="always")
def expand(
    polynomials: Array, terms: Array, influence: Array, which: int, signal: int, z: Array, used: Array, count: int,
    lows: Array, none: Array, degree: int, made: int, most: int, coefficients: Array, bounds: Array, states: Array,
    last: Array, later: Array, size: Array, shown: Array, o: int,
) -> tuple[int, int]:  # fmt: skip
    """Fill shown[o] with a signal's coefficients until all that follow are negligible against its ``size`` so far.

    Beyond ``degree``, of which ``last`` holds the absolute values of x's coefficients, delayed signals have none;
    ``later`` (n,) is room for those of higher degrees. Returns the degree, and to which ``coefficients`` are made.
    """
    signals = len(bounds)
    size[signal] = max(size[signal], abs(coefficients[signal]))
    negligible = max(NEGLIGIBLE * size[signal], ROUNDING * bounds[signal])
    bound = following(influence, which, signal, degree, last)
    while degree < most and bound > negligible:
        degree += 1
        state_terms(terms, which * (most + 1) + degree, z, used, count, none, states, later)
        bound = following(influence, which, signal, degree, later)
    if degree >= made:
        for r in range(made * signals, (degree + 1) * signals):
            coefficients[r] = 0.0
        add_columns(
            polynomials, which, used, count, z, lows, made * signals, (degree + 1) * signals, coefficients
        )  # fmt: skip
        made = degree + 1
    for i in range(degree + 1):
        shown[o, i] = coefficients[signals * i + signal]
    left_out = abs(shown[o, degree])
    while degree > 0 and left_out <= ROUNDING * size[signal]:
        degree -= 1
        left_out += abs(shown[o, degree])
    return degree, made


@njit(nogil=True, fastmath={"contract"})
def evaluate(shown: Array, o: int, degree: int) -> None:
    """Fill the last row of ``shown`` with the polynomial of row o at AT_ONCE times, which are in the row before."""
    taus, found = len(shown) - 2, len(shown) - 1
    for q in range(AT_ONCE):
        shown[found, q] = shown[o, degree]
    for i in range(degree - 1, -1, -1):
        for q in range(AT_ONCE):
            shown[found, q] = shown[found, q] * shown[taus, q] + shown[o, i]


@njit(nogil=True)
def read_samples(
    polynomials: Array, terms: Array, influence: Array, which: int, groups: Array, reads: Array, z: Array, used: Array,
    count: int, lows: Array, none: Array, degree: int, made: int, most: int, coefficients: Array, bounds: Array,
    states: Array, last: Array, later: Array, size: Array, shown: Array, tops: Array, U: Array, samples: Array,
    sample: Array, t: float, late: float, ahead: float, step: float, until: float, values: Array,
) -> None:  # fmt: skip
    """Fill values at the samples before ``until``, and count them in ``sample``, the next of each group.

    Row 0 is u; of the others :func:`expand` makes the polynomials. The two last rows of ``shown`` are room.
    """
    for g in range(len(samples)):
        begin = end = sample[g]
        while end < samples.shape[1] and samples[g, end] < until:
            end += 1
        if end == begin:
            continue
        sample[g] = end
        first = 0 if g == 0 else 1 + groups[g]
        for o in range(first, 1 + groups[g + 1]):
            if o == 0:
                tops[o] = degree
                for i in range(degree + 1):
                    shown[o, i] = U[i]
            else:
                tops[o], made = expand(
                    polynomials, terms, influence, which, reads[o - 1], z, used, count, lows, none, degree, made, most,
                    coefficients, bounds, states, last, later, size, shown, o,
                )  # fmt: skip
        for at in range(begin, end, AT_ONCE):
            several = min(AT_ONCE, end - at)
            for q in range(several):
                shown[len(shown) - 2, q] = (samples[g, at + q] - t - late) / step - ahead
            for o in range(first, 1 + groups[g + 1]):
                evaluate(shown, o, tops[o])
                for q in range(several):
                    values[o, at + q] = shown[len(shown) - 1, q]
