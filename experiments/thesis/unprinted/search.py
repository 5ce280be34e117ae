"""The search for what chapter 4 does not print, its limits and its initial output, by the outcomes that it prints."""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Callable, Sequence
from itertools import pairwise, product
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from scipy.optimize import brentq

from experiments.runs.batch import Each, threaded
from experiments.thesis.unprinted.chapter_2_weights import delay_free_rows, delay_free_scan
from experiments.thesis.unprinted.chapter_4_conditions import DELAYS, SETS, Conditions, Point
from experiments.thesis.unprinted.joint_search import least_miss, together
from experiments.thesis.unprinted.printed_outcomes import CONVERGED_PERCENT, OUTCOMES, READINGS, printed_outcomes
from experiments.thesis.unprinted.where_met import Found, all_met, compared, where_met

Span = tuple[Conditions, Any, Any, Any]  # with an initial output and two (limit, offset)
Over = tuple[Conditions, float, list[float]]  # with an initial output and limits
Line = tuple[Conditions, str, Any, Any]  # with a kind of loop, an initial output, and limit -> outcomes
Outcomes = Callable[[tuple[Conditions, Point]], dict[str, float]]
BESIDE = 4e-5  # of a limit: farther than Pade's approximation moves where an outcome comes


class Grid(NamedTuple):
    """Where is searched; limits as multiples of the input that the reference takes, outputs as multiples of r(0).

    Parameters
    ----------
    scan
        Limits for each outcome alone.
    limits, outputs
        Limits and initial outputs for all outcomes together, two of each at least.
    """

    scan: np.ndarray
    limits: np.ndarray
    outputs: np.ndarray


def _both(job: tuple[Conditions, Point]) -> dict[str, float]:
    one, point = job
    return one.both(point)


def _both_if_near(job: tuple[Conditions, Point]) -> dict[str, float]:
    one, point = job
    found = one.outcomes("none", point)
    far = least_miss(found) > 1
    return found | (dict.fromkeys(OUTCOMES["thesis"], math.nan) if far else one.outcomes("thesis", point))


def usual_grid() -> Grid:
    """From 0.5 (alone) or 0.95 (together) to 4 times the input that the reference takes, and from -r(0) to 2 r(0).

    Above that input the limits crowd towards it: the nearer, the later the loop leaves saturation.
    """
    scan = np.concatenate([np.linspace(0.5, 0.995, 16), 1 + np.geomspace(1e-4, 0.3, 30), np.linspace(1.35, 4.0, 46)])
    limits = np.concatenate([[0.95, 0.99], 1 + np.geomspace(1e-3, 3.0, 10)])
    return Grid(scan, limits, np.linspace(-1.0, 2.0, 13))


def every_condition(sets: Sequence[str] = SETS, delays: Sequence[str] = DELAYS) -> list[Conditions]:
    """All parameter sets with all delays, their designs made."""
    conditions = [Conditions(name, delay) for name, delay in product(sets, delays)]
    for one in conditions:
        _ = one.required, one.loop("none", 0.0)  # before the threads ask for it
    return conditions


def scanned(conditions: Sequence[Conditions], limits: np.ndarray, each: Each = threaded) -> pd.DataFrame:
    """Every outcome over the limit, from y(0) = 0 and from y(0) = r(0).

    Parameters
    ----------
    conditions
        Parameter sets with delays.
    limits
        As multiples of the input that the reference takes.

    Returns
    -------
    DataFrame
        set, delay, required (the input that the reference takes), initial_output, limit, and a column for each
        outcome of :meth:`experiments.thesis.unprinted.chapter_4_conditions.Conditions.both`, empty for never; sorted by
        these.
    """
    lines = _lines(conditions, limits, np.array([0.0, 1.0]))
    return _explored(lines, each(_never_reached, lines), each)


def grid_of(conditions: Sequence[Conditions], grid: Grid, each: Each = threaded) -> pd.DataFrame:
    """The same at each limit and initial output, with anti-windup where the loop without it misses by 100 % at most."""
    lines = _lines(conditions, grid.limits, grid.outputs)
    return _explored(lines, [math.inf] * len(lines), each, _both_if_near)


