"""The search for one limit and one initial output that give all the outcomes that chapter 4 prints."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from itertools import product
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from scipy.optimize import minimize

from experiments.runs.batch import Each, threaded
from experiments.thesis.unprinted.chapter_4_conditions import Conditions, Point
from experiments.thesis.unprinted.printed_outcomes import CONVERGED_PERCENT, READINGS, printed_outcomes
from experiments.thesis.unprinted.where_met import Found, compared

STARTS = 3  # the best initial outputs of the grid, from which the search goes on
EVALUATIONS = 30  # of one such search
SEARCHES = {"together": False, "together, converging": True}
"""What is searched for -> whether the error with anti-windup must converge to zero."""

Readings = Mapping[str, tuple[str, ...]]  # of each outcome

_MOST = 1e6  # stands for an infinite miss: the search takes differences


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


Start = tuple[Conditions, Joint, list[np.ndarray], bool]  # with the grid's limits and outputs, and whether to converge


def judged(point: Point, outcomes: Mapping[str, float], converging: bool, readings: Readings = READINGS) -> Joint:
    """How near a point comes, each outcome in the reading that comes nearest.

    Parameters
    ----------
    point, outcomes
        As :meth:`experiments.thesis.unprinted.chapter_4_conditions.Conditions.both` gives them.
    converging
        Whether the error with anti-windup must converge to zero, as section 4.2 says of Fig. 4.3; where it does not,
        the miss is infinite.
    readings
        Of each outcome.

    Notes
    -----
    The measure is our choice. Outcomes that are all within half a unit of their last digits miss by at most the
    greatest half_unit/printed, 0.125 for "around 4".
    """
    found = nearest_readings(outcomes, readings)
    worst = max(miss for miss, _ in found)
    met = not converging or outcomes["final_error_percent"] < CONVERGED_PERCENT
    return Joint(worst if met else math.inf, point, tuple(reading for _, reading in found), outcomes)


def least_miss(outcomes: Mapping[str, float]) -> float:
    """What a point misses by at least, of which some outcomes have been computed."""
    return max(miss for miss, _ in nearest_readings(outcomes))


def nearest_readings(outcomes: Mapping[str, float], readings: Readings = READINGS) -> list[tuple[float, str]]:
    """Of each outcome that has been computed: by how much its nearest reading misses, and which that is."""
    found = []
    for outcome, names in readings.items():
        if names[0] in outcomes:
            misses = [abs(outcomes[name] / printed_outcomes()[outcome].value - 1) for name in names]
            found.append(
                min((math.inf if math.isnan(miss) else miss, name) for miss, name in zip(misses, names, strict=True))
            )
    return found


def _starts(one: Conditions, points: pd.DataFrame, converging: bool) -> list[Start]:
    """The best initial outputs of a grid, each with its best limit; none where no point has all three outcomes."""
    best: dict[float, Joint] = {}  # of each initial output
    for row in points.to_dict("records"):
        joint = judged(Point(row["limit"], row["initial_output"]), row, converging)  # type: ignore[arg-type]
        best[joint.point.output] = min(joint, best.get(joint.point.output, joint), key=lambda joint: joint[:2])
    starts = sorted((joint for joint in best.values() if math.isfinite(joint.miss)), key=lambda joint: joint[:2])
    shared = points[points.duplicated("limit", keep=False)]  # the grid's own, without what it was refined by
    axes = [np.unique(frame[name]) for frame, name in ((shared, "limit"), (points, "initial_output"))]
    return [(one, start, axes, converging) for start in starts[:STARTS]]


def _refined(start: Start) -> Joint:
    """The nearest that Nelder and Mead's search finds from a point within the bounds of its grid: a local minimum."""
    one, first, axes, converging = start
    best = first

    def miss(x: np.ndarray) -> float:
        nonlocal best
        point = Point(*(float(np.clip(at, axis[0], axis[-1])) for at, axis in zip(x, axes, strict=True)))
        outcomes = one.outcomes("none", point)
        least = least_miss(outcomes)
        if least >= best.miss:  # whatever the other loop comes to, the point is no better
            return min(least, _MOST)
        joint = judged(point, outcomes | one.outcomes("thesis", point), converging)
        best = min(best, joint, key=lambda joint: joint[:2])
        return min(joint.miss, _MOST)

    steps = [_spacing(axis, at) / 2 for axis, at in zip(axes, first.point, strict=True)]
    simplex = np.array(first.point) + np.array([[0.0, 0.0], [steps[0], 0.0], [0.0, steps[1]]])
    options: Any = {"maxfev": EVALUATIONS, "initial_simplex": simplex, "xatol": 1e-6, "fatol": 1e-4}
    minimize(miss, simplex[0], method="Nelder-Mead", options=options)
    return best


def _spacing(axis: np.ndarray, at: float) -> float:
    """The distance from a value of an axis to the next one, or from the last but one to the last."""
    place = min(int(np.searchsorted(axis, at)), len(axis) - 2)
    return float(axis[place + 1] - axis[place])


def together(conditions: Sequence[Conditions], points: pd.DataFrame, each: Each = threaded) -> pd.DataFrame:
    """For each of :data:`SEARCHES` and each condition the nearest that one limit and one initial output come.

    Parameters
    ----------
    conditions
        Parameter sets with delays.
    points
        Of :func:`experiments.thesis.unprinted.search.grid_of`, with the exact dead time.

    Returns
    -------
    DataFrame
        Three rows, one an outcome, for each: search, worst_miss (:attr:`Joint.miss`), final_error_percent, and the
        columns of :func:`experiments.thesis.unprinted.search.alone`, limit_low and limit_high being the limit where the
        outcome is met. Nothing for a condition under which the outcomes never happen together.

    Notes
    -----
    With the exact dead time Nelder and Mead's search goes on from the best initial outputs of the grid. What it finds
    is a local minimum; the outcomes jump. With Pade's approximation the outcomes are those at the point that the exact
    dead time has found.
    """
    starts: dict[tuple[str, str], list[Start]] = {}
    for (name, converging), one in product(SEARCHES.items(), conditions):
        own = points[points["set"] == one.set_name]
        if one.delay == "exact":
            starts[name, one.set_name] = _starts(one, own, converging)
    refined = iter(each(_refined, [start for several in starts.values() for start in several]))
    found = {
        key: min((next(refined) for _ in several), key=lambda joint: joint[:2])
        for key, several in starts.items()
        if several
    }
    rows = []
    for name, one in product(SEARCHES, conditions):
        if (name, one.set_name) in found:
            joint = found[name, one.set_name]
            if one.delay != "exact":
                joint = judged(joint.point, one.both(joint.point), converging=False)
            rows += _rows(name, one, joint)
    return pd.DataFrame(rows)


def _rows(search: str, one: Conditions, joint: Joint) -> list[dict[str, object]]:
    limit, output = joint.point
    rows = []
    for outcome, reading in zip(READINGS, joint.readings, strict=True):
        computed, number = joint.outcomes[reading], printed_outcomes()[outcome]
        edge = limit if abs(computed - number.value) <= number.half_unit else math.nan
        head = {"search": search, "outcome": outcome, "reading": reading}
        under = {"set": one.set_name, "delay": one.delay, "initial_output": output}
        misses = {"worst_miss": joint.miss, "final_error_percent": joint.outcomes["final_error_percent"]}
        rows.append(head | under | compared(outcome, Found(edge, edge, limit, computed)) | misses)
    return rows
