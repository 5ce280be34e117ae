"""Characteristic roots of a loop with its exact dead times: the rightmost ones, and how many lie right of a line."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.polynomial.chebyshev import chebder, chebvander
from scipy.linalg import block_diag, eigvals

from design.blocks.block import Block, geometric_scale
from design.blocks.state_space import realize
from design.stability.axis import first_edges, turn
from design.stability.coprime import Terms, evaluate
from design.stability.delay_loop import DelayLoop
from design.stability.jet import Jet, combined, delayed, jet
from identification.base.arrays import Complex, Flags, Real
from identification.base.errors import InputError

ORDERS = (16, 32, 64, 128, 256, 512)  # of the discretised delay lines, tried in turn
AMPLIFICATION = 1e8  # of the data's rounding by exp(-h s), beyond which no roots are looked for
RESIDUAL = 1e-12  # of a root, relative to the terms' moduli and the root times the slope
ITERATIONS = 60  # of Ehrlich and Aberth's method at most


class CharacteristicRoots(NamedTuple):
    """Roots sorted by decreasing real part, those of multiplicity m m times; three arrays of shape (n,) and a line.

    ``roots`` in rad/s; ``hidden``, whether no dead time moves the root, see :class:`DelayLoop`; ``uncertainty``, the
    distance in rad/s to which rounding errors leave its place open: 0 for hidden roots and those of a Smith predictor,
    which are given, relative to the root about 1e-15 for other simple ones and 1e-15^(1/m) for multiple ones. Right of
    the real part ``line`` in rad/s there are no others.
    """

    roots: Complex
    hidden: Flags
    uncertainty: Real
    line: float


def rightmost_roots(loop: DelayLoop, count: int) -> CharacteristicRoots:
    """The hidden roots and the ``count`` or more rightmost of the others, which dead time and feedback move (3.14).

    Parameters
    ----------
    loop
        With any dead times.
    count
        Positive; more are returned when real parts coincide, fewer when there are no more right of
        -log(AMPLIFICATION)/h, h the longer dead time: there the data's rounding decides.

    Raises
    ------
    InputError
        count is not positive, or the dead times are too long beside the fastest root.

    Notes
    -----
    Of a Smith predictor with its own model, :attr:`DelayLoop.is_predicted`, all roots are returned: they are those of
    the denominator, as they were given.

    Otherwise starting values are the eigenvalues of the loop with its delay lines discretised by collocation in
    Chebyshev points (Breda, Maset, Vermiglio, SIAM J. Sci. Comput. 27 (2005) 482), the two scalar delayed signals only.
    They are refined together on the characteristic function itself by Newton's method in the form of Ehrlich and
    Aberth, which keeps approximations of a multiple root apart, and accepted when they are as many as the
    argument principle counts right of a line just left of them.
    """
    if count < 1:
        raise InputError(f"the number of roots is {count}; expected 1 or more")
    if loop.is_predicted:
        roots = np.array(loop.denominator.zeros)
        return _with_hidden(loop, roots, np.zeros(len(roots)), -np.inf)
    longest = max(term.delay_s for term in loop.characteristic if term.gain)
    floor = -np.log(AMPLIFICATION) / longest if longest else -np.inf
    for order in ORDERS:
        starts = _discretised_roots(loop, order)
        roots = _refined(loop, starts[starts.real > 1.1 * floor])
        roots = roots[roots.real > floor]
        uncertainty = _uncertainty(loop.characteristic, roots)
        number, line = _cut(loop, roots, uncertainty, count, floor)
        with suppress(InputError):  # of a line too far left
            if roots_right_of(loop, line) == number:
                return _with_hidden(loop, roots[:number], uncertainty[:number], line)
    fastest = max(abs(root) for term in loop.characteristic for root in term.zeros + term.poles)
    raise InputError(
        f"{ORDERS[-1]} points on a dead time of {longest:g} s do not resolve every root of the loop, whose blocks have "
        f"roots up to {fastest:g} rad/s; expected shorter dead times"
    )


def _with_hidden(loop: DelayLoop, roots: Complex, uncertainty: Real, line: float) -> CharacteristicRoots:
    """These roots and the loop's hidden ones, sorted."""
    hidden = len(loop.hidden)
    found = np.concatenate([np.array(loop.hidden, dtype=complex), roots])
    radius = np.concatenate([np.zeros(hidden), uncertainty])
    by_real = np.lexsort((found.imag, -found.real))
    return CharacteristicRoots(found[by_real], by_real < hidden, radius[by_real], line)


