"""Fig. A.8: the anti-windups of others beside the thesis's and the corrected one: recovery, control and guarantee."""

from __future__ import annotations

import math
from collections.abc import Mapping

import pandas as pd
from matplotlib.figure import Figure

from paper_figures.axis_figures.anti_windups import comparison
from paper_figures.axis_figures.labels import KINDS as RUNS
from paper_figures.axis_figures.labels import look_of
from paper_figures.look.captions import at_least, number, of_limits
from paper_figures.look.style import styled

TABLES: tuple[str, ...] = ("compare", "compare_runs")

KINDS = {run: look_of(run) for run in RUNS}
SHORT = {"thesis anti-windup": "thesis", "corrected anti-windup": "corrected"}
UPSETS = ("start", "pulse")


def caption(tables: Mapping[str, pd.DataFrame]) -> str:
    """Return the caption with the numbers of the tables."""
    table = tables["compare"]
    start, pulse = (table[table["upset"] == upset].set_index("run") for upset in UPSETS)
    said = "; ".join(_said(run, start.loc[run], pulse.loc[run]) for run in start.index if run in KINDS)
    least, from_s = (float(start[column].max()) for column in ("least_peak_error", "from_s"))
    physical = ""
    if not math.isnan(least):
        forced = f"every controller leaves an error |r - y| of {at_least(least)}" if least > 0 else "no error is forced"
        physical = f" From {number(from_s)} s after the start on {forced}."
    return (
        "The anti-windups of others beside the thesis's and the corrected one (not in the thesis), in the same loop of "
        f"chapter 4 under the limits {of_limits(table)}. (a) From rest, and (b) after a disturbance of half their "
        "distance at the plant's input, for a tenth of a period: how far the output is from that of the loop "
        "without saturation, over the reference's amplitude; dotted, 1 %, which counts as recovered. (c), (d) The "
        "recovery time and the greatest |u| over the larger limit; a full marker guarantees recovery whatever the "
        "control, a half one within a sector, an open one nothing. Recovery from rest and after the pulse: "
        f"{said}.{physical}"
    )


def _said(run: str, start: pd.Series, pulse: pd.Series) -> str:
    if isinstance(start["refused"], str):
        return f"{KINDS[run]}, refused ({start['refused']})"
    times = ["never" if math.isnan(row["recovery_s"]) else f"{number(row['recovery_s'])} s" for row in (start, pulse)]
    f = "" if math.isnan(start["f"]) else f", f = {number(start['f'])}"
    return f"{KINDS[run]} {' and '.join(times)} (guarantee: {start['guarantee']}{f})"


@styled()
def draw(tables: Mapping[str, pd.DataFrame]) -> Figure:
    """Return the figure; what never recovers is not in (c) and (d)."""
    return comparison(tables, {run: SHORT.get(kind, kind) for run, kind in KINDS.items()})
