"""The smallest peak error that any controller, causal or not, can reach under a limited input."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise

import numpy as np
import pandas as pd

from experiments.engine.simulate import limit_pair
from experiments.physical_limits.intervals import Interval, outward
from experiments.physical_limits.peak_program import REFINED, SPARE, PeakProgram
from experiments.runs.compare_anti_windups import SETTLED
from experiments.runs.references import Reference
from experiments.runs.steady_control import SAME, UNIT
from identification.base.errors import InputError
from identification.model.plant import PlantModel

PERIODIC_STEPS = 400, 1600  # of a period; the finer ones where the others leave more than
NARROW = 2e-3  # of the reference's amplitude open
STEPS = 200  # of a period from rest, for E(t0)
HORIZON = 3  # periods from rest
STARTS = 20  # most programs that trace E(t0)
FALL = 1.1  # E(t0) is traced further where it may fall by more than this
EVENLY = 16  # other t0 in a period

Tick = Callable[[], object]


def periodic_limit(plant: PlantModel, reference: Reference, limits: float | Sequence[float]) -> Interval:
    """Enclose the least peak of |r - y| over all periodic u within the limits.

    Parameters
    ----------
    plant
        With a pole, and none in the right half plane. Its dead time only shifts u.
    reference
        Periodic: its frequencies, 0 apart, are multiples of the slowest one, whose period u has. What is a multiple to
        1e-9 of itself is taken as one.
    limits
        Of the actuator, in its unit, (lower, upper), or one number for +-limits; finite, and on both sides of 0 where
        the plant integrates.

    Returns
    -------
    Interval
        In the unit of the output, see :meth:`experiments.physical_limits.peak_program.PeakProgram.solve`.

    Raises
    ------
    InputError
        An argument is not as above, or a pole is too fast for the period.

    Notes
    -----
    No u, periodic or not, keeps |r - y| below the lower end for ever: if one did, so would the mean of its
    shifts by whole periods, which is periodic. For K/s and r of amplitude a, with rho = limit/(a omega/K) <= 1,
    the least peak is a (sqrt(1 - rho^2) - rho arccos(rho)): of a bounded slope, y is at its nearest to r half the
    greatest excess of |r(t1) - r(t2)| over the way K limit |t1 - t2| away.
    """
    reference, (low, high) = harmonic(plant, reference), finite_limits(plant, limits)
    middle, half = (low + high) / 2, (high - low) / 2
    rounding = 4 * UNIT * half if middle else 0.0
    if reference.required(plant, middle).at_most <= half - rounding:
        return Interval(0.0, 0.0)
    found = Interval(0.0, math.inf)
    for steps in PERIODIC_STEPS:
        new = PeakProgram(plant, reference.exact_period_s, steps, periodic=True).solve(reference, (low, high))
        found = Interval(max(found.lower, new.lower), min(found.upper, new.upper))
        if found.upper - found.lower <= NARROW * reference.amplitude:
            break
    return found


@dataclass(frozen=True)
class RestLimit:
    """E(t0): from rest at t = 0, u = 0 before, the least greatest |r(t) - y(t)| for t0 <= t <= horizon_s.

    Parameters
    ----------
    plant, reference, limits
        As in :func:`periodic_limit`.
    steps
        In a period.
    tick
        Called after every program.

    Raises
    ------
    InputError
        An argument is not as :func:`periodic_limit` wants it.

    Notes
    -----
    Until the dead time is over the error is |r|, whatever u does; from then on it is that of the plant without
    dead time against the reference ahead. E falls with t0, so that every lower bound holds for all earlier t0 and
    every upper bound for all later ones.
    """

    plant: PlantModel
    reference: Reference
    limits: float | Sequence[float]
    steps: int = STEPS
    tick: Tick = lambda: None
    _solved: dict[int, Interval] = field(default_factory=dict, init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "reference", harmonic(self.plant, self.reference))
        object.__setattr__(self, "limits", finite_limits(self.plant, self.limits))

    @property
    def horizon_s(self) -> float:
        """When the error ceases to count: three periods after the dead time."""
        return self.plant.delay_s + HORIZON * self.reference.period_s

    @property
    def last(self) -> int:
        """Index of the latest t0: a period before the horizon."""
        return (HORIZON - 1) * self.steps * REFINED

    def start_s(self, index: int) -> float:
        """The t0 with an index, in seconds: 0 for -1, the dead time for 0, and from there on in equal parts."""
        if index < 0:
            return 0.0
        return self.plant.delay_s + index * self._program.part * self._program.cell_s

    def at(self, index: int) -> Interval:
        """Enclose E(t0) for one t0."""
        if index < 0:
            time_s, doubt = np.linspace(0.0, self.plant.delay_s, 1001), self.reference.rounding(self.plant.delay_s)
            known, later = float(np.abs(self.reference(time_s)).max()), self.at(0)
            between = self.reference.bend * time_s[1] ** 2 / 8
            return outward(max(known - doubt, later.lower), max(known + doubt + between, later.upper))
        if index not in self._solved:
            program = self._program
            limits = limit_pair(self.limits)
            self._solved[index] = program.solve(self.reference, limits, index * program.part, self.plant.delay_s)
            self.tick()
        return self._known(index)

    def _known(self, index: int) -> Interval:
        """What the programs solved so far say of E(t0)."""
        lower = max(found.lower for other, found in self._solved.items() if other >= index)
        upper = min(found.upper for other, found in self._solved.items() if other <= index)
        return Interval(lower, upper)

    def table(self) -> pd.DataFrame:
        """E(t0) as columns start_s, rest_lower, rest_upper: up to 20 programs where it falls most, and even steps."""
        floor = SETTLED * self.reference.amplitude

        def fall(pair: tuple[int, int]) -> float:
            high, low = self.at(pair[0]).upper, self.at(pair[1]).lower
            return max(high, floor) / max(low, floor) if pair[1] - pair[0] > 1 else 1.0

        chosen = [0, self.last]
        while len(chosen) < STARTS and fall(widest := max(pairwise(chosen), key=fall)) > FALL:
            chosen = sorted([*chosen, sum(widest) // 2])
        starts = sorted({*chosen, *range(0, self.last, self.steps * REFINED // EVENLY)})
        found = [self._known(index) for index in starts]
        if self.plant.delay_s:
            starts, found = [-1, *starts], [self.at(-1), *found]
        return pd.DataFrame(
            {
                "start_s": [self.start_s(index) for index in starts],
                "rest_lower": [interval.lower for interval in found],
                "rest_upper": [interval.upper for interval in found],
            }
        )

    def settling(self, band: float) -> Interval:
        """Enclose, in seconds, the first t0 from which on |r - y| can stay within ``band`` until ``horizon_s``.

        Before ``lower`` none can; a control that was found does from ``upper`` on. NaN where there is none.

        Parameters
        ----------
        band
            In the unit of the output, positive.
        """
        if not band > 0:
            raise InputError(f"the band is {band:g}; expected a positive number")
        return outward(self._first(band, lambda e: e.lower)[0], self._first(band, lambda e: e.upper)[1])

    def _first(self, band: float, end: Callable[[Interval], float]) -> tuple[float, float]:
        """The last t0 known with an end of E's interval beyond the band, and the next, within it; NaN if none is.

        The line through two t0 beyond the band says where it is reached, and twice, four times ... as far ahead where
        it is not yet. From a t0 within the band it is a quarter of the way back.
        """
        if end(self.at(-1)) <= band:
            return 0.0, 0.0
        beyond, error, within, tried, ahead = -1, math.inf, self.last + 1, 0, 0.5
        while within - beyond > 1:
            found = end(self.at(tried))
            if found <= band:
                within, ahead = tried, 1.0
                tried -= max(1, (within - beyond) // 4)
            else:
                fall = (error - found) / (tried - beyond)
                way = ahead * (found - band) / fall if 0 < fall < math.inf else self.last / EVENLY
                beyond, error, ahead = tried, found, 2 * ahead
                tried += max(1, math.ceil(min(way, within - 1 - beyond)))
        return (self.start_s(beyond), self.start_s(within)) if within <= self.last else (math.nan, math.nan)

    @cached_property
    def _program(self) -> PeakProgram:
        steps = HORIZON * self.steps + SPARE
        return PeakProgram(self.plant, self.reference.exact_period_s * steps / self.steps, steps, periodic=False)


def harmonic(plant: PlantModel, reference: Reference) -> Reference:
    """The reference with frequencies that are multiples of the slowest; refuses what :func:`periodic_limit` does."""
    if plant.unstable_poles:
        fastest = max(pole.real for pole in plant.unstable_poles)
        raise InputError(
            f"the plant has a pole in the right half plane, of real part {fastest:.4g} rad/s; expected none, since the "
            "bounds do not hold for states that grow"
        )
    if not (plant.pole_modes or plant.real_poles or plant.integrators > 0):
        raise InputError(
            f"the plant is a constant gain of {plant.gain:.4g}, whose least error is |r| less that gain times the "
            "limit; expected a plant with a pole"
        )
    if reference.slope:
        raise InputError(f"the reference has the slope {reference.slope:g} a second; expected a periodic one")
    if not any(reference.omegas):
        raise InputError(
            "the reference is a constant, which has no period, and no error lasts if the limits exceed its steady "
            f"control of {reference.required(plant).value:.6g}; expected a frequency above 0 rad/s too"
        )
    slowest = min(omega for omega in reference.omegas if omega > 0)
    harmonics = [round(omega / slowest) for omega in reference.omegas]
    near = (abs(omega - k * slowest) <= SAME * omega for omega, k in zip(reference.omegas, harmonics, strict=True))
    if not all(near):
        said = ", ".join(f"{omega:.6g}" for omega in reference.omegas)
        raise InputError(f"the reference has the frequencies {said} rad/s; expected multiples of a slowest one above 0")
    return replace(reference, omegas=tuple(k * slowest for k in harmonics))


def finite_limits(plant: PlantModel, limits: float | Sequence[float]) -> tuple[float, float]:
    """The lower and the upper limit; refuses what :func:`periodic_limit` does."""
    low, high = limit_pair(limits)
    if not (math.isfinite(low) and math.isfinite(high)):
        raise InputError(f"the saturation limits are {low:g} and {high:g}; expected finite ones")
    if plant.integrators > 0 and not low < 0 < high:
        raise InputError(
            f"the saturation limits are {low:g} and {high:g}; expected a negative and a positive one for a plant "
            "with an integrator"
        )
    return low, high
