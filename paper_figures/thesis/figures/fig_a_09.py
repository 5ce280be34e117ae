"""Fig. A.9: the drift that rounding inside the controller causes, in the thesis's form and without hidden modes."""

from __future__ import annotations

import math
from collections.abc import Mapping

import pandas as pd
from matplotlib.figure import Figure

from paper_figures.look import panels
from paper_figures.look.captions import duration, number, of_run, only, sampling_rate
from paper_figures.look.style import FULL_WIDTH, LINES, styled

TABLES: tuple[str, ...] = ("hidden_modes", "hidden_modes_summary")

FORMS = {
    "thesis": ("thesis anti-windup", "thesis's form"),
    "coprime": ("corrected anti-windup", "without hidden modes"),
}
GROWTH = {0: "", 1: " t", 2: " t^2/2"}


def caption(tables: Mapping[str, pd.DataFrame]) -> str:
    """Return the caption with the numbers of the tables."""
    summary = tables["hidden_modes_summary"]
    bits, resolution, limit = (only(summary, column) for column in ("bits", "resolution", "limit"))
    return (
        f"Rounding v to multiples of {number(resolution)} (1/2^{bits:g} of the range +-{number(limit)}) moves the "
        f"output of chapter 4's loop, at {sampling_rate(only(summary, 'rate_hz'))} by Tustin's rule, in "
        f"{duration(only(summary, 'duration_s'), 4)}. As drawn in Fig. 2.6, K and 1/(1 - T_so T_si) hide the plant's "
        "poles in Re s >= 0; no feedback corrects rounding between them. "
        f"{_said(summary, 'thesis')}{_expected(summary)}. The same transfer function without hidden modes: "
        f"{_said(summary, 'coprime')}."
    )


def _said(summary: pd.DataFrame, form: str) -> str:
    drift, largest = (of_run(summary, form, column) for column in ("drift", "largest_drift"))
    if math.isnan(drift):
        return "The loop diverges"
    return f"The drift ends at {number(drift)} (at most {number(largest)})"


def _expected(summary: pd.DataFrame) -> str:
    """The drift that half a step makes, if the plant has one to compare with."""
    expected = only(summary, "expected_drift")
    if math.isnan(expected):
        return ""
    growth = GROWTH[int(only(summary, "integrators"))]
    return f"; half a step makes -K (step/2){growth} = {number(expected)} (dashed)"


@styled()
def draw(tables: Mapping[str, pd.DataFrame]) -> Figure:
    """Return the figure."""
    table, summary = tables["hidden_modes"], tables["hidden_modes_summary"]
    axes = panels.lettered(FULL_WIDTH, 2.7, "ab")
    time_s = table["time_s"]
    for form, (kind, label) in FORMS.items():
        drift = table[f"drift_{form}"]
        on_top = 3 - LINES[kind]["linewidth"] / 10
        axes["a"].plot(time_s, drift, **LINES[kind], label=label, zorder=on_top)
        axes["b"].loglog(time_s, drift.abs(), **LINES[kind], zorder=on_top)
    expected = only(summary, "expected_drift")
    if not math.isnan(expected):
        line = expected * (time_s / only(summary, "duration_s")) ** only(summary, "integrators")
        axes["a"].plot(time_s, line, **LINES["reference"], zorder=3)
        axes["b"].loglog(time_s, line.abs(), **LINES["reference"], label="half a step", zorder=3)
        axes["b"].legend(**panels.ABOVE)
    axes["a"].set(xlabel="Time $t$ [s]", ylabel="Drift of the output $y$ [unit of $y$]", xlim=(0, time_s.iloc[-1]))
    axes["b"].set(
        xlabel="Time $t$ [s]", ylabel="Size of the drift [unit of $y$]", xlim=(time_s.iloc[0], time_s.iloc[-1])
    )
    axes["a"].legend(**panels.ABOVE, ncols=2)
    return axes["a"].figure  # type: ignore[return-value]
