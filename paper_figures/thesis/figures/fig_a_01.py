"""Fig. A.1: what the corrected anti-windup costs, f over its recovery time, for several sectors."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import pandas as pd
from matplotlib.figure import Figure

from paper_figures.look import panels, style
from paper_figures.look.captions import number, of_run
from paper_figures.look.style import COLUMN_WIDTH, FAMILY, LINES, styled

TABLES: tuple[str, ...] = ("trade_off", "trade_off_summary")

RUNS: dict[str, tuple[str, dict[str, Any], str]] = {
    "thesis": ("thesis anti-windup", {"marker": "s", "fillstyle": "none"}, "thesis (offset)"),
    "least": ("best of the thesis's form", {"marker": "D", "fillstyle": "none"}, "best of (2.23) (offset)"),
    "corrected": ("corrected anti-windup", {"marker": "o"}, "corrected"),
}
"""The anti-windups that are points: their colours, markers and words; hollow, they keep an offset."""


def caption(tables: Mapping[str, pd.DataFrame]) -> str:
    """Return the caption with the numbers of the tables."""
    table, summary = tables["trade_off"], tables["trade_off_summary"]
    thesis, least, corrected = (of_run(summary, run, "f") for run in ("thesis", "least", "corrected"))
    bandwidth = float(table["bandwidth"].iloc[0])
    bound = "within" if of_run(summary, "thesis", "fastest") <= bandwidth else "NOT within"
    return (
        "The least f = ||W_a (1 + theta1~)||_inf found for a recovery time and a sector k, with theta2 stable and no "
        f"pole of theta1~ faster than {number(bandwidth)} rad/s. A sector k covers controls |u| up to 1/(1 - k) times "
        f"the limits. The dot is our corrected design, f = {number(corrected)}. Hollow markers keep an offset for "
        f"ever: the thesis's theta1~, f = {number(thesis)}, whose fastest pole, "
        f"{number(of_run(summary, 'thesis', 'fastest'))} rad/s, is {bound} that bandwidth, and the best of its form "
        f"(2.23) within the bandwidth, f = {number(least)}."
    )


@styled()
def draw(tables: Mapping[str, pd.DataFrame]) -> Figure:
    """Return the figure."""
    table, summary = tables["trade_off"], tables["trade_off_summary"]
    figure = style.figure(COLUMN_WIDTH, 2.9)
    panel = figure.subplots()
    for order, sector in enumerate(sorted(table["sector"].unique())):
        curve = table[table["sector"] == sector]
        line = LINES[FAMILY[order % len(FAMILY)]]
        panel.loglog(curve["recovery_s"], curve["f"], **line, label=f"$k = {number(sector)}$")
    for run, (kind, look, label) in RUNS.items():
        at = of_run(summary, run, "recovery_s"), of_run(summary, run, "f")
        panel.plot(*at, **look, linestyle="none", markersize=5.0, color=LINES[kind]["color"], label=label)
    panel.set(xlabel="Recovery time [s]", ylabel="$f$ [unit of $W_a$]")
    panel.legend(**panels.ABOVE, ncols=2)
    return figure
