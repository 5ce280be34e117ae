"""Thesis Fig. 3.1: Smith predictor-based controller structure."""

from __future__ import annotations

from collections.abc import Mapping

import pandas as pd
from matplotlib.figure import Figure

from paper_figures.look.style import COLUMN_WIDTH
from paper_figures.thesis.figures.block_diagrams import Diagram

TABLES: tuple[str, ...] = ()

CAPTION = (
    "Smith predictor-based controller structure (thesis Fig. 3.1): the controller C_1(s) of Fig. 3.2 acts on the error "
    "e in a loop with the plant P(s) of Eq. (3.1), which has an integrator and dead time. The disturbance d is "
    "negligible. The text names C_1, P and H but not their places: we deduce that d acts at the plant's input and that "
    "H(s) is in the feedback path. The label u is ours. With H(s) = 1, which the text takes, H(s) could filter the "
    "reference just as well."
)


def caption(tables: Mapping[str, pd.DataFrame]) -> str:
    """Return the caption; it needs no table."""
    return CAPTION


def draw(tables: Mapping[str, pd.DataFrame]) -> Figure:
    """Return the diagram; it needs no table."""
    diagram = Diagram(COLUMN_WIDTH, 1.35)
    main, below = 0.86, 0.24

    error = diagram.junction(0.45, main, {"W": "+", "S": "-"})
    controller = diagram.block(1.0, main, "$C_1(s)$", 0.46)
    disturbed = diagram.junction(1.6, main, {"W": "+", "N": "+"})
    plant = diagram.block(2.38, main, r"$\dfrac{K}{s}\,R_0(s)\,e^{-T_d s}$", 1.02, 0.42)
    feedback = diagram.block(1.75, below, "$H(s)$", 0.46)
    output = diagram.branch(3.05, main)

    diagram.connect((0.06, main), error.west)
    diagram.connect(error.east, controller.west)
    diagram.connect(controller.east, disturbed.west)
    diagram.connect((disturbed.x, 1.27), disturbed.north)
    diagram.connect(disturbed.east, plant.west)
    diagram.connect(plant.east, (3.36, main))
    diagram.connect(output, (output[0], below), feedback.east)
    diagram.connect(feedback.west, (error.x, below), error.south)

    diagram.signal(0.14, main, "$r$")
    diagram.signal(0.605, main, "$e$")
    diagram.signal(1.32, main, "$u$")
    diagram.signal_beside(disturbed.x, 1.21, "$d$")
    diagram.signal(3.2, main, "$y$")
    diagram.signal(plant.x, plant.north[1], "$P(s)$")
    return diagram.figure()
