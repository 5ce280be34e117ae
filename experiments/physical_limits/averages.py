"""Moving averages of controls and of weights of errors, and how many of them are tried."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

PASSES = 3  # three boxes in a row are a smooth bell
PATIENCE = 2  # wider averages in a row that are no better, after which none is tried


def average(values: np.ndarray, half: int, first: int, periodic: bool) -> np.ndarray:
    """Repeated averages over ``half`` values to either side, from the value ``first`` on; shape (n,) as ``values``.

    Where there is no period to go on with, the values are mirrored at both ends.
    """
    later = values[first:]
    for _ in range(PASSES):
        total = np.append(0.0, np.cumsum(np.pad(later, half, mode="wrap" if periodic else "symmetric")))
        later = (total[2 * half + 1 :] - total[: -2 * half - 1]) / (2 * half + 1)
    return np.append(values[:first], later)


def spread(weights: np.ndarray, half: int, counted: slice) -> np.ndarray:
    """The weights that count, each spread evenly over up to ``half`` places to both sides, as far as the ends allow.

    That, done repeatedly, keeps their sum and their mean time, and so the costates of two integrators before them.
    Shape (n,) as ``weights``.
    """
    found, later = np.zeros_like(weights), weights[counted]
    place = np.arange(len(later))
    halves = np.minimum(half, np.minimum(place, place[::-1]))
    for _ in range(PASSES):
        rises = np.bincount(place - halves, later / (2 * halves + 1), len(later) + 1)
        falls = np.bincount(place + halves + 1, later / (2 * halves + 1), len(later) + 1)
        later = np.cumsum(rises - falls)[:-1]
    found[counted] = later
    return found


def best(bounds: Iterator[float]) -> float:
    """The greatest of bounds, of which no more are asked for when two in a row were no better; 0 of none."""
    best = next(bounds, 0.0)
    worse = 0
    for bound in bounds:
        best, worse = max(best, bound), 0 if bound > best else worse + 1
        if worse == PATIENCE:
            break
    return best
