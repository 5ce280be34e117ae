"""The smallest peak error that any controller, causal or not, can reach under a limited input, and what loops reach."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise

import numpy as np
import pandas as pd

from design.design_file import Design
from experiments.physical_limits.intervals import Interval, outward
from experiments.physical_limits.peak_program import REFINED, SPARE, PeakProgram
from experiments.runs.compare_anti_windups import SETTLED, loops, run_all
from experiments.runs.metrics import settling_time
from experiments.runs.references import Reference
from experiments.runs.steady_control import SAME
from identification.base.errors import InputError
from identification.model.plant import PlantModel

PERIODIC_STEPS = 400  # of a period
STEPS = 200  # of a period from rest, for E(t0)
FEWER_STEPS = 100  # of a period from rest, for the settling time alone
HORIZON = 3  # periods from rest
STARTS = 20  # most programs that trace E(t0)
FALL = 1.1  # E(t0) is traced further where it may fall by more than this
EVENLY = 16  # other t0 in a period
RUN_PERIODS = 12
SAMPLES_PER_PERIOD = 2000

NEVER = Interval(math.nan, math.nan)

Tick = Callable[[], object]


def periodic_limit(plant: PlantModel, reference: Reference, limit: float) -> Interval:
    """Enclose the least peak of |r - y| over all periodic u with |u| <= limit.

    Parameters
    ----------
    plant
        With a pole, and none in the right half plane. Its dead time only shifts u.
    reference
        Periodic: its frequencies, 0 apart, are multiples of the slowest one, whose period u has. What is a multiple to
        1e-9 of itself is taken as one.
    limit
        Of the actuator, in its unit, positive and finite.

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
    reference = _harmonic(plant, reference, limit)
    if reference.required(plant).at_most <= limit:
        return Interval(0.0, 0.0)
    return PeakProgram(plant, reference.exact_period_s, PERIODIC_STEPS, periodic=True).solve(reference, limit)


