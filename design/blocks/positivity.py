"""Whether a polynomial with rational coefficients is positive for every x >= 0: decided in exact arithmetic."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

from flint import fmpq, fmpq_poly

from design.blocks.block import Block

CLOSE = 2.0**-16  # relative distance from a place where p almost vanishes
NARROW = 2.0**-50  # relative width of an interval of x that is not divided further


def exact(value: float) -> fmpq:
    """The rational number that a float is."""
    return fmpq(*value.as_integer_ratio())


def not_positive_at(p: fmpq_poly, near: float = 0.0) -> float | None:
    """None if p(x) > 0 for every x >= 0 and p does not fall below 0 as x grows; else an x where that was not shown.

    Parameters
    ----------
    p
        A polynomial in x.
    near
        An x around which p almost vanishes, if one is known: the proof is then shorter.

    Returns
    -------
    float or None
        None is a proof. A number is an x with p(x) <= 0 (infinite: the leading coefficient is not positive), or one
        within a relative distance of 1e-15 of a root of p that is double or nearly so.

    Notes
    -----
    Descartes' rule of signs on intervals of x, divided until it decides (Vincent's theorem; Collins and Akritas,
    SYMSAC 1976): (1 + y)^n p(a + (b - a)/(1 + y)) without a change of sign in its coefficients has no root y > 0, and p
    none between a and b. Every number is a fraction of integers here, so that nothing is rounded.
    """
    degree = p.degree()
    if p[0] <= 0:
        return 0.0
    if p[degree] <= 0:
        return math.inf
    if degree == 0:
        return None
    known = [near * (1 - CLOSE), near * (1 + CLOSE)]
    if not 0 < near < math.inf:
        known = [2.0 ** round((_bits(p[0]) - _bits(p[degree])) / degree)]
    for x in known:
        if p(exact(x)) <= 0:
            return x
    waiting = list(pairwise([0.0, *known, math.inf]))
    while waiting:
        low, high = waiting.pop()
        if not _may_vanish(p, low, high):
            continue
        middle = _between(low, high)
        if p(exact(middle)) <= 0 or high < low * (1 + NARROW):
            return middle
        waiting += [(low, middle), (middle, high)]
    return None


def squared_magnitude(roots: Sequence[complex]) -> fmpq_poly:
    """prod |j omega - root|^2 as a polynomial in x = omega^2; the roots in conjugate pairs, as a block has them."""
    return squared_on_axis(real_polynomial(roots))


def squared_on_axis(polynomial: fmpq_poly) -> fmpq_poly:
    """|p(j omega)|^2 as a polynomial in x = omega^2."""
    return _on_axis(polynomial * _reflected(polynomial))


def real_polynomial(roots: Sequence[complex]) -> fmpq_poly:
    """prod (s - root) as a polynomial in s; the roots in conjugate pairs, as a block has them."""
    product = fmpq_poly([1])
    for root in roots:
        a, b = exact(root.real), exact(root.imag)
        if b == 0:
            product *= fmpq_poly([-a, 1])
        elif b > 0:
            product *= fmpq_poly([a * a + b * b, -2 * a, 1])
    return product


def popov_polynomial(block: Block, multiplier: float) -> fmpq_poly:
    """Re (1 + j m omega) block(j omega) times |denominator|^2, as a polynomial in x = omega^2."""
    product = real_polynomial(block.zeros) * _reflected(real_polynomial(block.poles))
    return exact(block.gain) * _on_axis(product * fmpq_poly([1, exact(multiplier)]))


def _reflected(polynomial: fmpq_poly) -> fmpq_poly:
    """p(-s)."""
    return polynomial(fmpq_poly([0, -1]))


def _on_axis(polynomial: fmpq_poly) -> fmpq_poly:
    """The real part of p(j omega) as a polynomial in x = omega^2."""
    return fmpq_poly([value * (-1) ** k for k, value in enumerate(polynomial.coeffs()[::2])])


def _bits(value: fmpq) -> int:
    """The power of two near a positive number."""
    return int(value.p).bit_length() - int(value.q).bit_length()


def _between(low: float, high: float) -> float:
    """A number between two, with few binary digits, about their geometric mean."""
    if low == 0:
        return high * 2.0**-8
    if high == math.inf:
        return low * 2.0**8
    middle = math.sqrt(low) * math.sqrt(high)
    mantissa, exponent = math.frexp(middle)
    digits = 3 - math.floor(math.log2(min(high / low - 1, 1.0)))
    return math.ldexp(round(math.ldexp(mantissa, digits)), exponent - digits)


def _may_vanish(p: fmpq_poly, low: float, high: float) -> bool:
    """Whether Descartes' rule leaves room for a root between two numbers, at which p is positive."""
    if high == math.inf:
        shifted = p(fmpq_poly([exact(low), 1]))
    else:
        scaled = p(fmpq_poly([exact(low), exact(high) - exact(low)]))  # 0 < x < 1, and x = 1/(1 + y)
        shifted = fmpq_poly(scaled.coeffs()[::-1])(fmpq_poly([1, 1]))
    signs = [value > 0 for value in shifted.numer().coeffs() if value]
    return any(one != other for one, other in pairwise(signs))
