"""Files of sweeps -> the frequency response of each test; what cannot be one is refused."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from identification.base.arrays import Complex, Real
from identification.base.errors import InputError, printable
from identification.base.files import is_folder, require_readable, true_path
from identification.formats.columns import Table
from identification.formats.csv_file import read_csv
from identification.formats.first_bytes import usual_suffix
from identification.formats.mat_file import read_mat
from identification.formats.reading import Reading
from identification.formats.uff_file import read_uff
from identification.sweeps.estimate_response import estimate_response
from identification.sweeps.kept_responses import read_responses
from identification.sweeps.response import FrequencyResponse, Record
from identification.sweeps.swapped_or_wrong_unit import bends, lead_time, wrap

FEWEST_LINES = 8
FEWEST_SAMPLES = 128
JITTER = 0.05  # largest distance of a sample from the uniform grid, in sampling intervals
CONSTANT = 1e-9  # of a signal's size
LARGEST = 1e50  # number in a column
MOST_POINTS = 20_000_000  # lines or samples of a test; a fit takes some 200 bytes of memory for each
KEPT = ".npz"
READERS = {".csv": read_csv, ".mat": read_mat, **dict.fromkeys((".uff", ".unv", ".ufb", ".58"), read_uff)}


def input_files(paths: Sequence[Path | str]) -> list[Path]:
    """The files that a list of files and folders means, in its order.

    A folder means the files in it that end in .csv, .mat, .uff, .unv, .ufb or .58, sorted by name; hidden ones and
    folders within are left out.

    Raises
    ------
    InputError
        A folder holds no such file or may not be read, or a file is given twice.
    """
    files: list[Path] = []
    for path in map(Path, paths):
        files += _files_in(path) if is_folder(path) else [path]
    met = set()
    for file in files:
        if (goal := true_path(file)) in met:
            raise InputError(f"{file}: is given twice; expected each file once")
        met.add(goal)
    return files


def read_sweeps(paths: Path | str | Sequence[Path | str], reading: Reading | None = None) -> list[FrequencyResponse]:
    """Read the tests of a file, or of files and folders (see :func:`input_files`), in their order.

    ``reading`` says what the files do not say themselves.

    A file that ends in .npz holds responses that were estimated before, see
    :mod:`identification.sweeps.kept_responses`; they keep their names and the paths that they came from. Every other
    file holds frequency responses or raw records: a MAT or universal file if it begins as such a file does, or its
    name ends in .mat, .uff, .unv, .ufb or .58, and else a CSV. Its columns, in a MAT file its variables, say what
    they are by their names: frequency_hz or omega (rad/s); magnitude_db or magnitude, with phase_deg or phase_rad;
    or real, imag; and coherence if there is one. A raw record has time_s, output, and input (band-limited like the
    output before both are sampled) or input_held (the command of a converter that holds it for one interval), and
    goes through
    :func:`identification.sweeps.estimate_response.estimate_response`. A column ``test`` tells several tests apart.

    Raises
    ------
    InputError
        A file cannot be read, lacks a column, or holds numbers that cannot be a sweep's; the sentence names
        the file, the line, the test, what was found and what was expected.
    """
    files = input_files([paths] if isinstance(paths, Path | str) else paths)
    tests = []
    for file, name in zip(files, _names(files), strict=True):
        require_readable(file)
        if file.suffix.lower() == KEPT:
            tests += read_responses(file)
            continue
        suffix = usual_suffix(file) or file.suffix.lower()
        for table in READERS.get(suffix, read_csv)(file, reading or Reading()):
            label = name if table.test is None else f"{name}, test {table.test}"
            tests.append(_from_record(table, label) if "time_s" in table.columns else _from_response(table, label))
    return tests


def _files_in(folder: Path) -> list[Path]:
    try:
        entries = sorted(folder.iterdir())
    except OSError as error:
        raise InputError(f"{folder}: cannot be read ({error.strerror})") from None
    files = [
        entry
        for entry in entries
        if entry.suffix.lower() in READERS and not entry.name.startswith(".") and not is_folder(entry)
    ]
    if not files:
        raise InputError(f"{folder}: holds no file that ends in {', '.join(READERS)}; expected one or more")
    return files


def _names(files: Sequence[Path]) -> list[str]:
    """Each file's base name, printable, with as many of its folders as tell it from the others of that name."""
    names = []
    for file in files:
        parts = file.absolute().parts
        others = [other.absolute().parts for other in files if other != file and other.name == file.name]
        length = 1
        while any(other[-length:] == parts[-length:] for other in others):
            length += 1
        names.append(printable("/".join((*parts[-length:-1], file.name))))
    return names


