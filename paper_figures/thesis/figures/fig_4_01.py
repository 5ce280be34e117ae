"""Thesis Fig. 4.1: output and tracking error under input saturation without anti-windup, plant with dead time."""

from __future__ import annotations

import math
from collections.abc import Mapping

import pandas as pd
from matplotlib.figure import Figure

from paper_figures.look import panels
from paper_figures.look.captions import largest, number, of_run, settled
from paper_figures.look.panels import NONE
from paper_figures.look.style import COLUMN_WIDTH, styled
from paper_figures.thesis.figures.shared_chapter_4 import chosen_limit, pade, pade_difference

TABLES: tuple[str, ...] = ("extended", "extended_summary")


def caption(tables: Mapping[str, pd.DataFrame]) -> str:
    """Return the caption with the numbers of the tables."""
    table, summary = tables["extended"], tables["extended_summary"]
    after, settling = (of_run(summary, "none", column) for column in ("peak_error_after_1s", "settling_s"))
    reached = "" if math.isnan(after) else f"reaches {number(after)} after the first second and "
    return (
        "Output without anti-windup (thesis Fig. 4.1): (a) reference r and output y, (b) error, "
        "(c) what second-order Pade approximations change in y: at most "
        f"{largest(pade_difference(table, NONE))}. {chosen_limit(tables)} The text reads an error of about 8.6 m from "
        f"its plot; here |e| {reached}{settled(settling)}."
    )


@styled()
def draw(tables: Mapping[str, pd.DataFrame]) -> Figure:
    """Return the figure: the output, the error and what the Pade approximation changes."""
    axes = panels.lettered(COLUMN_WIDTH, 4.4, "a;b;c", ratios=(1, 1, 0.6))
    panels.outputs(axes["a"], tables["extended"], NONE)
    panels.errors(axes["b"], tables["extended"], NONE)
    pade(axes["c"], tables["extended"], NONE)
    return panels.finished(axes)
