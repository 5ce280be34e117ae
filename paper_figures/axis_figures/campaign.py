"""What the loop does over the plants that W_a admits: errors, recovery and stability."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.colors import to_rgba
from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter

from design.design_file import Design
from paper_figures.axis_figures.labels import KINDS, look_of, united
from paper_figures.look import panels
from paper_figures.look.captions import actuator_said, duration, number, of_run, only, time_unit, with_unit
from paper_figures.look.style import FULL_WIDTH, LINES, styled

TABLES: tuple[str, ...] = ("campaign", "campaign_summary", "campaign_distance")

RUNS = ("corrected", "none")  # the thin lines upon the broad ones
MEASURES = {
    "a": ("peak_error", "Peak error after a quarter of a period"),
    "b": ("steady_error", "Peak error of the last period"),
    "c": ("recovery_s", "Recovery time"),
}
ENDS = ("least", "greatest")
BEYOND = 10.0  # times the top of a panel: what is not in it
DECADES = 9
LOGARITHMIC = 100.0  # times the least error is the greatest, from where on the axis is
UNSURE = 0.05  # a distribution function leaves its band as often as that


def caption(design: Design, tables: Mapping[str, pd.DataFrame]) -> str:
    """Return the caption with the numbers of the tables."""
    summary, signals = tables["campaign_summary"], design.signals
    plants = int(only(summary, "plants"))
    return (
        f"SYNTHETIC: {plants} plant{'s' if plants > 1 else ''} drawn within W_a (seed {int(only(summary, 'seed'))}), "
        f"each in the loop of the same design, under the limits {actuator_said(summary, signals.input_unit)}, for "
        f"{duration(only(summary, 'horizon_s'))} of the reference. How they lie within W_a is a choice of the program, "
        "so the shares are no probabilities of a real plant. (a) to (c) The share of all the plants whose numbers are "
        "no larger: the greatest error after a quarter of the reference's period, that of the last period, and the "
        "time after which the error stays within 1 % of the reference's amplitude. Runs that diverge or do not recover "
        f"count among all, so a line may end below 1. {_outcomes(summary, signals.output_unit)} (d) The errors of (a), "
        "from the least to the greatest, in each tenth of the distance from the model, the largest |P_true - P|/|W_a|. "
        f"Without limits {_percent(only(summary, 'linear_stable'))} of the loops are stable. With "
        f"{number(100 * (1 - UNSURE))} % confidence more plants would move a line by no more than "
        f"{number(band(int(only(summary, 'plants'))), 2)}."
    )


def _outcomes(summary: pd.DataFrame, unit: str) -> str:
    """For each run how many plants recover and diverge, with the medians."""
    said = []
    for run in RUNS:
        recovered, diverged, error, time_s = (
            of_run(summary, run, column) for column in ("recovered", "diverged", "steady_error_50", "recovery_50_s")
        )
        after = "" if math.isnan(time_s) else f", half of all within {duration(time_s)}"
        size = "unbounded" if math.isnan(error) else with_unit(error, unit)
        words = "With the corrected anti-windup" if run == "corrected" else "Without anti-windup"
        said.append(
            f"{words} {_percent(recovered)} recover{after}, {_percent(diverged)} diverge, and the median of the last "
            f"period's error is {size}."
        )
    return " ".join(said)


def _percent(share: float) -> str:
    return f"{number(100 * share)} %"


def band(plants: int) -> float:
    """Half the width of the 95 % confidence band around a distribution function of so many plants.

    With Massart's constant in the inequality of Dvoretzky, Kiefer and Wolfowitz.
    """
    return math.sqrt(math.log(2 / UNSURE) / (2 * plants))


@styled()
def draw(design: Design, tables: Mapping[str, pd.DataFrame]) -> Figure:
    """Return the figure; an axis of errors is logarithmic where they differ a hundredfold."""
    return distributions(tables, {run: KINDS[run] for run in RUNS}, design.signals.output_unit)


def distributions(tables: Mapping[str, pd.DataFrame], words: Mapping[str, str], unit: str) -> Figure:
    """Draw the distributions over the plants of each run; ``words`` are what they are called, ``unit`` the errors'."""
    table = tables["campaign"]
    axes = panels.lettered(FULL_WIDTH, 4.8, "ab;cd")
    for letter, (measure, label) in MEASURES.items():
        panel = axes[letter]
        shown = table[table["run"].isin(list(words))]
        low, high = _view(shown[measure], measure)
        scale, said_unit = time_unit(high) if measure == "recovery_s" else (1.0, unit)
        for order, (run, said) in enumerate(words.items()):
            rows = table[table["run"] == run]
            line = _steps(rows[measure].to_numpy(float), rows["share"].to_numpy(float), low, high)
            panel.plot(line[0] / scale, line[1], **LINES[look_of(run)], label=said, zorder=3 + order)
        panel.set(xlim=(low / scale, high / scale), xscale="log" if high > LOGARITHMIC * low > 0 else "linear")
        panel.set_xlabel(united(label, said_unit))
        if measure == "recovery_s" and shown[measure].isna().all():
            panel.text(0.5, 0.5, "no run recovers", transform=panel.transAxes, ha="center", va="center")
            panel.set_xticks([])
        panel.xaxis.set_minor_formatter(NullFormatter())
    axes["a"].legend(**panels.ABOVE, ncols=2)
    for letter in MEASURES:
        axes[letter].set(ylabel="" if letter == "b" else "Share of the plants [-]", ylim=(-0.03, 1.03))
    _over_distance(axes["d"], tables["campaign_distance"], list(words), axes["a"].get_xlim())
    axes["d"].set(yscale=axes["a"].get_xscale(), ylabel=united("Peak error", unit))
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


def _over_distance(panel: Axes, table: pd.DataFrame, runs: Sequence[str], view: tuple[float, float]) -> None:
    """Bands from the least to the greatest peak error of the plants in each bin; one that diverges is beyond the view.

    A bin without a plant leaves a gap.
    """
    for order, run in enumerate(runs):
        rows = table[table["run"] == run]
        edges = np.append(rows["from"].to_numpy(float), rows["to"].to_numpy(float)[-1:])
        beyond = np.where(rows["plants"] > 0, BEYOND * view[1], np.nan)
        least, greatest = (rows[f"{end}_peak_error"].fillna(pd.Series(beyond, rows.index)) for end in ENDS)
        line = LINES[look_of(run)]
        fill = {"fill": True, "facecolor": to_rgba(line["color"], 0.3), "edgecolor": line["color"]}
        panel.stairs(greatest, edges, baseline=least, **fill, linewidth=0.8, zorder=2 + order / 10)
    nearest = float(table["from"][table["plants"] > 0].min())
    panel.set(xlabel="Distance from the model [-]", xlim=(nearest, 1), ylim=view)
