"""Fig. A.6: what the anti-windup does over the plants that W_a admits: errors, recovery and stability."""

from __future__ import annotations

import math
from collections.abc import Mapping

import pandas as pd
from matplotlib.figure import Figure

from paper_figures.axis_figures.campaign import UNSURE, band, distributions
from paper_figures.look.captions import number, of_limits, of_run, only
from paper_figures.look.panels import CORRECTED, NONE, THESIS
from paper_figures.look.style import styled

TABLES: tuple[str, ...] = ("campaign", "campaign_summary", "campaign_distance")

RUNS = (CORRECTED, THESIS, NONE)  # the thin lines upon the broad ones
SAID = {"none": "without anti-windup", "thesis": "thesis", "corrected": "corrected"}


def caption(tables: Mapping[str, pd.DataFrame]) -> str:
    """Return the caption with the numbers of the tables."""
    summary = tables["campaign_summary"]
    plants = int(only(summary, "plants"))
    return (
        f"SYNTHETIC: the loop of chapter 4 with {plants} plant{'s' if plants > 1 else ''} drawn within W_a "
        f"(seed {int(only(summary, 'seed'))}), limits {of_limits(summary)}. (a) to (c) The share of plants up to each "
        f"value, +-{number(band(plants), 2)} with {number(100 * (1 - UNSURE))} % confidence; a line ends below 1 where "
        "runs diverge or do not recover. Plants whose |e| settles within 1 % of the amplitude: "
        f"{_outcomes(summary)}. (d) The errors of (a) over |P_true - P|/|W_a|. Without limits "
        f"{_percent(only(summary, 'linear_stable'))} of the loops are stable."
    )


def _outcomes(summary: pd.DataFrame) -> str:
    """For each run how many plants recover, half of all within what time."""
    said = []
    for name, label in SAID.items():
        recovered, time_s = (of_run(summary, name, column) for column in ("recovered", "recovery_50_s"))
        after = "" if math.isnan(time_s) else f" (half within {number(time_s)} s)"
        said.append(f"{label} {_percent(recovered)}{after}")
    return "; ".join(said)


def _percent(share: float) -> str:
    return f"{number(100 * share)} %"


@styled()
def draw(tables: Mapping[str, pd.DataFrame]) -> Figure:
    """Return the figure; an axis of errors is logarithmic where they differ a hundredfold."""
    return distributions(tables, {run.name: run.label for run in RUNS}, "unit of y")
