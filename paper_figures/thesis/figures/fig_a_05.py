"""Fig. A.5: what a computer and a real actuator make of the extended loop, over time and over the sampling rate."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from paper_figures.axis_figures.rates import CONTINUOUS, over_rate
from paper_figures.look import panels
from paper_figures.look.captions import duration, number, only, sampling_rate, settled
from paper_figures.look.panels import CORRECTED, NONE, THESIS
from paper_figures.look.style import FULL_WIDTH, LINES, styled

TABLES: tuple[str, ...] = ("sampled", "sampled_summary")

RUNS = (CORRECTED, THESIS, NONE)
BROAD = "#CCCCCC"
DECADES = 8
DIVERGENT = 100.0  # a run whose error exceeds another's by more than this leaves the panels


def caption(tables: Mapping[str, pd.DataFrame]) -> str:
    """Return the caption with the numbers of the tables."""
    summary = tables["sampled_summary"]
    rates = np.unique(summary["rate_hz"].dropna())
    quantum = only(summary, "quantum")
    tustin, held = (
        " to ".join(_size(_of(summary, "corrected", method, rate, "steady_error")) for rate in rates[[0, -1]])
        for method in ("tustin", "exact")
    )
    shown, slowest, fastest = (sampling_rate(hertz) for hertz in (only(summary, "shown_hz"), *rates[[0, -1]]))
    ends = [
        settled(_of(summary, "corrected", method, rate, "settling_s"))
        for method, rate in ((CONTINUOUS, math.nan), ("tustin", only(summary, "shown_hz")))
    ]
    return (
        f"A real drive: limits +-{number(only(summary, 'limit'))} in "
        f"{round(2 * only(summary, 'limit') / quantum)} steps, {duration(only(summary, 'full_range_s'))} across, one "
        f"sample late. (a) The largest error from t0 on: broad, continuous time; thin, the drive at "
        f"{shown}, Tustin's rule. Corrected, it {ends[0]} and {ends[1]}. (b) The largest error of "
        f"the last period; dotted, the rate of (a). Corrected, at {slowest} to {fastest}: {held} with held inputs, "
        f"{tustin} with Tustin's rule. The thesis's offset, "
        f"{_size(_of(summary, 'thesis', CONTINUOUS, math.nan, 'steady_error'))}, stays.{_divergent(summary)}"
    )


def _of(summary: pd.DataFrame, run: str, method: str, rate_hz: float, column: str) -> float:
    """The value of a column for a run, a method and a rate; NaN is the rate of continuous time."""
    rows = summary[(summary["run"] == run) & (summary["method"] == method)]
    if not math.isnan(rate_hz):
        rows = rows[np.isclose(rows["rate_hz"], rate_hz, rtol=1e-6)]
    return float(rows[column].iloc[0])


def _size(error: float) -> str:
    return "unbounded" if math.isnan(error) else number(error)


def _divergent(summary: pd.DataFrame) -> str:
    """How many of the runs with a drive are not there because they diverge."""
    gone = int((summary["steady_error"].isna() & summary["rate_hz"].notna()).sum())
    return f" Divergent runs, not drawn: {gone}." if gone else ""


@styled()
def draw(tables: Mapping[str, pd.DataFrame]) -> Figure:
    """Return the figure; both panels have the same view, and (a) ends where (b) reads it."""
    table, summary = tables["sampled"], tables["sampled_summary"]
    axes = panels.lettered(FULL_WIDTH, 2.9, "ab")
    time_s = table["time_s"].to_numpy(float)
    tails = {column: _tail(table[column].to_numpy(float)) for column in table if column != "time_s"}
    for order, run in enumerate(RUNS):
        line = LINES[run.kind]
        axes["a"].plot(*panels.envelope(time_s, tails[f"error_{run.name}"]), **panels.band(line))
        drive = panels.envelope(time_s, tails[f"error_{run.name}_drive"])
        axes["a"].plot(*drive, **(line | {"linewidth": 1.0}), label=run.label, zorder=3 + order)
    axes["a"].plot([], [], color=BROAD, linewidth=4.0, label="continuous time")
    axes["a"].set(xlabel="Time $t_0$ [s]", ylabel=r"$\max_{t \geq t_0}\,|e(t)|$ [unit of $y$]")
    axes["a"].set_xlim(0, time_s[-1] - only(summary, "period_s"))
    axes["a"].legend(**panels.ABOVE, ncols=2)
    over_rate(axes["b"], summary, [run.name for run in RUNS])
    axes["b"].axvline(only(summary, "shown_hz"), **LINES["family 6"], label="rate of (a)")
    axes["b"].set_ylabel(r"$\max\,|e(t)|$, last period [unit of $y$]")
    axes["b"].legend(**panels.ABOVE, ncols=2)
    peaks = np.array([tail[0] for tail in tails.values() if np.isfinite(tail[0])])
    top = 2 * min(peaks.max(), DIVERGENT * peaks.min()) if len(peaks) else 1.0
    least = float(summary["steady_error"][summary["rate_hz"].notna()].min())
    bottom = max(least / 3, top / 10**DECADES) if 3 * top > least else top / 10**DECADES
    for panel in axes.values():
        panel.set(yscale="log", ylim=(bottom, top))
    figure = axes["a"].get_figure(root=True)
    assert figure is not None
    return figure


def _tail(error: np.ndarray) -> np.ndarray:
    """The greatest |error| from each sample on; NaN for a run that diverges."""
    return np.asarray(np.maximum.accumulate(np.abs(error[::-1]))[::-1])