def roots_right_of(loop: DelayLoop, line: float, factor: complex = 1.0) -> int:
    """How many roots, hidden ones not counted, have a real part above ``line`` (rad/s), by the argument principle.

    Parameters
    ----------
    loop
        With any dead times.
    line
        Real part in rad/s.
    factor
        By which P forward is multiplied, not 0: a gain, or a rotation exp(-j phi), whose loop is not a real one.

    Raises
    ------
    InputError
        A root lies on the line as far as rounding shows, or the line so far left that too many roots lie right of it.

    Notes
    -----
    The function of :func:`normalised` has no poles on and right of the line and tends to 1 there: the number is that of
    its turns about 0 along the line. Between 0 and a frequency Omega it is followed with a bound on its slope. Beyond
    Omega 1 - feedback exp(-delay_s s) + P forward stays right of the imaginary axis, :func:`closing_omega`, and
    the phase of the rational factor is that of its roots.
    """
    if loop.is_predicted and factor == 1:
        roots = np.array(loop.denominator.zeros)
        if np.any(roots.real == line):
            raise InputError(f"a root lies on the line of real part {line:g} rad/s; expected a line between roots")
        return int(np.sum(roots.real > line))
    first, second, third = normalised(loop, line)
    top = closing_omega(loop, line, abs(factor), 0.9)
    edges = first_edges(tuple(root - line for root in first.zeros + first.poles), top)
    common = min(second.delay_s, third.delay_s)
    second, third = (replace(term, delay_s=term.delay_s - common) for term in (second, third))
    sides = (factor,) if factor == np.conj(factor) else (factor, complex(np.conj(factor)))
    end = np.array([top]), np.zeros(1)
    beyond = np.sum(np.angle(1 - (np.array(first.zeros) - line) / (1j * top)))
    beyond -= np.sum(np.angle(1 - (np.array(first.poles) - line) / (1j * top)))
    phase = 0.0
    for side in sides:

        def followed(centre: Real, half: Real, side: complex = side) -> tuple[Jet, Jet, Jet]:
            main, inner, outer = (jet((term,), line, centre, half) for term in (first, second, third))
            rest = delayed(combined(inner, outer, side), common, line, centre)
            return combined(main, rest, 1.0), main, rest

        whole, main, _ = followed(*end)
        phase += (turn(followed, edges) - np.angle(whole.value[0] / main.value[0]) - beyond) / len(sides)
    turns = -phase / np.pi
    if not abs(turns - np.round(turns)) < 1e-3:
        raise InputError(f"a root lies on the line of real part {line:g} rad/s; expected a line between roots")
    return int(np.round(turns))


def closing_omega(loop: DelayLoop, line: float, factor: float, level: float) -> float:
    """A frequency in rad/s, beyond all roots, from which on |feedback| + factor |P forward| < level on the line."""
    terms = loop.inner_loop, loop.open_loop.scaled(factor)
    roots = np.array([root for term in terms for root in term.zeros + term.poles])
    top = 2 * (float(np.abs(roots - line).max()) or geometric_scale(loop.denominator))
    while not sum(largest_beyond(term, line, top) for term in terms) < level:
        top *= 2
    return top


def largest_beyond(block: Block, line: float, omega: float) -> float:
    """An upper bound of |block| on the line at and beyond ``omega`` (rad/s); inf where a root lies beyond it.

    With z = x + jy and its conjugate, |j omega - z|^2 |j omega - z*|^2 = omega^4 (1 + 2 (x^2 - y^2)/omega^2 +
    |z|^4/omega^4). The bound tends to the limit with the square of 1/omega; the block must be proper.
    """

    def squared(roots: tuple[complex, ...]) -> Real:
        return ((np.array(roots, dtype=complex) - line) / omega) ** 2

    above, below = squared(block.zeros), squared(block.poles)
    least = 1 + 2 * np.minimum(below.real, 0.0)
    if np.any(least <= 0):
        return float("inf")
    shape = np.sum(np.log1p(2 * np.maximum(above.real, 0.0) + np.abs(above) ** 2)) - np.sum(np.log(least))
    size = np.log(abs(block.gain)) - block.relative_degree * np.log(omega) if block.gain else -np.inf
    return float(np.exp(size + shape / 4 - block.delay_s * line))


