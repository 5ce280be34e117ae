"""Thesis Fig. 2.2: input and output, controller output and saturated input, without anti-windup in the PID block."""

from __future__ import annotations

from collections.abc import Mapping

import pandas as pd
from matplotlib.figure import Figure

from paper_figures.look import captions
from paper_figures.look.captions import number, only
from paper_figures.look.style import styled
from paper_figures.thesis.figures import shared_pid

TABLES: tuple[str, ...] = ("pid", "pid_summary")


def caption(tables: Mapping[str, pd.DataFrame]) -> str:
    """Return the caption with the numbers of the tables."""
    table, summary = tables["pid"], tables["pid_summary"]
    last = shared_pid.last_third(table)
    within = captions.last_saturated(
        captions.last_outside(table["time_s"], table["control_swapped_none"], only(summary, "limit"))
    )
    return (
        "PID benchmark without anti-windup (thesis Fig. 2.2): (a) reference r and output y, (b) controller output u "
        "and sat(u), gains swapped, C(s) = 4.5 + 0.5/s; (c), (d) as printed, C(s) = 0.5 + 4.5/s. Beyond the limits "
        "(dotted) the scale is logarithmic. As printed the loop limit-cycles: in the last third y lies "
        f"{captions.between(last['output_printed_none'])}. Swapped, y overshoots by "
        f"{number(only(summary, 'overshoot_swapped_none'))} %; u rises to "
        f"{captions.largest(table['control_swapped_none'])} and {within}. {shared_pid.setting(summary)}"
    )


@styled()
def draw(tables: Mapping[str, pd.DataFrame]) -> Figure:
    """Return the figure: a column for the swapped gains, one for the printed ones."""
    return shared_pid.response(tables, "none", "without anti-windup")
