"""Thesis Fig. 2.4: the output with and without anti-windup in the PID block."""

from __future__ import annotations

from collections.abc import Mapping

import pandas as pd
from matplotlib.figure import Figure

from paper_figures.look import panels
from paper_figures.look.captions import number, only
from paper_figures.look.panels import Run
from paper_figures.look.style import FULL_WIDTH, styled
from paper_figures.thesis.figures import shared_pid

TABLES: tuple[str, ...] = ("pid", "pid_summary")


def caption(tables: Mapping[str, pd.DataFrame]) -> str:
    """Return the caption with the numbers of the tables."""
    table, summary = tables["pid"], tables["pid_summary"]
    without, having = (
        f"overshoots by {number(only(summary, f'overshoot_{run}'))} % and {shared_pid.settling(table, run)}"
        for run in ("swapped_none", "swapped_back_calculation")
    )
    return (
        "Output y of the PID benchmark without and with back-calculation (thesis Fig. 2.4): (a) gains swapped, (b) as "
        "printed. The text has y settle sooner with anti-windup, without overshoot. With swapped gains and "
        f"back-calculation y {having} (to 2 %); without, it {without}. As printed it "
        f"{shared_pid.settling(table, 'printed_back_calculation')} with back-calculation, and "
        f"{shared_pid.settling(table, 'printed_none')} without. {shared_pid.setting(summary)}"
    )


@styled()
def draw(tables: Mapping[str, pd.DataFrame]) -> Figure:
    """Return the figure: a panel for the swapped gains, one for the printed ones."""
    axes = panels.lettered(FULL_WIDTH, 2.3, "ab")
    for letter, gains in zip("ab", shared_pid.GAINS, strict=True):
        panels.outputs(
            axes[letter],
            tables["pid"],
            Run(f"{gains}_none", "without anti-windup", "without"),
            Run(f"{gains}_back_calculation", "thesis anti-windup", "with"),
        )
        axes[letter].set_ylabel(f"Output [unit of $y$],\n{gains} gains")
    return panels.finished(axes, "ab")
