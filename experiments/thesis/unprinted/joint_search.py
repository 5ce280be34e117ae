"""The search for one limit and one initial output that give all the outcomes that chapter 4 prints."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from scipy.optimize import minimize

from experiments.runs.batch import Tick, threaded
from experiments.thesis.unprinted.chapter_4_conditions import Conditions, Point
from experiments.thesis.unprinted.printed_outcomes import CONVERGED_PERCENT, READINGS, Found, compared, printed_outcomes

STARTS = 3  # the best points of the grid from which the search goes on
EVALUATIONS = 40  # of one such search
SEARCHES = {"together": False, "together, converging": True}
"""What is searched for -> whether the error with anti-windup must converge to zero."""


class Joint(NamedTuple):
    """How near a point comes to all three outcomes.

    Parameters
    ----------
    miss
        The largest |computed/printed - 1| over the outcomes; infinite when one of them never happens.
    point
        Where.
    readings
        Of each outcome, in the order of :data:`experiments.thesis.unprinted.printed_outcomes.READINGS`.
    outcomes
        Of both loops.
    """

    miss: float
    point: Point
    readings: tuple[str, ...]
    outcomes: Mapping[str, float]


def judged(point: Point, outcomes: Mapping[str, float], converging: bool) -> Joint:
    """How near a point comes, each outcome in the reading that comes nearest.

    Parameters
    ----------
    point, outcomes
        As :meth:`experiments.thesis.unprinted.chapter_4_conditions.Conditions.both` gives them.
    converging
        Whether the error with anti-windup must converge to zero, as section 4.2 says of Fig. 4.3; where it does not,
        the miss is infinite.

    Notes
    -----
    The measure is our choice. Outcomes that are all within half a unit of their last digits miss by at most the
    greatest half_unit/printed, 0.125 for "around 4".
    """
    misses, readings = [], []
    for outcome, names in READINGS.items():
        sizes = {name: abs(outcomes[name] / printed_outcomes()[outcome].value - 1) for name in names}
        nearest = min(names, key=lambda name: sizes[name] if math.isfinite(sizes[name]) else math.inf)
        readings.append(nearest)
        misses.append(sizes[nearest])
    met = np.isfinite(misses).all() and (not converging or outcomes["final_error_percent"] < CONVERGED_PERCENT)
    return Joint(max(misses) if met else math.inf, point, tuple(readings), outcomes)


def nearest(one: Conditions, points: pd.DataFrame, converging: bool) -> Joint | None:
    """The limit and the initial output of the least miss under a condition.

    Parameters
    ----------
    one
        The condition.
    points
        Its rows of :func:`experiments.thesis.unprinted.search.grid_of`.
    converging
        See :func:`judged`.

    Returns
    -------
    Joint or None
        None when no point of the grid has all three outcomes.

    Notes
    -----
    From the best points of the grid Nelder and Mead's search goes on within the grid's bounds. What it finds is a
    local minimum; the outcomes jump.
    """
    rows = points.to_dict("records")
    every = [judged(Point(row["limit"], row["initial_output"]), row, converging) for row in rows]  # type: ignore[arg-type]
    best = sorted((joint for joint in every if math.isfinite(joint.miss)), key=lambda joint: joint[:2])[:STARTS]
    if not best:
        return None
    return min((_refined(one, start, points, converging) for start in best), key=lambda joint: joint[:2])


def _refined(one: Conditions, start: Joint, points: pd.DataFrame, converging: bool) -> Joint:
    shared = points[points.duplicated("limit", keep=False)]  # the grid's own, without what it was refined by
    axes = [np.unique(frame[name]) for frame, name in ((shared, "limit"), (points, "initial_output"))]
    seen = [start]

    def miss(x: np.ndarray) -> float:
        point = Point(*(float(np.clip(at, axis[0], axis[-1])) for at, axis in zip(x, axes, strict=True)))
        seen.append(judged(point, one.both(point), converging))
        return min(seen[-1].miss, 1e6)  # the search takes differences

    steps = [_spacing(axis, at) / 2 for axis, at in zip(axes, start.point, strict=True)]
    simplex = np.array(start.point) + np.array([[0.0, 0.0], [steps[0], 0.0], [0.0, steps[1]]])
    options: Any = {"maxfev": EVALUATIONS, "initial_simplex": simplex, "xatol": 1e-6, "fatol": 1e-4}
    minimize(miss, simplex[0], method="Nelder-Mead", options=options)
    return min(seen, key=lambda joint: joint[:2])


def _spacing(axis: np.ndarray, at: float) -> float:
    """The distance from a value of an axis to the next one, or from the last but one to the last."""
    place = min(int(np.searchsorted(axis, at)), len(axis) - 2)
    return float(axis[place + 1] - axis[place])


def together(conditions: Sequence[Conditions], points: pd.DataFrame, tick: Tick = lambda: None) -> pd.DataFrame:
    """For each of :data:`SEARCHES` and each condition the nearest that one limit and one initial output come.

    Parameters
    ----------
    conditions
        Parameter sets with delays.
    points
        Of :func:`experiments.thesis.unprinted.search.grid_of`.

    Returns
    -------
    DataFrame
        Three rows, one an outcome, for each: search, worst_miss (:attr:`Joint.miss`), final_error_percent, and the
        columns of :func:`experiments.thesis.unprinted.search.alone`, limit_low and limit_high being the limit where the
        outcome is met. Nothing for a condition under which the outcomes never happen together.
    """
    jobs = [(search, one) for search in SEARCHES for one in conditions]

    def search(job: tuple[str, Conditions]) -> Joint | None:
        name, one = job
        own = points[(points["set"] == one.set_name) & (points["delay"] == one.delay)]
        return nearest(one, own, SEARCHES[name])

    rows = []
    for (name, one), joint in zip(jobs, threaded(search, jobs, tick), strict=True):
        if joint is None:
            continue
        limit, output = joint.point
        for outcome, reading in zip(READINGS, joint.readings, strict=True):
            computed, number = joint.outcomes[reading], printed_outcomes()[outcome]
            edge = limit if abs(computed - number.value) <= number.half_unit else math.nan
            head = {"search": name, "outcome": outcome, "reading": reading}
            under = {"set": one.set_name, "delay": one.delay, "initial_output": output}
            misses = {"worst_miss": joint.miss, "final_error_percent": joint.outcomes["final_error_percent"]}
            rows.append(head | under | compared(outcome, Found(edge, edge, limit, computed)) | misses)
    return pd.DataFrame(rows)
