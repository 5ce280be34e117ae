"""A storage function of M = 1 + theta1~, which proves that M is positive real, and bounds the windup that is left.

M = 1 + C (sI - A)^-1 b with the poles -p_k, real ones, the fastest first, as a chain: x_1' = p_1 (u~ - x_1) and
x_k' = p_k (x_(k-1) - x_k). Its output is w = M u~ = C x + u~. A storage function is V = x'P x with a positive definite
P and

    dV/dt <= 2 u~ w   for every x and u~, that is   [-(A'P + P A), C' - P b; C - b'P, 2] >= 0   (KYP lemma).

With M(0) = 0 the matrix has the kernel (-A^-1 b, 1), which takes P A^-1 b = -(C A^-1)', and is not negative where
-(A'P + P A) > 0. Every number here is rational, so that definiteness is decided by determinants without rounding.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from flint import ctx, fmpq, fmpq_mat, fmpq_poly
from scipy.linalg import solve_continuous_lyapunov

from design.blocks.block import Block
from design.blocks.positivity import (
    exact,
    not_positive_at,
    popov_polynomial,
    real_polynomial,
    squared_magnitude,
    squared_on_axis,
)
from identification.base.arrays import Real
from identification.base.errors import InputError

SLACK = fmpq(1, 10**4)  # least eigenvalue of -(A'P + P A), at first
LEAST_SLACK = fmpq(1, 10**11)  # rounding would hide a smaller one
MOVED = 1e-6  # of P, by which it may be moved to be exact
BITS = 256  # of the roots of the spectral factor

Rows = tuple[tuple[float, ...], ...]
"""P in double precision, which :func:`proved_storage` makes exact."""


@dataclass(frozen=True)
class Storage:
    """V = x'P x of a chain with the input u~ and the output w = C x + u~; dV/dt <= 2 u~ w is proved for exact numbers.

    Parameters
    ----------
    A, b, C, P
        Shapes (n, n), (n,), (n,), (n, n), rounded from the exact ones; x in the input's unit, P in seconds.
    """

    A: Real
    b: Real
    C: Real
    P: Real

    @property
    def steepness(self) -> float:
        """c with |C x| <= c V^(1/2) for every x, c^2 = C P^-1 C', in 1/s^(1/2)."""
        return float(np.sqrt(self.C @ np.linalg.solve(self.P, self.C))) if len(self.C) else 0.0

    def value(self, x: Real) -> Real:
        """V at states of shape (s, n), shape (s,), in the square of the input's unit times seconds."""
        return np.asarray(np.einsum("si,ij,sj->s", x, self.P, x))


def certificate(M: Block) -> Rows:
    """P of a positive real M with real poles, the one with the least :attr:`Storage.steepness` but for rounding.

    Raises
    ------
    InputError
        M is not strictly positive real but for a simple zero at s = 0, a pole is not real, or P in double precision
        does not prove it, see :func:`proved_storage`.

    Notes
    -----
    2 Re M = |g|^2 + slack |z|^2 on the axis, z being x, or x + A^-1 b u~ where M(0) = 0, and u~: g is a polynomial over
    the denominator of M, a spectral factor, and P solves A'P + P A = -(l l' + slack I) with the row l of g. Of all P
    those of the factors with every zero on one side are the extremal ones (Willems, 1971): the zeros to the right give
    the largest P, so that C P^-1 C' is least.
    """
    rates, at_zero, n = _rates(M), M.zeros.count(0j), len(M.poles)
    real, size = popov_polynomial(M, 0.0), fmpq_poly() if at_zero else squared_magnitude(M.poles)
    for k in range(1, n + 1):
        first, rest = (real_polynomial([complex(-rate) for rate in part]) for part in (rates[:k], rates[k:]))
        size += squared_on_axis((first[0] - at_zero * first) * rest)
    slack = SLACK
    while at_zero > 1 or not_positive_at(factored := (2 * real - slack * size).right_shift(at_zero)) is not None:
        slack /= 10
        if slack < LEAST_SLACK:
            raise InputError(f"1 + theta1~ with the zeros {M.zeros} is not positive real; expected Re M > 0")
    with ctx.workprec(BITS):
        found: Any = factored.complex_roots()
        roots = [complex((-root).sqrt()) for root, multiplicity in found for _ in range(multiplicity)]
    g = np.atleast_1d(np.real(np.poly([*roots, *(0.0,) * at_zero]))) * np.sqrt(float(factored[factored.degree()]))
    row = _floats(_along_chain(fmpq_poly([exact(value) for value in g[::-1]]), rates)[1])
    A = _floats(_chain(rates)[0])
    P = solve_continuous_lyapunov(A.T, -row.T @ row - float(slack) * np.eye(n)) if n else np.zeros((0, 0))
    rows = tuple(tuple(each) for each in ((P + P.T) / 2).tolist())
    proved_storage(M, rows)
    return rows


