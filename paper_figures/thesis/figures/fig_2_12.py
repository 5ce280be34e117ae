"""Thesis Fig. 2.12: tracking with input saturation under the proposed anti-windup, and the tracking error."""

from __future__ import annotations

import math
from collections.abc import Mapping

import pandas as pd
from matplotlib.figure import Figure

from paper_figures.look import panels
from paper_figures.look.captions import at_least, number, of_run, required_input
from paper_figures.look.panels import CORRECTED, THESIS
from paper_figures.look.style import COLUMN_WIDTH, styled

TABLES: tuple[str, ...] = ("delay_free", "delay_free_summary")

CLAIMED = 0.098
"""The tracking error [%] that the text of section 2.4 claims for this figure."""


def caption(tables: Mapping[str, pd.DataFrame]) -> str:
    """Return the caption with the numbers of the tables."""
    summary = tables["delay_free_summary"]
    limit, required = (of_run(summary, "none", column) for column in ("limit", "required"))
    thesis, corrected = (
        f"{number(of_run(summary, run, 'offset'))} +- {number(of_run(summary, run, 'ripple'))} "
        f"({number(of_run(summary, run, 'relative_error_percent'))} %{whose})"
        for run, whose in (("thesis", " of the amplitude"), ("corrected", ""))
    )
    return (
        "Tracking with the proposed anti-windup (thesis Fig. 2.12): (a) reference and output, (b) error, with the "
        f"thesis's theta1~ and the corrected one. {required_input(summary)}. "
        f"{within_reach(limit, required)} Over the last period the error is {thesis} with "
        f"the thesis's theta1~ and {corrected} with the corrected one."
    )


def within_reach(limit: float, required: float) -> str:
    """Say how closely a reference can be followed whose integrator takes an input of amplitude ``required``.

    Notes
    -----
    While omega t is within x of the reference's steepest point, cos x = limit/required, an integrator cannot keep
    up and falls behind by twice A (sin x - x cos x), A being the reference's amplitude: half of that is an error at
    either end that no controller avoids.
    """
    x = math.acos(min(limit / required, 1.0))
    least = 100 * (math.sin(x) - x * math.cos(x))
    verdict = "is beyond reach" if least > CLAIMED else "is not ruled out by that"
    return (
        f"No controller makes an integrator follow closer than {at_least(least)} % of the amplitude: the text's "
        f"tracking error of {CLAIMED} % {verdict}."
    )


@styled()
def draw(tables: Mapping[str, pd.DataFrame]) -> Figure:
    """Return the figure: the output above the error."""
    axes = panels.lettered(COLUMN_WIDTH, 3.6, "a;b")
    panels.outputs(axes["a"], tables["delay_free"], THESIS, CORRECTED)
    panels.errors(axes["b"], tables["delay_free"], THESIS, CORRECTED)
    return panels.finished(axes)
