"""Characteristic roots of a loop with its exact dead times: the rightmost ones, and how many lie right of a line."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.polynomial.chebyshev import chebder, chebvander
from numpy.typing import NDArray
from scipy.linalg import block_diag, eigvals

from design.block import Block, geometric_scale
from design.coprime import Real, Terms, common_denominator, evaluate
from design.realization import realize
from identification.files import InputError
from identification.plant import Complex

ORDERS = (16, 32, 64, 128, 256, 512)  # of the discretised delay lines, tried in turn
AMPLIFICATION = 1e8  # of the data's rounding by exp(-h s), beyond which no roots are looked for
RESIDUAL = 1e-12  # of a root, relative to the terms' moduli and the root times the slope
ITERATIONS = 60  # of Ehrlich and Aberth's method at most
STEP = 0.5  # |f'/f| times the spacing of the points that trace f
ROUNDING = 1e-13  # of f, relative to its terms' moduli: what stands for |f| at a root on the line
POINTS = 200_000  # at most, on one line


@dataclass(frozen=True)
class DelayLoop:
    """y = P u, u = forward (r - y) + feedback exp(-delay_s s) u: C = forward/(1 - feedback exp(-delay_s s)).

    Parameters
    ----------
    plant
        P with its own dead time, which may differ from the controller's.
    forward, feedback
        K and T_so of chapters 3 and 4, Thesis Eq. (3.31); C and 0 in chapter 2. Without dead time.
    delay_s
        The dead time in seconds inside the controller.

    Raises InputError for a dead time where none belongs, an improper forward, or an algebraic loop.

    Notes
    -----
    With all three blocks realised the characteristic function is

        d_P d_forward d_feedback (1 - feedback exp(-delay_s s) + P forward).

    What divides it whatever the dead times is *hidden*: a pole of the plant that is a zero of the controller, or
    the other way round, and poles that forward and feedback share, which are realised twice.
    """

    plant: Block
    forward: Block
    feedback: Block
    delay_s: float

    def __post_init__(self) -> None:
        if self.forward.delay_s or self.feedback.delay_s or not 0 <= self.delay_s < np.inf:
            raise InputError(
                f"forward and feedback have the dead times {self.forward.delay_s:g} s and {self.feedback.delay_s:g} s, "
                f"the controller has {self.delay_s:g} s; expected 0, 0, and zero or more"
            )
        blocks = {"forward": (self.forward, 0), "the plant times forward": (self.open_loop, 1)}
        for name, (block, least) in (blocks | {"feedback": (self.feedback, 1 if self.feedback.gain else 0)}).items():
            if block.relative_degree < least:
                raise InputError(
                    f"{name} has {len(block.zeros)} zeros and {len(block.poles)} poles; expected {least} or more "
                    "poles more than zeros, or the loop is algebraic"
                )

    @property
    def open_loop(self) -> Block:
        """P forward with P's dead time; equal poles and zeros have cancelled."""
        return self.plant * self.forward

    @property
    def inner_loop(self) -> Block:
        """-feedback exp(-delay_s s); equal poles and zeros have cancelled."""
        return self.feedback * Block(-1.0, (), (), self.delay_s)

    @property
    def denominator(self) -> Block:
        """The least common denominator of the two, a polynomial block."""
        return common_denominator(self.open_loop, self.inner_loop)

    @property
    def characteristic(self) -> Terms:
        """Characteristic function (3.12), (3.5), (3.27), no hidden roots: three polynomials, two of them delayed."""
        return self.denominator, self.inner_loop * self.denominator, self.open_loop * self.denominator

    @property
    def hidden(self) -> tuple[complex, ...]:
        """The hidden roots, exactly, with their multiplicities."""
        roots = list(self.plant.poles + self.forward.poles + self.feedback.poles)
        for root in self.denominator.zeros:
            roots.remove(root)
        return tuple(roots)


