"""Thesis Fig. 2.3: input and output, controller output and saturated input, with anti-windup in the PID block."""

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
    control = table["control_swapped_back_calculation"]
    within = captions.last_saturated(captions.last_outside(table["time_s"], control, only(summary, "limit")))
    last = shared_pid.last_third(table)
    return (
        "PID benchmark with back-calculation (thesis Fig. 2.3), panels as in Fig. 2.2. The text says that u and sat(u) "
        f"coincide, without overshoot. With swapped gains u starts at {number(control.iloc[0])} and {within}; from "
        f"then on the two coincide. The overshoot is {number(only(summary, 'overshoot_swapped_back_calculation'))} %. "
        f"As printed it is {number(only(summary, 'overshoot_printed_back_calculation'))} %, and in the last third y "
        f"lies {captions.between(last['output_printed_back_calculation'])}. The back-calculation coefficient is "
        f"{number(only(summary, 'back_calculation'))}, the default of Simulink's PID block. "
        f"{shared_pid.setting(summary)}"
    )


@styled()
def draw(tables: Mapping[str, pd.DataFrame]) -> Figure:
    """Return the figure: a column for the swapped gains, one for the printed ones."""
    return shared_pid.response(tables, "back_calculation", "thesis anti-windup")
