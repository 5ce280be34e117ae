"""Thesis Fig. 4.4: controller output and plant input under input saturation with the extended anti-windup."""

from __future__ import annotations

from collections.abc import Mapping

import pandas as pd
from matplotlib.figure import Figure

from paper_figures.look import panels
from paper_figures.look.captions import largest, last_saturated, of_run
from paper_figures.look.panels import CORRECTED, THESIS
from paper_figures.look.style import FULL_WIDTH, styled
from paper_figures.thesis.figures.shared_chapter_4 import beginning, few_cycles, limits, until

TABLES: tuple[str, ...] = ("extended", "extended_summary")


def caption(tables: Mapping[str, pd.DataFrame]) -> str:
    """Return the caption with the numbers of the tables."""
    table, summary = tables["extended"], tables["extended_summary"]
    thesis, corrected = (
        f"|u| reaches {largest(table[f'control_{run}'])} and u "
        f"{last_saturated(of_run(summary, run, 'last_saturation_s'))}"
        for run in ("thesis", "corrected")
    )
    return (
        "Controller output u and plant input sat(u) in the runs of Fig. 4.3 (thesis Fig. 4.4): (a) u with the thesis's "
        "theta1~, (b) its beginning, (c) a few cycles; (d) to (f) with the corrected one. Beyond "
        f"{limits(tables)} (dotted) the scale is logarithmic. Pale range: u swings faster than the page can show. With "
        f"the thesis's theta1~ {thesis}; with the corrected one {corrected}."
    )


@styled()
def draw(tables: Mapping[str, pd.DataFrame]) -> Figure:
    """Return the figure: a column for each anti-windup; the whole run, its beginning, and a few cycles of that."""
    axes = panels.lettered(FULL_WIDTH, 5.6, "ad;be;cf")
    limit, table = of_run(tables["extended_summary"], "none", "limit"), tables["extended"]
    runs = ("thesis", "corrected")
    start, cycles = until(table, beginning(tables, *runs)), until(table, few_cycles(tables, *runs))
    for (above, middle, below), run in zip((("a", "b", "c"), ("d", "e", "f")), (THESIS, CORRECTED), strict=True):
        panels.controls(axes[above], table, run, limit, "control")
        panels.controls(axes[middle], start, run, limit, "control", "saturated")
        panels.controls(axes[below], cycles, run, limit, "control", "saturated")
    return panels.finished(axes, "ad", "be", "cf")
