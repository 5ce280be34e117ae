"""Polynomials in ball arithmetic: every number carries a bound on its error, so that what is decided is proved."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import TypeVar

from flint import acb, acb_poly, arb, arb_poly, ctx

from design.blocks.block import Block, geometric_scale

Result = TypeVar("Result")

PRECISIONS = (256, 512, 1024, 2048)  # bits of a ball's centre, in turn while its radius leaves something undecided
ROOT = 60  # bits to which a root is known before it becomes a double


class UndecidedError(ArithmeticError):
    """At this precision a ball holds both answers."""


def decided(compute: Callable[[], Result]) -> Result | None:
    """What is computed at the least of PRECISIONS that decides it, or None where the highest one does not."""
    for bits in PRECISIONS:
        with ctx.workprec(bits):
            try:
                return compute()
            except UndecidedError:
                continue
    return None


def number(value: complex) -> acb:
    """The ball of radius 0 around a double."""
    return acb(value.real, value.imag)


@dataclass(frozen=True)
class Line:
    """x = (s + decay_rate)/unit: the line Re s = -decay_rate becomes the imaginary axis; no number is rounded.

    Parameters
    ----------
    decay_rate
        In 1/s.
    unit
        In rad/s, a power of two.
    """

    decay_rate: float
    unit: float

    def points(self, roots: Iterable[complex]) -> list[acb]:
        """One of each conjugate pair of roots in rad/s, and the real ones, in x."""
        return [(number(root) + self.decay_rate) / self.unit for root in roots if root.imag >= 0]

    def polynomial(self, roots: Iterable[complex]) -> arb_poly:
        """prod(x - root) over roots in rad/s."""
        return from_roots(self.points(roots))

    def hurwitz(self, roots: Iterable[complex]) -> arb_poly:
        """The same with the roots right of the line mirrored in it."""
        return from_roots(acb(-abs(root.real), root.imag) for root in self.points(roots))

    def gain(self, block: Block) -> arb:
        """The leading coefficient of the block in x."""
        return arb(block.gain) * arb(self.unit) ** -block.relative_degree

    def back(self, root: acb) -> complex:
        """A root in x as a double in rad/s; raises UndecidedError where its radius shows in the double."""
        if root.rad() > abs(root).lower() * arb(2) ** -ROOT:
            raise UndecidedError("a root is not known to the precision of a double")
        return complex(root * self.unit - self.decay_rate)


def line(decay_rate: float, *blocks: Block) -> Line:
    """The line with the geometric mean of the blocks' roots as unit."""
    return Line(decay_rate, 2.0 ** round(math.log2(geometric_scale(*blocks))))


def shared(first: Iterable[complex], second: Iterable[complex]) -> tuple[list[complex], list[complex], list[complex]]:
    """The roots that both hold, and what is left of each."""
    common, left, right = [], [], list(second)
    for root in first:
        if root in right:
            right.remove(root)
            common.append(root)
        else:
            left.append(root)
    return common, left, right


def reflected(
    first: Iterable[complex], second: Iterable[complex], decay_rate: float
) -> tuple[list[complex], list[complex], list[complex]]:
    """The roots of ``second`` that are exact mirror images of roots of ``first``, and what is left of each.

    The mirror is the line Re s = -decay_rate. On it s minus a root and s minus its image have the same modulus.
    """
    images, left, right = [], [], list(second)
    for root in first:
        mirrored_real = -2 * Fraction(decay_rate) - Fraction(root.real)
        image = next((each for each in right if each.imag == root.imag and each.real == mirrored_real), None)
        if image is None:
            left.append(root)
        else:
            right.remove(image)
            images.append(image)
    return images, left, right


def from_roots(roots: Iterable[acb]) -> arb_poly:
    """The real polynomial prod(x - root), complex roots by one of each pair."""
    product = arb_poly([1])
    for root in roots:
        real = root.imag == 0
        product *= arb_poly([-root.real, 1] if real else [root.real**2 + root.imag**2, -2 * root.real, 1])
    return product


