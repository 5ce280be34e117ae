"""The chapter 2 loop under saturation, without and with anti-windup (Fig. 2.12 to 2.14)."""

from __future__ import annotations

import numpy as np
import pandas as pd

from data.thesis import printed_numbers
from design.design_file import Design
from experiments.runs.compare_anti_windups import NAMES
from experiments.thesis.printed_choices import thesis_reference
from experiments.tracking import tracking_tables

PERIODS = 6  # the thesis does not print its horizon
SAMPLES_PER_PERIOD = 4000


def delay_free_tables(design: Design, limit: float | None = None) -> dict[str, pd.DataFrame]:
    """Run a delay-free design from rest.

    Parameters
    ----------
    design
        Of kind "delay-free".
    limit
        Of the actuator, +-limit; the thesis's printed one unless given.

    Returns
    -------
    dict
        ``delay_free`` and ``delay_free_summary``, see :mod:`experiments.runs.compare_anti_windups`.
    """
    reference = thesis_reference("delay-free", design.reference_omegas)
    used = printed_numbers()["delay_free"]["limit"] if limit is None else limit
    found = tracking_tables(design, reference, used, NAMES, periods=PERIODS, samples=SAMPLES_PER_PERIOD)
    return {
        "delay_free": found["tracking"],
        "delay_free_summary": as_thesis(found["tracking_summary"], found["tracking"], limit is not None),
    }


def as_thesis(summary: pd.DataFrame, table: pd.DataFrame, limit_is_given: bool) -> pd.DataFrame:
    """What the captions on the thesis's loops say of their runs.

    Parameters
    ----------
    summary, table
        See :func:`experiments.runs.compare_anti_windups.tracking_summary`, and the table that it sums up.
    limit_is_given
        Whether the user gave the limit; else it is the thesis's, printed or found.

    Returns
    -------
    DataFrame
        The columns of the summary up to ``covered`` without lower_limit and asked_control; limit_is_given (0 or 1); and
        peak_error_after_1s (from one second on, as chapter 4 reads its plot; empty: the run is shorter).
    """
    after = table[table["time_s"] >= 1.0]
    peaks = [float(np.abs(after[f"error_{run}"].to_numpy()).max()) if len(after) else np.nan for run in summary["run"]]
    found = summary.loc[:, :"covered"].drop(columns=["lower_limit", "asked_control"])
    found.insert(2, "limit_is_given", int(limit_is_given))
    found.insert(list(found).index("ripple") + 1, "peak_error_after_1s", peaks)
    return found
