"""Thesis Fig. 4.2: controller output and plant input under input saturation without anti-windup."""

from __future__ import annotations

from collections.abc import Mapping

import pandas as pd
from matplotlib.figure import Figure

from paper_figures.look import panels
from paper_figures.look.captions import largest, of_run
from paper_figures.look.panels import NONE
from paper_figures.look.style import COLUMN_WIDTH, styled
from paper_figures.thesis.figures.shared_chapter_4 import chosen_limit

TABLES: tuple[str, ...] = ("extended", "extended_summary")


def caption(tables: Mapping[str, pd.DataFrame]) -> str:
    """Return the caption with the numbers of the tables."""
    return (
        "Controller output and plant input in the run of Fig. 4.1 (thesis Fig. 4.2): (a) controller output u, (b) "
        "plant input sat(u). Beyond the limits (dotted) the scale is logarithmic. Pale range: the signal swings faster "
        f"than the page can show. {chosen_limit(tables)} |u| reaches "
        f"{largest(tables['extended']['control_none'])}."
    )


@styled()
def draw(tables: Mapping[str, pd.DataFrame]) -> Figure:
    """Return the figure: the controller output above the plant input."""
    axes = panels.lettered(COLUMN_WIDTH, 3.6, "a;b")
    limit = of_run(tables["extended_summary"], "none", "limit")
    for letter, signal in zip("ab", ("control", "saturated"), strict=True):
        panels.controls(axes[letter], tables["extended"], NONE, limit, signal)
    return panels.finished(axes)