def _lines(conditions: Sequence[Conditions], limits: np.ndarray, outputs: np.ndarray) -> list[Over]:
    """Each condition from each initial output, with the limits in the actuator's unit."""
    return [
        (one, float(part * one.initial_reference), [float(limit) for limit in limits * one.required])
        for one, part in product(conditions, outputs)
    ]


def _explored(lines: Sequence[Over], free: Sequence[float], each: Each, work: Outcomes = _both) -> pd.DataFrame:
    """The outcomes at the limits of each line, and where between two limits the lasting offset passes zero.

    The error converges to zero only there, on intervals that a grid would miss. Wider limits than that of ``free``, of
    each line a limit that is never reached, make the same run.
    """
    jobs = [(one, Point(limit, output)) for one, output, own in lines for limit in own]
    runs = [
        (one, Point(min(limit, least), output))
        for (one, output, own), least in zip(lines, free, strict=True)
        for limit in own
    ]
    different = list(dict.fromkeys(runs))
    outcomes = dict(zip(different, each(work, different), strict=True))
    table = _table(jobs, [outcomes[run] for run in runs])
    spans: list[Span] = [
        (one, output, low, high)
        for one in dict.fromkeys(one for one, _, _ in lines)
        for output, rows in _of(table, one).groupby("initial_output")
        for low, high in pairwise(rows[["limit", "final_offset_percent"]].itertuples(index=False, name=None))
        if low[1] * high[1] < 0 and max(abs(low[1]), abs(high[1])) > CONVERGED_PERCENT
    ]
    found = each(_converging, spans)
    return pd.concat([table, _table(found, each(_both, found))], ignore_index=True).sort_values(
        ["set", "delay", "initial_output", "limit"], ignore_index=True
    )


def _never_reached(line: Over) -> float:
    """The least of some limits that the control from an initial output never reaches, infinite where it reaches all.

    Any wider limit makes the same run, with anti-windup or without.
    """
    one, output, limits = line

    def is_free(limit: float) -> bool:
        return one.outcomes("none", Point(limit, output))["desaturation_s"] == 0

    ordered = sorted(limits)
    return ordered[bisect_left(ordered, True, key=is_free)] if is_free(ordered[-1]) else math.inf


def _converging(span: Span) -> tuple[Conditions, Point]:
    """Between two (limit, offset) of unlike signs: where the error converges to zero, or as near as 1e-6 comes."""
    one, output, low, high = span
    known = dict((low, high))

    def offset(limit: float) -> float:
        if limit not in known:
            known[limit] = one.outcomes("thesis", Point(limit, output))["final_offset_percent"]
        near = CONVERGED_PERCENT / 2
        return 0.0 if abs(known[limit]) < near else float(np.clip(known[limit], -8 * near, 8 * near))

    return one, Point(float(brentq(offset, low[0], high[0], xtol=1e-6 * high[0])), output)


def _of(table: pd.DataFrame, one: Conditions) -> pd.DataFrame:
    return table[(table["set"] == one.set_name) & (table["delay"] == one.delay)]


def _table(jobs: Sequence[tuple[Conditions, Point]], rows: Sequence[dict[str, float]]) -> pd.DataFrame:
    head = [
        {
            "set": one.set_name,
            "delay": one.delay,
            "required": one.required,
            "initial_output": point.output,
            "limit": point.limit,
        }
        for one, point in jobs
    ]
    return pd.DataFrame([first | row for first, row in zip(head, rows, strict=True)])


def alone(conditions: Sequence[Conditions], scan: pd.DataFrame, each: Each = threaded) -> pd.DataFrame:
    """For each outcome, reading, condition and initial output of a scan: the limits that give it, or come nearest.

    Returns
    -------
    DataFrame
        A row for each interval of the limit: outcome, reading, printed, tolerance, set, delay, initial_output,
        limit_low, limit_high (empty: there is none), limit (the closest), computed (both empty: it never happens), miss
        (computed - printed), met (0 or 1).
    """
    jobs: list[Line] = [
        (one, kind, output, rows.drop_duplicates("limit").set_index("limit")[list(names)].to_dict("index"))
        for one in conditions
        for output, rows in _of(scan, one).groupby("initial_output")
        for kind, names in OUTCOMES.items()
    ]
    return pd.DataFrame([row for rows in each(_found_on, jobs) for row in rows])


