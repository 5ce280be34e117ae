"""What rounding inside the controller makes of the output, with hidden modes and without them (Fig. A.9)."""

from __future__ import annotations

import math

import numpy as np
import pandas as pd

from design.blocks.block import fastest_root
from design.design_file import Design
from experiments.drive.sampled_loop import FORMS, Drive, instants, simulate_sampled
from experiments.engine.simulate import DivergenceError
from experiments.engine.watched import Tick
from experiments.runs.compare_anti_windups import span
from experiments.runs.references import Reference
from experiments.thesis.printed_choices import thesis_reference
from experiments.thesis.studies.chapter_4 import usual_limit
from identification.base.errors import InputError

# Our choices, in units of the design: the thesis has no computer.
PERIODS = 215  # of the reference: a quarter of an hour of the thesis's
MOST_SAMPLES = 1_000_000  # beyond which the run has fewer periods
SAMPLES = 2 + 2 * math.sqrt(5)  # in a period of the fastest root of the controller
BITS = 16  # of the computer's numbers: 2^BITS steps from limit to limit
FIRST = 0.1  # of a period, before which nothing has grown that can be seen
ROWS = 1000  # or fewer, where two fall on one sample
ANTI_WINDUP = "corrected"


def hidden_modes_tables(
    design: Design, limit: float | None = None, tick: Tick | None = None
) -> dict[str, pd.DataFrame]:
    """Run an extended design on a computer that rounds its numbers, its controller in either form.

    Parameters
    ----------
    design
        Of kind "extended".
    limit
        Of the actuator, +-limit; unless given, that of :func:`experiments.thesis.studies.chapter_4.extended_tables`.
    tick
        Called some times a second with the number of samples done since the last call.

    Returns
    -------
    dict
        ``hidden_modes``: time_s, sampling instants from FIRST of a period on whose logarithms are evenly spaced, and
        for each FORM of :data:`experiments.drive.sampled_loop.FORMS` drift_FORM, the output of the run with rounding
        less that of the run without. ``hidden_modes_summary``: a row for each form (run): drift, at the end, and
        largest_drift, of all samples and without its sign; both empty where a run diverges. In every row limit,
        resolution, bits, rate_hz, duration_s, integrators of the plant, and expected_drift, that of the thesis's form
        at the end.

    Raises
    ------
    InputError
        The limit is infinite, or the runs have too many steps.

    Notes
    -----
    The computer cuts v down to a multiple of the resolution, by half of it on average: n = -resolution/2. In the
    thesis's form y = P n, which a plant K/s^q, q >= 0, at low frequencies makes -K resolution/2 t^q/q!. For a plant
    with poles in the open right half plane or zeros at s = 0 expected_drift is empty.

    The rate is in units of the fastest zero or pole of K and T_so, so that it suits any plant. It is as low as Tustin's
    rule allows where the controller inverts a lightly damped resonance, which the rule moves by 7 % here; a higher rate
    costs more and drifts no less. SAMPLES is irrational: were the reference's period a whole number of samples, the
    same few numbers would be cut down again and again, and not by half of the resolution on average.
    """
    reference = thesis_reference("extended", design.reference_omegas)
    if limit is None:
        limit = usual_limit(design)
    if not math.isfinite(limit):
        raise InputError(f"the limit is {limit:g}; expected a finite one, whose range fixes the resolution")
    rate_hz = SAMPLES * fastest_root(*design.controller_parts()) / (2 * math.pi)
    period_s = span(design, reference)
    duration_s = min(PERIODS * period_s, MOST_SAMPLES / rate_hz)
    resolution = 2 * limit / 2**BITS

    time_s = instants(rate_hz, duration_s)
    first = max(1.0, FIRST * period_s * rate_hz)
    shown = np.unique(np.geomspace(first, len(time_s) - 1, ROWS).round().astype(int))
    columns, rows = {"time_s": time_s[shown]}, []
    for form in FORMS:
        drives = (Drive(rate_hz, "tustin", (-limit, limit), resolution=step) for step in (resolution, 0.0))
        rounded, exact = (_output(design, reference, drive, duration_s, form, tick) for drive in drives)
        drift = rounded - exact
        columns[f"drift_{form}"] = drift[shown]
        rows.append({"run": form, "drift": drift[-1], "largest_drift": np.abs(drift).max()})
    facts = {
        "limit": limit,
        "resolution": resolution,
        "bits": BITS,
        "rate_hz": rate_hz,
        "duration_s": duration_s,
        "integrators": design.plant.integrators,
        "expected_drift": _expected(design, resolution, duration_s),
    }
    return {"hidden_modes": pd.DataFrame(columns), "hidden_modes_summary": pd.DataFrame(rows).assign(**facts)}


def _output(
    design: Design, reference: Reference, drive: Drive, duration_s: float, form: str, tick: Tick | None
) -> np.ndarray:
    """y at the sampling instants; NaN where the loop diverges."""
    try:
        return simulate_sampled(design, reference, ANTI_WINDUP, drive, duration_s, tick=tick, form=form).output
    except DivergenceError:
        return np.full(len(instants(drive.rate_hz, duration_s)), math.nan)


def _expected(design: Design, resolution: float, time_s: float) -> float:
    """P n at low frequencies, n = -resolution/2 from 0 on."""
    q = design.plant.integrators
    if q < 0 or design.plant.unstable_poles:
        return math.nan
    return -design.plant.gain * resolution / 2 * time_s**q / math.factorial(q)
