"""The search over the conditions of :mod:`experiments.thesis.unprinted.wide_conditions`."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from itertools import product
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from scipy.optimize import minimize
from scipy.stats import qmc

from experiments.runs.batch import Each, threaded
from experiments.thesis.unprinted.joint_search import least_miss, nearest_readings
from experiments.thesis.unprinted.printed_outcomes import (
    CONVERGED_PERCENT,
    COUNTED_FROM_THE_END,
    READINGS,
    printed_outcomes,
)
from experiments.thesis.unprinted.wide_conditions import CASES, Case

COVERING = 10  # log2 of the number of points that cover each case
STARTS = 5  # of these points, from which the search goes on
EVALUATIONS = 60  # of one such search, for each condition that is searched
FIRST_STEP = 0.05  # of it, as a share of each range
COUNTED = {"start": READINGS, "end of saturation": COUNTED_FROM_THE_END}
"""From when 4.46 s are counted -> the readings."""

_MOST = 1e6  # stands for an infinite miss: the search takes differences
_PERCENT = 0.1  # of miss, for each percent of the amplitude by which the last error exceeds what has converged


class Wanted(NamedTuple):
    """From when 4.46 s are counted, a key of :data:`COUNTED`, and whether the error must converge to zero."""

    counted_from: str
    converging: bool


EVERY_WANTED = tuple(Wanted(*pair) for pair in product(COUNTED, (True, False)))


class Tried(NamedTuple):
    """A point of a case: the shares (a,) of the ranges of its axes, its values, and what it comes to.

    ``outcomes`` are of both loops, or of the one without anti-windup alone.
    """

    shares: np.ndarray
    values: Mapping[str, float]
    outcomes: Mapping[str, float]

    def miss(self, wanted: Wanted) -> float:
        """The largest |computed/printed - 1|, of what has been computed; infinite where an outcome never happens.

        Where the error should converge and does not, a tenth is added for each percent that it is too large.
        """
        miss = max(miss for miss, _ in nearest_readings(self.outcomes, COUNTED[wanted.counted_from]))
        excess = self.outcomes.get("final_error_percent", 0.0) - CONVERGED_PERCENT
        return miss + _PERCENT * max(excess, 0.0) if wanted.converging and math.isfinite(miss) else miss

    @property
    def complete(self) -> bool:
        """Whether both loops have been run."""
        return "final_error_percent" in self.outcomes


def tried(case: Case, shares: np.ndarray, most: float) -> Tried:
    """Run the loop without anti-windup, and the other one where the first misses by less than ``most``."""
    values = {axis.name: axis.at(share) for axis, share in zip(case.axes, shares, strict=True)}
    found = case.outcomes("none", values)
    near = least_miss(found) < most
    return Tried(shares, values, found | (case.outcomes("thesis", values) if near else {}))


def _covering(job: tuple[Case, np.ndarray]) -> Tried:
    return tried(*job, most=1.0)


def _refined(job: tuple[Case, Wanted, Tried]) -> Tried:
    """The nearest that Nelder and Mead's search finds from a point within the ranges: a local minimum."""
    case, wanted, best = job

    def miss(shares: np.ndarray) -> float:
        nonlocal best
        point = tried(case, np.clip(shares, 0.0, 1.0), best.miss(wanted))
        if point.complete:
            best = min(best, point, key=lambda point: point.miss(wanted))
        return min(point.miss(wanted), _MOST)

    first = best.shares
    simplex = np.vstack([first, first + np.diag(np.where(first < 0.5, FIRST_STEP, -FIRST_STEP))])
    options: Any = {
        "maxfev": EVALUATIONS * len(first),
        "initial_simplex": simplex,
        "xatol": 1e-7,
        "fatol": 1e-5,
        "adaptive": True,
    }
    minimize(miss, first, method="Nelder-Mead", options=options)
    return best


def wide_conditions_table(cases: Sequence[Case] = CASES, each: Each = threaded) -> pd.DataFrame:
    """For each case the nearest that one point comes to all that chapter 4 prints.

    Parameters
    ----------
    cases
        The first has the axes that all have.
    each
        Where the pieces of work are done.

    Returns
    -------
    DataFrame
        A row for each case, from when 4.46 s are counted, and whether the error must converge: case, counted_from,
        converging (0 or 1), worst_miss (the largest |computed/printed - 1|), final_error_percent, error, desaturation
        and recovery, each with its reading and whether it is met (0 or 1), and the values of the axes, empty for those
        of other cases. No row where no such point has been found.

    Notes
    -----
    Each case is covered by a Sobol sequence; the loop with anti-windup is run where the loop without misses by less
    than 100 %. Nelder and Mead's search goes on from the nearest of these points, and, in all cases but the first, from
    the first one's nearest. A run without anti-windup that misses by more than the nearest so far spares the run with.
    """
    for case in cases:
        _ = case.axes, case.moved  # before the threads ask for them
    sobol = {case: qmc.Sobol(len(case.axes), scramble=False).random_base2(COVERING) for case in cases}
    jobs = [(case, shares) for case in cases for shares in sobol[case]]
    covered: dict[Case, list[Tried]] = {case: [] for case in cases}
    for (case, _), point in zip(jobs, each(_covering, jobs), strict=True):
        covered[case].append(point)
    found = {cases[0]: _searched(cases[0], covered[cases[0]], each)}
    for case in cases[1:]:
        shared = [tried(case, _widened(case, point.shares), math.inf) for point in found[cases[0]].values()]
        found[case] = _searched(case, covered[case] + shared, each)
    rows = [
        _row(case, wanted, point)
        for case, best in found.items()
        for wanted, point in best.items()
        if not wanted.converging or point.outcomes["final_error_percent"] < CONVERGED_PERCENT
    ]
    return pd.DataFrame(rows)


def _widened(case: Case, shares: np.ndarray) -> np.ndarray:
    """The same upper limit and y(0) with what a case adds: an equal lower limit, the middle of every other range."""
    added = [shares[0] if name == "lower" else 0.5 for name in case.added]
    return np.append(shares, added)


def _searched(case: Case, points: Sequence[Tried], each: Each) -> dict[Wanted, Tried]:
    """The nearest point in each sense; in that which demands no convergence also what the other has found."""
    complete = [point for point in points if point.complete]
    starts = []
    for wanted in EVERY_WANTED:
        near = sorted((point.miss(wanted), place) for place, point in enumerate(complete))
        starts += [(case, wanted, complete[place]) for miss, place in near[:STARTS] if math.isfinite(miss)]
    best: dict[Wanted, Tried] = {}
    for (_, demanded, _), point in zip(starts, each(_refined, starts), strict=True):
        for wanted in (demanded, demanded._replace(converging=False)):
            best[wanted] = min(best.get(wanted, point), point, key=lambda point: point.miss(wanted))
    return best


def _row(case: Case, wanted: Wanted, point: Tried) -> dict[str, object]:
    found = nearest_readings(point.outcomes, COUNTED[wanted.counted_from])
    row: dict[str, object] = {
        "case": case.name,
        "counted_from": wanted.counted_from,
        "converging": int(wanted.converging),
        "worst_miss": max(miss for miss, _ in found),
        "final_error_percent": point.outcomes["final_error_percent"],
    }
    for outcome, (_, reading) in zip(READINGS, found, strict=True):
        computed, number = point.outcomes[reading], printed_outcomes()[outcome]
        met = int(abs(computed - number.value) <= number.half_unit)
        row |= {outcome: computed, f"{outcome}_reading": reading, f"{outcome}_met": met}
    return row | dict(point.values)
