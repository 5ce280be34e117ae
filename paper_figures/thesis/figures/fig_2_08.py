"""Thesis Fig. 2.8: how the nominal model and its error bound were identified."""

from __future__ import annotations

from collections.abc import Mapping

import pandas as pd
from matplotlib.figure import Figure

from paper_figures.look.style import COLUMN_WIDTH
from paper_figures.thesis.figures.block_diagrams import Diagram

TABLES: tuple[str, ...] = ()

CAPTION = (
    "System identification (thesis Fig. 2.8). A signal analyser drives one antenna axis with sine sweeps of 5 V "
    "amplitude between 10 and 200 Hz and returns the magnitude and phase of P_EL(j omega). The nominal transfer "
    "function P(s) of Eq. (2.20) is fitted to them. The bound W_a(s) of Eqs. (2.21) and (2.22) covers what the fit "
    "leaves over in all tests. The text gives the order of the steps; the drawing is our deduction."
)


def caption(tables: Mapping[str, pd.DataFrame]) -> str:
    """Return the caption; it needs no table."""
    return CAPTION


def draw(tables: Mapping[str, pd.DataFrame]) -> Figure:
    """Return the diagram; it needs no table."""
    diagram = Diagram(COLUMN_WIDTH, 2.4)
    sweep, response, fitted, bounded = 2.14, 1.9, 1.06, 0.36
    measurement = (sweep + response) / 2

    analyser = diagram.block(0.43, measurement, "signal\nanalyser", 0.66, 0.56)
    axis = diagram.block(2.92, measurement, "antenna axis\nwith drive", 0.8, 0.56)
    fit = diagram.block(1.62, fitted, "fit of transfer\nfunction", 0.96, 0.42)
    bound = diagram.block(2.37, bounded, r"bound on" "\n" r"$|P - P_\mathrm{EL}|$", 0.84, 0.42)
    measured = diagram.branch(analyser.x, fitted)
    model = diagram.branch(bound.x, fitted)

    diagram.connect((analyser.east[0], sweep), (axis.west[0], sweep))
    diagram.connect((axis.west[0], response), (analyser.east[0], response))
    diagram.connect(analyser.south, measured, fit.west)
    diagram.connect(fit.east, (3.32, fitted))
    diagram.connect(measured, (analyser.x, bounded), bound.west)
    diagram.connect(model, bound.north)
    diagram.connect(bound.east, (3.32, bounded))

    between = (analyser.east[0] + axis.west[0]) / 2 - 0.04
    diagram.signal(between, sweep, "5 V sine sweep, 10 to 200 Hz")
    diagram.signal(between, response, "response")
    diagram.signal_beside(analyser.x, 1.42, r"$P_\mathrm{EL}(j\omega)$: magnitude and phase")
    diagram.signal(2.88, fitted, "$P(s)$")
    diagram.signal(2.99, bounded, "$W_a(s)$")
    return diagram.figure()
