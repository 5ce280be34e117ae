"""What a real drive makes of the extended loop: its error over time and over the sampling rate (Fig. A.5)."""

from __future__ import annotations

import math

import numpy as np
import pandas as pd

from design.anti_windup.compensator import AntiWindup
from design.blocks.block import fastest_root
from design.design_file import Design
from experiments.drive.difference_equations import METHODS
from experiments.drive.sampled_loop import Drive, SampledRun, instants, simulate_sampled
from experiments.engine.simulate import DivergenceError
from experiments.runs.compare_anti_windups import SETTLED, compensators, loops, run_all, span
from experiments.runs.metrics import over_last, settling_time
from experiments.runs.references import Reference
from experiments.thesis.printed_choices import thesis_reference
from experiments.thesis.studies.chapter_4 import PERIODS, usual_limit
from identification.base.errors import InputError

# Our choices, in units of the design: the thesis has no computer and no drive.
SAMPLES = (2, 4, 8, 16, 32, 64)  # in a period of the fastest root of the controller
SHOWN = 16  # of them, whose run is kept over time
BITS = 12  # of the converter: 2^BITS levels from limit to limit
SLEW_PERIODS = 2  # of that root, which the actuator takes from limit to limit
LATE = 1  # samples from a sampling instant to the actuator's answer
MORE_PERIODS = 1  # than Fig. 4.1 to 4.4 have, so that the steady error is not what is left of the beginning
ROWS_PER_PERIOD = 1000


def sampled_rates_tables(design: Design, limit: float | None = None) -> dict[str, pd.DataFrame]:
    """Run an extended design from rest in continuous time and with a real drive at several rates.

    Parameters
    ----------
    design
        Of kind "extended".
    limit
        Of the actuator, +-limit; unless given, that of :func:`experiments.thesis.studies.chapter_4.extended_tables`.

    Returns
    -------
    dict
        ``sampled``: time_s and, for each anti-windup NAME, error_NAME (continuous) and error_NAME_drive (the drive with
        SHOWN samples, by Tustin's rule). ``sampled_summary``: a row for each run (NAME), method (continuous, tustin,
        exact) and rate_hz (empty: continuous): steady_error, the largest of the last period, and settling_s, after
        which the error stays within 1 % of the reference's amplitude around its lasting offset (empty: never);
        both empty where the loop diverges. In every row limit, quantum, full_range_s (from limit to limit), root
        (rad/s), shown_hz and period_s.

    Notes
    -----
    The rates are multiples of that of the fastest zero or pole of K and T_so, so that they suit any plant. A sampled
    run's numbers are those at its sampling instants.
    """
    reference = thesis_reference("extended", design.reference_omegas)
    period = span(design, reference)
    horizon = (PERIODS + MORE_PERIODS) * period
    continuous = loops(design, reference)
    if limit is None:
        limit = usual_limit(design)
    if not math.isfinite(limit):
        raise InputError(f"the limit is {limit:g}; expected a finite one, whose range a converter divides")
    root = fastest_root(*design.controller_parts())
    rates = {n: n * root / (2 * math.pi) for n in SAMPLES}
    facts = {
        "limit": limit,
        "quantum": 2 * limit / 2**BITS,
        "full_range_s": SLEW_PERIODS * 2 * math.pi / root,
        "root": root,
        "shown_hz": rates[SHOWN],
        "period_s": period,
    }

    stride = max(1, round(rates[SHOWN] * period / ROWS_PER_PERIOD))
    time_s = instants(rates[SHOWN], horizon)[::stride]
    columns = {"time_s": time_s}
    rows = []
    for name, run in run_all(continuous, limit, time_s).items():
        columns[f"error_{name}"] = run.outputs["error"]
        rows.append({"run": name, "method": "continuous", "rate_hz": math.nan})
        rows[-1] |= _numbers(time_s, run.outputs["error"], period, reference)
    for name, kind in compensators(design).items():
        for method in METHODS:
            for samples, rate in rates.items():
                drive = Drive(
                    rate,
                    method,
                    (-limit, limit),
                    quantum=facts["quantum"],
                    rate_limit=2 * limit / facts["full_range_s"],
                    input_delay_s=LATE / rate,
                )
                found = _run(design, reference, kind, drive, horizon)
                rows.append({"run": name, "method": method, "rate_hz": rate})
                if found is None:
                    rows[-1] |= {"steady_error": math.nan, "settling_s": math.nan}
                else:
                    rows[-1] |= _numbers(found.time_s, found.error, period, reference)
                if (samples, method) == (SHOWN, "tustin"):
                    error = np.full(len(time_s), math.nan) if found is None else found.error[::stride]
                    columns[f"error_{name}_drive"] = error
    return {"sampled": pd.DataFrame(columns), "sampled_summary": pd.DataFrame(rows).assign(**facts)}


def _run(
    design: Design, reference: Reference, kind: AntiWindup | None, drive: Drive, horizon: float
) -> SampledRun | None:
    """A run, or None if it diverges."""
    try:
        return simulate_sampled(design, reference, kind, drive, horizon, form="thesis")
    except DivergenceError:
        return None


def _numbers(time_s: np.ndarray, error: np.ndarray, period: float, reference: Reference) -> dict[str, float]:
    offset, ripple = over_last(time_s, error, period)
    return {
        "steady_error": abs(offset) + ripple,
        "settling_s": settling_time(time_s, error - offset, SETTLED * reference.amplitude),
    }
