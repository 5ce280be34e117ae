"""Stable coprime factors of a rational plant and all controllers that stabilise it, Thesis Theorem 2.1.1."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from design.blocks.block import Block, from_polynomial, geometric_scale, polynomial
from identification.base.arrays import Complex, Real
from identification.base.errors import InputError

Terms = tuple[Block, ...]  # what they stand for is their sum

ACCURACY = 1e-8  # to which X N_p + Y D_p must be 1
ROUNDING = 1e-13  # relative size below which a coefficient is zero


@dataclass(frozen=True)
class CoprimeFactors:
    """P = N_p/D_p and X N_p + Y D_p = 1, all four stable and proper, Thesis section 2.1.

    Parameters
    ----------
    N_p, D_p
        Stable coprime factors of the plant.
    X, Y
        Solution of the Bezout equation; X/Y is the controller of Q = 0.
    """

    N_p: Block
    D_p: Block
    X: Block
    Y: Block


def coprime_factors(
    plant: Block, roots: tuple[complex, ...], observer_roots: tuple[complex, ...] = ()
) -> CoprimeFactors:
    """Coprime factors whose controller of Q = 0 places the closed-loop poles at ``roots`` and ``observer_roots``.

    Parameters
    ----------
    plant
        P = n/d, proper, without dead time, with any poles and zeros but at least one pole and no common root.
    roots
        Roots in rad/s of c in N_p = n/c and D_p = d/c: as many as the plant has poles.
    observer_roots
        Roots in rad/s of c' in X = x/c' and Y = y/c': one fewer.

    Raises
    ------
    InputError
        The plant is zero, has no pole, a dead time, more zeros than poles or a pole that is also a zero; there
        are not as many roots as needed or they are not stable; or the solution fails the Bezout equation.

    Notes
    -----
    The Bezout equation, Thesis Eq. (3.7) and (3.8), is the polynomial equation x n + y d = c c', deg x, deg y < deg d,
    which is linear in the coefficients of x and y with the Sylvester matrix of n and d (Kucera, Discrete Linear
    Control, 1979).
    Where roots of c are poles of the plant, they cancel in D_p: c = d gives P/1 and X = 0, Y = 1. P = 1/(s - a)
    with c = s + a and c' = 1 gives the thesis's example: 1/(s + a), (s - a)/(s + a), 2 a and 1.
    """
    order = len(plant.poles)
    if plant.delay_s or plant.gain == 0 or order == 0 or plant.relative_degree < 0:
        raise InputError(
            f"the plant has the gain {plant.gain:g}, {len(plant.zeros)} zeros, {order} poles and the dead time "
            f"{plant.delay_s:g} s; coprime factors are for a gain other than 0, a pole or more, no more zeros "
            "than poles and no dead time"
        )
    common = set(plant.zeros) & set(plant.poles)
    if common:
        raise InputError(f"the plant's pole {common.pop():g} is also its zero; coprime factors have no common root")
    if (len(roots), len(observer_roots)) != (order, order - 1):
        raise InputError(
            f"{len(roots)} roots and {len(observer_roots)} observer roots were given; "
            f"a plant with {order} poles needs {order} and {order - 1}"
        )
    c, c_observer = Block(1.0, tuple(roots)), Block(1.0, tuple(observer_roots))
    for root in c.zeros + c_observer.zeros:
        if root.real >= 0:
            raise InputError(f"the chosen root {root:g} is not stable; expected a negative real part")

    n, d = Block(plant.gain, plant.zeros), Block(1.0, plant.poles)
    q = 2.0 ** round(np.log2(geometric_scale(n, d, c, c_observer)))  # powers of 2 scale without rounding
    sylvester = np.zeros((2 * order, 2 * order))
    for first, factor in ((0, n), (order, d)):
        coefficients = polynomial(factor, q)
        for power in range(order):  # this factor times (s/q)^(order - 1 - power)
            end = order + 1 + power
            sylvester[end - len(coefficients) : end, first + power] = coefficients
    scale = 2.0 ** np.round(np.log2(np.abs(sylvester).max(axis=0)))
    try:
        solution = np.linalg.solve(sylvester / scale, polynomial(c * c_observer, q))
    except np.linalg.LinAlgError:
        raise InputError("the Bezout equation is singular: the plant has a pole that is nearly its zero") from None
    solution[np.abs(solution) < ROUNDING * np.abs(solution).max()] = 0.0
    solution /= scale
    factors = CoprimeFactors(
        N_p=n * c.inverse(),
        D_p=d * c.inverse(),
        X=from_polynomial(solution[:order], q) * c_observer.inverse(),
        Y=from_polynomial(solution[order:], q) * c_observer.inverse(),
    )
    error = _bezout_error(factors, q)
    if not error < ACCURACY:
        raise InputError(
            f"X N_p + Y D_p differs from 1 by {error:.1g}; expected less than {ACCURACY:g}: the plant has a pole "
            "that is nearly its zero, or the chosen roots lie too far from its poles"
        )
    return factors


def controller(factors: CoprimeFactors, Q: Block) -> Block:
    """C = (X + D_p Q)/(Y - N_p Q), Thesis Theorem 2.1.1; for 1/s Eq. (3.6) and (4.1).

    Parameters
    ----------
    factors
        Of the plant.
    Q
        Any stable and proper transfer function without dead time.

    Raises
    ------
    InputError
        Q is unstable, improper or has a dead time, Y - N_p Q vanishes, or C is improper because Y - N_p Q is
        zero at infinite frequency.
    """
    if Q.delay_s or Q.relative_degree < 0 or not Q.is_stable:
        raise InputError(
            f"Q has {len(Q.zeros)} zeros, the dead time {Q.delay_s:g} s and the poles {Q.poles}; "
            "expected stable poles, no more zeros than poles and no dead time"
        )
    denominator = add(factors.Y, (factors.N_p * Q).scaled(-1.0))
    if denominator.gain == 0:
        raise InputError("Q is Y/N_p, for which Y - N_p Q vanishes; expected any other Q")
    C = add(factors.X, factors.D_p * Q) * denominator.inverse()
    if C.relative_degree < 0:
        raise InputError("Y - N_p Q is zero at infinite frequency, so that the controller is improper")
    return C


def parameter(factors: CoprimeFactors, C: Block) -> Block:
    """Q = (C Y - X)/(D_p + C N_p), the inverse of :func:`controller`; stable if and only if C stabilises the plant.

    Raises
    ------
    InputError
        C has a dead time, or D_p + C N_p vanishes, so that the loop is not well posed.
    """
    if C.delay_s:
        raise InputError(f"the controller has the dead time {C.delay_s:g} s; expected none")
    denominator = add(factors.D_p, C * factors.N_p)
    if denominator.gain == 0:
        raise InputError("the controller is -D_p/N_p, for which the loop is not well posed")
    return add(C * factors.Y, factors.X.scaled(-1.0)) * denominator.inverse()


def add(first: Block, second: Block) -> Block:
    """The sum of two rational blocks over their least common denominator; what cancels to rounding is zero."""
    poles = common_denominator(first, second)
    numerators = [Block(term.gain, term.zeros) * poles * Block(1.0, term.poles).inverse() for term in (first, second)]
    q = geometric_scale(*numerators)
    length = 1 + max(len(numerator.zeros) for numerator in numerators)
    parts = np.zeros((2, length))
    for part, numerator in zip(parts, numerators, strict=True):
        coefficients = polynomial(numerator, q)
        part[length - len(coefficients) :] = coefficients
    total = parts.sum(axis=0)
    total[np.abs(total) <= ROUNDING * np.abs(parts).sum(axis=0)] = 0.0
    return from_polynomial(total, q) * poles.inverse()


def common_denominator(first: Block, second: Block) -> Block:
    """The monic polynomial block of least degree that holds the poles of the one and of the other."""
    missing = list(second.poles)
    for pole in first.poles:
        if pole in missing:
            missing.remove(pole)
    return Block(1.0, (*first.poles, *missing))


def evaluate(terms: Terms, s: ArrayLike) -> tuple[Complex, Complex, Real]:
    """The sum of ``terms`` at ``s`` (any shape, rad/s), its derivative, and the sum of the terms' moduli."""
    s = np.asarray(s, dtype=complex)
    total, total_slope, magnitude = np.zeros_like(s), np.zeros_like(s), np.zeros(s.shape)
    for term in terms:
        value, slope = np.full_like(s, term.gain), np.zeros_like(s)
        for k in range(max(len(term.zeros), len(term.poles))):  # interleaved, so that nothing overflows
            if k < len(term.zeros):
                value, slope = value * (s - term.zeros[k]), slope * (s - term.zeros[k]) + value
            if k < len(term.poles):
                value = value / (s - term.poles[k])
                slope = (slope - value) / (s - term.poles[k])
        late = np.exp(-term.delay_s * s)
        total += value * late
        total_slope += (slope - term.delay_s * value) * late
        magnitude += np.abs(value * late)
    return total, total_slope, magnitude


def _bezout_error(factors: CoprimeFactors, q: float) -> float:
    """The largest |X N_p + Y D_p - 1| on arcs and rays of the right half plane around the frequency unit q."""
    radius, angle = np.meshgrid(q * np.geomspace(1e-6, 1e6, 241), np.linspace(0, np.pi / 2, 7))
    s = radius * np.exp(1j * angle)
    identity = factors.X(s) * factors.N_p(s) + factors.Y(s) * factors.D_p(s)
    return float(np.max(np.abs(identity - 1)))