def proved_storage(M: Block, rows: Rows) -> Storage:
    """The storage function of a certificate, proved in exact arithmetic for the roots that M holds.

    Parameters
    ----------
    M
        1 + theta1~, with real poles.
    rows
        P, shape (n, n), symmetric, n the number of poles. Where M(0) = 0 it is moved by a symmetric matrix of rank two
        to the nearest one that meets P A^-1 b = -(C A^-1)'.

    Raises
    ------
    InputError
        It is no certificate of this M.
    """
    rates, n, at_zero = _rates(M), len(M.poles), M.zeros.count(0j)
    if len(rows) != n or any(len(row) != n for row in rows) or rows != tuple(zip(*rows, strict=True)):
        raise InputError(f"the certificate of the anti-windup is not a symmetric matrix; expected one with {n} rows")
    P = fmpq_mat(n, n, [exact(value) for row in rows for value in row])
    at_infinity, C = _along_chain(real_polynomial(M.zeros), rates)
    A, b = _chain(rates)
    if n and at_zero:
        settled = fmpq_mat(n, 1, [1] * n)  # -A^-1 b
        missing = (C * A.inv()).transpose() - P * settled
        both, twice = missing * settled.transpose(), settled.transpose() * missing
        moved = (both + both.transpose()) * fmpq(1, n) - settled * twice * settled.transpose() * fmpq(1, n**2)
        if np.abs(_floats(moved)).max() > MOVED * np.abs(_floats(P)).max():
            raise InputError("the certificate of the anti-windup does not meet P A^-1 b = -(C A^-1)'")
        P += moved
    supplied = -1 * (A.transpose() * P + P * A)
    if not at_zero:
        supplied = _bordered(supplied, C.transpose() - P * b)
    if at_zero > 1 or at_infinity != 1 or M.gain != 1 or not (_is_definite(P) and _is_definite(supplied)):
        raise InputError("the certificate of the anti-windup does not prove that 1 + theta1~ is positive real")
    return Storage(_floats(A), _floats(b)[:, 0], _floats(C)[0], _floats(P))


def _rates(M: Block) -> list[fmpq]:
    """The p_k, exactly."""
    if any(pole.imag or pole.real >= 0 for pole in M.poles) or len(M.zeros) != len(M.poles):
        raise InputError(
            "1 + theta1~ has complex or unstable poles, or fewer zeros than poles; expected neither with a certificate"
        )
    return sorted((exact(-pole.real) for pole in M.poles), reverse=True)


def _chain(rates: Sequence[fmpq]) -> tuple[fmpq_mat, fmpq_mat]:
    """A and b of the chain."""
    n = len(rates)
    A = fmpq_mat(n, n)
    for k, rate in enumerate(rates):
        A[k, k] = -rate
        if k:
            A[k, k - 1] = rate
    return A, fmpq_mat(n, 1, [rate if k == 0 else 0 for k, rate in enumerate(rates)])


def _along_chain(numerator: fmpq_poly, rates: Sequence[fmpq]) -> tuple[fmpq, fmpq_mat]:
    """A numerator of degree n over the denominator: its value at infinity, and its row over the chain's states.

    The numerator is divided by s + p_n, what comes out by s + p_(n-1), and so on: the remainders are those of
    prod_(i > k) (s + p_i), so that they belong to x_k but for prod_(i <= k) p_i.
    """
    remainders: list[fmpq] = []
    for rate in reversed(rates):
        numerator, rest = divmod(numerator, fmpq_poly([rate, 1]))
        remainders.append(rest[0])
    row, gain = [], fmpq(1)
    for rate, remainder in zip(rates, reversed(remainders), strict=True):
        gain *= rate
        row.append(remainder / gain)
    return numerator[0], fmpq_mat(1, len(row), row)


def _bordered(matrix: fmpq_mat, column: fmpq_mat) -> fmpq_mat:
    """The symmetric matrix with one more row and column, whose diagonal entry is 2."""
    n = matrix.nrows()
    rows = [[matrix[i, j] for j in range(n)] + [column[i, 0]] for i in range(n)]
    rows.append([column[j, 0] for j in range(n)] + [fmpq(2)])
    return fmpq_mat(n + 1, n + 1, [value for row in rows for value in row])


def _is_definite(matrix: fmpq_mat) -> bool:
    """Whether a symmetric matrix is positive definite: every leading principal minor is positive (Sylvester)."""
    n = matrix.nrows()
    return all(fmpq_mat(k, k, [matrix[i, j] for i in range(k) for j in range(k)]).det() > 0 for k in range(1, n + 1))


def _floats(matrix: fmpq_mat) -> Real:
    return np.array([int(value.p) / int(value.q) for value in matrix.entries()]).reshape(matrix.nrows(), matrix.ncols())
