"""Whether a run is covered by its guarantee, in a sentence; see :mod:`experiments.runs.sector_promise`."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from experiments.runs.guarantee import Guarantee
from experiments.runs.windup_bound import Windup
from experiments.runs.words import sector_text
from identification.base.digits import told_apart

CONVERGED = 1e-9  # between refinements, of which each makes the error of a peak 1e5 times smaller


@dataclass(frozen=True)
class Verdict:
    """What a run needs, beside what is guaranteed.

    Parameters
    ----------
    guarantee
        Of the run's design and anti-windup.
    farthest_control, farthest_control_at_s
        u where |u| is largest, and when; of a run that never saturates, among its own times.
    steady
        The least and the greatest v_s.
    limits
        (sigma_1, sigma_2).
    needed_sector, needed_at_s
        The largest secant from v_s, and when; 0 for a run that never saturates, infinite where v_s reaches a limit.
    left_at_s
        When the run first needed more than is guaranteed; NaN: never.
    windup
        What a guarantee whatever the control says of the run; None for another one, and where nothing is promised.
    """

    guarantee: Guarantee
    farthest_control: float
    farthest_control_at_s: float
    steady: tuple[float, float]
    limits: tuple[float, float]
    needed_sector: float
    needed_at_s: float
    left_at_s: float
    windup: Windup | None = None

    @property
    def covered(self) -> bool:
        """Whether the guarantee speaks of the run, whose reference is then within the limits."""
        return bool(covers(self.guarantee.sector, self.needed_sector))

    @property
    def largest_control(self) -> float:
        """U, the largest |u|."""
        return abs(self.farthest_control)

    @property
    def covered_controls(self) -> tuple[float, float]:
        """From where to where u may reach wherever v_s is; only the limits where v_s reaches one of them.

        With the limit L, above or below, and v_s no farther that way than V, u in (u - L)/(u - V) = k_c.
        """
        k, (low, high) = self.guarantee.sector, self.limits
        if not (low < self.steady[0] and self.steady[1] < high):
            return self.limits
        if k >= 1:
            return -math.inf, math.inf
        least, greatest = ((end - k * steady) / (1 - k) for end, steady in zip(self.limits, self.steady, strict=True))
        return least, greatest

    @property
    def covered_control(self) -> float:
        """The most that |u| may reach wherever v_s is, where 0 lies within the limits."""
        least, greatest = self.covered_controls
        return min(-least, greatest)

    def agrees(self, other: Verdict) -> bool:
        """Whether both have the same largest |u| and needed sector, to rounding."""
        own, others = ((each.largest_control, each.needed_sector) for each in (self, other))
        return bool(np.all(np.isclose(others, own, rtol=CONVERGED, atol=0.0)))

    @property
    def needs(self) -> str:
        """What the run needs beside what is guaranteed and covered."""
        needed, guaranteed = told_apart(self.needed_sector, self.guarantee.sector, 3, sector_text)
        reached, most = told_apart(self.largest_control, self.covered_control, 3, _plain)
        said = f"|u| reached {reached}; up to {most} is covered"
        if math.isinf(self.covered_control):
            said = f"|u| reached {reached}; any size is covered"
        elif self.limits[0] != -self.limits[1]:
            least, greatest = (_plain(end, 3) for end in self.covered_controls)
            said = f"u reached {_plain(self.farthest_control, 3)}; from {least} to {greatest} is covered"
        return f"the run needs the sector {needed} at t = {self.needed_at_s:.3g} s, {guaranteed} is guaranteed ({said})"

    def __str__(self) -> str:
        """In words; empty for a run that never saturates, of which nothing need be promised."""
        if self.needed_sector == 0:
            return ""
        if self.guarantee.missing:
            return f"No guarantee: {self.guarantee.missing}; |u| reached {self.largest_control:.3g}"
        if self.windup is not None:
            return f"Guaranteed whatever the control: {self.windup} (|u| reached {self.largest_control:.3g})"
        if self.covered:
            return f"Covered by its guarantee: {self.needs}"
        if math.isinf(self.needed_sector):
            return (
                f"NOT covered by its guarantee: the reference takes a control of {self._steady_beyond}; |u| reached "
                f"{self.largest_control:.3g}"
            )
        return f"NOT covered by its guarantee, which it left at t = {self.left_at_s:.3g} s: {self.needs}"

    @property
    def _steady_beyond(self) -> str:
        """The v_s that lies farthest beyond the upper limit, or else beyond the lower one, and that limit."""
        (low, high), (least, greatest) = self.limits, self.steady
        steady, limit = (greatest, high) if greatest >= high else (least, low)
        said = told_apart(steady, limit, 4, _plain)
        return f"{said[0]}, {'the limit itself' if steady == limit else f'beyond the limit {said[1]}'}"


def covers(sector: float, needed: float | np.ndarray) -> np.ndarray:
    """Whether a guaranteed sector, from 1 on whatever the control, is more than what is needed."""
    return np.asarray(np.isfinite(needed) if sector >= 1 else np.less(needed, sector))


def _plain(value: float, digits: int) -> str:
    return f"{value:.{digits}g}"
