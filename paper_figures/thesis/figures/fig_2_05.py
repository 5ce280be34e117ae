"""Thesis Fig. 2.5: parallel internal model control structure."""

from __future__ import annotations

from collections.abc import Mapping

import pandas as pd
from matplotlib.figure import Figure

from paper_figures.look.style import FULL_WIDTH
from paper_figures.thesis.figures.block_diagrams import Diagram

TABLES: tuple[str, ...] = ()

CAPTION = (
    "Parallel internal model control structure (thesis Fig. 2.5). r is r_0, shaped by the exogenous dynamics; K(s) "
    "turns the error e = r - y into u_lin; the internal model units F_1(s) = G(s) and F_2(s) see the control signal u. "
    "The wiring follows from Eqs. (2.2), (2.6), (2.14) and (3.10): u = u_lin - F_2 F_1 u. So C = K/(1 + F_1 F_2), and "
    "G_A = G/(1 + F_1 F_2) from u_lin to y. The order of F_1 and F_2 is our deduction."
)


def caption(tables: Mapping[str, pd.DataFrame]) -> str:
    """Return the caption; it needs no table."""
    return CAPTION


def draw(tables: Mapping[str, pd.DataFrame]) -> Figure:
    """Return the diagram; it needs no table."""
    diagram = Diagram(FULL_WIDTH, 1.85)
    above, main, below = 1.4, 0.8, 0.22

    exogenous = diagram.block(0.78, main, r"$\Lambda(s)^{-1}$", 0.56)
    error = diagram.junction(1.5, main, {"W": "+", "S": "-"})
    stabilizer = diagram.block(2.27, main, "$K(s)$", 0.5)
    difference = diagram.junction(3.12, main, {"W": "+", "N": "-"})
    second_unit = diagram.block(3.53, above, "$F_2(s)$", 0.5)
    first_unit = diagram.block(4.2, above, "$F_1(s)$", 0.5)
    control = diagram.branch(4.61, main)
    plant = diagram.block(5.25, main, "$G(s)$", 0.5)
    output = diagram.branch(5.98, main)

    diagram.connect((0.1, main), exogenous.west)
    diagram.connect(exogenous.east, error.west)
    diagram.connect(error.east, stabilizer.west)
    diagram.connect(stabilizer.east, difference.west)
    diagram.connect(difference.east, plant.west)
    diagram.connect(control, (control[0], above), first_unit.east)
    diagram.connect(first_unit.west, second_unit.east)
    diagram.connect(second_unit.west, (difference.x, above), difference.north)
    diagram.connect(plant.east, (6.4, main))
    diagram.connect(output, (output[0], below), (error.x, below), error.south)
    diagram.outline((1.84, 0.45), (4.76, 1.75), "$C(s)$")

    diagram.signal(0.27, main, "$r_0$")
    diagram.signal(1.2, main, "$r$")
    diagram.signal(1.68, main, "$e$")
    diagram.signal(2.74, main, r"$u_\mathrm{lin}$")
    diagram.signal(3.87, main, "$u$")
    diagram.signal(6.19, main, "$y$")
    return diagram.figure()
