"""The circle criterion: the sector of a dead zone that varies with time, as one does that is seen from a trajectory."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from design.blocks.block import Block
from design.blocks.frequency_peak import frequency_grid, refined_maxima
from design.blocks.positivity import exact, not_positive_at, popov_polynomial, squared_magnitude
from identification.base.arrays import Real

FINE = 200  # frequencies a decade before the peaks are refined
BELOW = 1e-9  # by which the sector lies below the largest one found, relative
ROUNDING = 1e-12  # of -Re theta1~: a height that is nearer to 1 is the 1 of theta1~(0) = -1


def circle_sector(
    theta1_tilde: Block, perturbation: Callable[[Real], Real] | None = None, roots: tuple[complex, ...] = ()
) -> float:
    """The largest sector found of the circle criterion: that of Popov's condition with the multiplier 0.

    Parameters
    ----------
    theta1_tilde
        Strictly proper and stable.
    perturbation, roots
        As of :func:`design.anti_windup.popov.robust_popov_sector`.

    Returns
    -------
    float
        Re theta1~(j omega) - perturbation + 1/k > 0 for all omega and every sector below k; infinite when the left
        side without 1/k is never negative, 0 when there is none.

    Notes
    -----
    The local maxima of 1/k on a grid that resolves all roots are refined. Without a perturbation the sector is then
    proved, see :func:`design.blocks.positivity.not_positive_at`, unless it is infinite or 1 to 1e-12, as theta1~(0) =
    -1 makes it. With one, a maximum between two points of the grid that neither of them shows would be missed.
    """

    def least(omega: Real) -> Real:
        lost = 0.0 if perturbation is None else perturbation(omega)
        return np.asarray(lost - theta1_tilde(1j * omega).real)

    omega = frequency_grid(theta1_tilde.zeros + theta1_tilde.poles + roots, per_decade=FINE)
    values = least(omega)
    if not np.all(np.isfinite(values)):
        return 0.0
    height = max(-float(theta1_tilde(0j).real), float(refined_maxima(least, omega, values)[1].max()))
    if abs(height - 1) <= ROUNDING:
        return 1.0
    if height <= 0:
        return float("inf")
    numerator, denominator = popov_polynomial(theta1_tilde, 0.0), squared_magnitude(theta1_tilde.poles)
    while True:
        k = (1 - BELOW) / height
        if perturbation is not None:
            return k
        missed = not_positive_at(exact(k) * numerator + denominator)
        if missed is None:
            return k
        height = max(height * (1 + BELOW), float(least(np.sqrt([missed]))[0]))
