"""The anti-windups of a design beside each other, those of others too: two upsets of one run, a row for each."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

import numpy as np
import pandas as pd

from design.anti_windup.compensator import AntiWindup, uncertainty_cost
from design.anti_windup.other_anti_windups import OTHERS
from design.design_file import Design
from experiments.engine.saturated_loop import SaturatedLoop
from experiments.engine.simulate import Run, limit_pair, simulate
from experiments.physical_limits.least_peak_error import RestLimit
from experiments.runs.compare_anti_windups import SETTLED, anti_windups, is_slewing, run_all
from experiments.runs.design_loop import design_loop
from experiments.runs.disturbances import Disturbances, steps
from experiments.runs.guarantee import guarantee
from experiments.runs.metrics import of_table, recovery
from experiments.runs.references import Reference, SampledReference
from experiments.runs.run_length import required, scale, settled_periods, span
from experiments.runs.words import sector_text
from identification.base.errors import InputError
from identification.model.plant import PlantModel

MULTIPLE = 1.2  # of the control that the reference needs: the limit unless given
PERIODS, MOST_PERIODS = 4, 40  # for each upset; more than the least where
RECOVERIES = 3  # times the corrected anti-windup's recovery time take longer
PULSE = 0.1  # of a period: how long the disturbance acts
SAMPLES, ROWS = 2000, 80_000  # a period at most, and of each upset
KEPT = 8  # of the samples every so many are written
STEPS = 100  # of a period, of the physical limit
SMALLER = (2.0, 4.0, 8.0, 16.0, 32.0, 64.0)  # times, the reference where no run recovers

Tick = Callable[[], object]


def comparison_tables(
    design: Design,
    reference: Reference | SampledReference,
    limits: float | tuple[float, float] | None = None,
    tick: Tick = lambda: None,
    plant: PlantModel | None = None,
    rate_limit: float = math.inf,
) -> dict[str, pd.DataFrame]:
    """Run a design without and with each anti-windup that there is for it, from rest and through a disturbance.

    Parameters
    ----------
    design
        Of either kind.
    reference
        r(t); samples count for as long as they last, and hold their last value through the disturbance.
    limits
        Of the actuator, (lower, upper), or one number for +- that; unless given, 1.2 times the most that the control
        of perfect tracking reaches.
    tick
        Called after every run.
    plant
        The true plant; the design's own model unless given.
    rate_limit
        The most that the actuator changes in a second, in its unit; the controller does not know it.

    Returns
    -------
    dict
        ``compare``: for every anti-windup two rows. The upset ``start`` begins at rest, ``pulse`` some periods later:
        half the distance of the limits is added to the plant's input for a tenth of a period. Each counts for as
        many periods, four or what the corrected anti-windup takes, and times count from its beginning. See
        :func:`experiments.runs.run_length.span` for what a period is.

        run, upset, refused
            The last is the sentence where the design has no such anti-windup; the cells after it are empty then.
        guarantee, f
            ``global``: whatever the control; ``sector K``; ``none``, also where the actuator was too slow for the
            control, since guarantees are of limits alone. ||W_a (1 + theta1~)||, (2.19); empty where
            the anti-windup is not of this form.
        recovery_s
            When |y - y0| has fallen to 1 % of the reference's amplitude for good, y0 being the output without
            saturation and under the same disturbance; empty: not within these periods, or it has not been so for
            the last of them (of a constant, for as long as it took).
        last_saturation_s, crossings
            Of the limits; the first is empty where u is saturated at the end.
        peak_error, from_s, least_peak_error
            The greatest |r - y| from from_s on, a quarter of a period after the beginning, and what no controller
            betters; the last for the start only, and for a periodic reference.
        largest_control, last_error
            The greatest |u| over the larger limit, and the greatest |r - y| of the last period.
        lower_limit, limit, rate_limit, amplitude, required
            The second is the upper limit, then come the size of the reference, see
            :func:`experiments.runs.run_length.scale`, and the most that the control of perfect tracking reaches.
        enough
            1 where a run recovers from rest; else how many times smaller the reference was when one did, the first
            power of two of those up to 64; empty: with none of them. Limits and rate limit so many times wider do the
            same.

        ``compare_runs``: time_s, reference, output_unsaturated, and for every run NAME output_NAME and control_NAME.

    Raises
    ------
    InputError
        The limits are not finite and in order, or perfect tracking needs no control or one without bound.
    """
    true = design.loop_plant if plant is None else plant
    needed = required(true, reference)
    if limits is None and not 0 < needed < np.inf:
        raise InputError(
            f"the reference needs a steady control of {needed:g}, from which no limit follows; expected limits"
        )
    low, high = pair = limit_pair(MULTIPLE * needed if limits is None else limits)
    if not np.isfinite(high - low):
        raise InputError(f"the limits are {low:g} and {high:g}; expected finite ones")
    period = span(design, reference)
    recovery_s = RECOVERIES * design.corrected.judgement.recovery_s
    count = min(max(PERIODS, int(np.ceil(recovery_s / period)) + 1), MOST_PERIODS)
    rest = period if isinstance(reference, SampledReference) else reference.period_s
    if not math.isfinite(rest):
        count = max(count, settled_periods(design, reference, pair, rate_limit)[0])
    if isinstance(reference, SampledReference):
        count = max(count, math.ceil(float(reference.time_s[-1]) / period * (1 - 1e-12)))
    time_s = np.linspace(0.0, 2 * count * period, 2 * count * min(SAMPLES, ROWS // count) + 1)
    begin = count * period
    disturbances = Disturbances(input=steps([((high - low) / 2, begin), (0.0, begin + PULSE * period)]))

    kinds, refused = anti_windups(design)
    loops = {name: design_loop(design, reference, kind, true, disturbances) for name, kind in kinds.items()}
    unsaturated = simulate(loops["none"], (-np.inf, np.inf), time_s).outputs["output"]
    runs: dict[str, Run] = {}
    for name, loop in loops.items():
        try:
            runs |= run_all({name: loop}, pair, time_s, rate_limit)
        except InputError as error:
            refused[name] = str(error)
        tick()
    size = scale(reference, period)
    band = SETTLED * size
    first = time_s <= begin
    enough = _enough(runs, loops, pair, rate_limit, time_s[first], unsaturated[first], band, rest)
    from_s, least = _least_error(true, reference, pair, period)
    rows = []
    for name in ("none", *design.anti_windup, *OTHERS):
        known: dict[str, object] = {"lower_limit": low, "limit": high, "required": needed}
        known |= {"amplitude": size, "refused": refused.get(name)}
        known |= {"rate_limit": of_table(rate_limit), "enough": enough}
        if name in kinds:
            known |= _promised(design, kinds[name], true)
        if name in runs and is_slewing(runs[name]):
            known |= {"guarantee": "none"}
        for upset, start_s in (("start", 0.0), ("pulse", begin)):
            row: dict[str, object] = {"run": name, "upset": upset} | known
            if name in runs:
                row |= _row(runs[name], unsaturated, start_s, begin, period, from_s, max(-low, high), band, rest)
                row |= {"least_peak_error": least if upset == "start" else np.nan}
            rows.append(row)
    series = {"time_s": time_s, "reference": reference(time_s), "output_unsaturated": unsaturated}
    for name, run in runs.items():
        series |= {f"output_{name}": run.outputs["output"], f"control_{name}": run.control}
    return {"compare": pd.DataFrame(rows), "compare_runs": pd.DataFrame(series).iloc[::KEPT]}


def _promised(design: Design, kind: AntiWindup | None, plant: PlantModel) -> dict[str, object]:
    sector = guarantee(design, kind, plant).sector
    said = "none" if sector == 0 else "global" if sector >= 1 else f"sector {sector_text(sector)}"
    if kind is None or not kind.theta1_tilde.is_stable:
        return {"guarantee": said, "f": np.nan}
    return {"guarantee": said, "f": uncertainty_cost(design.additive_bound, kind.one_plus)[0]}


def _least_error(
    plant: PlantModel, reference: Reference | SampledReference, limits: tuple[float, float], period: float
) -> tuple[float, float]:
    """From when on errors count, in seconds, and how small the greatest can be at best; NaN where it is not known."""
    if isinstance(reference, SampledReference):
        return period / 4, np.nan
    try:
        rest = RestLimit(plant, reference, limits, STEPS)
        index = round(rest.last / (4 * 2))
        return rest.start_s(index), rest.at(index).lower
    except InputError:
        return period / 4, np.nan


def _enough(
    runs: Mapping[str, Run],
    loops: Mapping[str, SaturatedLoop],
    limits: tuple[float, float],
    rate_limit: float,
    time_s: np.ndarray,
    unsaturated: np.ndarray,
    band: float,
    rest: float,
) -> float:
    """How many times smaller the reference must be, from rest, for one of the runs to recover."""

    def recovers(run: Run) -> bool:
        distance = run.outputs["output"][: len(time_s)] - unsaturated
        return not math.isnan(recovery(time_s, distance, band, rest))

    if any(recovers(run) for run in runs.values()):
        return 1.0
    for multiple in SMALLER:  # the loop is homogeneous: wider limits under the same reference
        wider = multiple * limits[0], multiple * limits[1]
        for name in runs:
            try:
                (run,) = run_all({name: loops[name]}, wider, time_s, multiple * rate_limit).values()
            except InputError:
                continue
            if recovers(run):
                return multiple
    return math.nan


def _row(
    run: Run,
    unsaturated: np.ndarray,
    start_s: float,
    length: float,
    period: float,
    from_s: float,
    limit: float,
    band: float,
    rest: float,
) -> dict[str, object]:
    end_s = start_s + length
    counts = (run.time_s >= start_s) & (run.time_s <= end_s)
    time_s, control = run.time_s[counts] - start_s, run.control[counts]
    output, error = run.outputs["output"][counts], np.abs(run.outputs["error"][counts])
    events = run.events_s[(run.events_s >= start_s) & (run.events_s <= end_s)] - start_s
    saturated = control != run.saturated_control[counts]
    return {
        "recovery_s": recovery(time_s, output - unsaturated[counts], band, rest),
        "last_saturation_s": np.nan if saturated[-1] else max(events, default=0.0),
        "peak_error": error[time_s >= from_s].max(),
        "from_s": from_s,
        "largest_control": np.abs(control).max() / limit,
        "last_error": error[time_s >= time_s[-1] - period].max(),
        "crossings": len(events),
    }
