"""How the loop answers the reference, disturbances, and the uncertainty of its plant."""

from __future__ import annotations

from collections.abc import Mapping

import pandas as pd
from matplotlib.figure import Figure

from design.design_file import Design
from paper_figures.look.sensitivity import plot_sensitivity

TABLES: tuple[str, ...] = ()


def caption(design: Design, tables: Mapping[str, pd.DataFrame]) -> str:
    """Return the caption."""
    return (
        "The loop over the frequency, dead times exact. |S| is what it leaves of a disturbance at the output, |T| how "
        "much of the reference reaches the output; both keep their values while the control is within the limits. "
        "|W_a C S| below 1 at every frequency means that the loop is stable around every plant within W_a. At the "
        "frequencies of the reference, which are marked, S = 0 and T = 1: the output follows without lasting error."
    )


def draw(design: Design, tables: Mapping[str, pd.DataFrame]) -> Figure:
    """Return the figure."""
    return plot_sensitivity(design)
