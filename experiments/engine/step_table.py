"""One step of a linear system driven by polynomials: its Taylor series, and the table that maps its start to its end.

    x' = A x + B m + D w,  m constant,  w = sum w_i tau^i,  tau = (t - t_k)/step  ->  x = sum x_i tau^i

    x_p = X_p x_0 + K_p^B m + sum_{i < p} K_{p-i}^D w_i/C(p, i),    X_p = (step A)^p/p!,
    K_p^B = step (step A)^(p-1) B/p!,  K_p^D likewise

by x_{p+1} = step/(p+1) (A x_p + B m_p + D w_p), for tau^i integrates p - i times to tau^p/(C(p, i) (p - i)!).

A series ends where a bound on all that follows is negligible. A single small term proves nothing: from rest, the terms
of a signal that begins with t^3 are zero up to the second degree. Where m and w have no terms beyond the degree p,
x_{p+m} = X_m x_p/C(p+m, m), and C(p+m, m) > p for m > 0, so that for a signal c x

    |c x_{p+1}| + |c x_{p+2}| + ... <= (|c X_1| + |c X_2| + ...) |x_p|/(p + 1).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from experiments.engine.crossings import BINOMIAL, MOST
from identification.base.arrays import Array
from identification.base.compiled import njit

ROUNDING = 1e-16
NEGLIGIBLE = 1e-14  # a term, relative to the largest value of its signal so far
NOTHING = 1e-30  # what is smaller than this share of the largest value of its signal so far is zero
LEAST = 24  # degree: delayed polynomials may be of higher degree than the responses
LANES = 16  # products of rows are taken in multiples of so many columns


class Tables(NamedTuple):
    """A step as tables, each of one mode of a loop, or with a leading axis of several.

    Parameters
    ----------
    increments
        Shape (n, columns): times z = (x_0, m, w_0, w_1, ...), what x gains in the step. The gain and not the end: the
        rounding of its entries, the same at every step, is small where x is slow.
    polynomials
        Shape (signals (degree + 1), columns): times z, the signals' coefficients, those of degree 0 first.
    terms
        Shape (n (degree + 1), columns): times z, the coefficients of x, likewise.
    magnitudes
        Shape (signals, columns): times abs(z), what bounds the absolute values of a signal's coefficients together.
    influence
        Shape (signals + n, n): times |x_p|/(p + 1), what bounds together all coefficients of the signals, and of x, of
        degrees beyond p, where m and w have none beyond p - 1.
    """

    increments: Array
    polynomials: Array
    terms: Array
    magnitudes: Array
    influence: Array


class Rows(NamedTuple):
    """A sparse matrix: row r has ``data[q]`` in column ``indices[q]``, indptr[r] <= q < indptr[r + 1]."""

    indptr: Array
    indices: Array
    data: Array


def compressed(dense: Array) -> Rows:
    """Compress a dense matrix; indices are unsigned, so that none is tested for a count from the end."""
    row, column = np.nonzero(dense)
    indptr = np.searchsorted(row, np.arange(len(dense) + 1))
    return Rows(indptr.astype(np.uint32), column.astype(np.uint32), dense[row, column])


@njit(nogil=True)
def times(indptr: Array, indices: Array, data: Array, r: int, V: Array, i: int) -> float:
    """Row r of a matrix in compressed rows times V[i]."""
    value = 0.0
    for q in range(indptr[r], indptr[r + 1]):
        value += data[q] * V[i, indices[q]]
    return value


@njit(nogil=True)
def whole_lanes(count: int) -> int:
    """``count`` rounded up to a multiple of LANES."""
    return (count + LANES - 1) // LANES * LANES


@njit(nogil=True, fastmath={"contract", "reassoc"})
def dot(table: Array, which: int, row: int, z: Array, count: int) -> float:
    """The first ``count`` entries of a row of one of several tables times those of z."""
    value = 0.0
    for c in range(count):
        value += table[which, row, c] * z[c]
    return value


@njit(nogil=True)
def tabulate(rows: Rows, n: int, k: int, step: float) -> tuple[Tables, int]:
    """Tabulate a step.

    Parameters
    ----------
    rows
        Over (x (n,), m, w (k,)): n rows [A B D], and a row for each signal that is wanted.
    n, k
        Numbers of states and of inputs that are polynomials.
    step
        In seconds.

    Returns
    -------
    tables, degree
        Beyond ``degree`` the terms of each response together are below rounding; -1 where they are not at the highest.
    """
    indptr, indices, data = rows
    columns, signals = n + 1 + k, len(indptr) - 1 - n
    # responses[p] holds X_p, K_p^B and K_p^D side by side, outputs[p] the signals of them
    responses, outputs = np.zeros((MOST + 1, columns, columns)), np.zeros((MOST + 1, signals, columns))
    influence = np.zeros((signals + n, n))
    largest = np.zeros((n, columns))  # of the sums of absolute values that make a term: what its rounding is a share of
    for r in range(n):
        responses[0, r, r] = largest[r, r] = 1.0
    degree = -1
    for p in range(MOST + 1):
        if p > 0:
            small = True
            for r in range(n):
                made = np.zeros(columns)
                for q in range(indptr[r], indptr[r + 1]):
                    column, value = indices[q], data[q] * step / p
                    if column < n:
                        for c in range(columns):
                            part = value * responses[p - 1, column, c]
                            responses[p, r, c] += part
                            made[c] += abs(part)
                    elif p == 1:
                        responses[p, r, column] += value
                        made[column] += abs(value)
                for c in range(columns):
                    largest[r, c] = max(largest[r, c], made[c])
                    small = small and made[c] <= ROUNDING * largest[r, c]
                for c in range(n):
                    influence[signals + r, c] += abs(responses[p, r, c])
            if small and (k == 0 or p >= LEAST) and _ends(responses[p], influence[signals:], largest, p):
                degree = p
                break
        for s in range(signals):
            for q in range(indptr[n + s], indptr[n + s + 1]):
                column, value = indices[q], data[q]
                if column < n:
                    for c in range(columns):
                        outputs[p, s, c] += value * responses[p, column, c]
                elif p == 0:
                    outputs[p, s, column] += value
    # loops, since numba takes seconds to compile what adds arrays
    for p in range(1, degree + 1):
        for s in range(signals):
            for c in range(n):
                influence[s, c] += abs(outputs[p, s, c])
    polynomials, terms = _laid_out(outputs, signals, degree, n, k), _laid_out(responses, n, degree, n, k)
    increments, magnitudes = np.zeros((n, terms.shape[1])), np.zeros((signals, terms.shape[1]))
    for p in range(degree, -1, -1):  # the small terms first
        for c in range(terms.shape[1]):
            for s in range(signals):
                magnitudes[s, c] += abs(polynomials[signals * p + s, c])
            for r in range(n if p > 0 else 0):
                increments[r, c] += terms[n * p + r, c]
    return Tables(increments, polynomials, terms, magnitudes, influence), degree


@njit(nogil=True)
def _laid_out(responses: Array, rows: int, degree: int, n: int, k: int) -> Array:
    """Of responses (p, ., n + 1 + k) to x_0, m and w_0 the first ``rows``, as rows over z, by degree.

    w_i has its i degrees later.
    """
    table = np.zeros((rows * (degree + 1), n + 1 + k * (degree + 1)))
    for p in range(degree + 1):
        for r in range(rows):
            for c in range(n + 1):
                table[rows * p + r, c] = responses[p, r, c]
            for i in range(p + 1):
                for j in range(k):
                    table[rows * p + r, n + 1 + k * i + j] = responses[p - i, r, n + 1 + j] / BINOMIAL[p, i]
    return table


@njit(nogil=True)
def _ends(terms: Array, influence: Array, largest: Array, p: int) -> bool:
    """Whether all that follows the terms of degree p (columns, columns) is below rounding.

    ``influence`` holds |X_1| + ... + |X_p|. Where no row of abs(terms) sums to more than 1/2, what is missing in it
    doubles the bound at most.
    """
    n, columns = largest.shape
    for r in range(n):
        total = 0.0
        for c in range(columns):
            bound = 0.0
            for i in range(n):
                bound += influence[r, i] * abs(terms[i, c])
            if 2 * bound > ROUNDING * (p + 1) * largest[r, c]:
                return False
            total += abs(terms[r, c]) if c < n else 0.0
        if total > 0.5:
            return False
    return True


@njit(nogil=True)
def advance(
    rows: Rows, first: int, influence: Array, V: Array, n: int, known: int, most: int, scale: Array, step: float,
    reach: float, x: Array,
) -> None:  # fmt: skip
    """x at tau = reach, term by term, by the n rows from ``first`` on.

    V (most + 1, n + 1 + k) holds the terms of (x, m, w): V[0] and the delayed signals, to the degree ``known``, are
    given; to which they matter. The sum ends where all that follows is negligible against the largest value of each
    state so far, ``scale`` (n,), or after ``most`` terms.
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
            term = factor * times(indptr, indices, data, first + r, V, i)
            V[i + 1, r] = term
            term *= power
            x[r] += term
            scale[r] = max(scale[r], abs(x[r]))
            if negligible and abs(term) > NEGLIGIBLE * scale[r]:
                negligible = False
        for r in range(n):
            if not negligible:
                break
            bound = 0.0
            for c in range(n):
                bound += influence[r, c] * abs(V[i + 1, c])
            negligible = bound * power * reach <= (i + 2) * NEGLIGIBLE * scale[r]
        if negligible:
            break
