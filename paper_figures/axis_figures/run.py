"""The user's reference from rest, under the limits, without and with anti-windup."""

from __future__ import annotations

import math
from collections.abc import Mapping

import pandas as pd
from matplotlib.figure import Figure

from design.design_file import Design
from experiments.drive.sampled_loop import SampledRun
from paper_figures.axis_figures.labels import KINDS
from paper_figures.look.captions import (
    LITTLE,
    actuator_said,
    capitalised,
    duration,
    is_rounding,
    last_saturated,
    of_run,
    only,
    with_unit,
)
from paper_figures.look.plot_run import plot_run

TABLES: tuple[str, ...] = ("tracking", "tracking_summary")

SHOWN, ROOM = 6, 1.5  # periods that are shown; or as many times the time until which the control is saturated
SIGNALS = ("output", "error", "control", "saturated")


def caption(design: Design, tables: Mapping[str, pd.DataFrame]) -> str:
    """Return the caption with the numbers of the tables."""
    summary, signals = tables["tracking_summary"], design.signals
    said = ". ".join(_said(summary, str(run), signals.output_unit) for run in summary["run"])
    return (
        f"The reference from rest under the limits {actuator_said(summary, signals.input_unit)}: output, error, and "
        f"the control before and after the actuator; shaded, where it is at a limit. {said}."
    )


def _said(summary: pd.DataFrame, run: str, unit: str) -> str:
    words = capitalised(KINDS.get(run, run))
    offset, ripple = (of_run(summary, run, column) for column in ("offset", "ripple"))
    if pd.isna(offset):
        return f"{words}: the run diverges"
    error = LITTLE if is_rounding(summary, run) else with_unit(abs(offset) + ripple, unit)
    last = duration(only(summary, "span_s"))
    saturated = last_saturated(of_run(summary, run, "last_saturation_s"))
    if of_run(summary, run, "settled") == 0:
        return f"{words}: the control {saturated}, not settled within {duration(only(summary, 'until_s'))}"
    return f"{words}: the control {saturated}, the greatest error of the last {last} is {error}"


def draw(design: Design, tables: Mapping[str, pd.DataFrame]) -> Figure:
    """Return the figure."""
    summary, table = tables["tracking_summary"], tables["tracking"]
    saturated = float(summary["last_saturation_s"].max(skipna=False))
    least = SHOWN * only(summary, "span_s")
    table = table[table["time_s"] <= max(least, 2 * least if math.isnan(saturated) else ROOM * saturated)]
    time_s, reference = (table[name].to_numpy(float) for name in ("time_s", "reference"))
    runs = {
        str(run): SampledRun(time_s, reference, *(table[f"{name}_{run}"].to_numpy(float) for name in SIGNALS))
        for run in summary["run"]
    }
    return plot_run(runs, (only(summary, "lower_limit"), only(summary, "limit")), design.signals)
