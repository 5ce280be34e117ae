"""Thesis Fig. 4.3: output and tracking error under input saturation with the extended anti-windup."""

from __future__ import annotations

from collections.abc import Mapping

import pandas as pd
from matplotlib.figure import Figure

from paper_figures.look import panels
from paper_figures.look.captions import largest, number, of_run, settled
from paper_figures.look.panels import CORRECTED, THESIS
from paper_figures.look.style import FULL_WIDTH, styled
from paper_figures.thesis.figures.shared_chapter_4 import limits, pade, pade_difference

TABLES: tuple[str, ...] = ("extended", "extended_summary")


def caption(tables: Mapping[str, pd.DataFrame]) -> str:
    """Return the caption with the numbers of the tables."""
    table, summary = tables["extended"], tables["extended_summary"]
    thesis, corrected = (
        f"{settled(of_run(summary, run, 'settling_s'))}, with an offset of {number(of_run(summary, run, 'offset'))}"
        for run in ("thesis", "corrected")
    )
    return (
        f"Output with the extended anti-windup under {limits(tables)} (thesis Fig. 4.3): (a) reference and output, "
        "(b) error with the thesis's theta1~; (c), (d) with the corrected one, theta1~(0) = -1; (e) what second-order "
        f"Pade approximations change in (a): at most {largest(pade_difference(table, THESIS))}. The text has the "
        "output recover after around 4.46 seconds and the error converge to zero. With the thesis's theta1~ the error "
        f"{thesis}; with the corrected one it {corrected}."
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
