"""What the captions share: numbers in plain words, read from the tables."""

from __future__ import annotations

import math
from decimal import ROUND_CEILING, ROUND_FLOOR, Context

import numpy as np
import pandas as pd

from experiments.metrics import settling_time
from identification.files import InputError


def number(value: float, digits: int = 3) -> str:
    """Return a number to so many significant digits."""
    return f"{value:.{digits}g}"


def at_least(value: float, digits: int = 3) -> str:
    """Return a lower bound to so many significant digits, rounded towards less so that it stays one."""
    return number(float(Context(prec=digits, rounding=ROUND_FLOOR).create_decimal(value)), digits)


def at_most(value: float, digits: int = 3) -> str:
    """Return an upper bound to so many significant digits, rounded towards more so that it stays one."""
    return number(float(Context(prec=digits, rounding=ROUND_CEILING).create_decimal(value)), digits)


def fraction(value: float) -> str:
    """Return a value below 1 as 1/n where n is whole, else as a decimal number."""
    if 0 < value < 1 and math.isclose(1 / value, round(1 / value), rel_tol=1e-6):
        return f"1/{round(1 / value)}"
    return number(value)


def only(summary: pd.DataFrame, column: str) -> float:
    """Return the value of a column in a summary of one row."""
    return float(summary[column].iloc[0])


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
    return f"between {number(float(signal.min()))} and {number(float(signal.max()))}"


def required_input(summary: pd.DataFrame) -> str:
    """Say whether the limits leave room for the input that following the reference takes."""
    limit, required = (of_run(summary, "none", column) for column in ("limit", "required"))
    verdict = "exceeds" if required > limit else "is within"
    return (
        f"Following the reference takes an input that reaches {number(required, 4)}, "
        f"which {verdict} the limits of +-{number(limit, 4)}"
    )
