"""What the delay-free and the extended experiment share: one design run without and with each anti-windup."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
import pandas as pd

from design.anti_windup.compensator import AntiWindup
from design.design_file import Design
from experiments.engine.saturated_loop import SaturatedLoop
from experiments.engine.simulate import DivergenceError, Run, limit_pair, simulate
from experiments.runs.design_loop import design_loop
from experiments.runs.guarantee import guarantee
from experiments.runs.metrics import last_saturation, over_last, settling_time
from experiments.runs.references import Reference
from experiments.runs.sector_promise import judge_run
from experiments.runs.verdict import Verdict

SETTLED = 0.01  # band of the settling time, as a share of the reference's amplitude


def compensators(design: Design) -> dict[str, AntiWindup | None]:
    """No anti-windup, the thesis's (2.23), and the corrected one with theta1~(0) = -1."""
    return {"none": None} | {name: design.compensator(name) for name in ("thesis", "corrected")}


def loops(design: Design, reference: Reference) -> dict[str, SaturatedLoop]:
    """The loop of the design with each of :func:`compensators`."""
    return {name: design_loop(design, reference, kind) for name, kind in compensators(design).items()}


def span(design: Design, reference: Reference) -> float:
    """The period of the reference's slowest sinusoid in seconds; of a constant, twice the corrected one's recovery."""
    if np.isfinite(reference.period_s):
        return reference.period_s
    return 2 * design.corrected.judgement.recovery_s


def run_all(loops: Mapping[str, SaturatedLoop], limit: float | Sequence[float], time_s: np.ndarray) -> dict[str, Run]:
    """Simulate every loop under sat with its limits, one number for +- that; one that diverges has NaN from there on.

    An unstable controller (the H-infinity optimum may be one) diverges exponentially once the actuator has
    saturated and no anti-windup holds it: that is a result, and it must not hide the other runs.
    """
    return {name: _run(loop, limit, time_s) for name, loop in loops.items()}


def _run(loop: SaturatedLoop, limit: float | Sequence[float], time_s: np.ndarray) -> Run:
    try:
        return simulate(loop, limit_pair(limit), time_s)
    except DivergenceError as error:
        before = time_s[time_s < min(error.time_s, time_s[-1])]
        if len(before) < 2:
            raise
        part = _run(loop, limit, before)  # in other steps it may pass the bound a little earlier
        rest = np.full(len(time_s) - len(before), np.nan)
        return replace(
            part,
            time_s=time_s,
            control=np.append(part.control, rest),
            saturated_control=np.append(part.saturated_control, rest),
            outputs={name: np.append(values, rest) for name, values in part.outputs.items()},
        )


def verdicts(
    design: Design, loops: Mapping[str, SaturatedLoop], runs: Mapping[str, Run], limit: float, reference: Reference
) -> dict[str, Verdict]:
    """For each run of :func:`loops` with an anti-windup that did not diverge, whether its guarantee covers it."""
    kinds = {name: kind for name, kind in compensators(design).items() if kind is not None}
    return {
        name: judge_run(guarantee(design, kind), loops[name], (-limit, limit), runs[name], reference, design.loop_plant)
        for name, kind in kinds.items()
        if np.isfinite(runs[name].control[-1])
    }


def tracking_table(runs: Mapping[str, Run], reference: Reference) -> pd.DataFrame:
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
    limit: float,
    limit_is_given: bool,
    reference: Reference,
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
        Of the actuator, in its unit.
    limit_is_given
        Whether the user gave it; else it is the thesis's, printed or found.
    reference
        r(t).
    required
        The most that the control of perfect tracking reaches, in the actuator's unit.
    span_s
        Length of what is called the last period below, in seconds.

    Returns
    -------
    DataFrame
        run, limit, limit_is_given (0 or 1), required, last_saturation_s (empty: saturated to the end), settling_s
        (error within 1 % of the reference's amplitude, measured from the lasting offset of the error; empty:
        never), offset and ripple (middle and half distance of the extremes of the error over the last period),
        peak_error_after_1s (from one second on, as chapter 4 reads its plot; empty: the run is shorter),
        relative_error_percent (largest error of the last period over the reference's amplitude). A run that diverges
        has empty cells. Then, of :mod:`experiments.runs.sector_promise`, guaranteed_sector (0: nothing is guaranteed),
        needed_sector (infinite where v_s reaches a limit), largest_control (the largest |u|) and covered_control (how
        large it may be wherever v_s is; empty too where nothing is guaranteed, or any size is covered), empty for a run
        without anti-windup, by Pade's approximation or that diverges; and covered (0 or 1).
    """
    rows = []
    for name, run in runs.items():
        error = run.outputs["error"]
        offset, ripple = over_last(run.time_s, error, span_s)
        rows.append(
            {
                "run": name,
                "limit": limit,
                "limit_is_given": int(limit_is_given),
                "required": required,
                "last_saturation_s": last_saturation(run),
                "settling_s": settling_time(run.time_s, error - offset, SETTLED * reference.amplitude),
                "offset": offset,
                "ripple": ripple,
                "peak_error_after_1s": np.abs(error[run.time_s >= 1.0]).max() if run.time_s[-1] >= 1.0 else np.nan,
                "relative_error_percent": 100 * (abs(offset) + ripple) / reference.amplitude,
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
