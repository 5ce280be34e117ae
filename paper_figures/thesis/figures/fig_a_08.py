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


def caption(tables: Mapping[str, pd.DataFrame]) -> str:
    """Return the caption with the numbers of the tables."""
    table = tables["compare"]
    start = table[table["upset"] == "start"].set_index("run")
    least, from_s = (float(start[column].max()) for column in ("least_peak_error", "from_s"))
    physical = ""
    if not math.isnan(least):
        forced = f"every controller leaves an error |r - y| of {at_least(least)}" if least > 0 else "no error is forced"
        physical = f" From {number(from_s)} s on {forced}."
    return (
        f"Other anti-windups in the loop of chapter 4, limits {of_limits(table)}: the distance of the output from that "
        "without limits, (a) from rest, (b) after a pulse of half the range at the plant's input for a tenth of a "
        "period. Below 1 % (dotted) it has recovered. (c), (d) Full marker: recovery guaranteed for any control; "
        f"half, within a sector; open, not at all.{_absent(table)}{physical}"
    )


def _absent(table: pd.DataFrame) -> str:
    """What is not in (c) and (d), since it never recovers after one of the upsets or is not to be had."""
    runs = table[table["run"].isin(KINDS)].groupby("run", sort=False)
    refused = [KINDS[str(run)] for run, rows in runs if isinstance(rows["refused"].iloc[0], str)]
    gone = [KINDS[str(run)] for run, rows in runs if rows["recovery_s"].isna().any()]
    never = [kind for kind in gone if kind not in refused]
    said = (("Never recovered", never), ("Not possible for this plant", refused))
    return "".join(f" {words}: {', '.join(kinds)}." for words, kinds in said if kinds)


@styled()
def draw(tables: Mapping[str, pd.DataFrame]) -> Figure:
    """Return the figure; what never recovers is not in (c) and (d)."""
    return comparison(tables, {run: SHORT.get(kind, kind) for run, kind in KINDS.items()})
