"""Fig. A.8: the anti-windups of others beside the thesis's and the corrected one: recovery, control and guarantee."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter

from experiments.runs.compare_anti_windups import SETTLED
from paper_figures.look import panels
from paper_figures.look.captions import at_least, number, of_limits
from paper_figures.look.style import FULL_WIDTH, LINES, styled

TABLES: tuple[str, ...] = ("compare", "compare_runs")

KINDS = {
    "none": "without anti-windup",
    "thesis": "thesis anti-windup",
    "corrected": "corrected anti-windup",
    "back-calculation": "back-calculation",
    "conditioning": "conditioning",
    "observer": "observer",
    "internal-model": "internal model",
    "weston-postlethwaite": "Weston and Postlethwaite",
    "static": "static",
}
SHORT = {"thesis anti-windup": "thesis", "corrected anti-windup": "corrected"}
UPSETS = {"start": ("a", "c"), "pulse": ("b", "d")}
SHOWN = 0.5  # of the time that an upset counts
FLOOR = 1e-3  # of the amplitude
DOT: dict[str, Any] = {"marker": "o", "markersize": 5.0, "linestyle": "none"}
FILLED = {"global": "full", "none": "none"}  # of a marker; half for a sector


def caption(tables: Mapping[str, pd.DataFrame]) -> str:
    """Return the caption with the numbers of the tables."""
    table = tables["compare"]
    start, pulse = (table[table["upset"] == upset].set_index("run") for upset in UPSETS)
    said = "; ".join(_said(run, start.loc[run], pulse.loc[run]) for run in start.index if run in KINDS)
    least, from_s = (float(start[column].max()) for column in ("least_peak_error", "from_s"))
    physical = ""
    if not math.isnan(least):
        forced = f"every controller leaves an error |r - y| of {at_least(least)}" if least > 0 else "no error is forced"
        physical = f" From {number(from_s)} s after the start on {forced}."
    return (
        "The anti-windups of others beside the thesis's and the corrected one (not in the thesis), in the same loop of "
        f"chapter 4 under the limits {of_limits(table)}. (a) From rest, and (b) after a disturbance of half their "
        "distance at the plant's input, for a tenth of a period: how far the output is from that of the loop "
        "without saturation, over the reference's amplitude; dotted, 1 %, which counts as recovered. (c), (d) The "
        "recovery time and the greatest |u| over the larger limit; a full marker guarantees recovery whatever the "
        "control, a half one within a sector, an open one nothing. Recovery from rest and after the pulse: "
        f"{said}.{physical}"
    )


def _said(run: str, start: pd.Series, pulse: pd.Series) -> str:
    if isinstance(start["refused"], str):
        return f"{KINDS[run]}, refused ({start['refused']})"
    times = ["never" if math.isnan(row["recovery_s"]) else f"{number(row['recovery_s'])} s" for row in (start, pulse)]
    f = "" if math.isnan(start["f"]) else f", f = {number(start['f'])}"
    return f"{KINDS[run]} {' and '.join(times)} (guarantee: {start['guarantee']}{f})"


@styled()
def draw(tables: Mapping[str, pd.DataFrame]) -> Figure:
    """Return the figure; what never recovers is not in (c) and (d)."""
    table, runs = tables["compare"], tables["compare_runs"]
    axes = panels.lettered(FULL_WIDTH, 5.2, "ab;cd")
    half = float(runs["time_s"].iloc[-1]) / 2
    amplitude = float(np.ptp(runs["reference"])) / 2
    for begin, (upset, (above, below)) in zip((0.0, half), UPSETS.items(), strict=True):
        chosen = (runs["time_s"] >= begin) & (runs["time_s"] <= begin + SHOWN * half)
        _distances(axes[above], runs[chosen], begin, amplitude)
        _measures(axes[below], table[table["upset"] == upset])
    for letter in "bd":
        axes[letter].set_ylabel("")
    handles = axes["a"].get_legend_handles_labels()
    middle = (len(handles[0]) + 1) // 2
    for letter, part in (("a", slice(middle)), ("b", slice(middle, None))):
        axes[letter].legend(*(each[part] for each in handles), **panels.ABOVE, ncols=2)
    figure = axes["a"].get_figure(root=True)
    assert figure is not None
    return figure


def _distances(panel: Axes, runs: pd.DataFrame, begin: float, amplitude: float) -> None:
    time_s = runs["time_s"].to_numpy(float) - begin
    for run, kind in KINDS.items():
        if f"output_{run}" in runs:
            distance = (runs[f"output_{run}"] - runs["output_unsaturated"]).abs().to_numpy(float) / amplitude
            line = LINES[kind]
            points = panels.envelope(time_s, np.maximum(distance, FLOOR / 10))
            panel.plot(*points, **line, label=SHORT.get(kind, kind), zorder=3 - line["linewidth"] / 10)
    panel.axhline(SETTLED, **LINES["saturation limits"])
    panel.set(yscale="log", ylim=(FLOOR, 10.0), xlim=(0.0, time_s[-1]))
    panel.set(xlabel="Time after the upset [s]", ylabel=r"$|y - y_\mathrm{unsaturated}|$ / amplitude")


def _measures(panel: Axes, table: pd.DataFrame) -> None:
    for run, kind in KINDS.items():
        for _, row in table[(table["run"] == run) & table["recovery_s"].notna()].iterrows():
            look = DOT | {"fillstyle": FILLED.get(row["guarantee"], "bottom"), "color": LINES[kind]["color"]}
            panel.plot(row["largest_control"], row["recovery_s"], **look)
    panel.set(xscale="log")
    panel.xaxis.set_minor_formatter(NullFormatter())
    panel.set(xlabel=r"Greatest $|u|$ / limit", ylabel="Recovery time [s]", ylim=(0, None))
