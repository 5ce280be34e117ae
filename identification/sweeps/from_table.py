"""The columns of one test -> its frequency response; what cannot be one is refused."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from identification.base.arrays import Complex, Real
from identification.base.digits import showing_difference
from identification.base.errors import InputError
from identification.formats.columns import Table, rows_of
from identification.sweeps.estimate_response import estimate_response
from identification.sweeps.even_grid import on_even_grid
from identification.sweeps.response import FrequencyResponse, Record
from identification.sweeps.swapped_or_wrong_unit import bends, lead_time, wrap

FEWEST_LINES = 8
FEWEST_SAMPLES = 128
CONSTANT = 1e-9  # of a signal's size
LARGEST = 1e50  # number in a column
MOST_POINTS = 20_000_000  # lines or samples of a test; a fit takes some 200 bytes of memory for each
ROUNDING = 1e-4  # of a coherence outside 0 to 1
ALMOST, FILTERED = 0.95, 0.01  # of half the sampling rate; of the power, what a filter may leave there
GROWTH = 0.5  # power of omega: a response that leads and grows faster over its band is one from output to input


def from_response(table: Table, name: str) -> FrequencyResponse:
    """The test of a table with a frequency.

    A line at 0 Hz is left out, the lines are sorted, and several readings at one frequency are averaged, all of which
    the remarks say. A coherence may be NaN.

    Raises
    ------
    InputError
        The numbers cannot be a sweep's.
    """
    table = _above_zero(table)
    _check_numbers(table)
    frequency = next(iter(table.columns))
    values = table.columns[frequency]
    table.refuse_any(values < 0, frequency, "a positive number")
    table.refuse_any(values < 1 / LARGEST, frequency, f"{1 / LARGEST:g} or more")
    if np.any(np.diff(values) < 0):
        table = rows_of(table, np.argsort(values, kind="stable"))
        table = replace(table, remarks=(*table.remarks, "the lines were sorted by frequency"))
        values = table.columns[frequency]
    omega = 2 * np.pi * values if frequency == "frequency_hz" else values
    if (lines := np.unique(omega).size) < FEWEST_LINES:
        table.refuse(f"holds {lines} frequencies; expected {FEWEST_LINES} or more")
    coherence = table.columns.get("coherence")
    if coherence is not None:
        table.refuse_any((coherence < -ROUNDING) | (coherence > 1 + ROUNDING), "coherence", "a number from 0 to 1")
        coherence = np.clip(coherence, 0, 1)
    response = _complex(table, omega)
    if not response.any():
        table.refuse("the response is 0 at every frequency; expected a plant that responds")
    excitation, remarks = None, table.remarks
    if lines < omega.size:
        omega, response, coherence, excitation, remark = _averaged(omega, response, coherence)
        remarks += (remark,)
    lead_s = lead_time(omega, response)
    if lead_s and _grows(omega, response):
        table.refuse(
            f"the output leads the input by about {lead_s:.3g} s; expected a plant's output, which does not "
            "(are input and output swapped, or is the phase's sign?)"
        )
    return FrequencyResponse(
        omega,
        response,
        coherence,
        name,
        excitation=excitation,
        synthetic=table.synthetic,
        path=table.path,
        remarks=remarks,
    )


def _above_zero(table: Table) -> Table:
    """The table without its lines at 0 Hz, where an analyser writes whatever it likes."""
    rows = np.flatnonzero(next(iter(table.columns.values())) != 0)
    left_out = table.numbers.size - rows.size
    if not left_out:
        return table
    remark = "the line at 0 Hz was left out" if left_out == 1 else f"{left_out} lines at 0 Hz were left out"
    return replace(rows_of(table, rows), remarks=(*table.remarks, remark))


def _averaged(omega: Real, response: Complex, coherence: Real | None) -> tuple[Real, Complex, Real | None, Real, str]:
    """The readings (M,) averaged at each frequency, how the error's variance goes with their number, and a remark."""
    at, line, count = np.unique(omega, return_inverse=True, return_counts=True)

    def mean(values: Real) -> Real:
        return np.asarray(np.bincount(line, values) / count)

    averaged = np.asarray(mean(response.real) + 1j * mean(response.imag))
    size = np.abs(averaged)[line]
    apart = np.divide(np.abs(response - averaged[line]), size, out=np.zeros_like(size), where=size > 0)
    scatter = np.sqrt(np.sum(apart**2) / np.sum(count - 1))
    remark = (
        f"{np.count_nonzero(count > 1)} of {at.size} frequencies hold several readings, which were averaged; a "
        f"single one scatters by {100 * scatter:.2g} %"
    )
    excitation = np.median(count) / count
    return at, averaged, None if coherence is None else mean(coherence), excitation, remark


def _grows(omega: Real, response: Complex) -> bool:
    """Whether the response grows over its band faster than by the power GROWTH of omega."""
    lines = np.flatnonzero(response)
    slope = np.polyfit(np.log(omega[lines]), np.log(np.abs(response[lines])), 1)[0]
    return bool(slope > GROWTH)


