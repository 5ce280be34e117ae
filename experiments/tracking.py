"""One design from rest under its user's reference and limits, without and with anti-windup, as two tables."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import pandas as pd

from design.design_file import Design
from experiments.engine.simulate import limit_pair, simulate
from experiments.runs.compare_anti_windups import (
    SETTLED,
    is_slewing,
    loops,
    run_all,
    tracking_summary,
    tracking_table,
    verdicts,
)
from experiments.runs.metrics import of_table, recovery
from experiments.runs.references import Reference, SampledReference
from experiments.runs.region import longest_run, require_within_region
from experiments.runs.run_length import required, scale, settled_periods, span
from experiments.runs.sector_promise import steady_control

SAMPLES, LEAST, ROWS = 2000, 100, 20_000  # a period at most, a period at least, and in all


def tracking_tables(
    design: Design,
    reference: Reference | SampledReference,
    limits: float | Sequence[float],
    names: Sequence[str] = ("none", "corrected"),
    *,
    rate_limit: float = math.inf,
    periods: int | None = None,
    samples: int | None = None,
) -> dict[str, pd.DataFrame]:
    """Run a design from rest with several anti-windups.

    Parameters
    ----------
    design
        Of either kind.
    reference
        r(t); a sampled one runs until its last time.
    limits
        Of the actuator, (lower, upper), or one number for +- that.
    names
        The anti-windups, see :meth:`design.design_file.Design.chosen`.
    rate_limit
        The most that the actuator's output changes in a second, in its unit; the controller does not know it.
    periods, samples
        Length of a run in :func:`experiments.runs.run_length.span`, unless given until it has settled, see
        :func:`experiments.runs.run_length.settled_periods`; and its samples in each.

    Returns
    -------
    dict
        ``tracking`` and ``tracking_summary``, see :mod:`experiments.runs.compare_anti_windups`. To the summary are
        added rate_limit (empty: none), slews (1 where the actuator was too slow for the control in this run, else 0),
        recovery_s (when the output has come to within 1 % of the reference's amplitude of the loop without limits for
        good; empty: not before the last period), steady_least and steady_greatest, between which lies the control that
        follows the reference, linear_control, the greatest \\|u\\| of the loop without limits, span_s,
        the length of what is called the last period, until_s, that of the runs, and settled (0 where the run would have
        to last longer to be judged by its last period, else 1).

    Raises
    ------
    InputError
        The limits are not in order, there is no anti-windup of a name, or the reference takes an unstable plant out of
        the region in which the limits can hold it.
    """
    pair, plant = limit_pair(limits), design.loop_plant
    require_within_region(plant, reference, pair)
    span_s, count, left = span(design, reference), periods, frozenset[str]()
    if count is None:
        count, left = settled_periods(design, reference, pair, rate_limit, names)
    until = min(count * span_s, longest_run(plant))
    samples = samples or max(min(SAMPLES, round(ROWS / count)), LEAST)
    time_s = np.linspace(0.0, until, max(round(until / span_s * samples), 2) + 1)
    every = loops(design, reference, names)
    runs = run_all(every, pair, time_s, rate_limit)
    linear = simulate(next(iter(every.values())), (-math.inf, math.inf), time_s)
    promised = verdicts(design, every, runs, pair, reference)
    steady = steady_control(reference, plant, time_s)
    summary = tracking_summary(runs, promised, pair, reference, required(plant, reference), span_s)
    far = [run.outputs["output"] - linear.outputs["output"] for run in runs.values()]
    band = SETTLED * scale(reference, span_s)
    return {
        "tracking": tracking_table(runs, reference),
        "tracking_summary": summary.assign(
            rate_limit=of_table(rate_limit),
            slews=[int(is_slewing(run)) for run in runs.values()],
            recovery_s=[recovery(time_s, each, band, span_s) for each in far],
            steady_least=float(steady.min()),
            steady_greatest=float(steady.max()),
            linear_control=float(np.abs(linear.control).max()),
            span_s=span_s,
            until_s=until,
            settled=[int(name not in left) for name in runs],
        ),
    }
