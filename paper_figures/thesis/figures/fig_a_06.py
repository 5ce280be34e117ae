"""Fig. A.6: what the anti-windup does over the plants that W_a admits: errors, recovery and stability."""

from __future__ import annotations

import math
from collections.abc import Mapping

import pandas as pd
from matplotlib.figure import Figure

from experiments.runs.words import sector_text
from paper_figures.axis_figures.campaign import UNSURE, band, distributions
from paper_figures.look.captions import capitalised, number, of_limits, of_run, only
from paper_figures.look.panels import CORRECTED, NONE, THESIS
from paper_figures.look.style import styled

TABLES: tuple[str, ...] = ("campaign", "campaign_summary", "campaign_distance")

RUNS = (CORRECTED, THESIS, NONE)  # the thin lines upon the broad ones
SAID = {"none": "without anti-windup", "thesis": "with the thesis's", "corrected": "with the corrected one"}


def caption(tables: Mapping[str, pd.DataFrame]) -> str:
    """Return the caption with the numbers of the tables."""
    summary = tables["campaign_summary"]
    plants = int(only(summary, "plants"))
    return (
        "What the anti-windup does over the plants that W_a admits (not in the thesis). SYNTHETIC: "
        f"{plants} plant{'s' if plants > 1 else ''} that we drew (seed {int(only(summary, 'seed'))}), "
        "each in the loop of the same design, under "
        f"the limits {of_limits(summary)}, for {number(only(summary, 'horizon_s'))} s of the thesis's "
        f"reference. {_promised(summary)} How they lie within W_a is a choice of ours, so the shares are no "
        "probabilities of a real plant. "
        "(a) to (c) The share of all the plants whose numbers are no larger: the peak of |e| after a quarter of the "
        "reference's period, the peak of the last period, and the time after which |e| stays within 1 % of the "
        "reference's amplitude. Runs that diverge or do not recover count among all, so a line may end below 1. With "
        f"{number(100 * (1 - UNSURE))} % confidence more plants would move a line by no more than "
        f"{number(band(plants), 2)}. "
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
    return capitalised("; ".join(said))


def _percent(share: float) -> str:
    return f"{number(100 * share)} %"


@styled()
def draw(tables: Mapping[str, pd.DataFrame]) -> Figure:
    """Return the figure; an axis of errors is logarithmic where they differ a hundredfold."""
    return distributions(tables, {run.name: run.label for run in RUNS}, "")
