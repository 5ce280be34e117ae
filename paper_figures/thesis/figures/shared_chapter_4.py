"""What the figures of chapter 4 share: how its limits were chosen, which part is enlarged, and the Pade panel."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
import pandas as pd
from matplotlib.axes import Axes

from data.thesis import printed_numbers
from experiments.thesis.studies.desaturation import PERIODS, desaturation
from paper_figures.look import panels
from paper_figures.look.captions import duration, last_saturated, number, of_run
from paper_figures.look.fast_swings import SEEN, turns_of
from paper_figures.look.panels import Run, Trace
from paper_figures.look.style import LINES

MARGIN = 1.15
"""How much longer the enlarged part is than the time to the last saturation."""

LEFT = 0.1  # of the largest difference: where less is left, it counts as gone
CYCLES = 6  # of the control are shown one by one


def chosen_limit(tables: Mapping[str, pd.DataFrame]) -> str:
    """Say how the limits, which are not printed, were chosen."""
    summary, time_s = tables["extended_summary"], of_run(tables["extended_summary"], "none", "last_saturation_s")
    if of_run(summary, "none", "limit_is_given"):
        return f"Under {limits(tables)} the loop without anti-windup {last_saturated(time_s)}."
    target = desaturation(float(tables["extended"]["time_s"].iloc[-1]) / PERIODS)
    printed_s = float(printed_numbers()["extended"]["desaturation_s"])
    when = "at around 4 seconds, as the text says"
    if not math.isclose(target, printed_s, rel_tol=1e-6):
        when = f"at around {duration(target)}, as late in the reference's period as the text says"
    return (
        f"Chapter 4 prints no limits. Under {limits(tables)} the loop without anti-windup leaves saturation {when}: "
        f"it {last_saturated(time_s)}."
    )


def limits(tables: Mapping[str, pd.DataFrame]) -> str:
    """Say what the limits are, and whether they were given or chosen."""
    summary = tables["extended_summary"]
    whose = "given" if of_run(summary, "none", "limit_is_given") else "chosen"
    return f"the {whose} limits of +-{number(of_run(summary, 'none', 'limit'), 4)}"


def beginning(tables: Mapping[str, pd.DataFrame], *runs: str) -> float:
    """Return the end [s] of the part to enlarge: a little after the last saturation, else a tenth of the run."""
    last = [of_run(tables["extended_summary"], run, "last_saturation_s") for run in runs]
    end = float(tables["extended"]["time_s"].iloc[-1])
    return min(MARGIN * max(last), end) if all(time > 0 for time in last) else end / 10


def few_cycles(tables: Mapping[str, pd.DataFrame], *runs: str) -> float:
    """Return the end [s] of the first few cycles of the controls in that part, or of all of it if there are no more."""
    end = beginning(tables, *runs)
    table = tables["extended"][tables["extended"]["time_s"] <= end]
    ends = []
    for run in runs:
        control = table[f"control_{run}"].to_numpy(float)
        turns = turns_of(control, SEEN * float(np.ptp(control[np.isfinite(control)])))
        ends.append(float(table["time_s"].iloc[turns[2 * CYCLES - 1]]) if len(turns) >= 2 * CYCLES else end)
    return max(ends)


def until(table: pd.DataFrame, end_s: float) -> pd.DataFrame:
    """Return the rows of a run until a time."""
    rows: pd.DataFrame = table[table["time_s"] <= end_s]
    return rows


def pade(panel: Axes, table: pd.DataFrame, run: Run) -> None:
    """Draw what Pade approximations of the dead times change in the output of a run, until it has died away."""
    seen = until(table, pade_gone(table, run))
    trace = Trace(pade_difference(seen, run), LINES["second-order Pade"], r"$y - y_\mathrm{Pade}$")
    panels.draw(panel, seen["time_s"], [trace], panels.scale(table["reference"]))
    panel.set_ylabel("Difference\n[unit of $y$]")
    panels.key(panel)


def pade_difference(table: pd.DataFrame, run: Run) -> pd.Series:
    """Return the output of a run less that of the same run with Pade approximations."""
    return table[f"output_{run.name}"] - table[f"output_{run.name}_pade"]


def pade_gone(table: pd.DataFrame, run: Run) -> float:
    """Return the time [s] from which that difference stays below a tenth of its largest value."""
    size = pade_difference(table, run).abs()
    left = table["time_s"][size > LEFT * size.max()]
    return float(left.iloc[-1]) if len(left) > 1 else float(table["time_s"].iloc[-1])
