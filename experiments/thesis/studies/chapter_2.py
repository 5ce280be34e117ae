"""The chapter 2 loop under saturation, without and with anti-windup (Fig. 2.12 to 2.14)."""

from __future__ import annotations

import numpy as np
import pandas as pd

from data.thesis import printed_numbers
from design.design_file import Design
from experiments.runs.compare_anti_windups import loops, run_all, span, tracking_summary, tracking_table, verdicts
from experiments.thesis.printed_choices import thesis_reference

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
    limit_is_given = limit is not None
    limit = printed_numbers()["delay_free"]["limit"] if limit is None else limit
    horizon = PERIODS * span(design, reference)
    time_s = np.linspace(0.0, horizon, PERIODS * SAMPLES_PER_PERIOD + 1)
    exact = loops(design, reference)
    runs = run_all(exact, limit, time_s)
    promised = verdicts(design, exact, runs, limit, reference)
    required = reference.required(design.loop_plant).value
    return {
        "delay_free": tracking_table(runs, reference),
        "delay_free_summary": tracking_summary(
            runs, promised, limit, limit_is_given, reference, required, horizon / PERIODS
        ),
    }
