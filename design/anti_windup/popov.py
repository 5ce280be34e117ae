"""Popov's condition of Theorem 2.3.1: the largest sector that a theta1~ allows, for the model and for all of W_a."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.optimize import minimize_scalar

from design.blocks.block import Block
from design.blocks.frequency_peak import frequency_grid, refined_maxima
from design.blocks.positivity import exact, not_positive_at, popov_polynomial, squared_magnitude
from identification.base.arrays import Real

PER_DECADE = 200  # frequencies of the search
ROUNDS = 12  # of refined frequencies, at most
BELOW = 1e-9  # by which the sector lies below 1/|lowest point found|, relative


def popov_sector(theta1_tilde: Block) -> tuple[float, float]:
    """A sector k for which Popov's condition is proved, the largest that was found, and its multiplier.

    Condition ii of Theorem 2.3.1: Re (1 + j m omega) theta1~(j omega) + 1/k > 0 for all omega and some m >= 0; m = 0
    is the circle criterion.

    Parameters
    ----------
    theta1_tilde
        Strictly proper and stable.

    Returns
    -------
    k, multiplier
        The condition holds for every sector up to k, which is proved in exact arithmetic for the roots and the gain
        that the block holds, see :func:`design.blocks.positivity.not_positive_at`. k is BELOW of itself smaller than
        the largest sector for this multiplier; the multiplier, in seconds, is the best one to about 1e-6 of k. k is
        infinite when the left side without 1/k is proved positive (the multiplier is then the least of a grid). A dead
        zone with the limits +-L lies in the sector 1 - L/U as long as |u| <= U, and reaches 1 only as u grows without
        bound, so that k = 1, the most that theta1~(0) = -1 allows, is the boundary case.

    Notes
    -----
    For a given m the lowest point is searched on a grid, refined, and lowered by BELOW; where the proof fails it names
    a frequency that the search missed. The lowest point is a concave function of m, so that a local best is the best.
    """
    if theta1_tilde.gain == 0:
        return float("inf"), 0.0
    search = _Search(theta1_tilde, theta1_tilde.zeros + theta1_tilde.poles, None)
    denominator = squared_magnitude(theta1_tilde.poles)
    for trial in search.never_negative():
        if not_positive_at(popov_polynomial(theta1_tilde, trial)) is None:
            return float("inf"), trial
    height, multiplier = search.highest(multipliers=True)
    numerator = popov_polynomial(theta1_tilde, multiplier)
    while True:
        k = float(-(1 - BELOW) / height)
        missed = not_positive_at(exact(k) * numerator + denominator)
        if missed is None:
            return k, multiplier
        search.add(np.sqrt(missed) * np.linspace(1 - 1e-3, 1 + 1e-3, 101))
        height = min(search.lowest_refined(multiplier), height * (1 + BELOW))


def meets_circle_criterion(theta1_tilde: Block, sector: float) -> bool:
    """Whether Re theta1~(j omega) + 1/k > 0 for all omega and a sector k, in exact arithmetic; see popov_sector."""
    numerator, denominator = popov_polynomial(theta1_tilde, 0.0), squared_magnitude(theta1_tilde.poles)
    return not_positive_at(exact(sector) * numerator + denominator) is None


def robust_popov_sector(
    theta1_tilde: Block, perturbation: Callable[[Real], Real], roots: tuple[complex, ...] = ()
) -> tuple[float, float]:
    """The largest sector k found for which Popov's condition holds with a perturbation of theta1~.

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
        As of :func:`popov_sector`, but by search: every local minimum of a grid that resolves all roots is refined, so
        that k is right to about 1e-9 where none hides between two points of the grid, which is not proved. 0 when
        there is no sector.
    """
    # three decades below the slowest root theta1~ is theta1~(0)
    search = _Search(theta1_tilde, theta1_tilde.zeros + theta1_tilde.poles + roots, perturbation)
    if not np.all(np.isfinite(search.lost)):
        return 0.0, 0.0
    omega, lost = search.omega, search.lost
    decade = np.searchsorted(omega, omega[-1] / 10)
    rolls_off = omega[-1] * lost[-1] <= 2 * omega[decade] * lost[decade]  # or omega times it has no limit, and m is 0
    height, multiplier = search.highest(multipliers=bool(rolls_off))
    return (float("inf") if height >= 0 else -(1 - BELOW) / height), multiplier


class _Search:
    """The lowest point of Re (1 + j m omega) theta1~(j omega) - |1 + j m omega| perturbation over omega, for any m."""

    def __init__(
        self, theta1_tilde: Block, roots: tuple[complex, ...], perturbation: Callable[[Real], Real] | None
    ) -> None:
        self.theta1_tilde, self.perturbation = theta1_tilde, perturbation
        constants = [1 / abs(pole) for pole in theta1_tilde.poles] or [1.0]
        self.trials = np.append(0.0, np.geomspace(1e-3 * min(constants), 1e3 * max(constants), 200))
        self.omega = self.lost = np.empty(0)
        self.values = np.empty(0, dtype=complex)
        self.at_zero = float(theta1_tilde(0j).real)
        # m omega times it has a limit
        self.at_infinity = theta1_tilde.gain if theta1_tilde.relative_degree == 1 else float("inf")
        self.add(frequency_grid(roots, PER_DECADE))

    def add(self, omega: Real) -> None:
        """Put further frequencies, in rad/s, on the grid."""
        self.omega, first = np.unique(np.concatenate([self.omega, omega]), return_index=True)
        self.values = np.concatenate([self.values, self.theta1_tilde(1j * omega)])[first]
        self.lost = np.concatenate([self.lost, self._lost(omega)])[first]

    def _lost(self, omega: Real) -> Real:
        return np.zeros(len(omega)) if self.perturbation is None else self.perturbation(omega)

    def heights(self, multiplier: float) -> Real:
        """The function at the grid's frequencies."""
        tilt = multiplier * self.omega
        return np.asarray(self.values.real - tilt * self.values.imag - np.hypot(1, tilt) * self.lost)

    def lowest(self, multiplier: float) -> float:
        """Its lowest point on the grid and at both ends."""
        return min(self._lowest_end(multiplier), float(self.heights(multiplier).min()))

    def _lowest_end(self, multiplier: float) -> float:
        return min(self.at_zero, multiplier * self.at_infinity if multiplier else 0.0)

    def lowest_refined(self, multiplier: float) -> float:
        """Its lowest point, the local minima of the grid refined and kept as further frequencies."""

        def depth(omega: Real) -> Real:
            values = self.theta1_tilde(1j * omega)
            tilt = multiplier * omega
            return np.asarray(tilt * values.imag - values.real + np.hypot(1, tilt) * self._lost(omega))

        at, depths = refined_maxima(depth, self.omega, -self.heights(multiplier))
        self.add(at)
        return min(self._lowest_end(multiplier), -float(depths.max()))

    def never_negative(self) -> list[float]:
        """The multipliers of the grid for which no value is negative by more than rounding, the least first."""
        size = 1e-12 * float(np.abs(self.values).max())
        return [float(trial) for trial in self.trials if self.lowest(float(trial)) >= -size]

    def highest(self, multipliers: bool) -> tuple[float, float]:
        """The multiplier whose lowest point is highest, and that point; 0 unless multipliers are allowed."""
        height, multiplier = self.lowest_refined(0.0), 0.0
        if not multipliers:
            return height, multiplier
        for _ in range(ROUNDS):
            lowest = [self.lowest(float(trial)) for trial in self.trials]
            k = int(np.argmax(lowest))
            ends = float(self.trials[max(k - 1, 0)]), float(self.trials[min(k + 1, len(self.trials) - 1)])
            unit = ends[1]
            found = minimize_scalar(
                lambda share, unit=unit: -self.lowest(share * unit),
                bounds=(ends[0] / unit, 1.0),
                method="bounded",
                options={"xatol": 1e-10},
            )
            on_grid, at = max((lowest[k], float(self.trials[k])), (float(-found.fun), float(found.x) * unit))
            refined = self.lowest_refined(at)
            if refined > height + BELOW * abs(
                height
            ):  # or the circle criterion, which needs no multiplier, says as much
                height, multiplier = refined, at
            if on_grid - refined <= BELOW * abs(refined):
                break
        return height, multiplier


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
