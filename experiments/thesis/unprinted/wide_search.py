"""The search over the conditions of :mod:`experiments.thesis.unprinted.wide_conditions`."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from scipy.optimize import minimize
from scipy.stats import qmc

from experiments.runs.batch import Each, threaded
from experiments.thesis.unprinted.joint_search import least_miss, nearest_readings
from experiments.thesis.unprinted.printed_outcomes import CONVERGED_PERCENT, READINGS, printed_outcomes
from experiments.thesis.unprinted.wide_conditions import CASES, Case

COVERING = 9  # log2 of the number of points that cover each case
STARTS = 5  # of these points, from which the search goes on
EVALUATIONS = 60  # of one such search, for each condition that is searched
FIRST_STEP = 0.05  # of such a search, as a share of each range

_MOST = 1e6  # stands for an infinite miss: the search takes differences
_PERCENT = 0.1  # of miss, for each percent of the amplitude by which the last error exceeds what has converged


class Tried(NamedTuple):
    """A point of a case: the shares (a,) of the ranges of its axes, its values, and what it comes to.

    ``outcomes`` are of both loops, or of the one without anti-windup alone.
    """

    case: Case
    shares: np.ndarray
    values: Mapping[str, float]
    outcomes: Mapping[str, float]

    def miss(self, converging: bool) -> float:
        """The largest |computed/printed - 1|, of what has been computed; infinite where an outcome never happens.

        Where the error should converge and does not, a tenth is added for each percent that it is too large.
        """
        miss = max(miss for miss, _ in nearest_readings(self.outcomes, self.case.readings))
        excess = self.outcomes.get("final_error_percent", 0.0) - CONVERGED_PERCENT
        return miss + _PERCENT * max(excess, 0.0) if converging and math.isfinite(miss) else miss

    @property
    def complete(self) -> bool:
        """Whether both loops have been run."""
        return "final_error_percent" in self.outcomes


def tried(case: Case, shares: np.ndarray, most: float) -> Tried:
    """Run the loop without anti-windup, and the other one where the first misses by less than ``most``."""
    values = {axis.name: axis.at(share) for axis, share in zip(case.axes, shares, strict=True)}
    found = case.outcomes("none", values)
    near = least_miss(found) < most
    return Tried(case, shares, values, found | (case.outcomes("thesis", values) if near else {}))


def wide_conditions_table(cases: Sequence[Case] | None = None, each: Each = threaded) -> pd.DataFrame:
    """For each case the nearest that one point comes to all that chapter 4 prints.

    Parameters
    ----------
    cases
        :data:`CASES` unless given; the first has the axes that all have.
    each
        Where the pieces of work are done.

    Returns
    -------
    DataFrame
        Two rows for each case: case, converging (1: the error with anti-windup must converge to zero), worst_miss (the
        largest |computed/printed - 1|), final_error_percent, error, desaturation and recovery, each with its reading
        and whether it is met (0 or 1), and the values of the axes, empty for those of other cases. A row is missing
        where no such point has been found.

    Notes
    -----
    A Sobol sequence covers each case; the loop with anti-windup is run where the loop without misses by less than
    100 %. Nelder and Mead's search goes on from the nearest of these points, and from the nearest of the first case. It
    spares the run with anti-windup where the run without misses by more than the nearest point so far. What it finds is
    a local minimum.
    """
    rows, first = [], list[Tried]()
    for case in CASES if cases is None else cases:
        best = _searched(case, first, each)
        first = first or list(best.values())
        rows += [_row(point, converging) for converging, point in best.items()]
    table = pd.DataFrame(rows)
    return table[(table["converging"] == 0) | (table["final_error_percent"] < CONVERGED_PERCENT)]


def _searched(case: Case, first: Sequence[Tried], each: Each) -> dict[bool, Tried]:
    """The nearest point whose error converges, and the nearest one of all."""
    _ = case.axes, case.prepared  # before the threads ask for them
    covering = qmc.Sobol(len(case.axes), scramble=False).random_base2(COVERING)
    jobs = [(case, shares, 1.0) for shares in covering]
    jobs += [(case, _widened(case, point.shares), math.inf) for point in first]
    points = [point for point in each(_tried, jobs) if point.complete]
    starts = []
    for converging in (True, False):
        near = sorted((point.miss(converging), place) for place, point in enumerate(points))
        starts += [(points[place], converging) for miss, place in near[:STARTS] if math.isfinite(miss)]
    best: dict[bool, Tried] = {}
    for (_, demanded), point in zip(starts, each(_refined, starts), strict=True):
        for converging in {demanded, False}:
            best[converging] = min(best.get(converging, point), point, key=lambda point: point.miss(converging))
    return best


def _widened(case: Case, shares: np.ndarray) -> np.ndarray:
    """The same upper limit and y(0) with what a case adds: an equal lower limit, the middle of every other range."""
    return np.append(shares, [shares[0] if name == "lower" else 0.5 for name in case.added])


def _tried(job: tuple[Case, np.ndarray, float]) -> Tried:
    return tried(*job)


def _refined(start: tuple[Tried, bool]) -> Tried:
    """The nearest that Nelder and Mead's search finds from a point within the ranges."""
    best, converging = start

    def miss(shares: np.ndarray) -> float:
        nonlocal best
        point = tried(best.case, np.clip(shares, 0.0, 1.0), best.miss(converging))
        if point.complete:
            best = min(best, point, key=lambda point: point.miss(converging))
        return min(point.miss(converging), _MOST)

    first = best.shares
    simplex = np.vstack([first, first + np.diag(np.where(first < 0.5, FIRST_STEP, -FIRST_STEP))])
    ends = {"maxfev": EVALUATIONS * len(first), "xatol": 1e-7, "fatol": 1e-5}
    options: Any = ends | {"initial_simplex": simplex, "adaptive": True}
    minimize(miss, first, method="Nelder-Mead", options=options)
    return best


def _row(point: Tried, converging: bool) -> dict[str, object]:
    found = nearest_readings(point.outcomes, point.case.readings)
    row: dict[str, object] = {
        "case": point.case.name,
        "converging": int(converging),
        "worst_miss": max(miss for miss, _ in found),
        "final_error_percent": point.outcomes["final_error_percent"],
    }
    for outcome, (_, reading) in zip(READINGS, found, strict=True):
        computed, number = point.outcomes[reading], printed_outcomes()[outcome]
        met = int(abs(computed - number.value) <= number.half_unit)
        row |= {outcome: computed, f"{outcome}_reading": reading, f"{outcome}_met": met}
    return row | dict(point.values)
