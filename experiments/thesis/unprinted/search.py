"""The search for what chapter 4 does not print, its limits and its initial output, by the outcomes that it prints."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise, product
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from scipy.optimize import brentq

from experiments.runs.batch import Tick, threaded
from experiments.thesis.unprinted.chapter_2_weights import delay_free_rows, delay_free_scan
from experiments.thesis.unprinted.chapter_4_conditions import DELAYS, SETS, Conditions, Point
from experiments.thesis.unprinted.joint_search import together
from experiments.thesis.unprinted.printed_outcomes import (
    CONVERGED_PERCENT,
    READINGS,
    Found,
    compared,
    printed_outcomes,
    where_met,
)

Span = tuple[Conditions, Any, Any, Any]  # with an initial output and two (limit, offset)


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


def usual_grid() -> Grid:
    """From 0.5 (alone) or 0.95 (together) to 4 times the input that the reference takes, and from -r(0) to 2 r(0).

    Above that input the limits crowd towards it: the nearer, the later the loop leaves saturation.
    """
    scan = np.concatenate([np.linspace(0.5, 0.995, 16), 1 + np.geomspace(1e-4, 0.3, 30), np.linspace(1.35, 4.0, 46)])
    limits = np.concatenate([[0.95, 0.98, 0.99, 0.998], 1 + np.geomspace(1e-3, 3.0, 14)])
    return Grid(scan, limits, np.linspace(-1.0, 2.0, 25))


def every_condition(sets: Sequence[str] = SETS, delays: Sequence[str] = DELAYS) -> list[Conditions]:
    """All parameter sets with all delays, their designs made."""
    conditions = [Conditions(name, delay) for name, delay in product(sets, delays)]
    for one in conditions:
        _ = one.required, one.loop("none", 0.0)  # before the threads ask for it
    return conditions


def scanned(conditions: Sequence[Conditions], grid: Grid, tick: Tick = lambda: None) -> pd.DataFrame:
    """Every outcome over the limit, from y(0) = 0 and from y(0) = r(0).

    Returns
    -------
    DataFrame
        set, delay, required (the input that the reference takes), initial_output, limit, and a column for each
        outcome of :meth:`experiments.thesis.unprinted.chapter_4_conditions.Conditions.both`, empty for never; sorted by
        these.
    """
    return _explored(conditions, grid.scan, np.array([0.0, 1.0]), tick)


def grid_of(conditions: Sequence[Conditions], grid: Grid, tick: Tick = lambda: None) -> pd.DataFrame:
    """Every outcome at every limit and initial output of a grid; the columns are those of :func:`scanned`."""
    return _explored(conditions, grid.limits, grid.outputs, tick)


def _explored(conditions: Sequence[Conditions], limits: np.ndarray, outputs: np.ndarray, tick: Tick) -> pd.DataFrame:
    """The outcomes at each limit and initial output, and where between two limits the lasting offset passes zero.

    The error converges to zero only there, on intervals that a grid would miss.
    """
    jobs = [
        (one, Point(float(share * one.required), float(part * one.initial_reference)))
        for one, part, share in product(conditions, outputs, limits)
    ]
    table = _table(jobs, threaded(_both, jobs, tick))
    spans: list[Span] = [
        (one, output, low, high)
        for one in conditions
        for output, rows in _of(table, one).groupby("initial_output")
        for low, high in pairwise(rows[["limit", "final_offset_percent"]].itertuples(index=False, name=None))
        if low[1] * high[1] < 0 and max(abs(low[1]), abs(high[1])) > CONVERGED_PERCENT
    ]
    found = threaded(_converging, spans, tick)
    return pd.concat([table, _table(found, threaded(_both, found, tick))], ignore_index=True).sort_values(
        ["set", "delay", "initial_output", "limit"], ignore_index=True
    )


def _both(job: tuple[Conditions, Point]) -> dict[str, float]:
    one, point = job
    return one.both(point)


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


def alone(conditions: Sequence[Conditions], scan: pd.DataFrame, tick: Tick = lambda: None) -> pd.DataFrame:
    """For each outcome, reading, condition and initial output of a scan: the limits that give it, or come nearest.

    Returns
    -------
    DataFrame
        A row for each interval of the limit: outcome, reading, printed, tolerance, set, delay, initial_output,
        limit_low, limit_high (empty: there is none), limit (the closest), computed (both empty: it never happens), miss
        (computed - printed), met (0 or 1).
    """
    jobs: list[tuple[Conditions, str, str, Any, pd.DataFrame]] = [
        (one, outcome, reading, output, rows)
        for one in conditions
        for output, rows in _of(scan, one).groupby("initial_output")
        for outcome, readings in READINGS.items()
        for reading in readings
    ]

    def search(job: tuple[Conditions, str, str, Any, pd.DataFrame]) -> list[Found]:
        one, outcome, reading, output, rows = job
        kind = "thesis" if outcome == "recovery" else "none"
        return where_met(
            lambda limit: one.outcomes(kind, Point(limit, output))[reading],
            rows["limit"].tolist(),
            rows[reading].tolist(),
            printed_outcomes()[outcome],
        )

    rows = []
    for (one, outcome, reading, output, _), intervals in zip(jobs, threaded(search, jobs, tick), strict=True):
        head = {"outcome": outcome, "reading": reading, "set": one.set_name, "delay": one.delay}
        rows += [head | {"initial_output": output} | compared(outcome, found) for found in intervals]
    return pd.DataFrame(rows)


def conditions_tables(
    grid: Grid | None = None, conditions: Sequence[Conditions] | None = None, tick: Tick = lambda: None
) -> dict[str, pd.DataFrame]:
    """Search chapter 4's and chapter 2's conditions that are not printed.

    Parameters
    ----------
    grid
        :func:`usual_grid` unless given.
    conditions
        All four unless given.
    tick
        Called after every piece of work.

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
    scan = scanned(conditions, grid, tick)
    separate = alone(conditions, scan, tick).assign(search="alone")
    joint = together(conditions, grid_of(conditions, grid, tick), tick)
    sets = list(dict.fromkeys(one.set_name for one in conditions))
    chapter_2 = delay_free_scan(sets, tick=tick)
    summary = pd.concat([separate, joint, delay_free_rows(sets, chapter_2, tick)], ignore_index=True)
    columns = ["search", *(name for name in summary if name != "search")]
    both = pd.concat([scan.assign(case="extended"), chapter_2.assign(case="delay_free")], ignore_index=True)
    return {
        "conditions": both[["case", *(name for name in both if name != "case")]],
        "conditions_summary": summary[columns],
    }
