"""What becomes of a loop whose controller runs on a computer: its steady error over the rate, by method."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable

import numpy as np
import pandas as pd

from design.blocks.block import fastest_root
from design.design_file import Design
from experiments.drive.judge_loop import judge_loop
from experiments.drive.sampled_loop import METHODS, Drive, simulate_sampled
from experiments.runs.compare_anti_windups import SETTLED, loops, run_all, span, usual_periods
from experiments.runs.metrics import over_last, settling_time
from experiments.runs.references import Reference
from identification.base.errors import InputError

NAMES = ("none", "corrected")
SAMPLES = (2, 4, 8, 16, 32, 64)  # in a period of the fastest root of the controller
ROWS = 1000  # a period, of the run in continuous time

Tick = Callable[[], object]


def usual_rates(design: Design) -> dict[int, float]:
    """SAMPLES in a period of the fastest zero or pole of the controller -> the rate in Hz."""
    return {n: n * fastest_root(*design.controller_parts()) / math.tau for n in SAMPLES}


def rates_tables(
    design: Design,
    reference: Reference,
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
        Of the computer in Hz, beside :func:`usual_rates`.
    quantum, rate_limit, input_delay_s
        Of the actuator, see :class:`experiments.drive.sampled_loop.Drive`; the run in continuous time has the rate
        limit only.
    tick
        Called after every run.

    Returns
    -------
    dict
        ``rates``, see :func:`rows_of`, with stable (1 or 0: whether the linear loop is, see
        :func:`experiments.drive.judge_loop.judge_loop`), and in every row asked_hz (empty: none), amplitude (of the
        reference), quantum, lower_limit and limit (the upper one).
    """
    period, low_high = span(design, reference), dict(zip(("lower_limit", "limit"), limits, strict=True))
    count = usual_periods(design, reference)
    time_s = np.linspace(0.0, count * period, count * ROWS + 1)
    rates = sorted({*usual_rates(design).values(), *([rate] if rate else [])})
    rows = []
    for name, run in run_all(loops(design, reference, NAMES), limits, time_s, rate_limit).items():
        rows.append(
            {"run": name, "method": "continuous", "rate_hz": math.nan}
            | numbers_of(time_s, run.outputs["error"], period, reference)
        )
        tick()
    drives = [Drive(each, method, limits, quantum, rate_limit, input_delay_s) for method in METHODS for each in rates]
    for name in NAMES:
        rows += rows_of(design, reference, name, drives, time_s[-1], period, tick=tick)
    judged = [judge_loop(design, drive, omegas=reference.frequencies).stable for drive in drives]
    stable = [1] * len(NAMES) + [int(each) for each in judged] * len(NAMES)
    facts = {"asked_hz": rate or math.nan, "amplitude": reference.amplitude, "quantum": quantum, **low_high}
    return {"rates": pd.DataFrame(rows).assign(stable=stable, **facts)}


def rows_of(
    design: Design,
    reference: Reference,
    name: str,
    drives: Iterable[Drive],
    until_s: float,
    span_s: float,
    form: str = "coprime",
    tick: Tick = lambda: None,
) -> list[dict[str, object]]:
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
    rows: list[dict[str, object]] = []
    for drive in drives:
        row: dict[str, object] = {"run": name, "method": drive.method, "rate_hz": drive.rate_hz}
        try:
            run = simulate_sampled(design, reference, name, drive, until_s, form=form)
        except InputError:  # among them DivergenceError
            row |= {"steady_error": math.nan, "settling_s": math.nan}
        else:
            row |= numbers_of(run.time_s, run.error, span_s, reference)
        rows.append(row)
        tick()
    return rows


def numbers_of(time_s: np.ndarray, error: np.ndarray, span_s: float, reference: Reference) -> dict[str, float]:
    """steady_error and settling_s of a run, see :func:`rows_of`."""
    offset, ripple = over_last(time_s, error, span_s)
    return {
        "steady_error": abs(offset) + ripple,
        "settling_s": settling_time(time_s, error - offset, SETTLED * reference.amplitude),
    }


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
    own = table[table["run"] == run]
    least = float(own["steady_error"][own["method"] == "continuous"].iloc[0])
    rows = own[own["method"] == method].sort_values("rate_hz")
    near = ((rows["steady_error"] <= least + SETTLED * rows["amplitude"]) & (rows["stable"] == 1)).to_numpy()
    beyond = np.flatnonzero(~near)
    first = beyond[-1] + 1 if len(beyond) else 0
    return float(rows["rate_hz"].iloc[first]) if first < len(rows) else math.nan
