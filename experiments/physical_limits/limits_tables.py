"""What the runs of a design leave to gain: the least peak error beside what its loops reach."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import partial

import numpy as np
import pandas as pd

from design.design_file import Design
from experiments.physical_limits.intervals import Interval
from experiments.physical_limits.least_peak_error import RestLimit, Tick, finite_limits, harmonic, periodic_limit
from experiments.runs.compare_anti_windups import NAMES, SETTLED, loops, run_all
from experiments.runs.metrics import of_table, settling_time
from experiments.runs.references import Reference
from experiments.runs.workers import gathered
from identification.model.plant import PlantModel

FEWER_STEPS = 100  # of a period from rest, for the settling time alone
RUN_PERIODS = 12
SAMPLES_PER_PERIOD = 2000

NEVER = Interval(math.nan, math.nan)


def limits_tables(
    design: Design,
    reference: Reference,
    limits: Sequence[float | Sequence[float]],
    tick: Tick = lambda: None,
    names: Sequence[str] = NAMES,
    rate_limit: float = math.inf,
    scheduler: str | None = None,
) -> dict[str, pd.DataFrame]:
    """What the runs without and with anti-windup leave to gain, under several limits.

    Parameters
    ----------
    design
        Of either kind.
    reference
        Periodic, see :func:`experiments.physical_limits.least_peak_error.periodic_limit`.
    limits
        Of the actuator, each (lower, upper), or one number for +- that.
    tick
        Called after every program and after every set of runs; on a cluster after every limit.
    names
        The anti-windups that are run, see :meth:`design.design_file.Design.chosen`.
    rate_limit
        The most that the actuator changes in a second, of the runs; what no controller betters is that of the limits.
    scheduler
        Address of a Dask cluster's, on which each limit is a piece, see :mod:`experiments.runs.workers`; None: here.

    Returns
    -------
    dict
        ``limits_KIND``, a row for each limit, from the nearest pair to the farthest: lower_limit, limit (the upper
        one), rate_limit (empty: none), required (the most that the control of perfect tracking reaches),
        periodic_lower, periodic_upper; settling_lower_s, settling_upper_s (from rest, to within 1 % of the reference's
        amplitude, see
        :meth:`experiments.physical_limits.least_peak_error.RestLimit.settling`); and for every run NAME peak_NAME
        (greatest |error| over the last of twelve periods), settling_NAME_s (to the same band), ratio_NAME (peak_NAME
        over periodic_lower). Cells are empty for what never settles, diverges, or would be divided by zero.
        ``limits_KIND_summary`` for the first limit: lower_limit, limit, rate_limit, start_s, rest_lower, rest_upper
        (see :class:`experiments.physical_limits.least_peak_error.RestLimit`) and tail_NAME, the greatest |error|
        of the run from start_s to the horizon of three periods. The runs' controls are found ones too: where one does
        better, rest_upper and settling_upper_s are its own.

    Raises
    ------
    InputError
        See :func:`experiments.physical_limits.least_peak_error.periodic_limit`.
    """
    plant, name = design.loop_plant, design.kind.replace("-", "_")
    harmonic(plant, reference)
    pairs = [finite_limits(plant, limit) for limit in limits]
    rows = [(pair, False) for pair in sorted(set(pairs), key=lambda pair: (pair[1] - pair[0], pair))]
    items, work = [(pairs[0], True), *rows], partial(limit_table, design, reference, names, rate_limit)
    if scheduler is None:
        summary, *found = [work(item, tick=tick) for item in items]
    else:
        summary, *found = gathered(work, items, scheduler, tick)
    return {f"limits_{name}": pd.concat(found, ignore_index=True), f"limits_{name}_summary": summary}


def limit_table(
    design: Design,
    reference: Reference,
    names: Sequence[str],
    rate_limit: float,
    item: tuple[tuple[float, float], bool],
    tick: Tick = lambda: None,
) -> pd.DataFrame:
    """What :func:`limits_tables` holds of one pair of limits.

    Parameters
    ----------
    design, reference, names, rate_limit, tick
        As there.
    item
        (lower, upper), and whether the table is ``limits_KIND_summary``, and not the pair's row of ``limits_KIND``.
    """
    pair, summed_up = item
    plant, facts = design.loop_plant, {"lower_limit": pair[0], "limit": pair[1], "rate_limit": of_table(rate_limit)}
    time_s = np.linspace(0.0, RUN_PERIODS * reference.period_s, RUN_PERIODS * SAMPLES_PER_PERIOD + 1)
    if summed_up:
        rest = RestLimit(plant, reference, pair, tick=tick)
        summary = rest.table().assign(**facts)
        time_s = np.union1d(time_s[time_s <= rest.horizon_s], summary["start_s"])
    runs = run_all(loops(design, reference, names), pair, time_s, rate_limit)
    tick()
    errors = {run: np.abs(result.outputs["error"]) for run, result in runs.items()}
    if not summed_up:
        facts["required"] = reference.required(plant).value
        return pd.DataFrame([facts | _row(plant, reference, pair, time_s, errors, tick)])
    for run, error in errors.items():
        tails = np.maximum.accumulate(error[::-1])[::-1]
        summary[f"tail_{run}"] = tails[np.searchsorted(time_s, summary["start_s"])]
    reached = summary[["rest_upper", *(f"tail_{run}" for run in errors)]].min(axis=1)
    summary["rest_upper"] = np.maximum(reached, summary["rest_lower"])
    return summary


def _row(
    plant: PlantModel,
    reference: Reference,
    limits: tuple[float, float],
    time_s: np.ndarray,
    errors: Mapping[str, np.ndarray],
    tick: Tick,
) -> dict[str, float]:
    band, periodic, settled = SETTLED * reference.amplitude, periodic_limit(plant, reference, limits), NEVER
    tick()
    if periodic.lower <= band:
        settled = RestLimit(plant, reference, limits, FEWER_STEPS, tick).settling(band)
    last = time_s >= time_s[-1] - reference.period_s
    peaks = {run: float(error[last].max()) for run, error in errors.items()}
    times = {run: settling_time(time_s, errors[run], band) if peaks[run] <= band else math.nan for run in errors}
    reached = float(np.fmin.reduce([settled.upper, *times.values()]))
    row = {"periodic_lower": periodic.lower, "periodic_upper": periodic.upper}
    row |= {"settling_lower_s": settled.lower, "settling_upper_s": max(reached, settled.lower)}  # NaN of reached stays
    for run, peak in peaks.items():
        row |= {f"peak_{run}": peak, f"settling_{run}_s": times[run]}
        row[f"ratio_{run}"] = peak / periodic.lower if periodic.lower > 0 else math.nan
    return row
