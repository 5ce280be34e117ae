"""Beyond the band of the lines: how large |W_a| may be there, how large a user wants it, and how large it is."""

from __future__ import annotations

from dataclasses import dataclass
from numbers import Real

import numpy as np

from identification.base.arrays import Real as Numbers
from identification.base.errors import InputError, shown
from identification.bound.shape import OUTSIDE
from identification.bound.tightest_bound import Band, resonances, within
from identification.model.additive_bound import AdditiveBound
from identification.model.reports import Outside

FITTED = np.geomspace(1.0, OUTSIDE, 21)[1:]  # times the edges: where |W_a| is limited from the first round on
SLOW = np.geomspace(OUTSIDE, 300.0, 11)[1:]  # and where it has to cover a level: slower than these no root is left
LOOKED = np.geomspace(1.0, 1e4, 801)
FAR = 1e8


@dataclass(frozen=True)
class Beyond:
    """What is asked of |W_a| outside the band.

    Parameters
    ----------
    band
        The edges in rad/s.
    below, above
        The most that |P - plant| is from 0 to the lower edge, and from the upper edge to OUTSIDE times it, output unit
        per input unit; None where nobody says so.

    Raises
    ------
    InputError
        A level is not a positive number.
    """

    band: Band
    below: float | None
    above: float | None

    def __post_init__(self) -> None:
        for name in ("below", "above"):
            level = getattr(self, name)
            if level is not None and not (isinstance(level, Real) and 0 < float(level) < np.inf):
                raise InputError(f"the level {name} the lines is {shown(level)}; expected a positive number")

    def fitted(self) -> Numbers:
        """Frequencies (M,) outside the band to begin a fit with."""
        low, high = self.band
        slow = SLOW if self.below is not None else SLOW[:0]
        return np.concatenate([low / FITTED, low / slow, high * FITTED])

    def asked(self, omega: Numbers) -> Numbers:
        """What |W_a| has to be (M,) at least at omega (M,) in rad/s; 0 asks for nothing."""
        low, high = self.band
        below = np.where(omega <= low, self.below or 0.0, 0.0)
        return np.where((omega >= high) & (omega <= OUTSIDE * high), self.above or 0.0, below)

    def continued(self, omega: Numbers) -> Numbers:
        """Factor (M,) by which the envelope grows from the nearer edge on: 1/omega below, omega above."""
        low, high = self.band
        return np.maximum(1.0, np.maximum(low / omega, omega / high))

    def around(self, bound: AdditiveBound) -> Numbers:
        """Frequencies (M,) outside the band, edges and 0 among them, that show what a bound does there."""
        low, high = self.band
        omega = resonances(bound)
        return np.concatenate([[0.0], low / LOOKED, high * LOOKED, [OUTSIDE * high], omega[~within(omega, self.band)]])

    def report(self, bound: AdditiveBound) -> Outside:
        """How large a bound is there."""
        low, high = self.band
        omega = self.around(bound)
        magnitude = np.abs(bound(1j * omega))
        return Outside(
            low=low,
            high=high,
            below=self.below,
            above=self.above,
            at_zero=bound.gain,
            most_below=float(magnitude[omega <= low].max()),
            most_above=float(magnitude[omega >= high].max()),
            falling=float(FAR * high * np.abs(bound(1j * FAR * high))),
        )
