"""Thesis Fig. 4.3: output and tracking error under input saturation with the extended anti-windup."""

from __future__ import annotations

from collections.abc import Mapping

import pandas as pd
from matplotlib.figure import Figure

from paper_figures.look import panels
from paper_figures.look.captions import largest, number, of_run, promises, settled
from paper_figures.look.panels import CORRECTED, THESIS
from paper_figures.look.style import FULL_WIDTH, styled
from paper_figures.thesis.figures.shared_chapter_4 import chosen_limit, pade, pade_difference, pade_gone

TABLES: tuple[str, ...] = ("extended", "extended_summary")


def caption(tables: Mapping[str, pd.DataFrame]) -> str:
    """Return the caption with the numbers of the tables."""
    table, summary = tables["extended"], tables["extended_summary"]
    difference = pade_difference(table, THESIS)
    later = difference[table["time_s"] > pade_gone(table, THESIS)]
    thesis, corrected = (
        f"{settled(of_run(summary, run, 'settling_s'))} (to 1 % of the reference's amplitude around its offset), with "
        f"an offset of {number(of_run(summary, run, 'offset'))} over the last period"
        for run in ("thesis", "corrected")
    )
    return (
        "Output under input saturation with the extended anti-windup (thesis Fig. 4.3): (a) reference r and output y, "
        "(b) tracking error with the thesis's theta1~; (c), (d) the same with the corrected one, which has theta1~(0) "
        "= -1; (e) for the thesis's theta1~, the beginning of the exact output less that of the same loop with "
        f"second-order Pade approximations: at most {largest(difference)}, and {largest(later)} later. "
        f"{promises(summary)} The text says that the output recovers after around 4.46 seconds and that the error "
        "converges to zero. The thesis's theta1~ leaves the plant's integrator in theta2, which never forgets what a "
        f"saturation fed it: the error {thesis}. With the "
        f"corrected one the error {corrected}. {chosen_limit(tables)}"
    )


@styled()
def draw(tables: Mapping[str, pd.DataFrame]) -> Figure:
    """Return the figure: a column for each anti-windup, and below what the Pade approximation changes."""
    axes = panels.lettered(FULL_WIDTH, 4.7, "ac;bd;ee", ratios=(1, 1, 0.6))
    for (above, below), run in zip((("a", "b"), ("c", "d")), (THESIS, CORRECTED), strict=True):
        panels.outputs(axes[above], tables["extended"], run)
        panels.errors(axes[below], tables["extended"], run)
    pade(axes["e"], tables["extended"], THESIS)
    return panels.finished(axes, "ac", "bd")