@dataclass(frozen=True)
class RestLimit:
    """E(t0): from rest at t = 0, u = 0 before, the least greatest |r(t) - y(t)| for t0 <= t <= horizon_s.

    Parameters
    ----------
    plant, reference, limit
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
    limit: float
    steps: int = STEPS
    tick: Tick = lambda: None
    _solved: dict[int, Interval] = field(default_factory=dict, init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "reference", _harmonic(self.plant, self.reference, self.limit))

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
            self._solved[index] = program.solve(self.reference, self.limit, index * program.part, self.plant.delay_s)
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
        return outward(self._first(lambda e: e.lower <= band)[0], self._first(lambda e: e.upper <= band)[1])

    def _first(self, inside: Callable[[Interval], bool]) -> tuple[float, float]:
        """Two neighbouring t0 between which a statement that stays true as E falls becomes so; NaN if it never does."""
        if inside(self.at(-1)):
            return 0.0, 0.0
        if not inside(self.at(self.last)):
            return math.nan, math.nan
        outside, found = -1, self.last
        while found - outside > 1:
            middle = (outside + found) // 2
            if inside(self.at(middle)):
                found = middle
            else:
                outside = middle
        return self.start_s(outside), self.start_s(found)

    @cached_property
    def _program(self) -> PeakProgram:
        steps = HORIZON * self.steps + SPARE
        return PeakProgram(self.plant, self.reference.exact_period_s * steps / self.steps, steps, periodic=False)


def limits_tables(
    design: Design, reference: Reference, limits: Sequence[float], tick: Tick = lambda: None
) -> dict[str, pd.DataFrame]:
    """What the runs without and with anti-windup leave to gain, under several limits.

    Parameters
    ----------
    design
        Of either kind.
    reference
        Periodic, see :func:`periodic_limit`.
    limits
        Of the actuator, +-limit each.
    tick
        Called after every program and after every set of runs.

    Returns
    -------
    dict
        ``limits_KIND``, a row for each limit, ascending: limit, required (the most that the control of perfect
        tracking reaches), periodic_lower, periodic_upper; settling_lower_s, settling_upper_s (from rest, see
        :meth:`RestLimit.settling`, to within 1 % of the reference's amplitude); and for every run NAME peak_NAME
        (greatest |error| over the last of twelve periods), settling_NAME_s (to the same band), ratio_NAME (peak_NAME
        over periodic_lower). Cells are empty for what never settles, diverges, or would be divided by zero.
        ``limits_KIND_summary`` for the first limit: limit, start_s,
        rest_lower, rest_upper (see :class:`RestLimit`) and tail_NAME, the greatest |error| of the run from start_s
        to the horizon of three periods.

    Raises
    ------
    InputError
        A limit is not positive and finite, or see :func:`periodic_limit`.
    """
    plant, name = design.loop_plant, design.kind.replace("-", "_")
    required = reference.required(plant).value
    for limit in limits:
        _harmonic(plant, reference, limit)
    rest = RestLimit(plant, reference, limits[0], tick=tick)
    summary = rest.table().assign(limit=limits[0])
    evenly = np.linspace(0.0, RUN_PERIODS * reference.period_s, RUN_PERIODS * SAMPLES_PER_PERIOD + 1)
    time_s, every, rows = np.union1d(evenly, summary["start_s"]), loops(design, reference), []
    for limit in sorted(set(limits)):
        runs = run_all(every, limit, time_s)
        tick()
        errors = {run: np.abs(result.outputs["error"]) for run, result in runs.items()}
        rows.append({"limit": limit, "required": required} | _row(plant, reference, limit, time_s, errors, tick))
        if limit == limits[0]:
            counted = time_s <= rest.horizon_s
            for run, error in errors.items():
                tails = np.maximum.accumulate(error[counted][::-1])[::-1]
                summary[f"tail_{run}"] = tails[np.searchsorted(time_s, summary["start_s"])]
    return {f"limits_{name}": pd.DataFrame(rows), f"limits_{name}_summary": summary}


def _row(
    plant: PlantModel,
    reference: Reference,
    limit: float,
    time_s: np.ndarray,
    errors: Mapping[str, np.ndarray],
    tick: Tick,
) -> dict[str, float]:
    band, periodic, settled = SETTLED * reference.amplitude, periodic_limit(plant, reference, limit), NEVER
    tick()
    if periodic.lower <= band:
        settled = RestLimit(plant, reference, limit, FEWER_STEPS, tick).settling(band)
    row = {"periodic_lower": periodic.lower, "periodic_upper": periodic.upper}
    row |= {"settling_lower_s": settled.lower, "settling_upper_s": settled.upper}
    for run, error in errors.items():
        row[f"peak_{run}"] = peak = float(error[time_s >= time_s[-1] - reference.period_s].max())
        row[f"settling_{run}_s"] = settling_time(time_s, error, band) if peak <= band else math.nan
        row[f"ratio_{run}"] = peak / periodic.lower if periodic.lower > 0 else math.nan
    return row


def _harmonic(plant: PlantModel, reference: Reference, limit: float) -> Reference:
    """The reference with frequencies that are multiples of the slowest; refuses what :func:`periodic_limit` does."""
    if plant.unstable_poles:
        fastest = max(pole.real for pole in plant.unstable_poles)
        raise InputError(
            f"the plant has a pole in the right half plane, of real part {fastest:.4g} rad/s; expected none, since no "
            "bound here holds for states that grow"
        )
    if not (plant.pole_modes or plant.real_poles or plant.integrators > 0):
        raise InputError(
            f"the plant is the gain {plant.gain:.4g}, whose least error is the largest |r| less {abs(plant.gain):.4g} "
            "times the limit; expected a plant with a pole"
        )
    if reference.slope:
        raise InputError(f"the reference has the slope {reference.slope:g} a second; expected a periodic one")
    slowest = min((omega for omega in reference.omegas if omega > 0), default=math.inf)
    harmonics = [round(omega / slowest) for omega in reference.omegas]
    near = (abs(omega - k * slowest) <= SAME * omega for omega, k in zip(reference.omegas, harmonics, strict=True))
    if not math.isfinite(slowest) or not all(near):
        said = ", ".join(f"{omega:.6g}" for omega in reference.omegas)
        raise InputError(f"the reference has the frequencies {said} rad/s; expected multiples of a slowest one above 0")
    if not (math.isfinite(limit) and limit > 0):
        raise InputError(f"the limit is {limit:g}; expected a positive finite number")
    return replace(reference, omegas=tuple(k * slowest for k in harmonics))