def _complex(table: Table, omega: Real) -> Complex:
    """The response (M,) from the columns that hold it."""
    columns = table.columns
    if "response" in columns:
        return np.asarray(columns["response"], dtype=complex)
    if "real" in columns:
        return np.asarray(columns["real"] + 1j * columns["imag"], dtype=complex)
    if "magnitude_db" in columns:
        table.refuse_any(np.abs(columns["magnitude_db"]) > 1000, "magnitude_db", "a number from -1000 to 1000")
        magnitude = 10 ** (columns["magnitude_db"] / 20)
    else:
        magnitude = columns["magnitude"]
        table.refuse_any(magnitude < 0, "magnitude", "zero or more (a minus sign is half a turn of the phase)")
    if "phase_deg" in columns:
        row = wrap(columns["phase_deg"], 2 * np.pi) if bends(omega, magnitude) else None
        _check_unit(table, row, "phase_deg", "degrees", "radians")
        phase_rad = np.radians(columns["phase_deg"])
    else:
        _check_unit(table, wrap(columns["phase_rad"], 360.0), "phase_rad", "radians", "degrees")
        phase_rad = columns["phase_rad"]
    return np.asarray(magnitude * np.exp(1j * phase_rad), dtype=complex)


def from_record(table: Table, name: str, *, resample: bool) -> FrequencyResponse:
    """The test of a table with time stamps, see :func:`identification.sweeps.estimate_response.estimate_response`.

    ``resample`` brings uneven stamps to an even grid, see :func:`identification.sweeps.even_grid.on_even_grid`.

    Raises
    ------
    InputError
        The numbers cannot be a record of a sweep.
    """
    _check_numbers(table)
    samples = table.numbers.size
    if samples < FEWEST_SAMPLES:
        table.refuse(f"holds {samples} samples; expected {FEWEST_SAMPLES} or more")
    table, sampling_s = on_even_grid(table, resample=resample)
    held = "input_held" in table.columns
    driven = "input_held" if held else "input"
    for column, expected in ((driven, "a sweep"), ("output", "the response to a sweep")):
        signal = table.columns[column]
        if np.ptp(signal) <= max(CONSTANT * np.max(np.abs(signal)), 1 / LARGEST):
            table.refuse(f"the {column} is {signal[0]:g} throughout; expected {expected}")
    record = Record(sampling_s, table.columns[driven], table.columns["output"], held)
    lead_s = _lead(record)
    if lead_s:
        table.refuse(
            f"the output leads the {driven} by about {lead_s:.3g} s; expected an output that follows "
            "(are the two swapped?)"
        )
    try:
        estimate = estimate_response(sampling_s, record.input, record.output, held=held)
    except InputError as error:
        table.refuse(str(error))
    remarks = table.remarks
    if not held and _reaches_nyquist(record, estimate.omega):
        remarks += (
            "the input has power up to half the sampling rate, which no filter before a converter leaves: if a "
            'converter holds it from sample to sample, name it input_held (--columns "input=input_held")',
        )
    return FrequencyResponse(
        estimate.omega,
        estimate.response,
        None,
        name,
        excitation=estimate.excitation,
        left_out=estimate.left_out,
        synthetic=table.synthetic,
        record=record,
        path=table.path,
        remarks=remarks,
    )


def _reaches_nyquist(record: Record, omega: Real) -> bool:
    """Whether the input's power just below half the sampling rate is a good part of that at the lines ``omega``."""
    power = np.abs(np.fft.rfft(record.input - np.mean(record.input))) ** 2
    line = 2 * np.pi / (record.input.size * record.sampling_s)
    at_lines = power[np.rint(omega / line).astype(int)]
    top = power[int(ALMOST * power.size) :]
    return bool(np.mean(top) > FILTERED * np.median(at_lines))


def _lead(record: Record) -> float:
    """Seconds by which the output leads the input; swapped, it is the output that has the excited band of a sweep."""
    try:
        with np.errstate(all="ignore"):
            back = estimate_response(record.sampling_s, record.output, record.input)
    except (InputError, np.linalg.LinAlgError):  # an output need not excite, nor be noisy
        return 0.0
    usable = np.isfinite(back.response) & (back.response != 0)
    return lead_time(back.omega, np.divide(1, back.response, out=np.zeros_like(back.response), where=usable))


def _check_numbers(table: Table) -> None:
    if table.numbers.size > MOST_POINTS:
        table.refuse(f"holds {table.numbers.size} points; expected at most {MOST_POINTS}")
    for column, values in table.columns.items():
        if column != "coherence":  # unknown where nothing was excited
            table.refuse_any(~np.isfinite(values), column, "a finite number")
        table.refuse_any(np.abs(values) > LARGEST, column, f"a number up to {LARGEST:g} in size")


def _check_unit(table: Table, row: int | None, column: str, unit: str, other: str) -> None:
    if row is not None:
        found, before = showing_difference(table.columns[column][row], table.columns[column][row - 1])
        found = f"is {found} after the {before} of {table.at(row - 1, column)}, as if wrapped in {other}"
        table.refuse_row(row, column, unit, found)
