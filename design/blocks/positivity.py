"""Whether a polynomial with real coefficients is positive for every x >= 0: decided in exact integer arithmetic."""

from __future__ import annotations

import math
from collections.abc import Sequence
from fractions import Fraction
from itertools import pairwise

from design.blocks.block import Block

Polynomial = list[Fraction]  # coefficients, lowest power first
NARROW = 2.0**-50  # relative width of an interval of x that is not divided further


def not_positive_at(polynomial: Sequence[Fraction]) -> float | None:
    """None if p(x) > 0 for every x >= 0 and p does not fall below 0 as x grows; else an x where that was not shown.

    Parameters
    ----------
    polynomial
        Coefficients of p, lowest power first.

    Returns
    -------
    float or None
        None is a proof. A number is an x with p(x) <= 0 (infinite: the leading coefficient is not positive), or one
        within a relative distance of 1e-15 of a root of p that is double or nearly so.

    Notes
    -----
    Descartes' rule of signs on intervals of x, divided until it decides (Vincent's theorem; Collins and Akritas,
    SYMSAC 1976): (1 + y)^n p(a + (b - a)/(1 + y)) without a change of sign in its coefficients has no root y > 0, and p
    none between a and b. Every number is an integer here, so that nothing is rounded.
    """
    common = math.lcm(*(value.denominator for value in polynomial))
    p = [value.numerator * (common // value.denominator) for value in polynomial]
    while len(p) > 1 and p[-1] == 0:
        p.pop()
    if p[0] <= 0:
        return 0.0
    if p[-1] <= 0:
        return math.inf
    if len(p) == 1:
        return None
    middle = 2.0 ** round((p[0].bit_length() - p[-1].bit_length()) / (len(p) - 1))
    if _value(p, middle) <= 0:
        return middle
    waiting = [(0.0, middle), (middle, math.inf)]
    while waiting:
        low, high = waiting.pop()
        if not _may_vanish(p, low, high):
            continue
        middle = _between(low, high)
        if _value(p, middle) <= 0 or high < low * (1 + NARROW):
            return middle
        waiting += [(low, middle), (middle, high)]
    return None


def squared_magnitude(roots: Sequence[complex]) -> Polynomial:
    """prod |j omega - root|^2 as a polynomial in x = omega^2; the roots in conjugate pairs, as a block has them."""
    return squared_on_axis(real_polynomial(roots))


def squared_on_axis(polynomial: Sequence[Fraction]) -> Polynomial:
    """|p(j omega)|^2 as a polynomial in x = omega^2."""
    return _on_axis(multiplied(polynomial, _reflected(polynomial)))


def real_polynomial(roots: Sequence[complex]) -> Polynomial:
    """prod (s - root) as a polynomial in s; the roots in conjugate pairs, as a block has them."""
    product = [Fraction(1)]
    for root in roots:
        a, b = Fraction(root.real), Fraction(root.imag)
        if b == 0:
            product = multiplied(product, [-a, Fraction(1)])
        elif b > 0:
            product = multiplied(product, [a * a + b * b, -2 * a, Fraction(1)])
    return product


def popov_polynomial(block: Block, multiplier: float) -> Polynomial:
    """Re (1 + j m omega) block(j omega) times |denominator|^2, as a polynomial in x = omega^2."""
    product = multiplied(real_polynomial(block.zeros), _reflected(real_polynomial(block.poles)))
    gain = Fraction(block.gain)
    return [gain * value for value in _on_axis(multiplied(product, [Fraction(1), Fraction(multiplier)]))]


def _reflected(polynomial: Sequence[Fraction]) -> Polynomial:
    """p(-s)."""
    return [value if k % 2 == 0 else -value for k, value in enumerate(polynomial)]


def _on_axis(polynomial: Polynomial) -> Polynomial:
    """The real part of p(j omega) as a polynomial in x = omega^2."""
    return [value * (-1) ** k for k, value in enumerate(polynomial[::2])]


def multiplied(left: Sequence[Fraction], right: Sequence[Fraction]) -> Polynomial:
    """The product of two polynomials."""
    product = [Fraction(0)] * (len(left) + len(right) - 1)
    for i, a in enumerate(left):
        for j, b in enumerate(right):
            product[i + j] += a * b
    return product


def combined(a: Fraction, left: Sequence[Fraction], b: Fraction, right: Sequence[Fraction]) -> Polynomial:
    """a left + b right."""
    total = [Fraction(0)] * max(len(left), len(right))
    for factor, polynomial in ((a, left), (b, right)):
        for k, value in enumerate(polynomial):
            total[k] += factor * value
    return total


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


def _value(p: Sequence[int], x: float) -> int:
    """The sign of p(x), as an integer that has it."""
    above, below = x.as_integer_ratio()
    total, power = 0, 1
    for value in reversed(p):
        total = total * above + value * power
        power *= below
    return total


def _may_vanish(p: Sequence[int], low: float, high: float) -> bool:
    """Whether Descartes' rule leaves room for a root between two numbers."""
    above, below = low.as_integer_ratio()
    n = len(p) - 1
    # below^n p((above + x)/below): the interval is x > 0, or 0 < x < width
    shifted = _shifted([value * below ** (n - k) for k, value in enumerate(p)], above)
    if high < math.inf:
        above, below = (Fraction(high) - Fraction(low)).as_integer_ratio()
        below_x = Fraction(low).denominator
        above *= below_x
        # x = width/(1 + y)
        shifted = [value * above**k * below ** (n - k) for k, value in enumerate(shifted)]
        shifted = _shifted(shifted[::-1], 1)
    signs = [value > 0 for value in shifted if value]
    return any(one != other for one, other in pairwise(signs))


def _shifted(p: list[int], by: int) -> list[int]:
    """The coefficients of p(x + by)."""
    shifted = list(p)
    if by:
        for first in range(len(p) - 1):
            for k in range(len(p) - 2, first - 1, -1):
                shifted[k] += by * shifted[k + 1]
    return shifted
