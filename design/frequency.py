"""Peaks of a magnitude over all frequencies: a grid that no lightly damped root can hide from, then refined."""

from __future__ import annotations

from collections.abc import Callable, Iterable

import numpy as np
from numpy.typing import NDArray

Real = NDArray[np.float64]


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
    distances = np.geomspace(1e-2, 1e3, 101)
    for root in found[found.imag > 0]:
        width = max(-root.real, root.real, 1e-6 * abs(root))
        points += [np.array([root.imag]), root.imag + width * distances, root.imag - width * distances]
    grid = np.unique(np.concatenate(points))
    undamped = found[found.real == 0].imag
    return np.asarray(grid[(grid >= slowest) & (grid <= fastest) & ~np.isin(grid, undamped)])


def peak(magnitude: Callable[[Real], Real], roots: Iterable[complex]) -> tuple[float, float]:
    """The largest value of a magnitude over 0 <= omega <= infinity and where it is reached: the norm, Thesis Eq. (2.1).

    Parameters
    ----------
    magnitude
        Vectorised function of omega in rad/s, (n,) -> (n,), finite off the roots' axis points.
    roots
        Poles and zeros that shape it, see :func:`frequency_grid`.

    Returns
    -------
    value, omega
        The grid's five highest local maxima are refined to the solver's accuracy. The limits omega -> 0 and
        omega -> infinity are taken at the grid's ends, three decades beyond every root.
    """
    from scipy.optimize import minimize_scalar  # only here: most commands read designs and search no peak

    grid = frequency_grid(roots)
    values = magnitude(grid)
    if not np.all(np.isfinite(values)):
        return float("inf"), float(grid[~np.isfinite(values)][0])
    best = int(np.argmax(values))
    result = (float(values[best]), float(grid[best]))
    inner = np.flatnonzero((values[1:-1] >= values[:-2]) & (values[1:-1] >= values[2:])) + 1
    for k in inner[np.argsort(values[inner])[-5:]]:
        refined = minimize_scalar(
            lambda omega: -float(magnitude(np.array([omega]))[0]),
            bounds=(grid[k - 1], grid[k + 1]),
            method="bounded",
            options={"xatol": 1e-10 * grid[k]},
        )
        result = max(result, (float(-refined.fun), float(refined.x)))
    return result