def _from_response(table: Table, name: str) -> FrequencyResponse:
    _check_numbers(table)
    frequency = next(iter(table.columns))
    values = table.columns[frequency]
    table.refuse_any(values <= 0, frequency, "a positive number")
    table.refuse_any(values < 1 / LARGEST, frequency, f"{1 / LARGEST:g} or more")
    _check_order(table, frequency)
    if values.size < FEWEST_LINES:
        table.refuse(f"holds {values.size} frequencies; expected {FEWEST_LINES} or more")
    coherence = table.columns.get("coherence")
    if coherence is not None:
        table.refuse_any((coherence < 0) | (coherence > 1), "coherence", "a number from 0 to 1")
    omega = 2 * np.pi * values if frequency == "frequency_hz" else values
    response = _complex(table, omega)
    if not response.any():
        table.refuse("the response is 0 at every frequency; expected a plant that responds")
    lead_s = lead_time(omega, response)
    if lead_s:
        table.refuse(
            f"the output leads the input by about {lead_s:.3g} s; expected a plant's output, which does not "
            "(are input and output swapped, or is the phase's sign?)"
        )
    return FrequencyResponse(omega, response, coherence, name, synthetic=table.synthetic, path=table.path)


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


def _from_record(table: Table, name: str) -> FrequencyResponse:
    _check_numbers(table)
    time_s = table.columns["time_s"]
    _check_order(table, "time_s")
    if time_s.size < FEWEST_SAMPLES:
        table.refuse(f"holds {time_s.size} samples; expected {FEWEST_SAMPLES} or more")
    sampling_s = float(time_s[-1] - time_s[0]) / (time_s.size - 1)
    if sampling_s < 1 / LARGEST:
        table.refuse(f"the samples lie {sampling_s:.3g} s apart; expected {1 / LARGEST:g} s or more")
    _check_uniform(table, sampling_s)
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
    return FrequencyResponse(
        estimate.omega,
        estimate.response,
        None,
        name,
        excitation=estimate.excitation,
        synthetic=table.synthetic,
        record=record,
        path=table.path,
    )


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
        table.refuse_any(~np.isfinite(values), column, "a finite number")
        table.refuse_any(np.abs(values) > LARGEST, column, f"a number up to {LARGEST:g} in size")


def _check_order(table: Table, column: str) -> None:
    values = table.columns[column]
    late = np.diff(values, prepend=-np.inf) <= 0
    if late.any():
        row = int(np.argmax(late))
        before = f"{values[row - 1]:.10g} of {table.at(row - 1, column)}"
        table.refuse_row(row, column, f"more than the {before} (increasing, no duplicates)")


def _check_uniform(table: Table, sampling_s: float) -> None:
    time_s = table.columns["time_s"]
    if np.max(np.abs((time_s - time_s[0]) / sampling_s - np.arange(time_s.size))) > JITTER:
        step = np.diff(time_s)
        usual = np.median(step)
        off = np.abs(step - usual)
        row = 1 + int(np.argmax(off > 0.9 * off.max()))
        due = f"about {time_s[row - 1] + usual:.10g}"
        table.refuse_row(row, "time_s", f"{due} (uniform sampling, within {100 * JITTER:g} % of an interval)")


def _check_unit(table: Table, row: int | None, column: str, unit: str, other: str) -> None:
    if row is not None:
        before = f"{table.columns[column][row - 1]:.10g} of {table.at(row - 1, column)}"
        found = f"is {table.columns[column][row]:.10g} after the {before}, as if wrapped in {other}"
        table.refuse_row(row, column, unit, found)
