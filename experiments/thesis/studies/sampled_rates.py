"""What a real drive makes of the extended loop: its error over time and over the sampling rate (Fig. A.5)."""

from __future__ import annotations

import math

import numpy as np
import pandas as pd

from design.blocks.block import fastest_root
from design.design_file import Design
from experiments.drive.difference_equations import METHODS
from experiments.drive.sampled_loop import Drive, instants, simulate_sampled
from experiments.engine.simulate import DivergenceError
from experiments.rates import numbers_of, rows_of, usual_rates
from experiments.runs.compare_anti_windups import NAMES, loops, run_all, span
from experiments.thesis.printed_choices import thesis_reference
from experiments.thesis.studies.chapter_4 import usual_limit
from experiments.thesis.studies.desaturation import PERIODS
from identification.base.errors import InputError

# Our choices, in units of the design: the thesis has no computer and no drive.
SHOWN = 16  # samples in a period of the fastest root of the controller: the rate whose run is kept over time
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
        raise InputError(f"the limit is {limit:g}; expected a finite one, whose range fixes the resolution")
    root = fastest_root(*design.controller_parts())
    shown = usual_rates(design)[SHOWN]
    facts = {
        "limit": limit,
        "quantum": 2 * limit / 2**BITS,
        "full_range_s": SLEW_PERIODS * 2 * math.pi / root,
        "root": root,
        "shown_hz": shown,
        "period_s": period,
    }

    def drive(method: str, rate: float) -> Drive:
        return Drive(rate, method, (-limit, limit), facts["quantum"], 2 * limit / facts["full_range_s"], LATE / rate)

    stride = max(1, round(shown * period / ROWS_PER_PERIOD))
    time_s = instants(shown, horizon)[::stride]
    columns = {"time_s": time_s}
    rows: list[dict[str, object]] = []
    for name, run in run_all(continuous, limit, time_s).items():
        columns[f"error_{name}"] = run.outputs["error"]
        rows.append({"run": name, "method": "continuous", "rate_hz": math.nan})
        rows[-1] |= numbers_of(time_s, run.outputs["error"], period, reference)
    drives = [drive(method, rate) for method in METHODS for rate in usual_rates(design).values()]
    for name in NAMES:
        rows += rows_of(design, reference, name, drives, horizon, period, "thesis")
        try:
            found = simulate_sampled(design, reference, name, drive("tustin", shown), horizon, form="thesis")
        except DivergenceError:
            columns[f"error_{name}_drive"] = np.full(len(time_s), math.nan)
        else:
            columns[f"error_{name}_drive"] = found.error[::stride]
    return {"sampled": pd.DataFrame(columns), "sampled_summary": pd.DataFrame(rows).assign(**facts)}
