"""Thesis Fig. 2.11: Fig. 2.10 enlarged around the least f(gamma) for the chosen beta."""

from __future__ import annotations

from collections.abc import Mapping

import pandas as pd
from matplotlib.figure import Figure

from paper_figures.look import style
from paper_figures.look.captions import fraction, number, only
from paper_figures.look.panels import ABOVE
from paper_figures.look.style import COLUMN_WIDTH, LINES, styled
from paper_figures.thesis.figures.shared_f_gamma import curves, lowest

TABLES: tuple[str, ...] = ("f_gamma", "f_gamma_summary")

NEIGHBOURS = 12
"""How many values of gamma are shown on either side of the least f."""


def caption(tables: Mapping[str, pd.DataFrame]) -> str:
    """Return the caption with the numbers of the tables."""
    summary = tables["f_gamma_summary"]
    gamma, f, beta_best, gamma_best, f_best = (
        number(only(summary, column), 4) for column in ("gamma", "f", "beta_best", "gamma_best", "f_best")
    )
    beta = fraction(only(summary, "beta"))
    return (
        f"Fig. 2.10 enlarged around the least f for beta = {beta} s (thesis Fig. 2.11): f = {f} at gamma = {gamma}. "
        "The text has its least f at gamma = 97 and beta = 1/40 and prints no value of f. Our beta is the best of a "
        f"coarse grid. Over a continuous beta, f falls to {f_best} at beta = {beta_best} s and gamma = {gamma_best}."
    )


@styled()
def draw(tables: Mapping[str, pd.DataFrame]) -> Figure:
    """Return the figure."""
    beta, curve = curves(tables)[0]
    gamma, f = lowest(curve)
    here = int(curve["f"].to_numpy().argmin())
    near = curve.iloc[max(here - NEIGHBOURS, 0) : here + NEIGHBOURS + 1]
    line = LINES["family 1"]
    figure = style.figure(COLUMN_WIDTH, 2.4)
    panel = figure.subplots()
    panel.plot(near["gamma"], near["f"], **line)
    panel.plot(
        gamma,
        f,
        "o",
        color=line["color"],
        markersize=4.5,
        label=rf"$\gamma = {number(gamma, 4)}$, $f = {number(f, 4)}$",
    )
    panel.set(xlabel=r"$\gamma$ [-]", ylabel=rf"$f(\gamma)$ [unit of $W_a$], $\beta$ = {fraction(beta)} s")
    panel.legend(**ABOVE)
    return figure
