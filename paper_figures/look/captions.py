"""What the captions share: numbers in plain words, read from the tables."""

from __future__ import annotations

import math

import numpy as np
import pandas as pd

from experiments.runs.metrics import settling_time
from experiments.runs.words import limits_text, sector_text
from identification.base.digits import lower_end, told_apart, upper_end
from identification.base.errors import InputError

ROUNDING = 1e-6  # of the amplitude: a smaller error is no more than that
LITTLE = "less than a millionth of the amplitude"


def number(value: float, digits: int = 3) -> str:
    """Return a number to so many significant digits."""
    return f"{value:.{digits}g}"


def capitalised(sentence: str, *names: str) -> str:
    """Return a sentence with a capital, unless one of these names begins it."""
    return sentence if names and sentence.startswith(names) else f"{sentence[:1].upper()}{sentence[1:]}"


def at_least(value: float, digits: int = 3) -> str:
    """Return a lower bound to so many significant digits, rounded towards less so that it stays one."""
    return number(float(lower_end(value, digits)), digits)


def at_most(value: float, digits: int = 3) -> str:
    """Return an upper bound to so many significant digits, rounded towards more so that it stays one."""
    return number(float(upper_end(value, digits)), digits)


def apart(low: float, high: float, unit: str = "", digits: int = 3) -> str:
    """Return a range, its ends in more digits where so many say them alike; one number if they are equal."""
    first, last = told_apart(low, high, digits, number)
    return f"{first}{unit} to {last}{unit}" if low != high else f"{first}{unit}"


def time_unit(time_s: float) -> tuple[float, str]:
    """Return the unit in which a time is said, in seconds: the largest of s, ms, us and ns that it is not shorter than.

    A shorter one, and zero, are said in seconds.
    """
    units = ((1.0, "s"), (1e-3, "ms"), (1e-6, "us"), (1e-9, "ns"))
    return next((unit for unit in units if time_s >= unit[0]), units[0])


def duration(time_s: float, digits: int = 3) -> str:
    """Return a time in its unit."""
    unit, name = time_unit(time_s)
    return f"{number(time_s / unit, digits)} {name}"


def sampling_rate(rate_hz: float) -> str:
    """Return a number a second in the largest of GHz, MHz, kHz and Hz of which it is a tenth or more, else in Hz."""
    units = ((1e9, "GHz"), (1e6, "MHz"), (1e3, "kHz"), (1.0, "Hz"))
    unit, name = next((unit for unit in units if rate_hz >= 0.1 * unit[0]), units[-1])
    return f"{number(rate_hz / unit)} {name}"


def hertz(frequency: float) -> str:
    """Return a frequency in Hz, kHz or MHz, the largest that it is not below."""
    unit, name = next((unit for unit in ((1e6, "MHz"), (1e3, "kHz")) if frequency >= unit[0]), (1.0, "Hz"))
    return f"{number(frequency / unit)} {name}"


def fraction(value: float) -> str:
    """Return a value below 1 as 1/n where n is whole, else as a decimal number."""
    if 0 < value < 1 and math.isclose(1 / value, round(1 / value), rel_tol=1e-6):
        return f"1/{round(1 / value)}"
    return number(value)


def only(summary: pd.DataFrame, column: str) -> float:
    """Return the value of a column in a summary of one row."""
    return float(summary[column].iloc[0])


def of_limits(summary: pd.DataFrame) -> str:
    """Return the limits of the runs in a summary, ``+-12`` or ``-3 to 12``."""
    return limits_text(float(summary["lower_limit"].iloc[0]), float(summary["limit"].iloc[0]))


def with_unit(value: float, unit: str, digits: int = 3) -> str:
    """A value in words with its unit, where it is known."""
    return f"{number(value, digits)} {unit}".rstrip()


def limits_said(table: pd.DataFrame, unit: str) -> str:
    """The limits of a table in words: ``+-12 A`` or ``-3 to 12 A``."""
    return f"{of_limits(table)} {unit}".rstrip()


