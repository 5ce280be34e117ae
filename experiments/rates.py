"""What becomes of a loop whose controller runs on a computer: its steady error over the rate, by method."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd

from design.blocks.block import fastest_root
from design.design_file import Design
from experiments.drive.judge_loop import judge_loop
from experiments.drive.sampled_loop import METHODS, Drive, simulate_sampled
from experiments.runs.compare_anti_windups import SETTLED, anti_windups, loops, run_all
from experiments.runs.metrics import of_table, over_last, settling_time
from experiments.runs.references import Reference, SampledReference
from experiments.runs.run_length import scale, settled_periods, span
from identification.base.errors import InputError

NAMES = ("none", "corrected")
SAMPLES = (2, 4, 8, 16, 32, 64)  # in a period of the fastest root of the controller
AN_OCTAVE = 2  # rates, below these
FOLLOWED = 0.1  # of the amplitude: a loop whose error in continuous time is more does not follow
ROWS = 1000  # a period, of the run in continuous time

Tick = Callable[[], object]


def usual_rates(design: Design) -> dict[int, float]:
    """SAMPLES in a period of the fastest zero or pole of the controller -> the rate in Hz."""
    return {n: n * fastest_root(*design.controller_parts()) / math.tau for n in SAMPLES}


def lower_rates(design: Design, reference: Reference | SampledReference) -> list[float]:
    """From two samples in a period of the reference's fastest sinusoid up to the :func:`usual_rates`, in Hz.

    Where there is none, from one sample in the recovery time of the corrected anti-windup.
    """
    fastest = 0.0 if isinstance(reference, SampledReference) else max(reference.frequencies, default=0.0)
    low = fastest / math.pi or 1 / design.corrected.judgement.recovery_s
    octaves = math.log2(min(usual_rates(design).values()) / low)
    return [low * 2 ** (k / AN_OCTAVE) for k in range(1, math.ceil(AN_OCTAVE * octaves))]


def rates_tables(
    design: Design,
    reference: Reference | SampledReference,
    limits: tuple[float, float],
    *,
    rate: float | None = None,
    quantum: float = 0.0,
    rate_limit: float = math.inf,
    input_delay_s: float = 0.0,
    tick: Tick = lambda: None,
) -> dict[str, pd.DataFrame]:
    """Run a design from rest in continuous time and on a computer at several rates, by every method.

    Parameters
    ----------
    design
        Of kind "extended".
    reference
        r(t).
    limits
        (lower, upper), in the actuator's unit.
    rate
        Of the computer in Hz, beside :func:`usual_rates` and :func:`lower_rates`.
    quantum, rate_limit, input_delay_s
        Of the actuator, see :class:`experiments.drive.sampled_loop.Drive`; the run in continuous time has the rate
        limit only.
    tick
        Called after every run.

    Returns
    -------
    dict
        ``rates``, see :func:`rows_of`, of NAMES and, at ``rate`` alone, of every anti-windup that there is. A run is
        made where its linear loop is stable (stable 1, else 0, see :func:`experiments.drive.judge_loop.judge_loop`) and
        follows in continuous time, and at ``rate``; steady_error, empty of what is not run, is no less than that of the
        linear loop between the samples. unslewed_error is that of the run without the rate limit, at ``rate``. settled
        is 0 for every row of a run that has not settled in continuous time, see
        :func:`experiments.runs.run_length.settled_periods`; then its steady_error is of a transient. In every row:
        until_s (length of a run), asked_hz (empty: none), amplitude (see :func:`experiments.runs.run_length.scale`),
        quantum, lower_limit, limit (the upper one), and
        rate_limit (empty: none).
    """
    period, low_high = span(design, reference), dict(zip(("lower_limit", "limit"), limits, strict=True))
    count, left = settled_periods(design, reference, limits, rate_limit)
    size = scale(reference, period)
    time_s = np.linspace(0.0, count * period, count * ROWS + 1)
    rates = sorted({*usual_rates(design).values(), *lower_rates(design, reference), *([rate] if rate else [])})
    rows: list[dict[str, Any]] = []
    names = [*NAMES, *sorted({*anti_windups(design)[0]} - {*NAMES} if rate else ())]
    for name, run in run_all(loops(design, reference, names), limits, time_s, rate_limit).items():
        rows.append(
            {"run": name, "method": "continuous", "rate_hz": math.nan}
            | numbers_of(time_s, run.outputs["error"], period, reference)
        )
        tick()
    drives = [Drive(each, method, limits, quantum, rate_limit, input_delay_s) for method in METHODS for each in rates]
    judged = {drive: _linear(design, drive, reference) for drive in drives}
    rows = [row | {"stable": 1} for row in rows]
    for name, continuous in zip(names, rows[:], strict=True):
        follows = continuous["steady_error"] <= FOLLOWED * size and name in NAMES
        tried = [each for each in judged if name in NAMES or each.rate_hz == rate]
        ran = [each for each in tried if (follows and math.isfinite(judged[each])) or each.rate_hz == rate]
        found = dict(zip(ran, rows_of(design, reference, name, ran, time_s[-1], period, tick=tick), strict=True))
        free = [replace(each, rate_limit=math.inf) for each in ran if each.rate_hz == rate and rate_limit < math.inf]
        unslewed = rows_of(design, reference, name, free, time_s[-1], period, tick=tick)
        errors = {(row["method"], row["rate_hz"]): row["steady_error"] for row in unslewed}
        for each in tried:
            row: dict[str, Any] = {
                "run": name,
                "method": each.method,
                "rate_hz": each.rate_hz,
                "steady_error": math.nan,
            }
            row |= found.get(each, {}) | {"stable": int(math.isfinite(judged[each]))}
            if row["stable"]:
                row["steady_error"] = max(row["steady_error"], judged[each])  # a NaN that comes first stays
            rows.append(row | {"unslewed_error": errors.get((each.method, each.rate_hz), math.nan)})
    rows = [row | {"settled": int(row["run"] not in left)} for row in rows]
    facts = {"asked_hz": rate or math.nan, "amplitude": size, "until_s": time_s[-1], "quantum": quantum, **low_high}
    return {"rates": pd.DataFrame(rows).assign(**facts, rate_limit=of_table(rate_limit))}


def _linear(design: Design, drive: Drive, reference: Reference | SampledReference) -> float:
    """The most that the error of the linear loop reaches between the samples, infinite where it is not stable.

    Of samples it is that of the constant which they end as; a ramp has none but that of its constant.
    """
    if isinstance(reference, SampledReference):
        reference = Reference((float(reference.values[-1]),), (0.0,), (math.pi / 2,), 0.0)
    judged = judge_loop(design, drive, omegas=reference.omegas)
    return float(np.abs(reference.amplitudes) @ judged.between_errors) / 100 if judged.stable else math.inf


def rows_of(
    design: Design,
    reference: Reference | SampledReference,
    name: str,
    drives: Iterable[Drive],
    until_s: float,
    span_s: float,
    form: str = "coprime",
    tick: Tick = lambda: None,
) -> list[dict[str, Any]]:
    """Run a design with one anti-windup on each of several drives.

    Parameters
    ----------
    design, reference, name, form
        See :func:`experiments.drive.sampled_loop.simulate_sampled`.
    drives
        Computers with their actuators.
    until_s, span_s
        Length of a run, and of what is called its last period, in seconds.
    tick
        Called after every run.

    Returns
    -------
    list of dict
        A row for each drive: run, method, rate_hz; steady_error, the largest of the last period, and settling_s, after
        which the error stays within 1 % of the reference's amplitude around its lasting offset (empty: never). Both are
        empty where the loop diverges or the method has no controller at the rate, and read at the sampling instants.
    """
    rows: list[dict[str, Any]] = []
    for drive in drives:
        row: dict[str, Any] = {"run": name, "method": drive.method, "rate_hz": drive.rate_hz}
        try:
            run = simulate_sampled(design, reference, name, drive, until_s, form=form)
        except InputError:  # among them DivergenceError
            row |= {"steady_error": math.nan, "settling_s": math.nan}
        else:
            row |= numbers_of(run.time_s, run.error, span_s, reference)
        rows.append(row)
        tick()
    return rows


def numbers_of(
    time_s: np.ndarray, error: np.ndarray, span_s: float, reference: Reference | SampledReference
) -> dict[str, float]:
    """steady_error and settling_s of a run, see :func:`rows_of`."""
    offset, ripple = over_last(time_s, error, span_s)
    return {
        "steady_error": abs(offset) + ripple,
        "settling_s": settling_time(time_s, error - offset, SETTLED * scale(reference, span_s)),
    }


def continuous_error(table: pd.DataFrame, run: str) -> float:
    """The steady error of a run in continuous time, of the table of :func:`rates_tables`."""
    return float(table["steady_error"][(table["run"] == run) & (table["method"] == "continuous")].iloc[0])


def is_near(row: pd.Series, continuous: float) -> bool:
    """Whether a row's linear loop is stable, and its steady error near that in continuous time."""
    return bool(row["stable"] == 1 and row["steady_error"] <= continuous + SETTLED * row["amplitude"])


def lowest_rate(table: pd.DataFrame, run: str, method: str) -> float:
    """The lowest rate in Hz from which on, as far as was tried, a computer does what continuous time does.

    Parameters
    ----------
    table
        See :func:`rates_tables`.
    run, method
        Which rows.

    Returns
    -------
    float
        At it and at all higher rates of the table the linear loop is stable, and the steady error no more than that in
        continuous time and 1 % of the reference's amplitude; NaN where there is none.
    """
    rows = table[(table["run"] == run) & (table["method"] == method)].sort_values("rate_hz")
    least = continuous_error(table, run)
    beyond = np.flatnonzero([not is_near(row, least) for _, row in rows.iterrows()])
    first = beyond[-1] + 1 if len(beyond) else 0
    return float(rows["rate_hz"].iloc[first]) if first < len(rows) else math.nan
