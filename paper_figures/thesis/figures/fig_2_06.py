"""Thesis Fig. 2.6: anti-windup tracking control architecture with the internal model structure."""

from __future__ import annotations

from collections.abc import Mapping

import pandas as pd
from matplotlib.figure import Figure

from paper_figures.look.style import FULL_WIDTH
from paper_figures.thesis.figures.block_diagrams import Diagram

TABLES: tuple[str, ...] = ()

CAPTION = (
    "Anti-windup control architecture with the internal model structure (thesis Fig. 2.6). The actuator saturates u to "
    "u_m. The excess u~ = u - u_m acts through theta_1(s) on the output of K(s) and through theta_2(s) on the output "
    "of the plant. The wiring follows from Eq. (2.10): (1 + F_1 F_2) u = u_lin - u_d with u_d = theta_1 u~, and y_lin "
    "= y + y_d with y_d = theta_2 u~. By Eqs. (2.12) and (2.13), y_lin and not y is compared with r."
)


def caption(tables: Mapping[str, pd.DataFrame]) -> str:
    """Return the caption; it needs no table."""
    return CAPTION


def draw(tables: Mapping[str, pd.DataFrame]) -> Figure:
    """Return the diagram; it needs no table."""
    diagram = Diagram(FULL_WIDTH, 2.75)
    above, main, excess_level, compensators, below = 2.5, 1.9, 1.35, 0.75, 0.2

    exogenous = diagram.block(0.64, main, r"$\Lambda(s)^{-1}$", 0.54)
    error = diagram.junction(1.25, main, {"W": "+", "S": "-"})
    stabilizer = diagram.block(1.78, main, "$K(s)$", 0.46)
    control = diagram.junction(2.48, main, {"W": "+", "N": "-", "S": "-"})
    second_unit = diagram.block(2.86, above, "$F_2(s)$", 0.46)
    first_unit = diagram.block(3.48, above, "$F_1(s)$", 0.46)
    actuator = diagram.saturation(4.3, main)
    excess = diagram.junction(actuator.x, excess_level, {"W": "+", "E": "-"})
    first_compensator = diagram.block(3.42, compensators, r"$\theta_1(s)$", 0.46)
    second_compensator = diagram.block(5.24, compensators, r"$\theta_2(s)$", 0.46)
    plant = diagram.block(5.24, main, "$G(s)$", 0.46)
    linear = diagram.junction(5.9, compensators, {"W": "+", "N": "+"})

    asked = diagram.branch(3.88, main)
    limited = diagram.branch(4.79, main)
    divided = diagram.branch(actuator.x, compensators)
    output = diagram.branch(linear.x, main)

    diagram.connect((0.08, main), exogenous.west)
    diagram.connect(exogenous.east, error.west)
    diagram.connect(error.east, stabilizer.west)
    diagram.connect(stabilizer.east, control.west)
    diagram.connect(control.east, actuator.west)
    diagram.connect(actuator.east, plant.west)
    diagram.connect(plant.east, (6.42, main))

    diagram.connect(asked, (asked[0], above), first_unit.east)
    diagram.connect(first_unit.west, second_unit.east)
    diagram.connect(second_unit.west, (control.x, above), control.north)

    diagram.connect(asked, (asked[0], excess.y), excess.west)
    diagram.connect(limited, (limited[0], excess.y), excess.east)
    diagram.connect(excess.south, divided, first_compensator.east)
    diagram.connect(divided, second_compensator.west)
    diagram.connect(first_compensator.west, (control.x, compensators), control.south)
    diagram.connect(second_compensator.east, linear.west)

    diagram.connect(output, linear.north)
    diagram.connect(linear.south, (linear.x, below), (error.x, below), error.south)

    diagram.signal(0.2, main, "$r_0$")
    diagram.signal(0.99, main, "$r$")
    diagram.signal(1.375, main, "$e$")
    diagram.signal(2.18, main, r"$u_\mathrm{lin}$")
    diagram.signal(3.18, main, "$u$")
    diagram.signal(4.66, main, r"$u_\mathrm{m}$")
    diagram.signal(6.15, main, "$y$")
    diagram.signal_beside(excess.x, 1.02, r"$\tilde{u}$")
    diagram.signal(2.84, compensators, r"$u_\mathrm{d}$")
    diagram.signal(5.6, compensators, r"$y_\mathrm{d}$")
    diagram.signal(3.58, below, r"$y_\mathrm{lin}$")
    return diagram.figure()
