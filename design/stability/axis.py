"""Zeros, turns and peaks of functions on a vertical line of the s-plane, bounded between points."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from design.stability.jet import Jet, known
from identification.base.arrays import Real, Whole
from identification.base.errors import InputError

CELLS = 4_000_000  # at most, that one search may look at
NARROW = 1e-14  # of its frequency: half the width of a cell that is no longer halved
PRECISION = 1e-9  # to which the square of a peak is known
SHARPER = 1e-12  # to which it is the largest beside the place where it was found
NEWTON = 100  # steps at most to a zero, each inside its bracket

NO_ZERO, ONE_ZERO, OPEN, HALVE = range(4)  # of a cell: none; at most one; rounding hides it; look closer


Function = Callable[[Real, Real], Jet]  # of centre and half in rad/s, (n,) each
Judge = Callable[[Real, Real], Whole]  # of the same; NO_ZERO, ... for each cell


def sign_of(value: Real, slope: Real, bounds: Jet) -> Whole:
    """What is known of a real function on cells, as a code for :func:`judged_cells`: whether it has a zero there.

    ``value`` and ``slope`` are a real or imaginary part of ``bounds``, which bounds the rest.
    """
    with np.errstate(all="ignore"):
        second = bounds.curvature * bounds.half
        moves = (np.abs(slope) + second / 2) * bounds.half
        code = np.full(value.shape, HALVE)
        code[moves < bounds.noise] = OPEN  # to halve the cell shows nothing more
        code[np.abs(slope) > second] = ONE_ZERO
        code[np.abs(value) > moves + bounds.noise] = NO_ZERO
    return code


def first_edges(roots: tuple[complex, ...], top: float) -> Real:
    """Edges of cells from 0 to ``top`` (rad/s), factors of two apart, from a thousandth of the slowest root on."""
    moduli = [abs(root) for root in roots if root != 0]
    lowest = 1e-3 * min([*moduli, top])
    return np.concatenate([[0.0], np.geomspace(lowest, top, 2 + int(np.log2(top / lowest)))])


def judged_cells(judge: Judge, edges: Real) -> tuple[Real, Real, Whole]:
    """Halve the cells between ``edges`` until each is judged; left ends, right ends and codes by increasing omega.

    Raises
    ------
    InputError
        More than :data:`CELLS` are needed.
    """
    left, right = edges[:-1], edges[1:]
    lowest, looked_at = NARROW * edges[min(1, len(edges) - 1)], 0
    kept: list[tuple[Real, Real, Whole]] = []
    while len(left):
        looked_at += len(left)
        if looked_at > CELLS:
            raise InputError(
                f"the loop needs more than {CELLS} intervals up to {edges[-1]:g} rad/s; expected shorter dead times or "
                "slower roots"
            )
        centre, half = (left + right) / 2, (right - left) / 2
        code = judge(centre, half)
        code = np.where((code == HALVE) & (half <= NARROW * right + lowest), OPEN, code)
        open_ = code == HALVE
        kept.append((left[~open_], right[~open_], code[~open_]))
        left, right = (
            np.concatenate([left[open_], centre[open_]]),
            np.concatenate([centre[open_], right[open_]]),
        )
    found = tuple(np.concatenate(parts) for parts in zip(*kept, strict=True))
    order = np.argsort(found[0], kind="stable")
    return found[0][order], found[1][order], found[2][order]


def zeros(real: Callable[[Real], tuple[Real, Real]], judge: Judge, edges: Real) -> tuple[Real, Real]:
    """Every zero of a real function on ``edges`` but 0, and whether the function rises (1) or falls (-1) through it.

    Parameters
    ----------
    real
        Value and slope at frequencies in rad/s.
    judge
        With the codes of :func:`sign_of`; a cell where zeros are not looked for has NO_ZERO.
    edges
        Increasing, in rad/s.

    Notes
    -----
    A cell with ONE_ZERO has a zero where the signs at its ends differ. Neighbouring cells that rounding leaves open
    are one cell, which is treated alike: what turns back within the rounding of the function is no crossing.
    """
    left, right, code = judged_cells(judge, edges)
    joined = np.flatnonzero((code[1:] == OPEN) & (code[:-1] == OPEN))
    left, right, code = np.delete(left, joined + 1), np.delete(right, joined), np.delete(code, joined)
    ends = np.union1d(left, right)
    sign = np.where(real(ends)[0] >= 0, 1.0, -1.0)
    begins = sign[np.searchsorted(ends, left)]
    finishes = sign[np.searchsorted(ends, right)]
    crossing = (code != NO_ZERO) & (begins != finishes) & (left > 0)
    low, high, rising = left[crossing], right[crossing], finishes[crossing]
    at = (low + high) / 2
    for _ in range(NEWTON):
        value, slope = real(at)
        above = np.where(value >= 0, 1.0, -1.0) == rising
        low, high = np.where(above, low, at), np.where(above, at, high)
        with np.errstate(all="ignore"):
            following = at - value / slope
        following = np.where((following > low) & (following < high), following, (low + high) / 2)
        if np.all(np.abs(following - at) <= 4e-16 * at):
            break
        at = following
    return np.asarray(at), np.asarray(rising)


def turn(function: Callable[[Real, Real], tuple[Jet, Jet, Jet]], edges: Real) -> float:
    """How far the phase of a function moves along ``edges``, in rad; nan when a zero lies on the way as far as seen.

    Parameters
    ----------
    function
        The function and the two parts whose sum it is.
    edges
        Increasing, in rad/s.

    Notes
    -----
    On each cell the function stays within a disc around its value at the centre that leaves 0 out, or the first part
    does so and is larger than the second: then the function turns with it, to a right angle.
    """

    def judge(centre: Real, half: Real) -> Whole:
        whole, main, rest = function(centre, half)
        code = np.full(centre.shape, HALVE)
        code[half * whole.steepness < whole.noise] = OPEN
        code[main.is_clear_of_zero & (0.9 * main.least > rest.size)] = ONE_ZERO
        code[whole.is_clear_of_zero] = NO_ZERO
        return code

    left, right, code = judged_cells(judge, edges)
    if np.any(code == OPEN):
        return float("nan")
    ends = np.append(left, right[-1])
    whole, main, _ = function(ends, np.zeros_like(ends))
    with np.errstate(all="ignore"):  # where the first part is 0 it is not what is followed
        alone, beside = np.angle(whole.value[1:] / whole.value[:-1]), np.angle(whole.value / main.value)
        turned = np.angle(main.value[1:] / main.value[:-1]) + np.diff(beside)
    return float(np.sum(np.where(code == NO_ZERO, alone, turned)))


def peak(numerator: Function, denominator: Function, edges: Real, best: float) -> tuple[float, float | None]:
    """The largest |numerator/denominator| on ``edges`` and its frequency in rad/s, by branch and bound.

    No point exceeds the value found by more than half :data:`PRECISION` of it. ``best`` with None is returned when
    no point exceeds that.
    """
    least, where, width, precision = best**2, None, 0.0, PRECISION

    def judge(centre: Real, half: Real) -> Whole:
        nonlocal least, where, width
        n, d = numerator(centre, half), denominator(centre, half)
        with np.errstate(all="ignore"):
            nearest = d.least
            size = n.size / nearest
            steepness = (n.steepness + size * d.steepness) / nearest
            curvature = (n.curvature + 2 * steepness * d.steepness + size * d.curvature) / nearest
            ratio = n.value / d.value
            slope = (n.slope - ratio * d.slope) / d.value
            square = np.abs(ratio) ** 2
            upper = square + 2 * np.abs(np.real(np.conj(ratio) * slope)) * half
            upper = known(upper + (steepness**2 + size * curvature) * half**2)
        at = int(np.argmax(np.nan_to_num(square, nan=-1.0)))
        if square[at] > least:
            least, where, width = float(square[at]), float(centre[at]), 2 * float(half[at])
        return np.where(upper > (1 + precision) * least, HALVE, NO_ZERO)

    judged_cells(judge, edges)
    if where is not None:
        precision = SHARPER
        judged_cells(judge, np.array([max(where - width, 0.0), where + width]))
    return float(np.sqrt(least)), where
