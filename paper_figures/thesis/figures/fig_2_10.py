"""Thesis Fig. 2.10: the function f(gamma) to be minimised, for different values of beta."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import pandas as pd
from matplotlib.figure import Figure

from identification.base.arrays import Real
from paper_figures.look import panels, style
from paper_figures.look.captions import fraction, number, only
from paper_figures.look.style import COLUMN_WIDTH, FAMILY, LINES, styled
from paper_figures.thesis.figures.shared_f_gamma import at_zero, curves, lowest

TABLES: tuple[str, ...] = ("f_gamma", "f_gamma_summary")

ROOM = 0.25  # of what f is brought down by, above and below
MARGIN = 0.05  # of the axis, beside the last f that is shown


def caption(tables: Mapping[str, pd.DataFrame]) -> str:
    """Return the caption with the numbers of the tables."""
    summary = tables["f_gamma_summary"]
    _, chosen = curves(tables)[0]
    gamma, f = lowest(chosen)
    return (
        "f(gamma) = ||W_a (1 + theta1~)||_inf over gamma for several beta (thesis Fig. 2.10). theta1~ is that of Eq. "
        f"(2.23), with alpha = {fraction(only(summary, 'alpha'))} s, which cancels the zero of W_a. Dots mark the "
        f"least values. The least of all is f = {number(f, 4)} at gamma = {number(gamma)} and beta = "
        f"{fraction(only(summary, 'beta'))} s, which is chosen; without anti-windup, at gamma = 0, f = ||W_a||_inf = "
        f"{number(at_zero(chosen), 4)}. Over a continuous beta the least found is f = "
        f"{number(only(summary, 'f_best'), 4)} at beta = {number(only(summary, 'beta_best'))} s, gamma = "
        f"{number(only(summary, 'gamma_best'))}."
    )


@styled()
def draw(tables: Mapping[str, pd.DataFrame]) -> Figure:
    """Return the figure; its view is where f is not far above ||W_a||, which is what it is to be brought down from."""
    figure = style.figure(COLUMN_WIDTH, 2.9)
    panel = figure.subplots()
    drawn = curves(tables)
    low, high = _view([curve["f"].to_numpy(float) for _, curve in drawn], at_zero(drawn[0][1]))
    table = tables["f_gamma"]
    first, last = float(table["gamma"].min()), float(table["gamma"][table["f"] <= high].max())
    last = min(last + MARGIN * (last - first), float(table["gamma"].max()))
    for order, (beta, curve) in enumerate(drawn):
        line = LINES[FAMILY[order % len(FAMILY)]]
        chosen = " (chosen)" if order == 0 else ""
        shown = curve[: int((curve["gamma"] <= last).sum()) + 1]
        panel.plot(
            shown["gamma"], shown["f"], **line, label=rf"$\beta$ = {fraction(beta)} s{chosen}", zorder=3 - bool(order)
        )
        panel.plot(*lowest(curve), "o", color=line["color"], markersize=3.5, zorder=3)
    panel.set(xlabel=r"$\gamma$ [-]", ylabel=r"$f(\gamma)$ [unit of $W_a$]", ylim=(low, high))
    panel.set_xlim(first, last)
    panel.legend(**panels.ABOVE, ncols=2)
    return figure


def _view(f: Sequence[Real], start: float) -> tuple[float, float]:
    """From 0 to a little above where f starts; from a little below the least f if that is more than half of it."""
    least = min(float(values.min()) for values in f)
    low = 0.0 if least < start / 2 else least - ROOM * (start - least or start)
    return low, start + ROOM * (start - low)
