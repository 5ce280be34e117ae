"""What the figures of chapter 4 share: how its limits were chosen, and which part of its runs is enlarged."""

from __future__ import annotations

import math
from collections.abc import Mapping

import pandas as pd

from data.thesis import printed_numbers
from experiments.thesis.studies.desaturation import PERIODS, desaturation
from paper_figures.look.captions import duration, last_saturated, number, of_run

MARGIN = 1.15
"""How much longer the enlarged part is than the time to the last saturation."""


def chosen_limit(tables: Mapping[str, pd.DataFrame]) -> str:
    """Say how the limits, which are not printed, were chosen."""
    summary = tables["extended_summary"]
    limit, time_s = (of_run(summary, "none", column) for column in ("limit", "last_saturation_s"))
    if of_run(summary, "none", "limit_is_given"):
        return f"Under the given limits of +-{number(limit, 4)} the loop without anti-windup {last_saturated(time_s)}."
    target = desaturation(float(tables["extended"]["time_s"].iloc[-1]) / PERIODS)
    printed_s = float(printed_numbers()["extended"]["desaturation_s"])
    when = "at around 4 seconds, as the text says"
    if not math.isclose(target, printed_s, rel_tol=1e-6):
        when = f"at around {duration(target)}, as late in the reference's period as the text says"
    return (
        f"Chapter 4 prints no limits; +-{number(limit, 4)} are those under which the program finds that the loop "
        f"without anti-windup leaves saturation {when}: it {last_saturated(time_s)}."
    )


def beginning(tables: Mapping[str, pd.DataFrame], *runs: str) -> float:
    """Return the end [s] of the part to enlarge: a little after the last saturation, else a tenth of the run."""
    last = [of_run(tables["extended_summary"], run, "last_saturation_s") for run in runs]
    end = float(tables["extended"]["time_s"].iloc[-1])
    return min(MARGIN * max(last), end) if all(time > 0 for time in last) else end / 10