def a_second(rate_limit: float, unit: str) -> str:
    """A rate limit in words, ``2000 A/s``."""
    return f"{number(rate_limit)} {unit}/s" if unit else f"{number(rate_limit)} a second"


def actuator_said(table: pd.DataFrame, unit: str) -> str:
    """The limits of a table in words and, if there is one, its rate limit."""
    rate_limit, limits = only(table, "rate_limit"), limits_said(table, unit)
    return limits if math.isnan(rate_limit) else f"{limits} and the rate limit {a_second(rate_limit, unit)}"


def of_run(summary: pd.DataFrame, run: str, column: str) -> float:
    """Return the value of a column in the row of a run.

    Raises
    ------
    InputError
        No row is of that run.
    """
    values = summary[column][summary["run"] == run]
    if values.empty:
        raise InputError(f"the summary has no row whose run is {run}; it has {', '.join(map(str, summary['run']))}")
    return float(values.iloc[0])


def is_rounding(summary: pd.DataFrame, run: str) -> bool:
    """Whether the error that a run leaves is less than a millionth of the amplitude: no more than rounding."""
    return of_run(summary, run, "relative_error_percent") < 100 * ROUNDING


def last_saturated(time_s: float) -> str:
    """Say when a control is saturated for the last time; NaN is at the end of the run."""
    if math.isnan(time_s):
        return "is saturated at the end of the run"
    return f"is last saturated at {number(time_s)} s" if time_s > 0 else "is never saturated"


def settled(time_s: float) -> str:
    """Say when an error has settled; NaN is never."""
    return f"settles in {number(time_s)} s" if math.isfinite(time_s) else "does not settle within the run"


def last_outside(time_s: pd.Series, control: pd.Series, limit: float) -> float:
    """Return the first time [s] after which a control stays within +-limit, NaN if it does not."""
    return settling_time(time_s.to_numpy(), control.to_numpy(), limit)


def largest(signal: pd.Series) -> str:
    """Return the largest magnitude of a signal."""
    return number(float(np.abs(signal).max()))


def between(signal: pd.Series) -> str:
    """Say between which values a signal lies."""
    least, most = told_apart(float(signal.min()), float(signal.max()), 3, number)
    return f"between {least} and {most}"


def required_input(summary: pd.DataFrame) -> str:
    """Say whether the limits leave room for the input that following the reference takes."""
    limit, required = (of_run(summary, "none", column) for column in ("limit", "required"))
    verdict = "exceeds" if required > limit else "is within"
    taken, given = told_apart(required, limit, 4, number)
    return f"Following the reference takes an input that reaches {taken}, which {verdict} the limits of +-{given}"


def promised(summary: pd.DataFrame, run: str) -> str:
    """Say of a run with an anti-windup whether its guarantee covers it, and what it needs."""
    guaranteed, needed, largest_control, covered_control = (
        of_run(summary, run, column)
        for column in ("guaranteed_sector", "needed_sector", "largest_control", "covered_control")
    )
    if math.isnan(guaranteed):
        return "diverges, and no guarantee covers it"
    if needed == 0:
        return "never saturates and needs no guarantee"
    if guaranteed == 0:
        return "has no guarantee, since theta2 is not stable"
    if math.isinf(needed):
        return "is NOT covered by its guarantee, since the reference takes more than the limits give"
    sector, k = told_apart(needed, guaranteed, 3, sector_text)
    reached, most = told_apart(largest_control, covered_control, 3, number)
    covered = "any size" if math.isnan(covered_control) else f"up to {most}"
    verdict = "is covered" if of_run(summary, run, "covered") else "is NOT covered"
    return (
        f"{verdict} by its guarantee: it needs the sector {sector}, {k} is guaranteed (|u| reaches {reached}, "
        f"{covered} is covered)"
    )


def promises(summary: pd.DataFrame) -> str:
    """Say so of the runs with both anti-windups, the corrected one first."""
    corrected, thesis = (promised(summary, run) for run in ("corrected", "thesis"))
    return f"With the corrected anti-windup the run {corrected}; with the thesis's it {thesis}."
