"""The Nyquist curve of the loop, with the discs that W_a puts around it."""

from __future__ import annotations

from collections.abc import Mapping

import pandas as pd
from matplotlib.figure import Figure

from design.design_file import Design
from paper_figures.look.nyquist import plot_nyquist

TABLES: tuple[str, ...] = ()


def caption(design: Design, tables: Mapping[str, pd.DataFrame]) -> str:
    """Return the caption."""
    return (
        "The loop L = P C over the frequency, dead times exact, plant P and controller C. The loop of every plant "
        "within W_a passes through every disc, so that all of them are stable if no disc holds the critical point -1. "
        "The circle around -1 is as large as the distance of L from it: the larger, the better damped is the loop."
    )


def draw(design: Design, tables: Mapping[str, pd.DataFrame]) -> Figure:
    """Return the figure."""
    return plot_nyquist(design)
