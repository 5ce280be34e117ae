"""Peaks of a magnitude over all frequencies: searched on a grid that resolves every root, proved for rational ones."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable

import numpy as np

from design.blocks.block import Block
from design.blocks.positivity import exact, not_positive_at, squared_magnitude
from identification.base.arrays import Real
from identification.base.errors import InputError

REFINED = 1e-8  # of the distance between a maximum's neighbours on the grid: the height is then off by its square
POINTS = 21  # that divide an interval around a maximum
DISTANCES = np.geomspace(1e-2, 1e3, 101)  # of the points around a resonance, in half widths
CERTIFIED = 1e-9  # by which a norm may exceed the value found, relative


def frequency_grid(roots: Iterable[complex], per_decade: int = 60) -> Real:
    """A sorted grid of frequencies that resolves every root's resonance.

    Parameters
    ----------
    roots
        Poles and zeros in rad/s of what will be evaluated; roots at zero add nothing.
    per_decade
        Points a decade between 1e-3 times the slowest and 1e3 times the fastest root.

    Returns
    -------
    ndarray, shape (n,)
        Frequencies in rad/s, positive. Around each root the points lie at geometric distances of 1e-2 to 1e3
        half widths from its natural frequency; points on an undamped root are left out.
    """
    found = np.array([root for root in roots if root != 0], dtype=complex)
    if not len(found):
        return np.geomspace(1e-3, 1e3, 6 * per_decade + 1)
    slowest, fastest = np.abs(found).min() * 1e-3, np.abs(found).max() * 1e3
    points = [np.geomspace(slowest, fastest, int(per_decade * np.log10(fastest / slowest)) + 1)]
    for root in found[found.imag > 0]:
        width = max(-root.real, root.real, 1e-6 * abs(root))
        points += [np.array([root.imag]), root.imag + width * DISTANCES, root.imag - width * DISTANCES]
    grid = np.unique(np.concatenate(points))
    undamped = found[found.real == 0].imag
    return np.asarray(grid[(grid >= slowest) & (grid <= fastest) & ~np.isin(grid, undamped)])


def peak(magnitude: Callable[[Real], Real], roots: Iterable[complex]) -> tuple[float, float]:
    """The largest value found of a magnitude over 0 <= omega <= infinity: the norm of Thesis Eq. (2.1), by search.

    Parameters
    ----------
    magnitude
        Vectorised function of omega in rad/s, (n,) -> (n,), finite off the roots' axis points.
    roots
        Poles and zeros that shape it, see :func:`frequency_grid`.

    Returns
    -------
    value, omega
        The value is reached at omega, so that it is a lower bound of the norm. Every local maximum of the grid is
        refined to :data:`REFINED` of omega; a maximum that lies between two points of the grid and shows at neither is
        missed. For rational functions :func:`block_norm` proves that there is none. The limits omega -> 0 and
        omega -> infinity are taken at the grid's ends, three decades beyond every root.
    """
    grid = frequency_grid(roots)
    values = magnitude(grid)
    if not np.all(np.isfinite(values)):
        return float("inf"), float(grid[~np.isfinite(values)][0])
    return _highest(magnitude, grid, values)


def refined_maxima(function: Callable[[Real], Real], grid: Real, values: Real) -> tuple[Real, Real]:
    """All local maxima of a function on a grid, each moved to where the function is largest between its neighbours.

    Parameters
    ----------
    function
        Vectorised function of omega in rad/s, (n,) -> (n,).
    grid, values
        Increasing frequencies and the function there, shape (n,).

    Returns
    -------
    omega, heights
        Shape (m,): where the maxima lie, to :data:`REFINED` of the distance of their neighbours, and the values.
    """
    padded = np.concatenate([[-np.inf], values, [-np.inf]])
    k = np.flatnonzero((values >= padded[:-2]) & (values >= padded[2:]))
    at, heights = grid[k], values[k]
    low, high = grid[np.maximum(k - 1, 0)], grid[np.minimum(k + 1, len(grid) - 1)]
    share = np.linspace(0, 1, POINTS)
    for _ in range(math.ceil(math.log(1 / REFINED) / math.log((POINTS - 1) / 2))):
        inside = low[:, None] + (high - low)[:, None] * share
        found = function(inside.ravel()).reshape(inside.shape)
        best, row = np.argmax(found, axis=1), np.arange(len(k))
        better = found[row, best] > heights
        at = np.where(better, inside[row, best], at)
        heights = np.where(better, found[row, best], heights)
        low, high = inside[row, np.maximum(best - 1, 0)], inside[row, np.minimum(best + 1, POINTS - 1)]
    return at, heights


def _highest(function: Callable[[Real], Real], grid: Real, values: Real) -> tuple[float, float]:
    """The highest of the refined maxima, and where it lies."""
    at, heights = refined_maxima(function, grid, values)
    best = int(np.argmax(heights))
    return float(heights[best]), float(at[best])


def searched_norm(block: Block) -> tuple[float, float]:
    """The largest magnitude that :func:`peak` finds of a rational function, or that it has at 0 or infinity.

    Returns
    -------
    value, omega
        Infinite where the block has a pole on the axis or is improper.
    """
    on_axis = [abs(pole.imag) for pole in block.poles if pole.real == 0]
    if on_axis or block.relative_degree < 0:
        return float("inf"), min(on_axis, default=float("inf"))
    magnitude = _magnitude(block)
    ends = [(float(magnitude(np.zeros(1))[0]), 0.0)]
    if block.relative_degree == 0:
        ends.append((abs(block.gain), float("inf")))
    return max(*ends, peak(magnitude, block.zeros + block.poles))


def block_norm(block: Block) -> tuple[float, float]:
    """The largest magnitude of a rational function on the imaginary axis: the norm, Thesis Eq. (2.1), with a proof.

    Parameters
    ----------
    block
        Its dead time does not matter.

    Returns
    -------
    value, omega
        The magnitude at omega in rad/s is the value, and no frequency has one above (1 + CERTIFIED) value: for the
        roots and the gain that the block holds this is proved in exact arithmetic, by
        :func:`design.blocks.positivity.not_positive_at` of ((1 + CERTIFIED) value)^2 |denominator|^2 - |numerator|^2.
        The value itself is rounded to about 1e-14 of it. Infinite where the block has a pole on the axis or is
        improper.

    Raises
    ------
    InputError
        A root is so close to the axis that double precision does not resolve its peak.
    """
    value, omega = searched_norm(block)
    if not 0 < value < np.inf:
        return value, omega
    magnitude = _magnitude(block)
    numerator, denominator = squared_magnitude(block.zeros), squared_magnitude(block.poles)
    while True:
        above = (exact(value) * (1 + exact(CERTIFIED))) ** 2
        at = not_positive_at(above * denominator - exact(block.gain) ** 2 * numerator, omega**2)
        if at is None:
            return value, omega
        near = math.sqrt(at) * np.linspace(1 - 1e-3, 1 + 1e-3, POINTS)
        higher = _highest(magnitude, near, magnitude(near))
        if not higher[0] > value * (1 + CERTIFIED / 2):
            raise InputError(
                f"the norm {value:g} of a block, at {omega:g} rad/s, could not be proved; expected better damped roots"
            )
        value, omega = higher


def _magnitude(block: Block) -> Callable[[Real], Real]:
    rational = block.without_delay()
    return lambda omega: np.asarray(np.abs(rational(1j * omega)))
