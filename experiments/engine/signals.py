"""The polynomials of a step's signals, each until a bound on what follows is negligible; compiled with numba."""

from __future__ import annotations

from experiments.engine.kinks import FACTORIAL, INVERSE
from experiments.engine.step_table import NEGLIGIBLE, NOTHING, ROUNDING, Tables, dot, whole_lanes
from identification.base.arrays import Array
from identification.base.compiled import njit

AT_ONCE = 8  # samples


@njit(nogil=True)
def state_terms(tables: Tables, which: int, degree: int, z: Array, columns: int, size: Array) -> None:
    """Fill size (n,) with the absolute values of x's coefficients of one degree."""
    n = len(size)
    for r in range(n):
        size[r] = abs(dot(tables.terms, which, n * degree + r, z, columns))


@njit(nogil=True, fastmath={"contract", "reassoc"})
def following(tables: Tables, which: int, signal: int, degree: int, terms: Array) -> float:
    """A bound on all coefficients of a signal beyond a degree, which :func:`state_terms` of that degree gives."""
    value = 0.0
    for r in range(len(terms)):
        value += tables.influence[which, signal, r] * terms[r]
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
def derive(z: Array, n: int, k: int, derived: Array, filled: Array) -> int:
    """Add what the brief delayed signals have of the others, to which degrees z is ``filled`` (k,); the highest degree.

    ``derived`` is (k, k, derivatives), see :func:`experiments.engine.brief_dead_times.derived`.
    """
    known = 0
    for q in range(k):
        known = max(known, filled[q])
    for j in range(k):
        for q in range(k):
            for i in range(filled[q] + 1 if derived[j, q, 0] != 0 else 0):
                for order in range(min(derived.shape[2] - 1, filled[q] - i) + 1):
                    higher = FACTORIAL[i + order] * INVERSE[i] * z[n + 1 + k * (i + order) + q]
                    z[n + 1 + k * i + j] += derived[j, q, order] * higher
                filled[j] = known
    return known


@njit(nogil=True)
def unfold(
    tables: Tables, which: int, k: int, z: Array, sizes: Array, known: int, radius: float, usual: int, size: Array,
    negligible: Array, P: Array, terms: Array,
) -> tuple[int, float]:  # fmt: skip
    """Fill P[: 1 + k] with the coefficients of u and Z x until all that follow are negligible up to a radius.

    Parameters
    ----------
    tables, which
        Of both modes, and the mode's.
    P
        Shape (signals, most + 1).
    z, known, radius
        What the step begins with, the highest degree of a delayed signal in it, and how many steps far the polynomials
        are read.
    usual
        The last step's degree, below which the end is not looked for.
    sizes, size, negligible, terms
        Filled with abs(z), the largest values of the signals so far, what is negligible beside them, and the absolute
        values of x's coefficients of the last degree.

    Returns
    -------
    degree, power
        Of the last coefficient, and radius to that power.
    """
    n, signals, most = len(terms), len(P), P.shape[1] - 1
    columns = whole_lanes(n + 1 + k * (known + 1))
    for i in range(columns):
        sizes[i] = abs(z[i])
    for s in range(1 + k):
        negligible[s] = ROUNDING * dot(tables.magnitudes, which, s, sizes, columns)
    quiet, power = 0, 1.0
    for degree in range(most + 1):
        small = degree > known
        upto = whole_lanes(n + 1 + k * (min(degree, known) + 1))  # of the causes of this degree
        for s in range(1 + k):
            c = dot(tables.polynomials, which, signals * degree + s, z, upto)
            if degree == 0:
                size[s] = max(size[s], abs(c))
                negligible[s] = max(NEGLIGIBLE * size[s], negligible[s])
            P[s, degree] = c if abs(c) > NOTHING * size[s] else 0.0
            small = small and abs(c) * power <= negligible[s]
        quiet = quiet + 1 if small else 0
        if quiet > 1 and degree >= usual - 1:  # what follows may be negligible; most steps end as the last one did
            state_terms(tables, which, degree, z, columns, terms)
            for s in range(1 + k):
                small = small and following(tables, which, s, degree, terms) * power <= negligible[s]
            if small:
                return degree, power
        power *= radius
    terms[:] = 0.0  # what the tables leave out is below rounding
    return most, power / radius


@njit(nogil=True, fastmath={"contract"})
def evaluate(P: Array, signal: int, degree: int, taus: Array, found: Array) -> None:
    """Fill found (AT_ONCE,) with the polynomial P[signal] of a degree at ``taus``."""
    for q in range(AT_ONCE):
        found[q] = P[signal, degree]
    for i in range(degree - 1, -1, -1):
        for q in range(AT_ONCE):
            found[q] = found[q] * taus[q] + P[signal, i]


@njit(nogil=True)
def expand(
    tables: Tables, which: int, signal: int, k: int, z: Array, sizes: Array, known: int, degree: int, terms: Array,
    later: Array, size: Array, P: Array,
) -> int:  # fmt: skip
    """Fill P[signal] with a signal's coefficients until all that follow are negligible against its ``size`` so far.

    ``sizes`` is abs(z); ``terms`` holds the absolute values of x's coefficients of the given ``degree``, beyond which
    delayed signals have none; ``later`` (n,) is room for those of higher degrees. Returns the degree.
    """
    n, (signals, entries) = len(terms), P.shape
    columns = whole_lanes(n + 1 + k * (known + 1))
    for i in range(degree + 1):
        upto = whole_lanes(n + 1 + k * (min(i, known) + 1))
        P[signal, i] = dot(tables.polynomials, which, signals * i + signal, z, upto)
    size[signal] = max(size[signal], abs(P[signal, 0]))
    negligible = max(NEGLIGIBLE * size[signal], ROUNDING * dot(tables.magnitudes, which, signal, sizes, columns))
    bound = following(tables, which, signal, degree, terms)
    while degree < entries - 1 and bound > negligible:
        degree += 1
        P[signal, degree] = dot(tables.polynomials, which, signals * degree + signal, z, columns)
        state_terms(tables, which, degree, z, columns, later)
        bound = following(tables, which, signal, degree, later)
    left_out = abs(P[signal, degree])
    while degree > 0 and left_out <= ROUNDING * size[signal]:
        degree -= 1
        left_out += abs(P[signal, degree])
    return degree
