"""Thesis Fig. 2.14: tracking with input saturation without the proposed anti-windup."""

from __future__ import annotations

import math
from collections.abc import Mapping

import pandas as pd
from matplotlib.figure import Figure

from paper_figures.look import panels
from paper_figures.look.captions import largest, last_saturated, number, of_run, required_input
from paper_figures.look.panels import NONE
from paper_figures.look.style import COLUMN_WIDTH, styled

TABLES: tuple[str, ...] = ("delay_free", "delay_free_summary")


def caption(tables: Mapping[str, pd.DataFrame]) -> str:
    """Return the caption with the numbers of the tables."""
    table, summary = tables["delay_free"], tables["delay_free_summary"]
    early = table["time_s"] <= table["time_s"].iloc[-1] / 2
    error, control = (table[column].abs() for column in ("error_none", "control_none"))
    if control.isna().any():
        end = table["time_s"][control.notna()].iloc[-1]
        times = " times the limits" if math.isfinite(of_run(summary, "none", "limit")) else ""
        behaviour = f"diverges, past 1e100{times} at about {number(end)} s: the stabiliser is unstable by itself"
    else:
        behaviour = (
            f"{'grows' if control[~early].max() > control[early].max() else 'does not grow'}: |u| reaches "
            f"{largest(control[early])} in the first half of the run and {largest(control[~early])} in the second, |e| "
            f"{largest(error[early])} and {largest(error[~early])}, and u "
            f"{last_saturated(of_run(summary, 'none', 'last_saturation_s'))}"
        )
    return (
        "Tracking with input saturation without anti-windup (thesis Fig. 2.14): (a) reference r and output y, (b) "
        f"tracking error. {required_input(summary)}. The text calls this loop unstable; the control {behaviour}."
    )


@styled()
def draw(tables: Mapping[str, pd.DataFrame]) -> Figure:
    """Return the figure: the output above the error."""
    axes = panels.lettered(COLUMN_WIDTH, 3.6, "a;b")
    panels.outputs(axes["a"], tables["delay_free"], NONE)
    panels.errors(axes["b"], tables["delay_free"], NONE)
    return panels.finished(axes)
