"""Read one sweep, an analyser's frequency response or a raw record, and refuse what cannot be one."""

from __future__ import annotations

import csv
from dataclasses import dataclass
from io import StringIO
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from identification.files import InputError, read_text
from identification.sweep import estimate_response

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]

FEWEST_LINES = 8
FEWEST_SAMPLES = 128
JITTER = 0.05  # largest distance of a sample from the uniform grid, in sampling intervals
KINDS = (
    ("frequency_hz", "magnitude_db", "phase_deg"),
    ("frequency_hz", "real", "imag"),
    ("time_s", "input", "output"),
)


@dataclass(frozen=True)
class FrequencyResponse:
    """One test: the response of the plant at M lines.

    Parameters
    ----------
    omega
        (M,) rad/s, positive, increasing.
    response
        (M,) complex, output unit per input unit.
    coherence
        (M,) between 0 and 1, or None. Kept for the reader; no weight is made of it, since it is as noisy
        as the response and errs together with it.
    name
        What to call this test.
    variance
        (M,) estimate of E|error|^2 of each line, or None; a raw record has one.
    excitation
        (M,) how the variance goes from line to line on account of the excitation alone, or None for alike.
    synthetic
        The file says of itself that it is synthetic.
    """

    omega: Real
    response: Complex
    coherence: Real | None
    name: str
    variance: Real | None = None
    excitation: Real | None = None
    synthetic: bool = False


@dataclass(frozen=True)
class _Table:
    """The numbers of a CSV: its columns, and for each row the line of the file that holds it."""

    path: Path
    columns: dict[str, Real]
    lines: NDArray[np.intp]
    synthetic: bool

    def refuse(self, bad: NDArray[np.bool_], column: str, expected: str) -> None:
        """Raise InputError at the first row where ``bad`` holds."""
        if bad.any():
            row = int(np.argmax(bad))
            raise InputError(
                f"{self.path}, line {self.lines[row]}: {column} is {self.columns[column][row]:.10g}; "
                f"expected {expected}"
            )


def read_sweep(path: Path | str) -> FrequencyResponse:
    """Read a CSV that holds a frequency response or a raw record; its header's columns say which.

    A frequency response has the columns frequency_hz, magnitude_db, phase_deg or frequency_hz, real, imag, and
    may have coherence; a raw record has time_s, input, output. Further columns are ignored, so are
    blank lines and those that begin with '#'. A raw record goes through
    :func:`identification.sweep.estimate_response`.

    Raises
    ------
    InputError
        The file cannot be read, has no such columns, or holds numbers that cannot be a sweep's; the
        sentence names the file, the line or column, what was found and what was expected.
    """
    table = _read_table(Path(path))
    if "time_s" in table.columns:
        return _from_record(table)
    return _from_response(table)


def _from_response(table: _Table) -> FrequencyResponse:
    frequency_hz = table.columns["frequency_hz"]
    table.refuse(frequency_hz <= 0, "frequency_hz", "a positive number")
    _refuse_order(table, "frequency_hz")
    if frequency_hz.size < FEWEST_LINES:
        raise InputError(f"{table.path}: holds {frequency_hz.size} frequencies; expected {FEWEST_LINES} or more")
    coherence = table.columns.get("coherence")
    if coherence is not None:
        table.refuse((coherence < 0) | (coherence > 1), "coherence", "a number from 0 to 1")
    if "magnitude_db" in table.columns:
        magnitude_db = table.columns["magnitude_db"]
        table.refuse(np.abs(magnitude_db) > 1000, "magnitude_db", "a number from -1000 to 1000")
        phase_rad = np.radians(table.columns["phase_deg"])
        response = np.asarray(10 ** (magnitude_db / 20) * np.exp(1j * phase_rad), dtype=complex)
    else:
        response = np.asarray(table.columns["real"] + 1j * table.columns["imag"], dtype=complex)
    if not response.any():
        raise InputError(f"{table.path}: the response is 0 at every frequency; expected a plant that responds")
    return FrequencyResponse(2 * np.pi * frequency_hz, response, coherence, table.path.name, synthetic=table.synthetic)


