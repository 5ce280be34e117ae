"""What becomes of the loop on a computer: its steady error over the sampling rate, by method."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter

from design.design_file import Design
from experiments.rates import FOLLOWED, continuous_error, lowest_rate
from experiments.runs.compare_anti_windups import SETTLED
from paper_figures.axis_figures.labels import KINDS, look_of, united
from paper_figures.look import panels
from paper_figures.look.captions import actuator_said, hertz, only, with_unit
from paper_figures.look.style import FULL_WIDTH, LINES, figure, styled

TABLES: tuple[str, ...] = ("rates",)

RUNS = ("corrected", "none")  # the thin lines upon the broad ones
CONTINUOUS = "continuous"
METHODS = {"matched": ("matched", "^"), "tustin": ("Tustin's rule", "o"), "exact": ("held inputs", "s")}
MARKER = 3.5
LEAST = 1e-6  # of the amplitude: an error that is less is drawn as this
DIVERGENT = 100.0  # times the reference's amplitude is not shown


def caption(design: Design, tables: Mapping[str, pd.DataFrame]) -> str:
    """Return the caption with the numbers of the tables."""
    table, signals = tables["rates"], design.signals
    band = with_unit(SETTLED * only(table, "amplitude"), signals.output_unit)
    said = ", ".join(_said(table, method, words) for method, (words, _) in METHODS.items())
    near = (
        " With the corrected anti-windup the error comes to stay within 1 % of the amplitude of that in continuous "
        f"time by {said}."
    )
    if not continuous_error(table, "corrected") <= FOLLOWED * only(table, "amplitude"):
        near = ""
    levels = only(table, "quantum")
    steps = f" in steps of {with_unit(levels, signals.input_unit)}" if levels else ""
    return (
        f"The controller on a computer, under the limits {actuator_said(table, signals.input_unit)}{steps}: the "
        "greatest error of the last period over the sampling rate, at the samples or, of the linear loop, between "
        "them. The controller is made again for samples ('matched', triangles), or its blocks are discretised by "
        "Tustin's rule (circles) or as they answer an input that is held "
        f"for a sample (squares); broad, in continuous time; dotted, {band}, which is 1 % "
        f"of the reference's amplitude; less than a millionth of it is drawn as that.{near}{_divergent(table)}"
    )


def _said(table: pd.DataFrame, method: str, words: str) -> str:
    rate = lowest_rate(table, "corrected", method)
    where = "at none of these rates" if math.isnan(rate) else f"from {hertz(rate)} on"
    return f"{words} {where}"


def _divergent(table: pd.DataFrame) -> str:
    """Which of the runs on a computer are not there, and why."""
    shown = table[table["run"].isin(RUNS) & table["rate_hz"].notna()]
    unstable = shown[(shown["stable"] == 0) & (shown["run"] == RUNS[0])]
    most = [
        f"{hertz(rows.max())} ({METHODS[str(method)][0]})" for method, rows in unstable.groupby("method")["rate_hz"]
    ]
    said = (
        [f" Rates at which the linear loop is unstable are not drawn; the highest is {', '.join(most)}."]
        if most
        else []
    )
    still = [KINDS[run] for run in RUNS if not continuous_error(table, run) <= FOLLOWED * only(table, "amplitude")]
    if still:
        said.append(f" In continuous time the loop does not follow, and no rates are tried: {', '.join(still)}.")
    runs = shown[
        shown["steady_error"].isna()
        & (shown["stable"] == 1)
        & ~shown["run"].isin([r for r in RUNS if KINDS[r] in still])
    ]
    rows = ((str(row.run), str(row.method), float(str(row.rate_hz))) for row in runs.itertuples())
    gone = [f"{KINDS.get(run, run)}, {METHODS[method][0]}, {hertz(rate)}" for run, method, rate in rows]
    if gone:
        said.append(f" Not drawn, since it diverges: {'; '.join(gone)}.")
    return "".join(said)


@styled()
def draw(design: Design, tables: Mapping[str, pd.DataFrame]) -> Figure:
    """Return the figure."""
    least = LEAST * only(tables["rates"], "amplitude")
    table = tables["rates"].assign(steady_error=tables["rates"]["steady_error"].clip(lower=least))
    table["steady_error"] = table["steady_error"].where(table["stable"] == 1)  # an unstable loop has none
    panel = figure(FULL_WIDTH, 3.2).subplots()
    over_rate(panel, table, RUNS)
    for run in RUNS:
        panel.plot([], [], **LINES[look_of(run)], label=KINDS[run])
    panel.axhline(SETTLED * only(table, "amplitude"), **LINES["saturation limits"])
    asked = only(table, "asked_hz")
    if not math.isnan(asked):
        panel.axvline(asked, **LINES["reference"], label="the computer's rate")
    panel.set_ylabel(united("Greatest error, last period", design.signals.output_unit))
    known = table["steady_error"][table["rate_hz"].notna()].dropna()
    known = known[(known > 0) & (known < DIVERGENT * only(table, "amplitude"))]
    if len(known):
        top = 2 * max(float(known.max()), SETTLED * only(table, "amplitude"))
        panel.set_ylim(float(known.min()) / 2, top)
    panel.legend(**panels.ABOVE, ncols=3)
    found = panel.get_figure(root=True)
    assert found is not None
    return found


def over_rate(panel: Axes, table: pd.DataFrame, runs: Sequence[str]) -> None:
    """Draw the error of the last period: a line a run and a marker a method; broad, in continuous time.

    Parameters
    ----------
    panel
        Where to draw.
    table
        With the columns run, method (continuous, matched, tustin, exact), rate_hz and steady_error.
    runs
        Those that are drawn, the last one upon the others.
    """
    ends = (table["rate_hz"].min(), table["rate_hz"].max())
    known = {method: look for method, look in METHODS.items() if method in set(table["method"])}
    for order, run in enumerate(runs):
        line = LINES[look_of(run)]
        own = table[table["run"] == run]
        band = panels.band(line)
        panel.plot(ends, [continuous_error(table, run)] * 2, **band, zorder=2 - band["linewidth"] / 10)
        for method, (_, marker) in known.items():
            rows = own[own["method"] == method]
            face = "#FFFFFF" if method == "exact" else line["color"]
            look = line | {"marker": marker, "markersize": MARKER, "markerfacecolor": face, "zorder": 3 + order}
            panel.plot(rows["rate_hz"], rows["steady_error"], **look)
    for method, (label, marker) in known.items():
        face = "#FFFFFF" if method == "exact" else "#000000"
        look = {"color": "#000000", "linestyle": "none", "marker": marker, "markersize": MARKER}
        panel.plot([], [], **look, markerfacecolor=face, label=label)
    panel.set(xscale="log", xlabel="Sampling rate [Hz]", yscale="log")
    panel.xaxis.set_minor_formatter(NullFormatter())
