"""Fig. A.4: the error that no control under the same limits can better, and what the loops reach."""

from __future__ import annotations

import math
from collections.abc import Mapping
from itertools import combinations
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from paper_figures.axis_figures.limits import FLOOR, curves
from paper_figures.look import panels
from paper_figures.look.captions import at_least, at_most, number, only
from paper_figures.look.panels import CORRECTED, NONE, THESIS, Run
from paper_figures.look.style import FULL_WIDTH, LINES, styled

TABLES: tuple[str, ...] = (
    "limits_extended",
    "limits_extended_summary",
    "limits_delay_free",
    "limits_delay_free_summary",
)

RUNS = (NONE, THESIS, CORRECTED)
MARKERS = {"none": "^", "thesis": "s", "corrected": "o"}
ROOM = 1.04  # times the limit that tracking needs is the right end
MARGIN = 0.03  # of the axis, left of the first limit
POINTS = 40  # of the floor between two limits


def caption(tables: Mapping[str, pd.DataFrame]) -> str:
    """Return the caption with the numbers of the tables."""
    rest, periodic = (_chosen(tables, kind) for kind in ("extended", "delay_free"))
    best, none, thesis, corrected = (
        _after(rest[f"settling_{name}_s"]) for name in ("upper", *(run.name for run in RUNS))
    )
    peaks = [_reaches(periodic[f"peak_{run.name}"]) for run in RUNS]
    return (
        "Grey: errors that no control within +-L undercuts; some control reaches the line on it. "
        f"(a) With dead time, from rest, L = {number(rest['limit'])}: the largest error from "
        f"t0 on. It settles to 1 % {best} at best, {none} without anti-windup, {thesis} (thesis), {corrected} "
        f"(corrected). (b) Without dead time, last of twelve periods. At L = {number(periodic['limit'])} the least is "
        f"{at_least(periodic['periodic_lower'], 4)} to {at_most(periodic['periodic_upper'], 4)}; the loop without "
        f"anti-windup {peaks[0]}, {peaks[1]} (thesis), {peaks[2]} (corrected). Dashed: L = "
        f"{at_most(periodic['required'])}, needed to track."
    )


def _chosen(tables: Mapping[str, pd.DataFrame], kind: str) -> dict[str, float]:
    """The row of the limit that the summary is for."""
    table, limit = tables[f"limits_{kind}"], only(tables[f"limits_{kind}_summary"], "limit")
    nearest = int((table["limit"] - limit).abs().to_numpy().argmin())
    return {str(column): float(table[column].iloc[nearest]) for column in table}


def _after(time_s: float) -> str:
    return "never" if math.isnan(time_s) else f"after {number(time_s)} s"


def _reaches(peak: float) -> str:
    return "diverges" if math.isnan(peak) else f"leaves {number(peak)}"


@styled()
def draw(tables: Mapping[str, pd.DataFrame]) -> Figure:
    """Return the figure; (b) ends a little above the limit that perfect tracking needs."""
    axes = panels.lettered(FULL_WIDTH, 2.8, "ab")
    rest, periodic = tables["limits_extended_summary"], tables["limits_delay_free"]
    curves(axes["a"], rest, "start_s", "rest", {f"tail_{run.name}": LINES[run.kind] for run in RUNS})
    axes["a"].plot([], [], **FLOOR, label="best that was found")
    for run in RUNS:
        axes["a"].plot([], [], **LINES[run.kind], label=run.label)
    axes["a"].set(xlabel="Time $t_0$ [s]", ylabel=r"$\max_{t \geq t_0}\,|e(t)|$ [unit of $y$]")
    axes["a"].legend(**panels.ABOVE, ncols=2)

    dots = {f"peak_{run.name}": _dots(run) for run in RUNS}
    runs = periodic[["limit", *dots]]
    curves(axes["b"], _floor(periodic).merge(runs, "left", on="limit"), "limit", "periodic", dots)
    for run in RUNS:
        axes["b"].plot([], [], **_dots(run), label=run.label)
    required = only(periodic, "required")
    axes["b"].axvline(required, **LINES["reference"], label="needed to track")
    first, last = float(periodic["limit"].min()), float(periodic["limit"].max())
    right = max(min(last, ROOM * required), ROOM * first)
    axes["b"].set_xlim(first - MARGIN * (right - first), right)
    axes["b"].set(xlabel="Limit $L$ [unit of $u$]", ylabel=r"$\max\,|e(t)|$, last period [unit of $y$]")
    axes["b"].legend(**panels.ABOVE, ncols=2)
    figure = axes["a"].get_figure(root=True)
    assert figure is not None
    return figure


def _dots(run: Run) -> dict[str, Any]:
    """The look of a run at the limits that were computed, which nothing joins."""
    look = {"linestyle": "none", "marker": MARKERS[run.name], "markersize": 4.0}
    return {"color": LINES[run.kind]["color"], **look}


def _floor(table: pd.DataFrame) -> pd.DataFrame:
    """Both ends of the least error over the limit, between the limits of a table too.

    The least error v(L) is that of a convex problem whose constraints are linear in L, so v is convex: it lies on or
    below the chord between two limits, and on or above the same chord continued beyond them. It is zero at the limit
    that tracking needs.
    """
    needed = {"limit": only(table, "required"), "periodic_lower": 0.0, "periodic_upper": 0.0}
    rows = pd.concat([table[list(needed)], pd.DataFrame([needed])]).drop_duplicates("limit").sort_values("limit")
    limits, lowest, highest = rows.to_numpy(float).T
    at = np.unique(np.concatenate([limits, *np.linspace(limits[:-1], limits[1:], POINTS).T]))
    lower = np.zeros(len(at))
    for i, j in combinations(range(len(limits)), 2):
        width = limits[j] - limits[i]
        before = lowest[i] + (lowest[i] - highest[j]) / width * (limits[i] - at)
        after = lowest[j] + (lowest[j] - highest[i]) / width * (at - limits[j])
        lower = np.fmax(lower, np.where(at <= limits[i], before, np.where(at >= limits[j], after, 0.0)))
    upper = np.interp(at, limits, highest)
    return pd.DataFrame({"limit": at, "periodic_lower": lower, "periodic_upper": upper})
