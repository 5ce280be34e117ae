"""Every anti-windup that there is for a design beside the others: recovery, control and guarantee."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, MaxNLocator, NullFormatter

from design.design_file import Design
from experiments.runs.compare_anti_windups import SETTLED
from paper_figures.axis_figures.labels import KINDS, look_of
from paper_figures.look import panels
from paper_figures.look.captions import actuator_said, at_least, duration, only, with_unit
from paper_figures.look.style import FULL_WIDTH, LINES, styled

TABLES: tuple[str, ...] = ("compare", "compare_runs")

UPSETS = {"start": ("a", "c"), "pulse": ("b", "d")}
SHOWN = 0.5  # of the time that an upset counts
FLOOR = 1e-3  # of the amplitude
FEW = 10  # times the least control is the greatest, below which powers of ten are too few ticks
MOST = 10.0  # of the amplitude
ROOM = 1.25  # times the time until which a run is away that is shown
HEADROOM = 1.15  # times the slowest recovery
NEAR = 0.02  # of two dots, relative, that would hide each other
TINY = 1e-300
RING = 3.5  # wider is a dot behind another one
OVER_LETTERS = {"bbox_to_anchor": (1.0, 1.1)}
DOT: dict[str, Any] = {"marker": "o", "markersize": 5.0, "linestyle": "none"}
FILLED = {"global": "full", "none": "none"}  # of a marker; half for a sector


def caption(design: Design, tables: Mapping[str, pd.DataFrame]) -> str:
    """Return the caption with the numbers of the tables."""
    table, signals = tables["compare"], design.signals
    start, pulse = (table[table["upset"] == upset].set_index("run") for upset in UPSETS)
    said = "; ".join(_said(run, start.loc[run], pulse.loc[run]) for run in start.index if run in KINDS)
    least, from_s = (float(start[column].max()) for column in ("least_peak_error", "from_s"))
    half = (only(table, "limit") - only(table, "lower_limit")) / 2
    physical = ""
    if not math.isnan(least):
        error = with_unit(float(at_least(least)), signals.output_unit)
        forced = f"every controller leaves an error of {error} or more" if least > 0 else "no error is forced"
        physical = f" From {duration(from_s)} after the start on {forced} by the limits."
    return (
        "The anti-windups that exist for this design, each in the same loop under the limits "
        f"{actuator_said(table, signals.input_unit)}. Second order, Eq. (2.23), is the published one, a filter with "
        "two poles; corrected is the one that the program designs in its place. (a) From rest, and "
        "(b) after a disturbance of "
        f"{with_unit(half, signals.input_unit)} at the plant's input, for a tenth of a period: how far the output is "
        "from that of the loop without limits, over the reference's amplitude; dotted, 1 %, which counts as recovered. "
        "(c), (d) The recovery time and the greatest control asked for, over the larger limit. A full marker: recovery "
        "is guaranteed whatever the control; a half one: as long as the control stays within a bound; an open one: "
        "nothing is guaranteed. Markers at one place lie around each other. Recovery from rest and after the "
        f"disturbance: {said}.{physical}"
    )


def _said(run: str, start: pd.Series, pulse: pd.Series) -> str:
    if isinstance(start["refused"], str):
        return f"{KINDS[run]}, none for this design ({start['refused']})"
    times = ["never" if math.isnan(row["recovery_s"]) else duration(row["recovery_s"]) for row in (start, pulse)]
    return f"{KINDS[run]} {times[0]} and {times[1]}"


@styled()
def draw(design: Design, tables: Mapping[str, pd.DataFrame]) -> Figure:
    """Return the figure; what never recovers is not in (c) and (d)."""
    return comparison(tables, KINDS)


def comparison(tables: Mapping[str, pd.DataFrame], words: Mapping[str, str]) -> Figure:
    """Draw distances over time and measures of each run; ``words`` are what the runs are called in the key."""
    table, runs = tables["compare"], tables["compare_runs"]
    axes = panels.lettered(FULL_WIDTH, 5.2, "ab;cd")
    half = float(runs["time_s"].iloc[-1]) / 2
    amplitude = only(table, "amplitude")
    for begin, (upset, (above, below)) in zip((0.0, half), UPSETS.items(), strict=True):
        chosen = (runs["time_s"] >= begin) & (runs["time_s"] <= begin + SHOWN * half)
        _distances(axes[above], runs[chosen], begin, amplitude, words)
        _measures(axes[below], table[table["upset"] == upset], words)
    top = max(axes[letter].get_ylim()[1] for letter in "ab")
    for letter in "ab":
        axes[letter].set_ylim(top=top)
    axes["b"].set_ylabel("")
    handles = axes["a"].get_legend_handles_labels()
    middle = (len(handles[0]) + 1) // 2
    for letter, part in (("a", slice(middle)), ("b", slice(middle, None))):
        axes[letter].legend(*(each[part] for each in handles), **(panels.ABOVE | OVER_LETTERS), ncols=2)
    figure = axes["a"].get_figure(root=True)
    assert figure is not None
    return figure


def _distances(panel: Axes, runs: pd.DataFrame, begin: float, amplitude: float, words: Mapping[str, str]) -> None:
    time_s = runs["time_s"].to_numpy(float) - begin
    distances = {
        run: (runs[f"output_{run}"] - runs["output_unsaturated"]).abs().to_numpy(float) / amplitude
        for run in words
        if f"output_{run}" in runs
    }
    top = max([10 * SETTLED, *(2 * float(distance.max()) for distance in distances.values())])
    last_s = max([0.0, *(float(time_s[distance > FLOOR].max(initial=0.0)) for distance in distances.values())])
    end_s = min(time_s[-1], ROOM * last_s or time_s[-1])
    shown = time_s <= end_s
    for run, distance in distances.items():
        line = LINES[look_of(run)]
        points = panels.envelope(time_s[shown], np.maximum(distance[shown], FLOOR / 10))
        panel.plot(*points, **line, label=words[run], zorder=3 - line["linewidth"] / 10)
    if not last_s:
        _say(panel, "no run is away by as much as 0.1 %")
    panel.axhline(SETTLED, **LINES["saturation limits"])
    panel.set(yscale="log", ylim=(FLOOR, min(top, MOST)), xlim=(0.0, end_s))
    panel.set(xlabel="Time after the upset [s]", ylabel=r"$|y - y_\mathrm{unsaturated}|$ / amplitude [-]")


def _measures(panel: Axes, table: pd.DataFrame, words: Mapping[str, str]) -> None:
    """The dots of runs that are at one place are rings around each other."""
    shown = table[table["run"].isin(list(words)) & table["recovery_s"].notna()]
    slowest = float(shown["recovery_s"].max())
    place = np.column_stack([np.log(shown["largest_control"].clip(lower=TINY)), shown["recovery_s"] / (slowest or 1.0)])
    for i, (_, row) in enumerate(shown.iterrows()):
        behind = int((np.abs(place[i + 1 :] - place[i]) < NEAR).all(axis=1).sum())
        look = DOT | {"fillstyle": FILLED.get(row["guarantee"], "bottom"), "color": LINES[look_of(row["run"])]["color"]}
        look["markersize"] += RING * behind
        panel.plot(row["largest_control"], row["recovery_s"], **look)
    if not slowest > 0:
        _say(panel, "every run recovers at once" if slowest == 0 else "no run recovers")
    panel.set(xscale="log")
    panel.xaxis.set_minor_formatter(NullFormatter())
    low, high = panel.get_xlim()
    if high < FEW * low:
        panel.xaxis.set_major_locator(MaxNLocator(4, steps=[1, 2, 5, 10]))
        panel.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    panel.set(
        xlabel=r"Greatest $|u|$ / limit [-]",
        ylabel="Recovery time [s]",
        ylim=(0, HEADROOM * slowest) if slowest > 0 else (-1, 1),
    )
    if not slowest > 0:
        panel.set_yticks([0] if slowest == 0 else [])


def _say(panel: Axes, words: str) -> None:
    """What there is instead of lines."""
    panel.text(0.5, 0.75, words, transform=panel.transAxes, ha="center", va="center")