class CharacteristicRoots(NamedTuple):
    """Roots sorted by decreasing real part, those of multiplicity m m times; three arrays of shape (n,).

    ``roots`` in rad/s; ``hidden``, whether no dead time moves the root, see :class:`DelayLoop`; ``uncertainty``, the
    distance in rad/s within which rounding hides where it is: 0 for hidden roots, relative to the root about
    1e-15 for other simple ones and 1e-15^(1/m) for multiple ones.
    """

    roots: Complex
    hidden: NDArray[np.bool_]
    uncertainty: Real


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
    Starting values are the eigenvalues of the loop with its delay lines discretised by collocation in Chebyshev
    points (Breda, Maset, Vermiglio, SIAM J. Sci. Comput. 27 (2005) 482), the two scalar delayed signals only. They
    are refined together on the exact characteristic function by Newton's method in the form of Ehrlich and
    Aberth, which keeps approximations of a multiple root apart, and accepted when they are as many as the
    argument principle counts right of a line just left of them.
    """
    if count < 1:
        raise InputError(f"{count} roots were asked for; expected one or more")
    longest = max(term.delay_s for term in loop.characteristic if term.gain)
    floor = -np.log(AMPLIFICATION) / longest if longest else -np.inf
    for order in ORDERS:
        starts = _discretised_roots(loop, order)
        roots = _refined(loop, starts[starts.real > 1.1 * floor])
        roots = roots[roots.real > floor]
        uncertainty = _uncertainty(loop.characteristic, roots)
        number, line = _cut(loop, roots, uncertainty, count, floor)
        with suppress(InputError):  # of a line too far left
            if abs(_turns(loop, line) - number) < 0.1:
                break
    else:
        raise InputError(f"{ORDERS[-1]} points a dead time do not find every root; expected shorter dead times")
    hidden = len(loop.hidden)
    found = np.concatenate([np.array(loop.hidden, dtype=complex), roots[:number]])
    radius = np.concatenate([np.zeros(hidden), uncertainty[:number]])
    by_real = np.lexsort((found.imag, -found.real))
    return CharacteristicRoots(found[by_real], by_real < hidden, radius[by_real])


def roots_right_of(loop: DelayLoop, line: float) -> int:
    """How many roots, hidden ones not counted, have a real part above ``line`` (rad/s), by the argument principle.

    It is the number of turns about 0, along the line, of the function of :func:`normalised`, which has no poles right
    of it and tends to 1 there. Raises InputError when a root lies on the line as far as rounding shows, or the line so
    far left that too many roots lie right of it.
    """
    turns = _turns(loop, line)
    if not abs(turns - np.round(turns)) < 0.1:
        raise InputError(f"a root lies on the line of real part {line:g} rad/s; expected a line between roots")
    return int(np.round(turns))


def _turns(loop: DelayLoop, line: float) -> float:
    """The turns about 0 that make the number of roots right of the line; nan when it goes through 0 or near."""
    ratio = normalised(loop, line)
    omega = trace([ratio], line, asymptotic_omega(loop, line, 0.1))
    values = evaluate(ratio, line + 1j * omega)[0]
    with np.errstate(divide="ignore", invalid="ignore"):
        steps = np.angle(values[1:] / values[:-1])
    return float((np.angle(values[-1]) - np.sum(steps)) / np.pi) if np.all(np.abs(steps) < 1) else float("nan")


def normalised(loop: DelayLoop, line: float) -> Terms:
    """The characteristic function over a polynomial of the same degree whose roots lie left of ``line`` (rad/s).

    Its three terms are finite on and right of the line, and P C = third/(first + second).
    """
    q, roots = geometric_scale(loop.denominator), loop.denominator.zeros
    poles = (complex(min(p.real, 2 * line - p.real) - 0.1 * (abs(p - line) or q), p.imag) for p in roots)
    below = Block(1.0, (), tuple(poles))
    return tuple(term * below for term in loop.characteristic)


def trace(functions: Sequence[Terms], line: float, top: float) -> Real:
    """Points omega, 0 to ``top`` (rad/s), at line + j omega on which each function is followed without a gap.

    Between neighbours a, b |f'/f| (b - a) is at most STEP at both ends: neither a root nor a turn by a dead time hides.
    """

    def steepness(omega: Real) -> Real:
        found = [evaluate(terms, line + 1j * omega) for terms in functions]
        with np.errstate(divide="ignore", invalid="ignore"):
            ratios = [np.abs(slope) / np.maximum(np.abs(value), ROUNDING * size) for value, slope, size in found]
        return np.asarray(np.nan_to_num(np.max(ratios, axis=0), nan=np.inf))

    resonances = [abs(root.imag) for terms in functions for term in terms for root in term.zeros + term.poles]
    omega = np.unique([0.0, *resonances, *np.geomspace(1e-9 * top, top, 91)])
    omega = omega[omega <= top]
    steep = steepness(omega)
    while len(omega) < POINTS:
        gaps, steeper = np.diff(omega), np.maximum(steep[1:], steep[:-1])
        wide = (gaps > STEP / np.maximum(steeper, 1e-300)) & (gaps > 1e-9 * omega[1:] + 1e-15 * top)
        if not np.any(wide):
            return omega
        at = np.flatnonzero(wide) + 1
        middle = (omega[at] + omega[at - 1]) / 2
        omega, steep = np.insert(omega, at, middle), np.insert(steep, at, steepness(middle))
    raise InputError(f"more than {POINTS} points are needed to follow the loop up to {top:g} rad/s")


def asymptotic_omega(loop: DelayLoop, line: float, size: float) -> float:
    """A frequency in rad/s above which feedback plus P forward stay below ``size`` on the line and right of it."""
    terms = loop.inner_loop, loop.open_loop
    roots = np.array([root for term in terms for root in term.zeros + term.poles])
    top = 10 * (float(np.abs(roots - line).max()) or geometric_scale(loop.denominator))
    while True:
        value, _, magnitude = evaluate(terms, line + 1j * top)
        if (np.abs(value) if loop.delay_s == loop.plant.delay_s else magnitude) < size:
            return top
        top *= 2


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


def _cut(loop: DelayLoop, roots: Complex, uncertainty: Real, count: int, floor: float) -> tuple[int, float]:
    """How many of the sorted roots to take, ``count`` or more, and a line left of them with no root near it."""
    for number in range(count, len(roots)):
        left, right = roots[number], roots[number - 1]
        if right.real - left.real > 1e-6 * abs(left) + 10 * (uncertainty[number] + uncertainty[number - 1]):
            return number, float(right.real + left.real) / 2
    leftmost = min(root.real for root in [*roots, *loop.denominator.zeros])
    return len(roots), floor if np.isfinite(floor) else leftmost - geometric_scale(loop.denominator)