def _from_record(table: _Table) -> FrequencyResponse:
    time_s = table.columns["time_s"]
    _refuse_order(table, "time_s")
    if time_s.size < FEWEST_SAMPLES:
        raise InputError(f"{table.path}: holds {time_s.size} samples; expected {FEWEST_SAMPLES} or more")
    dt = float(time_s[-1] - time_s[0]) / (time_s.size - 1)
    if np.max(np.abs((time_s - time_s[0]) / dt - np.arange(time_s.size))) > JITTER:
        step = np.diff(time_s, prepend=time_s[0])
        usual = np.median(step[1:])
        off = np.abs(step[1:] - usual)
        worst = 1 + np.argmax(off > 0.9 * off.max())
        table.refuse(
            np.arange(time_s.size) == worst,
            "time_s",
            f"about {time_s[worst - 1] + usual:.10g} (uniform sampling, within {100 * JITTER:g} % of an interval)",
        )
    if np.ptp(table.columns["input"]) == 0:
        raise InputError(f"{table.path}: the input is {table.columns['input'][0]:g} throughout; expected a sweep")
    try:
        estimate = estimate_response(dt, table.columns["input"], table.columns["output"])
    except InputError as error:
        raise InputError(f"{table.path}: {error}") from None
    return FrequencyResponse(
        estimate.omega,
        estimate.response,
        None,
        table.path.name,
        variance=estimate.variance,
        excitation=estimate.excitation,
        synthetic=table.synthetic,
    )


def _refuse_order(table: _Table, column: str) -> None:
    values = table.columns[column]
    step = np.diff(values, prepend=-np.inf)
    row = int(np.argmax(step <= 0))
    if step[row] <= 0:
        table.refuse(
            np.arange(values.size) == row,
            column,
            f"more than the {values[row - 1]:.10g} of line {table.lines[row - 1]} (increasing, no duplicates)",
        )


def _read_table(path: Path) -> _Table:
    """Parse the columns of one of KINDS and coherence; the numbers are finite."""
    numbered = [(n, text) for n, text in enumerate(read_text(path).lstrip("\ufeff").splitlines(), 1) if text.strip()]
    comments = [text for _, text in numbered if text.startswith("#")]
    rows = [(n, text) for n, text in numbered if not text.startswith("#")]
    if not rows:
        raise InputError(f"{path}: holds no header and no numbers; expected a CSV with a header line")
    header = [name.strip().strip('"') for name in rows[0][1].split(",")]
    wanted = _columns_wanted(path, rows[0][0], header)
    for n, text in rows[1:]:
        fields = text.count(",") + 1
        if fields != len(header):
            raise InputError(f"{path}, line {n}: holds {fields} fields; expected {len(header)} as in the header")
    if len(rows) == 1:
        raise InputError(f"{path}: holds a header and no numbers; expected a line for each point")
    texts = pd.read_csv(
        StringIO("\n".join(text for _, text in rows[1:])),
        header=None,
        names=range(len(header)),
        dtype=str,
        keep_default_na=False,
        skipinitialspace=True,
        quoting=csv.QUOTE_NONE,
    )
    lines = np.array([n for n, _ in rows[1:]])
    columns = {}
    for name in wanted:
        column = texts[header.index(name)].str.strip()
        values = pd.to_numeric(column, errors="coerce").to_numpy(dtype=float)
        bad = ~np.isfinite(values)
        if bad.any():
            row = int(np.argmax(bad))
            raise InputError(f"{path}, line {lines[row]}: {name} is '{column[row]}'; expected a finite number")
        columns[name] = values
    return _Table(path, columns, lines, any("SYNTHETIC" in text for text in comments))


def _columns_wanted(path: Path, line: int, header: list[str]) -> list[str]:
    for kind in KINDS:
        if set(kind) <= set(header):
            wanted = [*kind, "coherence"] if kind[0] == "frequency_hz" and "coherence" in header else list(kind)
            for name in wanted:
                if header.count(name) > 1:
                    raise InputError(f"{path}, line {line}: column '{name}' comes twice; expected it once")
            return wanted
    found = ", ".join(f"'{name}'" for name in header)
    expected = " or ".join(", ".join(kind) for kind in KINDS)
    raise InputError(f"{path}, line {line}: the columns are {found}; expected {expected}")
