"""Thesis Fig. 2.7: equivalent anti-windup scheme with the dead zone."""

from __future__ import annotations

from collections.abc import Mapping

import pandas as pd
from matplotlib.figure import Figure

from paper_figures.look.style import FULL_WIDTH
from paper_figures.thesis.figures.block_diagrams import Diagram

TABLES: tuple[str, ...] = ()

CAPTION = (
    "Equivalent anti-windup scheme (thesis Fig. 2.7). The dead zone u~ = u - sat(u) = dz(u) of Eq. (2.16) replaces the "
    "saturation of Fig. 2.6. The loop of K(s) and G_A(s) = G/(1 + F), F = F_1 F_2, is then linear, and the dead zone "
    "is in a loop of its own with theta_1~ = theta_1/(1 + F): the loop of Theorem 2.3.1. The drawing follows from Eqs. "
    "(2.10) to (2.16)."
)


def caption(tables: Mapping[str, pd.DataFrame]) -> str:
    """Return the caption; it needs no table."""
    return CAPTION


def draw(tables: Mapping[str, pd.DataFrame]) -> Figure:
    """Return the diagram; it needs no table."""
    diagram = Diagram(FULL_WIDTH, 2.45)
    above, main, nonlinear, below = 2.28, 1.72, 0.95, 0.25

    error = diagram.junction(0.5, main, {"W": "+", "N": "-"})
    stabilizer = diagram.block(1.12, main, "$K(s)$", 0.46)
    augmented = diagram.block(3.9, main, "$G_A(s)$", 0.5)
    inverse = diagram.block(2.45, nonlinear, r"$(1 + F(s))^{-1}$", 0.86)
    control = diagram.junction(3.2, nonlinear, {"W": "+", "S": "-"})
    dead_zone = diagram.dead_zone(3.9, nonlinear)
    first_compensator = diagram.block(3.9, below, r"$\tilde{\theta}_1(s)$", 0.46)
    second_compensator = diagram.block(4.98, nonlinear, r"$\theta_2(s)$", 0.46)
    output = diagram.junction(5.7, main, {"W": "+", "S": "-"})

    stabilized = diagram.branch(1.79, main)
    linear = diagram.branch(4.98, main)
    excess = diagram.branch(4.46, nonlinear)

    diagram.connect((0.1, main), error.west)
    diagram.connect(error.east, stabilizer.west)
    diagram.connect(stabilizer.east, augmented.west)
    diagram.connect(augmented.east, output.west)
    diagram.connect(output.east, (6.4, main))
    diagram.connect(linear, (linear[0], above), (error.x, above), error.north)

    diagram.connect(stabilized, (stabilized[0], nonlinear), inverse.west)
    diagram.connect(inverse.east, control.west)
    diagram.connect(control.east, dead_zone.west)
    diagram.connect(dead_zone.east, second_compensator.west)
    diagram.connect(excess, (excess[0], below), first_compensator.east)
    diagram.connect(first_compensator.west, (control.x, below), control.south)
    diagram.connect(second_compensator.east, (output.x, nonlinear), output.south)

    diagram.signal(0.22, main, "$r$")
    diagram.signal(0.73, main, "$e$")
    diagram.signal(1.57, main, r"$u_\mathrm{lin}$")
    diagram.signal(4.56, main, r"$y_\mathrm{lin}$")
    diagram.signal(6.09, main, "$y$")
    diagram.signal(3.44, nonlinear, "$u$")
    diagram.signal(4.29, nonlinear, r"$\tilde{u}$")
    diagram.signal(5.45, nonlinear, r"$y_\mathrm{d}$")
    return diagram.figure()