def normalised(loop: DelayLoop, line: float) -> Terms:
    """The characteristic function over a polynomial of the same degree whose roots lie left of ``line`` (rad/s).

    Its three terms are finite on and right of the line, and P C = third/(first + second).
    """
    q, roots = geometric_scale(loop.denominator), loop.denominator.zeros
    poles = (complex(min(p.real, 2 * line - p.real) - 0.1 * (abs(p - line) or q), p.imag) for p in roots)
    below = Block(1.0, (), tuple(poles))
    return tuple(term * below for term in loop.characteristic)


def _discretised_roots(loop: DelayLoop, order: int) -> Complex:
    """Eigenvalues in rad/s of the loop with ``order`` points for each delay line."""
    q = geometric_scale(loop.denominator)
    system = realize(loop.open_loop, loop.inner_loop)
    size = len(system.b)
    points = np.cos(np.pi * np.arange(order + 1) / order)
    differentiate = chebvander(points, order - 1) @ chebder(np.linalg.inv(chebvander(points, order)))
    matrix = system.A / q
    rows = {loop.plant.delay_s: system.C[0]}
    rows[loop.delay_s] = rows.get(loop.delay_s, 0.0) + system.C[1]
    for delay, row in rows.items():
        if delay == 0 or not np.any(row):
            matrix[:size, :size] -= np.outer(system.b, row) / q
            continue
        # phi(t, theta) = z(t + theta), theta from 0 to -delay: phi' = d phi/d theta, and phi(t, 0) = z = row x
        slope = differentiate * 2 / (delay * q)
        matrix = block_diag(matrix, slope[1:, 1:])
        matrix[-order:, :size] = np.outer(slope[1:, 0], row)
        matrix[:size, -1] = -system.b / q
    return np.asarray(eigvals(matrix) * q)


def _refined(loop: DelayLoop, starts: Complex) -> Complex:
    """Those starting values that settle on a root, refined, by decreasing real part."""
    terms, q = loop.characteristic, geometric_scale(loop.denominator)
    z = starts.copy()
    last, moving = np.full(len(z), np.inf), np.full(len(z), True)
    for _ in range(ITERATIONS):
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):  # of those that never settle
            value, slope, magnitude = evaluate(terms, z)
            others = np.subtract.outer(z, z)
            others[others == 0] = np.inf
            step = np.nan_to_num(1 / (slope / value - np.sum(1 / others, axis=1)), nan=0.0, posinf=0.0, neginf=0.0)
        is_root = np.abs(value) <= RESIDUAL * (magnitude + np.abs(z * slope))
        size = np.abs(step)
        moving &= ~is_root | (size < last)  # on a root the corrections shrink until they are rounding
        if not np.any(moving):
            break
        last = size
        z = np.where(moving, z - step * (np.minimum(size, np.abs(z) + q) / np.maximum(size, 1e-300)), z)
        z = np.where(starts.imag == 0, z.real, z)
    return np.asarray(z[is_root][np.argsort(-z[is_root].real)])


def _uncertainty(terms: Terms, roots: Complex) -> Real:
    """Radii (rad/s) of the circles around the roots on which the function exceeds its rounding, to a factor of 2."""
    around = np.exp(2j * np.pi * np.arange(8) / 8)
    value, slope, magnitude = evaluate(terms, roots)
    noise = np.maximum(1e-15 * (magnitude + np.abs(roots * slope)), np.abs(value))
    radius = 2.0**-52 * np.maximum(np.abs(roots), 1e-100)
    while True:
        values = evaluate(terms, roots[:, None] + radius[:, None] * around)[0]
        inside = np.abs(values).min(axis=1) <= noise
        if not np.any(inside):
            return radius
        radius = np.where(inside, 2 * radius, radius)


def unstable_roots(count: int) -> str:
    """``count`` roots in the right half plane, in words."""
    return f"{count} root{'s' if count > 1 else ''} in the right half plane"


def _cut(loop: DelayLoop, roots: Complex, uncertainty: Real, count: int, floor: float) -> tuple[int, float]:
    """How many of the sorted roots to take, ``count`` or more, and a line left of them with no root near it."""
    for number in range(count, len(roots)):
        left, right = roots[number], roots[number - 1]
        if right.real - left.real > 1e-6 * abs(left) + 10 * (uncertainty[number] + uncertainty[number - 1]):
            return number, float(right.real + left.real) / 2
    leftmost = min(root.real for root in [*roots, *loop.denominator.zeros])
    return len(roots), floor if np.isfinite(floor) else leftmost - geometric_scale(loop.denominator)