def mirrored(polynomial: arb_poly) -> arb_poly:
    """p(-x)."""
    return arb_poly([(-1) ** power * coefficient for power, coefficient in enumerate(polynomial.coeffs())])


def squared(polynomial: arb_poly) -> arb_poly:
    """p(x) p(-x) as a polynomial in x^2: |p|^2 on the imaginary axis, where x^2 = -omega^2."""
    return arb_poly((polynomial * mirrored(polynomial)).coeffs()[::2])


def in_x(even: arb_poly) -> arb_poly:
    """The polynomial in x that a polynomial in x^2 is."""
    return arb_poly([part for coefficient in even.coeffs() for part in (coefficient, 0)])


def polynomial_roots(polynomial: arb_poly) -> list[acb]:
    """Discs that hold one root each of a real polynomial; real roots have an imaginary part of exactly 0.

    Raises
    ------
    UndecidedError
        Two roots are too close to separate at this precision.

    Notes
    -----
    The disc of radius n |p(z)/p'(z)| around z holds a root of p, whose degree is n, because p'/p is the sum of n
    terms 1/(z - root). Where n such discs are disjoint each holds one. Nothing else is believed of the starts.
    """
    degree = polynomial.degree()
    if degree < 1:
        return []
    p = acb_poly(polynomial)
    slope = p.derivative()
    try:
        starts = p.roots()
    except ValueError as error:
        raise UndecidedError(str(error)) from None
    discs = [_disc(p, slope, start.mid(), degree) for start in starts]
    if len(discs) != degree or any(
        first.overlaps(second) for k, first in enumerate(discs) for second in discs[k + 1 :]
    ):
        raise UndecidedError("two roots are too close to separate")
    # the conjugate of a root is a root: of its own disc unless another is met
    result = []
    for k, disc in enumerate(discs):
        partners = [other for j, other in enumerate(discs) if j != k and other.overlaps(disc.conjugate())]
        real = not partners
        result.append(acb(disc.real, 0) if real else disc)
    return result


def _disc(p: acb_poly, slope: acb_poly, z: acb, degree: int) -> acb:
    """The root near ``z`` with its radius, a square around the disc."""
    for _ in range(12):
        step = (p(z) / slope(z)).mid()
        z = (z - step).mid()
        if not step.is_finite():
            raise UndecidedError("a root is not found")
        if step == 0 or abs(step).upper() < abs(z).lower() * arb(2) ** (16 - ctx.prec):
            break
    radius = (degree * abs(p(z) / slope(z))).upper()
    if not radius.is_finite():
        raise UndecidedError("a root is not found")
    return z + acb(arb(0, radius), arb(0, radius))


def right_half_plane_roots(squares: Iterable[acb]) -> list[acb]:
    """The square roots with positive real part of the roots of a polynomial in x^2.

    Raises
    ------
    UndecidedError
        A root may lie on the imaginary axis.
    """
    found = [square.sqrt() for square in squares]
    if not all(root.real > 0 for root in found):
        raise UndecidedError("a root may lie on the imaginary axis")
    return found


def negative_pivot(matrix: Sequence[Sequence[acb]]) -> float | None:
    """The first negative pivot of a Hermitian matrix over its diagonal entry's modulus; None: positive definite.

    Raises
    ------
    UndecidedError
        The sign of a pivot is not decided at this precision.
    """
    rows = [list(row[: k + 1]) for k, row in enumerate(matrix)]  # lower triangle
    for k in range(len(rows)):
        pivot = rows[k][k].real
        if pivot < 0:
            return float(pivot / abs(matrix[k][k].real))
        if not pivot > 0:
            raise UndecidedError("a pivot may be positive or negative")
        column = [rows[i][k] for i in range(k + 1, len(rows))]
        for i, factor in enumerate(column, start=k + 1):
            scaled = factor / pivot
            for j in range(k + 1, i + 1):
                rows[i][j] -= scaled * column[j - k - 1].conjugate()
    return None
