"""Popov's condition of Theorem 2.3.1: the largest sector that a theta1~ allows, for the model and for all of W_a."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

from design.block import Block
from design.frequency import frequency_grid

Real = NDArray[np.float64]


def popov_sector(
    theta1_tilde: Block, perturbation: Callable[[Real], Real] | None = None, roots: tuple[complex, ...] = ()
) -> tuple[float, float]:
    """The largest sector k for which Popov's condition holds, and the multiplier that proves it.

    Condition ii of Theorem 2.3.1: Re (1 + j m omega) theta1~(j omega) + 1/k > 0 for all omega and some m >= 0; m = 0
    is the circle criterion.

    Parameters
    ----------
    theta1_tilde
        Strictly proper and stable.
    perturbation
        Function of omega in rad/s, (n,) -> (n,): how far theta1~(j omega) may be off; then the condition holds for
        every such function, see :func:`robust_loss`. Not finite where it has no limit: no sector is left.
    roots
        Poles and zeros in rad/s that shape the perturbation.

    Returns
    -------
    k, multiplier
        The condition holds for every sector below k; k is infinite when the left side without 1/k is never
        negative (the multiplier is then the least that was tried), 0 when there is none. The multiplier is in
        seconds. A dead zone with the limits +-L lies in the sector 1 - L/U as long as |u| <= U, and reaches 1 only
        as u grows without bound, so that k = 1, the most that theta1~(0) = -1 allows, is the boundary case.
    """
    # three decades below the slowest root theta1~ is theta1~(0)
    grid = frequency_grid(theta1_tilde.zeros + theta1_tilde.poles + roots, per_decade=200)
    values = theta1_tilde(1j * grid)
    lost = np.zeros(len(grid)) if perturbation is None else perturbation(grid)
    if not np.all(np.isfinite(lost)):
        return 0.0, 0.0
    decade = np.searchsorted(grid, grid[-1] / 10)
    rolls_off = grid[-1] * lost[-1] <= 2 * grid[decade] * lost[decade]  # or omega times it has no limit, and m is 0
    at_zero = float(theta1_tilde(0j).real)

    def lowest(multiplier: float) -> float:
        left = values.real - multiplier * grid * values.imag - np.hypot(1, multiplier * grid) * lost
        return min(at_zero, float(left.min()))

    time_constants = [1 / abs(pole) for pole in theta1_tilde.poles] or [1.0]
    positive = np.geomspace(1e-3 * min(time_constants), 1e3 * max(time_constants), 200)
    trials = np.concatenate([[0.0], positive if rolls_off else []])
    heights = [lowest(trial) for trial in trials]
    if max(heights) >= 0:
        return float("inf"), float(trials[int(np.argmax(np.array(heights) >= 0))])
    k = int(np.argmax(heights))
    if not rolls_off:
        return -1 / heights[0], 0.0
    found = minimize_scalar(
        lambda multiplier: -lowest(multiplier),
        bounds=(trials[max(k - 1, 0)], trials[min(k + 1, len(trials) - 1)]),
        method="bounded",
    )
    height, multiplier = max((heights[k], float(trials[k])), (float(-found.fun), float(found.x)))
    return (float("inf") if height >= 0 else -1 / height), multiplier


def robust_loss(one_plus: Block, robustness: Callable[[Real], Real]) -> Callable[[Real], Real]:
    """How far an uncertainty within W_a moves the function that meets the dead zone.

    Parameters
    ----------
    one_plus
        1 + theta1~.
    robustness
        |W_a C S| as a function of omega in rad/s.

    Returns
    -------
    callable
        |1 + theta1~| x/(1 - x) with x = |W_a C S|; infinite where x >= 1.

    Notes
    -----
    With the plant P + Delta, v = C (r - y - y_d), y = (P + Delta)(u - u_tilde), y_d = P (1 + theta1~) u_tilde and
    u = v - theta1~ u_tilde give v = C S_Delta (r + Delta (1 + theta1~) u_tilde), so that the dead zone sees

        u = C S_Delta r - (theta1~ - C S_Delta Delta (1 + theta1~)) u_tilde,   S_Delta = S/(1 + C S Delta).

    The uncertainty enters by C S_Delta Delta (1 + theta1~), where (2.19) minimises W_a (1 + theta1~) alone.
    """

    def loss(omega: Real) -> Real:
        x = robustness(omega)
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.asarray(np.where(x < 1, np.abs(one_plus(1j * omega)) * x / (1 - x), np.inf))

    return loss
