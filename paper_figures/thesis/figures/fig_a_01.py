"""Fig. A.1: what the corrected anti-windup costs, f over its recovery time, for several sectors."""

from __future__ import annotations

from collections.abc import Mapping

import pandas as pd
from matplotlib.figure import Figure

from paper_figures.look import panels, style
from paper_figures.look.captions import number, of_run
from paper_figures.look.style import COLUMN_WIDTH, FAMILY, LINES, styled

TABLES: tuple[str, ...] = ("trade_off", "trade_off_summary")


def caption(tables: Mapping[str, pd.DataFrame]) -> str:
    """Return the caption with the numbers of the tables."""
    table, summary = tables["trade_off"], tables["trade_off_summary"]
    thesis, least, corrected = (of_run(summary, run, "f") for run in ("thesis", "least", "corrected"))
    slow = table[table["recovery_s"] == table["recovery_s"].max()]
    flat = "; ".join(f"{number(row.f)} for k = {number(row.sector)}" for row in slow.itertuples())
    return (
        "The least f = ||W_a (1 + theta1~)||_inf found of an anti-windup whose theta2 is stable (theta1~(0) = -1), "
        "over the time in which y_d falls to 1 %, for several sectors k of the circle criterion; no pole of theta1~ is "
        f"faster than {number(float(table['bandwidth'].iloc[0]))} rad/s (not in the thesis). A dead zone lies in the "
        "sector k as long as |u| stays below 1/(1 - k) times the limits and the reference takes no control in the "
        "steady state; k = 1 is a positive real 1 + theta1~, whose windup ends whatever the control. A recovery that "
        "leaves little room below this bandwidth costs f, as does a larger sector; for "
        f"the slowest recovery f is {flat}. The dot is the design's own, f = {number(corrected)}. The thesis's theta1~ "
        f"has f = {number(thesis)} and the best found of its form {number(least)}, and "
        f"both keep an offset for ever ({number(of_run(summary, 'thesis', 'lasting_offset'))} and "
        f"{number(of_run(summary, 'least', 'lasting_offset'))} for each unit of the integral of u - sat(u))."
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
    ends = table["recovery_s"].min(), table["recovery_s"].max()
    for run, kind, label in (
        ("thesis", "thesis anti-windup", "thesis (offset)"),
        ("least", "best of the thesis's form", "best of (2.23) (offset)"),
    ):
        panel.plot(ends, [of_run(summary, run, "f")] * 2, **LINES[kind], label=label)
    own = LINES["corrected anti-windup"]["color"]
    panel.plot(
        of_run(summary, "corrected", "recovery_s"), of_run(summary, "corrected", "f"), "o", color=own, label="corrected"
    )
    panel.set(xlabel="Recovery time [s]", ylabel="$f$", xlim=ends)
    panel.legend(**panels.ABOVE, ncols=2)
    return figure
