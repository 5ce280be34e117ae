"""Thesis Fig. 3.2: the Smith predictor-based controller C_1(s)."""

from __future__ import annotations

from collections.abc import Mapping

import pandas as pd
from matplotlib.figure import Figure

from paper_figures.look.style import COLUMN_WIDTH
from paper_figures.thesis.figures.block_diagrams import Diagram

TABLES: tuple[str, ...] = ()

CAPTION = (
    "The Smith predictor-based controller C_1(s) (thesis Fig. 3.2): the free part C_0(s), in negative "
    "feedback with the estimated dead time's (1 - e^(-T_d s))/s, is followed by the approximate inverse of "
    "the flexible modes over the gain. The wiring follows from Eq. (3.2), u = C_1 e, with hats on estimated "
    "parameters; the order of the two factors in series is our deduction."
)


def caption(tables: Mapping[str, pd.DataFrame]) -> str:
    """Return the caption; it needs no table."""
    return CAPTION


def draw(tables: Mapping[str, pd.DataFrame]) -> Figure:
    """Return the diagram; it needs no table."""
    diagram = Diagram(COLUMN_WIDTH, 1.6)
    main, below = 1.05, 0.42

    error = diagram.junction(0.62, main, {"W": "+", "S": "-"})
    free_part = diagram.block(1.22, main, "$C_0(s)$", 0.5)
    predictor = diagram.block(1.22, below, r"$\dfrac{1 - e^{-\hat{T}_d s}}{s}$", 0.74, 0.46)
    inverse = diagram.block(2.42, main, r"$\dfrac{\hat{R}_\epsilon(s)^{-1}}{\hat{K}}$", 0.66, 0.48)
    free_output = diagram.branch(1.81, main)

    diagram.connect((0.06, main), error.west)
    diagram.connect(error.east, free_part.west)
    diagram.connect(free_part.east, inverse.west)
    diagram.connect(free_output, (free_output[0], below), predictor.east)
    diagram.connect(predictor.west, (error.x, below), error.south)
    diagram.connect(inverse.east, (3.34, main))
    diagram.outline((0.3, 0.1), (2.95, 1.52), "$C_1(s)$")

    diagram.signal(0.16, main, "$e$")
    diagram.signal(3.17, main, "$u$")
    return diagram.figure()
