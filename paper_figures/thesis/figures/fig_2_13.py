"""Thesis Fig. 2.13: controller output while there exists input saturation."""

from __future__ import annotations

from collections.abc import Mapping

import pandas as pd
from matplotlib.figure import Figure

from paper_figures.look import panels
from paper_figures.look.captions import last_saturated, number, of_run
from paper_figures.look.panels import CORRECTED, THESIS
from paper_figures.look.style import COLUMN_WIDTH, styled

TABLES: tuple[str, ...] = ("delay_free", "delay_free_summary")


def caption(tables: Mapping[str, pd.DataFrame]) -> str:
    """Return the caption with the numbers of the tables."""
    table, summary = tables["delay_free"], tables["delay_free_summary"]
    limit = of_run(summary, "none", "limit")
    beyond = {run: table[f"control_{run}"].abs() - limit for run in ("thesis", "corrected")}
    thesis, corrected = (
        (
            f"exceeds them by up to {number(excess.max())}, for {number(100 * (excess > 0).mean(), 2)} % of the time, "
            f"and {last_saturated(of_run(summary, run, 'last_saturation_s'))}"
            if excess.max() > 0
            else "does not reach them"
        )
        for run, excess in beyond.items()
    )
    whose = "given" if of_run(summary, "none", "limit_is_given") else "printed"
    return (
        "Controller output u and saturated input sat(u) in the run of Fig. 2.12 (thesis Fig. 2.13): (a) with the "
        f"thesis's theta1~, (b) with the corrected one. Dotted: the {whose} limits of +-{number(limit)}. The text says "
        f"that the controller output is truncated at the limits. sat(u) is. In (a) u {thesis}; in (b) it {corrected}."
    )


@styled()
def draw(tables: Mapping[str, pd.DataFrame]) -> Figure:
    """Return the figure: a panel for each anti-windup."""
    axes = panels.lettered(COLUMN_WIDTH, 3.6, "a;b")
    limit = of_run(tables["delay_free_summary"], "none", "limit")
    for letter, run in zip("ab", (THESIS, CORRECTED), strict=True):
        panels.controls(axes[letter], tables["delay_free"], run, limit, "control", "saturated")
    return panels.finished(axes, "ab")
