"""Suprema over frequency by dense grids and refinement around every local maximum."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from benchmarks.referee.factors import Real

ROUNDS = 9  # each divides the distance of the points around a maximum by ten


def supremum(function: Callable[[Real], Real], omega: Real) -> tuple[float, float]:
    """The largest value of a function of omega in rad/s, and where: on the points (n,), refined between them.

    The points must resolve the function so far that every local maximum shows.
    """
    omega = omega[np.append(True, np.diff(omega) > 1e-10 * omega[1:])]  # the same to rounding hides what lies beside
    values = function(omega)
    inner = 1 + np.flatnonzero((values[1:-1] >= values[:-2]) & (values[1:-1] >= values[2:]))
    inner = inner[values[inner] >= 0.9 * values.max()] if values.max() > 0 else inner
    best = int(np.argmax(values))
    top, at = float(values[best]), float(omega[best])
    for k in inner:
        low, high = omega[k - 1], omega[k + 1]
        for _ in range(ROUNDS):
            fine = np.linspace(low, high, 21)
            found = function(fine)
            m = int(np.argmax(found))
            if found[m] > top:
                top, at = float(found[m]), float(fine[m])
            low, high = fine[max(m - 1, 0)], fine[min(m + 1, 20)]
    return top, at
