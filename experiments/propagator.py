"""One step of a linear system driven by polynomials: its Taylor series, and the table that maps its start to its end.

    x' = A x + B m + D w,  m constant,  w = sum w_i tau^i,  tau = (t - t_k)/step  ->  x = sum x_i tau^i

    x_p = X_p x_0 + K_p^B m + sum_{i < p} K_{p-i}^D w_i/C(p, i),    X_p = (step A)^p/p!,
    K_p^B = step (step A)^(p-1) B/p!,  K_p^D likewise

by x_{p+1} = step/(p+1) (A x_p + B m_p + D w_p), for tau^i integrates p - i times to tau^p/(C(p, i) (p - i)!).
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from experiments.crossings import BINOMIAL, MOST

Array = NDArray[Any]

ROUNDING = 1e-16
NEGLIGIBLE = 1e-14  # a term, relative to the largest value of its signal so far
LEAST = 24  # degree: delayed polynomials may be of higher degree than the responses
LANES = 16  # products of rows are taken in multiples of so many columns


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


@njit(cache=True, nogil=True)
def times(indptr: Array, indices: Array, data: Array, r: int, V: Array, i: int) -> float:
    """Row r of a matrix in compressed rows times V[i]."""
    value = 0.0
    for q in range(indptr[r], indptr[r + 1]):
        value += data[q] * V[i, indices[q]]
    return value


@njit(cache=True, nogil=True)
def whole_lanes(count: int) -> int:
    """``count`` rounded up to a multiple of LANES."""
    return (count + LANES - 1) // LANES * LANES


@njit(cache=True, nogil=True, fastmath={"contract", "reassoc"})
def dot(table: Array, which: int, row: int, z: Array, count: int) -> float:
    """The first ``count`` entries of a row of one of two tables times those of z."""
    value = 0.0
    for c in range(count):
        value += table[which, row, c] * z[c]
    return value


@njit(cache=True, nogil=True)
def tabulate(rows: Rows, n: int, k: int, step: float) -> tuple[Array, Array, int]:
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
    increments (n, columns), polynomials (signals (degree + 1), columns), degree
        Both times z = (x_0, m, w_0, w_1, ..., w_degree) are what x gains in the step, and the signals' coefficients,
        those of degree 0 first. Beyond ``degree`` each entry's terms are below rounding; -1 where they are not at the
        highest. The gain and not the end: its entries' rounding, the same at every step, is small where x is slow.
    """
    indptr, indices, data = rows
    columns, signals = n + 1 + k, len(indptr) - 1 - n
    # responses[p] holds X_p, K_p^B and K_p^D side by side, outputs[p] the signals of them
    responses, outputs = np.zeros((MOST + 1, columns, columns)), np.zeros((MOST + 1, signals, columns))
    largest = np.zeros((n, columns))
    for r in range(n):
        responses[0, r, r] = 1.0
    degree = -1
    for p in range(MOST + 1):
        if p > 0:
            small = True
            for r in range(n):
                for q in range(indptr[r], indptr[r + 1]):
                    column, value = indices[q], data[q] * step / p
                    if column < n:
                        for c in range(columns):
                            responses[p, r, c] += value * responses[p - 1, column, c]
                    elif p == 1:
                        responses[p, r, column] += value
                for c in range(columns):
                    size = abs(responses[p, r, c])
                    largest[r, c] = max(largest[r, c], size)
                    if size > ROUNDING * largest[r, c]:
                        small = False
            if small and (k == 0 or p >= LEAST):
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
    wide = n + 1 + k * (degree + 1)
    increments, polynomials = np.zeros((n, wide)), np.zeros((signals * (degree + 1), wide))
    for p in range(degree, -1, -1):  # the small terms first
        for r in range(n):
            for c in range(n + 1 if p > 0 else 0):
                increments[r, c] += responses[p, r, c]
            for i in range(p):
                for j in range(k):
                    increments[r, n + 1 + k * i + j] += responses[p - i, r, n + 1 + j] / BINOMIAL[p, i]
        for s in range(signals):
            row = signals * p + s
            for c in range(n + 1):
                polynomials[row, c] = outputs[p, s, c]
            for i in range(p + 1):
                for j in range(k):
                    polynomials[row, n + 1 + k * i + j] = outputs[p - i, s, n + 1 + j] / BINOMIAL[p, i]
    return increments, polynomials, degree


@njit(cache=True, nogil=True)
def advance(
    rows: Rows, V: Array, n: int, known: int, most: int, scale: Array, step: float, reach: float, x: Array
) -> None:
    """x at tau = reach, term by term.

    V (most + 1, n + 1 + k) holds the terms of (x, m, w): V[0] and the delayed signals, to the degree ``known``, are
    given; to which they matter. The sum ends where a term is negligible against ``scale``, or after ``most``.
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
def expand(
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
