"""Sums of blocks on cells of a vertical line of the s-plane: value, slope, and bounds of both on the whole cell."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from design.blocks.block import Block
from design.stability.coprime import Terms
from identification.base.arrays import Complex, Flags, Real

UNIT = 2.0**-50  # rounding of a product or sum, for each of its factors


class Jet(NamedTuple):
    """A function of omega on cells |omega - centre| <= half; arrays of shape (n,).

    ``value`` and ``slope`` (d/d omega) are those at the centres. ``size``, ``steepness`` and ``curvature`` are upper
    bounds of |f|, |df/d omega| and |d2f/d omega2| on each cell, ``noise`` one of the rounding of ``value``.
    """

    half: Real
    value: Complex
    slope: Complex
    size: Real
    steepness: Real
    curvature: Real
    noise: Real

    @property
    def least(self) -> Real:
        """A lower bound of |f| on each cell."""
        return np.asarray(np.maximum(np.abs(self.value) - self.half * self.steepness, 0.0))

    @property
    def is_clear_of_zero(self) -> Flags:
        """Whether f stays within a disc around its value at the centre that leaves 0 out."""
        return np.asarray(0.9 * np.abs(self.value) > self.half * self.steepness + self.noise)


def jet(terms: Terms, line: float, centre: Real, half: Real) -> Jet:
    """The sum of ``terms`` at line + j omega on cells.

    Parameters
    ----------
    terms
        Blocks with their dead times.
    line
        Real part of s in rad/s.
    centre, half
        Centres and half widths of the cells in rad/s, shape (n,).

    Notes
    -----
    The Taylor coefficients of s - z about c are majorised by those of |c - z| + x, and of 1/(s - p) by those of
    1/(|c - p| - x). The product M(x) of all these majorises the rational part of a term, so that its k-th derivative
    is at most M^(k)(half) on the cell; the bounds are infinite where a pole comes closer than ``half``. The dead time
    is of constant modulus on the line and adds its powers to the derivatives.
    """
    total = _of_term(terms[0], line, centre, half)
    for term in terms[1:]:
        total = combined(total, _of_term(term, line, centre, half), 1.0)
    return total


def _of_term(term: Block, line: float, centre: Real, half: Real) -> Jet:
    """One block."""
    s = line + 1j * centre
    value, slope = np.full_like(s, term.gain), np.zeros_like(s)
    size, first, second = np.full(s.shape, abs(term.gain)), np.zeros(s.shape), np.zeros(s.shape)
    with np.errstate(all="ignore"):
        for k in range(max(len(term.zeros), len(term.poles))):  # interleaved, so that nothing overflows
            if k < len(term.zeros):
                factor = s - term.zeros[k]
                value, slope = value * factor, slope * factor + value
                reach = np.abs(factor) + half
                size, first, second = size * reach, first + 1 / reach, second - 1 / reach**2
            if k < len(term.poles):
                factor = s - term.poles[k]
                value = value / factor
                slope = (slope - value) / factor
                reach = np.maximum(np.abs(factor) - half, 0.0)
                size, first, second = size / reach, first + 1 / reach, second + 1 / reach**2
        noise = UNIT * (4 + len(term.zeros) + len(term.poles)) * np.abs(value)
        rational = Jet(half, value, 1j * slope, size, size * first, size * (first**2 + second), noise)
        return delayed(_tightened(rational), term.delay_s, line, centre)


def delayed(found: Jet, delay_s: float, line: float, centre: Real) -> Jet:
    """A function times exp(-delay_s s) at line + j centre."""
    if delay_s == 0:
        return found
    _, value, slope, size, steepness, curvature, noise = found
    s = line + 1j * centre
    late, constant = np.exp(-delay_s * s), np.exp(-delay_s * line)
    return _tightened(
        Jet(
            found.half,
            value * late,
            (slope - 1j * delay_s * value) * late,
            constant * size,
            constant * (steepness + delay_s * size),
            constant * (curvature + 2 * delay_s * steepness + delay_s**2 * size),
            constant * (noise + UNIT * (1 + delay_s * np.abs(s)) * np.abs(value)),
        )
    )


def product(first: Jet, second: Jet) -> Jet:
    """The first times the conjugate of the second; of a function with itself the square of its modulus."""
    a, b = first, second
    with np.errstate(all="ignore"):
        return Jet(
            a.half,
            a.value * np.conj(b.value),
            a.slope * np.conj(b.value) + a.value * np.conj(b.slope),
            a.size * b.size,
            known(a.steepness * b.size + a.size * b.steepness),
            known(a.curvature * b.size + 2 * a.steepness * b.steepness + a.size * b.curvature),
            a.noise * np.abs(b.value) + np.abs(a.value) * b.noise,
        )


def combined(first: Jet, second: Jet, factor: complex) -> Jet:
    """The first plus ``factor`` times the second."""
    bounds = (a + abs(factor) * b for a, b in zip(first[3:], second[3:], strict=True))
    value, slope = first.value + factor * second.value, first.slope + factor * second.slope
    return _tightened(Jet(first.half, value, slope, *bounds))


def _tightened(found: Jet) -> Jet:
    """The bounds made less where the value or slope at the centre and the next higher derivative allow it."""
    with np.errstate(all="ignore"):
        curvature = known(found.curvature)
        steepness = np.minimum(known(found.steepness), known(np.abs(found.slope) + found.half * curvature))
        size = np.minimum(known(found.size), known(np.abs(found.value) + found.half * steepness))
    return found._replace(size=size, steepness=steepness, curvature=curvature)


def known(bound: Real) -> Real:
    """An upper bound, infinite where it could not be computed."""
    return np.asarray(np.where(np.isnan(bound), np.inf, bound))
