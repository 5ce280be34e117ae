"""The circle criterion: the sector of a dead zone that varies with time, as one does that is seen from a trajectory."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from design.block import Block
from design.frequency import Real, frequency_grid

FINE = 200  # frequencies a decade before the peaks are refined
REFINEMENTS = 8  # of each peak
A_REFINEMENT = 17  # frequencies of each, in place of three
ROUNDING = 1e-12  # of -Re theta1~: a height that is nearer to 1 is the 1 of theta1~(0) = -1


def circle_sector(
    theta1_tilde: Block, perturbation: Callable[[Real], Real] | None = None, roots: tuple[complex, ...] = ()
) -> float:
    """The largest sector of the circle criterion: :func:`design.popov.popov_sector` with the multiplier 0.

    Parameters
    ----------
    theta1_tilde, perturbation, roots
        As of :func:`design.popov.popov_sector`.

    Returns
    -------
    float
        Re theta1~(j omega) - perturbation + 1/k > 0 for all omega and every sector below k; infinite when the left
        side without 1/k is never negative, 0 when there is none.

    Notes
    -----
    The local maxima of 1/k on a grid that resolves all roots are refined; one between two points of the grid that
    neither of them shows would be missed.
    """

    def least(omega: Real) -> Real:
        lost = 0.0 if perturbation is None else perturbation(omega)
        return np.asarray(lost - theta1_tilde(1j * omega).real)

    omega = frequency_grid(theta1_tilde.zeros + theta1_tilde.poles + roots, per_decade=FINE)
    values = least(omega)
    if not np.all(np.isfinite(values)):
        return 0.0
    tops = 1 + np.flatnonzero((values[1:-1] >= values[:-2]) & (values[1:-1] >= values[2:]))
    left, right = omega[tops - 1], omega[tops + 1]
    height = max(-float(theta1_tilde(0j).real), float(values.max()))
    for _ in range(REFINEMENTS if len(tops) else 0):
        finer = np.linspace(left, right, A_REFINEMENT)
        values = least(finer.ravel()).reshape(finer.shape)
        best = np.clip(np.argmax(values, axis=0), 1, A_REFINEMENT - 2)
        left, right = (np.take_along_axis(finer, best[None] + side, axis=0)[0] for side in (-1, 1))
        height = max(height, float(values.max()))
    if abs(height - 1) <= ROUNDING:
        return 1.0
    return float("inf") if height <= 0 else 1 / height
