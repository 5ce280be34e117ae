"""Fig. A.4: the error that no control under the same limits can better, and what the loops reach."""

from __future__ import annotations

import math
from collections.abc import Mapping

import pandas as pd
from matplotlib.figure import Figure

from paper_figures.axis_figures.limits import FLOOR, curves
from paper_figures.look import panels
from paper_figures.look.captions import at_least, at_most, number, only
from paper_figures.look.panels import CORRECTED, NONE, THESIS
from paper_figures.look.style import FULL_WIDTH, LINES, styled

TABLES: tuple[str, ...] = (
    "limits_extended",
    "limits_extended_summary",
    "limits_delay_free",
    "limits_delay_free_summary",
)

RUNS = (NONE, THESIS, CORRECTED)


def caption(tables: Mapping[str, pd.DataFrame]) -> str:
    """Return the caption with the numbers of the tables."""
    rest, periodic = (_chosen(tables, kind) for kind in ("extended", "delay_free"))
    best, none, thesis, corrected = (
        _after(rest[f"settling_{name}_s"]) for name in ("upper", *(run.name for run in RUNS))
    )
    peaks = [_reaches(periodic[f"peak_{run.name}"]) for run in RUNS]
    return (
        "How much is left to gain. Grey: the error that no control within +-L can better, even if it knows the "
        "reference in advance, by linear programs and their dual certificates; the line on it is reached by some "
        f"control. (a) The loop with dead time from rest under L = {number(rest['limit'])}: the greatest error from t0 "
        "on, within three periods. The error comes to stay within 1 % of the reference's amplitude "
        f"{best} under the best control that was found, {none} without anti-windup, {thesis} with the thesis's one, "
        f"{corrected} with the corrected one. (b) The loop without dead time: the greatest error of the last of twelve "
        f"periods over L; dashed, the L that perfect tracking needs, {at_most(periodic['required'])}, from which on no "
        f"error is forced. At L = {number(periodic['limit'])} no control stays below "
        f"{at_least(periodic['periodic_lower'], 4)}, and one reaches {at_most(periodic['periodic_upper'], 4)}; without "
        f"anti-windup the loop {peaks[0]}, with the thesis's "
        f"one it {peaks[1]}, with the corrected one it {peaks[2]}."
    )


def _chosen(tables: Mapping[str, pd.DataFrame], kind: str) -> dict[str, float]:
    """The row of the limit that the summary is for."""
    table, limit = tables[f"limits_{kind}"], only(tables[f"limits_{kind}_summary"], "limit")
    nearest = int((table["limit"] - limit).abs().to_numpy().argmin())
    return {str(column): float(table[column].iloc[nearest]) for column in table}


def _after(time_s: float) -> str:
    return "never" if math.isnan(time_s) else f"after {number(time_s)} s"


def _reaches(peak: float) -> str:
    return "diverges" if math.isnan(peak) else f"reaches {number(peak)}"


@styled()
def draw(tables: Mapping[str, pd.DataFrame]) -> Figure:
    """Return the figure; (b) ends a little above the limit that perfect tracking needs."""
    axes = panels.lettered(FULL_WIDTH, 2.8, "ab")
    rest, periodic = tables["limits_extended_summary"], tables["limits_delay_free"]
    curves(axes["a"], rest, "start_s", "rest", {f"tail_{run.name}": run.kind for run in RUNS})
    axes["a"].plot([], [], **FLOOR, label="best that was found")
    for run in RUNS:
        axes["a"].plot([], [], **LINES[run.kind], label=run.label)
    axes["a"].set(xlabel="Time $t_0$ [s]", ylabel=r"$\max_{t \geq t_0}\,|e(t)|$")
    axes["a"].legend(**panels.ABOVE, ncols=2)

    peaks = {f"peak_{run.name}": run.kind for run in RUNS}
    curves(axes["b"], periodic, "limit", "periodic", peaks, {"marker": "o", "markersize": 2.5})
    required = only(periodic, "required")
    axes["b"].axvline(required, **LINES["reference"], label="needed for tracking")
    if len(periodic) > 1:
        axes["b"].set_xlim(right=min(float(periodic["limit"].max()), 1.04 * max(required, periodic["limit"].min())))
    axes["b"].set(xlabel="Limit $L$", ylabel=r"$\max\,|e(t)|$, last period")
    axes["b"].legend(**panels.ABOVE)
    figure = axes["a"].get_figure(root=True)
    assert figure is not None
    return figure
