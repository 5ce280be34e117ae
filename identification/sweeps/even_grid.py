"""The time stamps of a record -> its sampling interval; uneven stamps are brought to an even grid on request."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from identification.base.arrays import Real
from identification.base.digits import showing_difference
from identification.formats.columns import Table

JITTER = 0.05  # largest distance of a sample from the uniform grid, in sampling intervals
ROUNDED = 1e-6  # of the last digit: the distance of a stamp from a multiple of it, beside the rounding of floats
FEWEST_STEPS = 5  # of the rarer length: one longer step is a missing row, many are a rounded interval
MOST_ADDED = 2.0  # times as many rows as the record has
SHORTEST_S = 1e-50  # interval
SMALL = 0.01  # error of the cubic up to the frequency that is told


def on_even_grid(table: Table, *, resample: bool) -> tuple[Table, float]:
    """A table with the column ``time_s`` and its sampling interval in seconds.

    Stamps that are rounded, to the last digit that was written or to single precision, are even if an even grid fits
    all of them within half a unit of that digit and JITTER of an interval.

    Others are refused unless ``resample`` is True. The output and a band-limited input are then brought to an even
    grid by a cubic spline, a held input by its last value; a remark says how far samples moved and up to which
    frequency the spline follows a sine to SMALL of its amplitude, which the largest step h decides.

    Raises
    ------
    InputError
        The stamps do not increase, or are uneven.

    References
    ----------
    C. A. Hall and W. W. Meyer, "Optimal error bounds for cubic spline interpolation", J. Approximation Theory 16,
    1976: the error is at most 5/384 h^4 max|f''''|.
    """
    time_s = table.columns["time_s"]
    steps = np.diff(time_s)
    count = np.arange(time_s.size)
    even_s = float(time_s[-1] - time_s[0]) / (time_s.size - 1)
    if 0 < even_s < SHORTEST_S:
        table.refuse(f"the samples lie {even_s:.3g} s apart; expected {SHORTEST_S:g} s or more")
    if even_s > 0 and np.max(np.abs((time_s - time_s[0]) / even_s - count)) <= JITTER:
        _check_order(table)
        return table, even_s
    centred = count - count.mean()
    fitted_s = float(centred @ (time_s - time_s.mean()) / (centred @ centred))
    unit = _last_digit(time_s, fitted_s) if fitted_s >= SHORTEST_S and steps.min() >= 0 else 0.0
    off = np.abs(time_s - time_s.mean() - fitted_s * centred)
    if unit and off.max() <= unit / 2 + JITTER * fitted_s and _often_rounded(steps, unit):
        remark = f"the time stamps are rounded to {unit:.3g} s; all fit {1 / fitted_s:.7g} samples a second"
        return replace(table, remarks=(*table.remarks, remark)), fitted_s
    _check_order(table)
    usual = float(np.median(steps))
    if not resample:
        apart = np.abs(steps - usual)
        row = 1 + int(np.argmax(apart > 0.9 * apart.max()))
        found, due = showing_difference(time_s[row], time_s[row - 1] + usual)
        table.refuse_row(
            row,
            "time_s",
            f"about {due} (uniform sampling, within {100 * JITTER:g} % of an interval), or --resample",
            f"is {found}",
        )
    return _resampled(table, usual)


def _resampled(table: Table, usual: float) -> tuple[Table, float]:
    from scipy.interpolate import CubicSpline  # a tenth of a second, and only uneven records need it

    time_s = table.columns["time_s"]
    steps = np.diff(time_s)
    intervals = float(np.sum(np.maximum(np.rint(steps / usual), 1)))
    if intervals > MOST_ADDED * steps.size:
        table.refuse(
            f"the record has {steps.size} intervals, an even grid of {usual:.4g} s has {intervals:.0f}; expected a "
            "record without long gaps"
        )
    sampling_s = float(time_s[-1] - time_s[0]) / intervals
    grid = time_s[0] + sampling_s * np.arange(int(intervals) + 1)
    last = np.clip(np.searchsorted(time_s, grid, side="right") - 1, 0, None)
    columns: dict[str, Real] = {
        name: values[last] if name == "input_held" else CubicSpline(time_s, values)(grid)
        for name, values in table.columns.items()
        if name != "time_s"
    }
    nearest = np.clip(np.rint((time_s - time_s[0]) / sampling_s), 0, intervals)
    moved = np.max(np.abs(time_s - time_s[0] - sampling_s * nearest))
    highest = (SMALL * 384 / 5) ** 0.25 / (2 * np.pi * steps.max())
    remark = (
        f"resampled from {time_s.size} uneven stamps to {grid.size} even ones, {1 / sampling_s:.6g} a second; samples "
        f"lay up to {100 * moved / sampling_s:.2g} % of an interval from them; a sine is followed to "
        f"{100 * SMALL:g} % up to {highest:.3g} Hz"
    )
    numbers = table.numbers[last]
    return replace(
        table, columns={"time_s": grid, **columns}, numbers=numbers, remarks=(*table.remarks, remark)
    ), sampling_s


def _last_digit(time_s: Real, interval: float) -> float:
    """The unit to which all stamps are rounded, in seconds, if it is not small against the interval; else 0."""
    power = int(np.floor(np.log10(interval))) + 1
    for unit in 10.0 ** np.arange(power, power - 3, -1):
        multiple = time_s / unit
        resolved = np.finfo(float).eps * np.max(np.abs(multiple))
        if resolved < ROUNDED * 1e3 and np.all(np.abs(multiple - np.rint(multiple)) <= ROUNDED + 4 * resolved):
            return float(unit)
    with np.errstate(over="ignore"):
        single = time_s.astype(np.float32)
    return float(np.spacing(np.max(np.abs(single)))) if np.array_equal(single, time_s) else 0.0


def _often_rounded(steps: Real, unit: float) -> bool:
    """Whether steps of one length are not a rare exception among those of another."""
    lengths = np.rint(steps / unit)
    longer = np.count_nonzero(lengths > np.median(lengths))
    shorter = np.count_nonzero(lengths < np.median(lengths))
    return bool(max(longer, shorter) >= FEWEST_STEPS)


def _check_order(table: Table) -> None:
    time_s = table.columns["time_s"]
    late = np.diff(time_s, prepend=-np.inf) <= 0
    if late.any():
        row = int(np.argmax(late))
        found, before = showing_difference(time_s[row], time_s[row - 1])
        place = table.at(row - 1, "time_s")
        table.refuse_row(row, "time_s", f"more than the {before} of {place} (increasing, no duplicates)", f"is {found}")
