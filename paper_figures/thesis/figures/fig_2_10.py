"""Thesis Fig. 2.10: the function f(gamma) to be minimised, for different values of beta."""

from __future__ import annotations

from collections.abc import Mapping

import pandas as pd
from matplotlib.figure import Figure

from paper_figures.look import panels, style
from paper_figures.look.captions import fraction, number, only
from paper_figures.look.style import COLUMN_WIDTH, FAMILY, LINES, styled
from paper_figures.thesis.figures.shared_f_gamma import curves, lowest

TABLES: tuple[str, ...] = ("f_gamma", "f_gamma_summary")


def caption(tables: Mapping[str, pd.DataFrame]) -> str:
    """Return the caption with the numbers of the tables."""
    summary = tables["f_gamma_summary"]
    least = "; ".join(
        f"{number(f, 4)} at gamma = {number(gamma)} for beta = {fraction(beta)}"
        for beta, curve in curves(tables)
        for gamma, f in [lowest(curve)]
    )
    return (
        "The function f(gamma) = ||W_a (1 + theta1~)||_inf over gamma for different values of beta, with theta1~ of "
        f"Eq. (2.23) and alpha = {fraction(only(summary, 'alpha'))} s, which cancels the zero of W_a (thesis Fig. "
        f"2.10); f(0) = ||W_a||_inf for all, and dots mark the least values: {least}. The text takes "
        f"its beta from such curves; here that is beta = {fraction(only(summary, 'beta'))} s, the best of this coarse "
        f"grid. Over a continuous beta the least found is f = {number(only(summary, 'f_best'), 4)} at beta = "
        f"{number(only(summary, 'beta_best'))} s, gamma = {number(only(summary, 'gamma_best'))}. The text speaks of "
        "values of beta from 0 to 1 without naming those that are drawn."
    )


@styled()
def draw(tables: Mapping[str, pd.DataFrame]) -> Figure:
    """Return the figure; its view ends a little above f(0), which is what f is to be brought down from."""
    figure = style.figure(COLUMN_WIDTH, 2.9)
    panel = figure.subplots()
    starts = []
    for order, (beta, curve) in enumerate(curves(tables)):
        line = LINES[FAMILY[order % len(FAMILY)]]
        chosen = " (chosen)" if order == 0 else ""
        panel.plot(
            *panels.envelope(curve["gamma"].to_numpy(), curve["f"].to_numpy()),
            **line,
            label=rf"$\beta = {fraction(beta)}$ s{chosen}",
            zorder=3 if order == 0 else 2,
        )
        panel.plot(*lowest(curve), "o", color=line["color"], markersize=3.5, zorder=3)
        starts.append(float(curve["f"].iloc[0]))
    panel.set(xlabel=r"$\gamma$", ylabel=r"$f(\gamma)$")
    panel.set_xlim(tables["f_gamma"]["gamma"].min(), tables["f_gamma"]["gamma"].max())
    panel.set_ylim(0, 1.25 * max(starts))
    panel.legend(**panels.ABOVE, ncols=2)
    return figure
