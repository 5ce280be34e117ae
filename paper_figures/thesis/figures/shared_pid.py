"""What the figures of the PID benchmark share: their panels, and phrases of their captions."""

from __future__ import annotations

from collections.abc import Mapping

import pandas as pd
from matplotlib.figure import Figure

from experiments.runs.metrics import settling_time
from paper_figures.look import captions, panels
from paper_figures.look.captions import number, only
from paper_figures.look.style import FULL_WIDTH

GAINS = ("swapped", "printed")
"""The columns of a figure."""

SETTLED = 0.02
"""Band of the settling time, as a share of the step."""


def response(tables: Mapping[str, pd.DataFrame], kind: str, line: str) -> Figure:
    """Return the figure of the output above the control, a column for each of ``GAINS``.

    Parameters
    ----------
    tables
        ``pid`` and ``pid_summary``.
    kind
        ``none`` or ``back_calculation``.
    line
        Its entry in ``style.LINES``.
    """
    axes = panels.lettered(FULL_WIDTH, 3.7, "ac;bd")
    limit = only(tables["pid_summary"], "limit")
    for (above, below), gains in zip((("a", "b"), ("c", "d")), GAINS, strict=True):
        run = panels.Run(f"{gains}_{kind}", line, f"{gains} gains")
        panels.outputs(axes[above], tables["pid"], run)
        panels.controls(axes[below], tables["pid"], run, limit, "control", "saturated")
    return panels.finished(axes, "ac")


def last_third(table: pd.DataFrame) -> pd.DataFrame:
    """Return the rows of the last third of the run."""
    rows: pd.DataFrame = table[table["time_s"] >= 2 / 3 * table["time_s"].iloc[-1]]
    return rows


def settling(table: pd.DataFrame, run: str) -> str:
    """Say when the output of a run has settled."""
    error = table["reference"] - table[f"output_{run}"]
    band = SETTLED * panels.scale(table["reference"])
    return captions.settled(settling_time(table["time_s"].to_numpy(), error.to_numpy(), band))


def setting(summary: pd.DataFrame) -> str:
    """Say what the thesis leaves open."""
    return f"We chose the swap and the step of {number(only(summary, 'step'))} to fit the text."
