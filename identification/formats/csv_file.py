"""A CSV -> its columns of numbers; a CSV of sweeps -> one table for each test in it."""

from __future__ import annotations

import csv
import math
import sys
from array import array
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import numpy as np

from identification.base.errors import InputError
from identification.base.files import read_text
from identification.formats.columns import Table, choose_columns, quoted, split_tests
from identification.formats.reading import Reading
from identification.formats.sizes import require_size

SEPARATORS = {",": "commas", ";": "semicolons", "\t": "tabs"}


def read_csv(path: Path, reading: Reading) -> list[Table]:
    """Read the tests of a CSV of sweeps, see :func:`read_columns`."""
    return read_columns(path, lambda place, header: choose_columns(place, header, "columns", may_be_complex=False))


def read_columns(path: Path, choose: Callable[[str, list[str]], Sequence[str]]) -> list[Table]:
    """Read the tests of a CSV: a header line with the columns' names, then a line for each point.

    ``choose`` gets what to call the header's place and its names, and gives the names of the columns to read. A
    column ``test`` tells tests apart. What the header is separated by, commas, semicolons or tabs, separates every
    line. Decimals have a point. Blank lines and those that begin with '#' are left out, and so are columns of other
    names.

    Raises
    ------
    InputError
        The file cannot be read, lacks a column, or holds something that is no number.
    """
    require_size(path)
    text = read_text(path).lstrip("\ufeff")
    rows = ((n, line) for n, line in _lines(text) if not line.startswith("#"))
    if (head := next(rows, None)) is None:
        raise InputError(f"{path}: holds no header and no numbers; expected a CSV with a header line")
    place = f"{path}, line {head[0]}"
    separator = _separator(place, head[1])
    header = _fields(path, *head, separator)
    wanted = [(name, header.index(name), array("d")) for name in choose(place, header)]
    test = header.index("test") if "test" in header else None
    numbers, labels = array("q"), []
    for n, line in rows:
        row = _fields(path, n, line, separator)
        if len(row) != len(header):
            expected = f"{len(header)} as in the header"
            if separator == "," and len(row) > len(header):
                expected += ", and decimals with a point"
            raise InputError(f"{path}, line {n}: holds {len(row)} fields; expected {expected}")
        if test is not None and not row[test]:
            raise InputError(f"{path}, line {n}: test is ''; expected a number or a name")
        for name, column, values in wanted:
            value = _number(row[column])
            if not math.isfinite(value):
                place = f"line {n}" if test is None else f"line {n}, test {row[test]}"
                expected = "a finite number" + (" with a decimal point" if "," in row[column] else "")
                raise InputError(f"{path}, {place}: {name} is {quoted(row[column])}; expected {expected}")
            values.append(value)
        numbers.append(n)
        if test is not None:
            labels.append(sys.intern(row[test]))
    if not numbers:
        raise InputError(f"{path}: holds a header and no numbers; expected a line for each point")
    synthetic = any("SYNTHETIC" in line for _, line in _lines(text) if line.startswith("#"))
    columns = {name: np.array(values) for name, _, values in wanted}
    table = Table(path, columns, np.array(numbers), in_lines=True, synthetic=synthetic)
    return [table] if test is None else split_tests(table, labels)


def _lines(text: str) -> Iterator[tuple[int, str]]:
    """The lines that are not blank, with their numbers from 1; a list of all would take more memory than the text."""
    start, number = 0, 0
    while start <= len(text):
        stop = text.find("\n", start)
        stop = len(text) if stop < 0 else stop
        number += 1
        line = text[start:stop]
        if line.strip():
            yield number, line
        start = stop + 1


def _separator(place: str, header: str) -> str:
    found = [separator for separator in SEPARATORS if separator in header]
    if len(found) > 1:
        names = " and ".join(SEPARATORS[separator] for separator in found)
        raise InputError(f"{place}: the header holds {names}; expected one of them between the columns")
    return found[0] if found else ","


def _fields(path: Path, number: int, line: str, separator: str) -> list[str]:
    try:
        row = next(csv.reader([line], delimiter=separator, skipinitialspace=True))
    except csv.Error as error:
        raise InputError(f"{path}, line {number}: cannot be read ({error}); expected fields of a CSV") from None
    return [" ".join(field.split()) for field in row]


def _number(text: str) -> float:
    try:
        return math.nan if "_" in text else float(text)
    except ValueError:
        return math.nan