def _found_on(line: Line) -> list[dict[str, Any]]:
    """The rows of :func:`alone` for a loop from one initial output."""
    one, kind, output, known = line

    def run(limit: float) -> dict[str, float]:
        return one.outcomes(kind, Point(limit, output))

    readings = [(outcome, name) for outcome, names in READINGS.items() for name in names if name in OUTCOMES[kind]]
    return [
        _row(one, outcome, reading, output, found)
        for outcome, reading, intervals in all_met(run, known, readings)
        for found in intervals
    ]


def _row(one: Conditions, outcome: str, reading: str, output: float, found: Found) -> dict[str, Any]:
    under = {"set": one.set_name, "delay": one.delay, "initial_output": output}
    return {"outcome": outcome, "reading": reading} | under | compared(outcome, found)


def approximated(conditions: Sequence[Conditions], exact: pd.DataFrame, each: Each = threaded) -> pd.DataFrame:
    """Where Pade's approximation moves what the exact dead time gives.

    Parameters
    ----------
    conditions
        Parameter sets with Pade's approximation.
    exact
        Of :func:`alone` for the same sets with the exact dead time.

    Returns
    -------
    DataFrame
        For each row of ``exact`` what is found within :data:`BESIDE` of its interval; or, where it has none, what its
        limit gives.
    """
    jobs = [(one, row) for one in conditions for row in exact[exact["set"] == one.set_name].to_dict("records")]
    return pd.DataFrame([row for rows in each(_found_beside, jobs) for row in rows])


def _found_beside(job: tuple[Conditions, Any]) -> list[dict[str, Any]]:
    one, row = job
    outcome, reading, output, limit = (row[name] for name in ("outcome", "reading", "initial_output", "limit"))
    kind = "thesis" if reading in OUTCOMES["thesis"] else "none"

    def read(limit: float) -> float:
        return one.outcomes(kind, Point(limit, output))[reading]

    if not row["met"]:
        found = Found(math.nan, math.nan, limit, math.nan if math.isnan(limit) else read(limit))
        return [_row(one, outcome, reading, output, found)]
    limits = [row["limit_low"] * (1 - BESIDE), limit, row["limit_high"] * (1 + BESIDE)]
    intervals = where_met(read, limits, [read(limit) for limit in limits], printed_outcomes()[outcome])
    return [_row(one, outcome, reading, output, found) for found in intervals]


def conditions_tables(
    grid: Grid | None = None, conditions: Sequence[Conditions] | None = None, each: Each = threaded
) -> dict[str, pd.DataFrame]:
    """Search chapter 4's and chapter 2's conditions that are not printed.

    Parameters
    ----------
    grid
        :func:`usual_grid` unless given.
    conditions
        All four unless given.
    each
        Where the pieces of work are done.

    Returns
    -------
    dict
        ``conditions``: case ("extended" or "delay_free") and the columns of :func:`scanned` and of
        :func:`experiments.thesis.unprinted.chapter_2_weights.delay_free_scan`; a cell is empty for what never happens
        and for what is of the other case. ``conditions_summary``: search ("alone", "together", "together, converging"
        or "weights"), the columns of :func:`alone` and :func:`together`, and ``weights``; see
        :func:`experiments.thesis.unprinted.chapter_2_weights.delay_free_rows` for chapter 2.
    """
    grid = grid or usual_grid()
    conditions = every_condition() if conditions is None else conditions
    exact, pade = ([one for one in conditions if one.delay == delay] for delay in DELAYS)
    scan = scanned(exact, grid.scan, each)
    separate = alone(exact, scan, each)
    if pade:
        scan = pd.concat([scan, scanned(pade, grid.scan[::3], each)], ignore_index=True)
        separate = pd.concat([separate, approximated(pade, separate, each)], ignore_index=True)
    joint = together(conditions, grid_of(exact, grid, each), each)
    sets = list(dict.fromkeys(one.set_name for one in conditions))
    chapter_2 = delay_free_scan(sets, each=each)
    summary = pd.concat([separate.assign(search="alone"), joint, delay_free_rows(sets, chapter_2)], ignore_index=True)
    columns = ["search", *(name for name in summary if name != "search")]
    both = pd.concat([scan.assign(case="extended"), chapter_2.assign(case="delay_free")], ignore_index=True)
    return {
        "conditions": both[["case", *(name for name in both if name != "case")]],
        "conditions_summary": summary[columns],
    }
