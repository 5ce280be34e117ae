"""One design run without and with its anti-windups: loops, runs, and the tables that say what they do."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
import pandas as pd

from design.anti_windup.compensator import AntiWindup
from design.anti_windup.other_anti_windups import OTHERS
from design.design_file import Design
from experiments.engine.saturated_loop import SaturatedLoop
from experiments.engine.simulate import DivergenceError, Run, limit_pair, simulate
from experiments.runs.design_loop import design_loop
from experiments.runs.guarantee import guarantee
from experiments.runs.metrics import last_saturation, over_last, settling_time
from experiments.runs.references import Reference, SampledReference
from experiments.runs.sector_promise import judge_run
from experiments.runs.verdict import Verdict
from identification.base.errors import InputError

SETTLED = 0.01  # band of the settling time, as a share of the reference's amplitude
NAMES = ("none", "thesis", "corrected")
"""No anti-windup, (2.23), and the one with theta1~(0) = -1."""


def compensators(design: Design, names: Sequence[str] = NAMES) -> dict[str, AntiWindup | None]:
    """The anti-windups of these names, see :meth:`design.design_file.Design.chosen`."""
    return {name: design.chosen(name) for name in names}


def anti_windups(design: Design) -> tuple[dict[str, AntiWindup | None], dict[str, str]]:
    """No anti-windup, those that a design holds and those of others, by name; and why some of these do not exist."""
    found: dict[str, AntiWindup | None] = {"none": None}
    refused = {}
    for name in (*design.anti_windup, *OTHERS):
        try:
            found[name] = design.chosen(name)
        except InputError as error:
            refused[name] = str(error)
    return found, refused


def loops(
    design: Design, reference: Reference | SampledReference, names: Sequence[str] = NAMES
) -> dict[str, SaturatedLoop]:
    """The loop of the design with each of :func:`compensators`."""
    return {name: design_loop(design, reference, kind) for name, kind in compensators(design, names).items()}


def span(design: Design, reference: Reference) -> float:
    """The period of the reference's slowest sinusoid in seconds; of a constant, twice the corrected one's recovery."""
    if np.isfinite(reference.period_s):
        return reference.period_s
    return 2 * design.corrected.judgement.recovery_s


def run_all(
    loops: Mapping[str, SaturatedLoop],
    limit: float | Sequence[float],
    time_s: np.ndarray,
    rate_limit: float = math.inf,
) -> dict[str, Run]:
    """Simulate every loop under sat with its limits, one number for +- that; one that diverges has NaN from there on.

    The actuator moves no faster than ``rate_limit`` a second.

    An unstable controller (the H-infinity optimum may be one) diverges exponentially once the actuator has
    saturated and no anti-windup holds it: that is a result, and it must not hide the other runs.
    """
    return {name: _run(loop, limit_pair(limit), time_s, rate_limit) for name, loop in loops.items()}


def _run(loop: SaturatedLoop, limits: tuple[float, float], time_s: np.ndarray, rate_limit: float) -> Run:
    try:
        return simulate(loop, limits, time_s, rate=rate_limit)
    except DivergenceError as error:
        before = time_s[time_s < min(error.time_s, time_s[-1])]
        if len(before) < 2:
            raise
        part = _run(loop, limits, before, rate_limit)  # in other steps it may pass the bound a little earlier
        rest = np.full(len(time_s) - len(before), np.nan)
        return replace(
            part,
            time_s=time_s,
            control=np.append(part.control, rest),
            saturated_control=np.append(part.saturated_control, rest),
            outputs={name: np.append(values, rest) for name, values in part.outputs.items()},
        )


def is_slewing(run: Run) -> bool:
    """Whether the actuator was too slow for the control anywhere in a run."""
    return bool(np.any(np.abs(run.modes) > 1))


def verdicts(
    design: Design,
    loops: Mapping[str, SaturatedLoop],
    runs: Mapping[str, Run],
    limit: float | Sequence[float],
    reference: Reference | SampledReference,
) -> dict[str, Verdict]:
    """For each run of :func:`loops` with an anti-windup, whether its guarantee covers it.

    Of one that diverges, and of one whose actuator was too slow for the control, it says nothing.
    """
    kinds = {name: kind for name, kind in compensators(design, list(loops)).items() if kind is not None}
    return {
        name: judge_run(guarantee(design, kind), loops[name], limit_pair(limit), run, reference, design.loop_plant)
        for name, kind in kinds.items()
        if np.isfinite((run := runs[name]).control[-1]) and not is_slewing(run)
    }


def tracking_table(runs: Mapping[str, Run], reference: Reference | SampledReference) -> pd.DataFrame:
    """time_s, reference and, for every run NAME, output_NAME, error_NAME, control_NAME, saturated_NAME."""
    time_s = next(iter(runs.values())).time_s
    columns = {"time_s": time_s, "reference": reference(time_s)}
    for name, run in runs.items():
        columns[f"output_{name}"] = run.outputs["output"]
        columns[f"error_{name}"] = run.outputs["error"]
        columns[f"control_{name}"] = run.control
        columns[f"saturated_{name}"] = run.saturated_control
    return pd.DataFrame(columns)


def tracking_summary(
    runs: Mapping[str, Run],
    verdicts: Mapping[str, Verdict],
    limit: float | Sequence[float],
    reference: Reference | SampledReference,
    required: float,
    span_s: float,
) -> pd.DataFrame:
    """One row a run: what the captions say.

    Parameters
    ----------
    runs
        Name -> run.
    verdicts
        See :func:`verdicts`.
    limit
        Of the actuator, in its unit: (lower, upper), or one number for +- that.
    reference
        r(t).
    required
        The most that the control of perfect tracking reaches, in the actuator's unit.
    span_s
        Length of what is called the last period below, in seconds.

    Returns
    -------
    DataFrame
        run, lower_limit, limit (the upper one), required, last_saturation_s (empty: saturated to the end), settling_s
        (error within 1 % of the reference's amplitude, measured from the lasting offset of the error; empty:
        never), offset and ripple (middle and half distance of the extremes of the error over the last period),
        asked_control (the largest |u| of the samples), relative_error_percent (largest error of the last period over
        the reference's amplitude; empty where that is 0). A run that diverges
        has empty cells. Then, of :mod:`experiments.runs.sector_promise`, guaranteed_sector (0: nothing is guaranteed),
        needed_sector (infinite where v_s reaches a limit), largest_control (the largest |u|) and covered_control (how
        large it may be wherever v_s is; empty too where nothing is guaranteed, or any size is covered), empty for a run
        without anti-windup, by Pade's approximation or that diverges; and covered (0 or 1).
    """
    rows = []
    low, high = limit_pair(limit)
    for name, run in runs.items():
        error = run.outputs["error"]
        offset, ripple = over_last(run.time_s, error, span_s)
        rows.append(
            {
                "run": name,
                "lower_limit": low,
                "limit": high,
                "required": required,
                "last_saturation_s": last_saturation(run),
                "settling_s": settling_time(run.time_s, error - offset, SETTLED * reference.amplitude),
                "offset": offset,
                "ripple": ripple,
                "asked_control": float(np.abs(run.control).max()),
                "relative_error_percent": 100 * (abs(offset) + ripple) / (reference.amplitude or math.nan),
            }
            | _promised(verdicts.get(name))
        )
    return pd.DataFrame(rows)


def _promised(found: Verdict | None) -> dict[str, float]:
    names = ("guaranteed_sector", "needed_sector", "largest_control", "covered_control")
    if found is None:
        return dict.fromkeys(names, np.nan) | {"covered": 0}
    covered_control = found.covered_control if 0 < found.guarantee.sector < 1 else np.nan
    numbers = (found.guarantee.sector, found.needed_sector, found.largest_control, covered_control)
    return dict(zip(names, numbers, strict=True)) | {"covered": int(found.covered)}
