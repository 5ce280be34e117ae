"""Thesis Fig. 2.1: closed-loop feedback system of a controller and a plant."""

from __future__ import annotations

from collections.abc import Mapping

import pandas as pd
from matplotlib.figure import Figure

from paper_figures.look.style import COLUMN_WIDTH
from paper_figures.thesis.figures.block_diagrams import Diagram

TABLES: tuple[str, ...] = ()

CAPTION = (
    "Closed-loop feedback system: the controller C(s) acts on the error e = r - y, and the disturbance d is "
    "added to the control signal u at the input of the plant P(s) (thesis Fig. 2.1). The text names r, u, y "
    "and d but not where d enters: the plant input is our deduction, and the thesis takes d as zero."
)


def caption(tables: Mapping[str, pd.DataFrame]) -> str:
    """Return the caption; it needs no table."""
    return CAPTION


def draw(tables: Mapping[str, pd.DataFrame]) -> Figure:
    """Return the diagram; it needs no table."""
    diagram = Diagram(COLUMN_WIDTH, 1.2)
    main, below = 0.72, 0.2

    error = diagram.junction(0.52, main, {"W": "+", "S": "-"})
    controller = diagram.block(1.16, main, "$C(s)$", 0.5)
    disturbed = diagram.junction(1.89, main, {"W": "+", "N": "+"})
    plant = diagram.block(2.46, main, "$P(s)$", 0.5)
    output = diagram.branch(2.97, main)

    diagram.connect((0.1, main), error.west)
    diagram.connect(error.east, controller.west)
    diagram.connect(controller.east, disturbed.west)
    diagram.connect((disturbed.x, 1.12), disturbed.north)
    diagram.connect(disturbed.east, plant.west)
    diagram.connect(plant.east, (3.3, main))
    diagram.connect(output, (output[0], below), (error.x, below), error.south)

    diagram.signal(0.2, main, "$r$")
    diagram.signal(0.75, main, "$e$")
    diagram.signal(1.57, main, "$u$")
    diagram.signal_beside(disturbed.x, 1.06, "$d$")
    diagram.signal(3.12, main, "$y$")
    return diagram.figure()
