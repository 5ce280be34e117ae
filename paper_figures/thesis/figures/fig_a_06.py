"""Fig. A.6: what the anti-windup does over the plants that W_a admits: errors, recovery and stability."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter

from experiments.runs.guarantee import sector_text
from paper_figures.look import panels
from paper_figures.look.captions import number, of_limits, of_run, only
from paper_figures.look.panels import CORRECTED, NONE, THESIS
from paper_figures.look.style import FULL_WIDTH, LINES, styled

TABLES: tuple[str, ...] = ("campaign", "campaign_summary", "campaign_distance")

RUNS = (CORRECTED, THESIS, NONE)  # the thin lines upon the broad ones
SAID = {"none": "without anti-windup", "thesis": "with the thesis's", "corrected": "with the corrected one"}
MEASURES = {
    "a": ("peak_error", "Peak error, after a quarter of a period"),
    "b": ("steady_error", "Steady error, of the last period"),
    "c": ("recovery_s", "Recovery time [s]"),
}
STABLE = panels.band(LINES["family 4"])
DECADES = 9
LOGARITHMIC = 100.0  # times the least error is the greatest, from where on the axis is
UNSURE = 0.05  # a distribution function leaves its band as often as that


def caption(tables: Mapping[str, pd.DataFrame]) -> str:
    """Return the caption with the numbers of the tables."""
    summary = tables["campaign_summary"]
    plants = int(only(summary, "plants"))
    # Massart's constant in the inequality of Dvoretzky, Kiefer and Wolfowitz
    band = math.sqrt(math.log(2 / UNSURE) / (2 * plants))
    return (
        "What the anti-windup does over the plants that W_a admits (not in the thesis). SYNTHETIC: "
        f"{plants} plants that we drew (seed {int(only(summary, 'seed'))}), each in the loop of the same design, under "
        f"the limits {of_limits(summary)}, for {number(only(summary, 'horizon_s'))} s of the thesis's "
        f"reference. {_promised(summary)} How they lie within W_a is a choice of ours, so the shares are no "
        "probabilities of a real plant. "
        "(a) to (c) The share of all the plants whose numbers are no larger: the peak of |e| after a quarter of the "
        "reference's period, the peak of the last period, and the time after which |e| stays within 1 % of the "
        "reference's amplitude. Runs that diverge or do not recover count among all, so a line may end below 1. With "
        f"{number(100 * (1 - UNSURE))} % confidence more plants would move a line by no more than {number(band, 2)}. "
        f"{_outcomes(summary)}. (d) The shares in each tenth of the distance from the model, the largest "
        f"|P_true - P|/|W_a|: broad grey, the linear loop is stable ({_percent(only(summary, 'linear_stable'))} of "
        "all); coloured, the run recovers."
    )


def _promised(summary: pd.DataFrame) -> str:
    """Of which anti-windup a guarantee speaks of these plants, and how many of its runs it covers."""
    said = [
        f"with the {run} one, the sector {sector_text(sector)}, it covers {_percent(of_run(summary, run, 'covered'))} "
        "of the runs"
        for run in ("corrected", "thesis")
        if (sector := of_run(summary, run, "guaranteed_sector")) > 0
    ]
    if not said:
        return "No anti-windup has a guarantee that speaks of all these plants."
    return f"What an anti-windup guarantees of all these plants: {'; '.join(said)}."


def _outcomes(summary: pd.DataFrame) -> str:
    """For each run how many plants recover and diverge, with the medians."""
    said = []
    for name, label in SAID.items():
        recovered, diverged, error, time_s = (
            of_run(summary, name, column) for column in ("recovered", "diverged", "steady_error_50", "recovery_50_s")
        )
        after = "" if math.isnan(time_s) else f", half of all within {number(time_s)} s"
        size = "unbounded" if math.isnan(error) else number(error)
        said.append(
            f"{label} {_percent(recovered)} recover{after}, {_percent(diverged)} diverge, and the median of the last "
            f"period's error is {size}"
        )
    sentence = "; ".join(said)
    return sentence[0].upper() + sentence[1:]


def _percent(share: float) -> str:
    return f"{number(100 * share)} %"


@styled()
def draw(tables: Mapping[str, pd.DataFrame]) -> Figure:
    """Return the figure; an axis of errors is logarithmic where they differ a hundredfold."""
    table = tables["campaign"]
    axes = panels.lettered(FULL_WIDTH, 4.8, "ab;cd")
    for letter, (measure, label) in MEASURES.items():
        panel = axes[letter]
        low, high = _view(table[measure], measure)
        for order, run in enumerate(RUNS):
            rows = table[table["run"] == run.name]
            line = _steps(rows[measure].to_numpy(float), rows["share"].to_numpy(float), low, high)
            panel.plot(*line, **LINES[run.kind], label=run.label, zorder=3 + order)
        panel.set(xlabel=label, xlim=(low, high), xscale="log" if high > LOGARITHMIC * low > 0 else "linear")
        panel.xaxis.set_minor_formatter(NullFormatter())
    axes["a"].legend(**panels.ABOVE, ncols=2)
    _over_distance(axes["d"], tables["campaign_distance"])
    for letter, panel in axes.items():
        panel.set(ylabel={"b": "", "d": "Share that recovers"}.get(letter, "Share of the plants"), ylim=(-0.03, 1.03))
    figure = axes["a"].get_figure(root=True)
    assert figure is not None
    return figure


def _view(values: pd.Series, measure: str) -> tuple[float, float]:
    """The ends of an axis: times from 0 on, errors in as many decades as can be read."""
    known = values.dropna()
    if known.empty or not known.max() > 0:
        return 0.0, 1.0
    if measure == "recovery_s":
        return 0.0, 1.1 * float(known.max())
    margin = 2.0 if known.max() > LOGARITHMIC * known.min() else 1.05
    high = margin * float(known.max())
    return max(float(known.min()) / margin, high / 10**DECADES), high


def _steps(values: np.ndarray, share: np.ndarray, low: float, high: float) -> tuple[np.ndarray, np.ndarray]:
    """The corners of a distribution function between the ends of the axis."""
    known = np.isfinite(values)
    corners = np.repeat(np.concatenate([[low], values[known], [high]]), 2)[1:-1]
    return corners, np.repeat(np.concatenate([[0.0], share[known]]), 2)


def _over_distance(panel: Axes, table: pd.DataFrame) -> None:
    """The shares in each bin, as steps; a bin without a plant leaves a gap."""
    for order, run in enumerate(RUNS):
        rows = table[table["run"] == run.name]
        edges = np.append(rows["from"].to_numpy(float), rows["to"].to_numpy(float)[-1:])
        panel.stairs(rows["recovered"], edges, baseline=None, **LINES[run.kind], zorder=3 + order)
        if run is NONE:
            panel.stairs(rows["linear_stable"], edges, baseline=None, **STABLE, label="linear loop stable")
    panel.set(xlabel="Distance from the model", xlim=(0, 1))
    panel.legend(**panels.ABOVE)
