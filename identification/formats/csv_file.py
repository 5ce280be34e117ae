"""A CSV -> its columns of numbers; a CSV of sweeps -> one table for each test in it."""

from __future__ import annotations

import csv
import math
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from identification.base.errors import InputError
from identification.base.files import read_text
from identification.formats.columns import Table, choose_columns, quoted, split_tests

SEPARATORS = {",": "commas", ";": "semicolons", "\t": "tabs"}


def read_csv(path: Path) -> list[Table]:
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
    lines = read_text(path).lstrip("\ufeff").split("\n")
    numbered = [(n, line) for n, line in enumerate(lines, 1) if line.strip()]
    rows = [(n, line) for n, line in numbered if not line.startswith("#")]
    if not rows:
        raise InputError(f"{path}: holds no header and no numbers; expected a CSV with a header line")
    place = f"{path}, line {rows[0][0]}"
    separator = _separator(place, rows[0][1])
    header = _fields(path, *rows[0], separator)
    wanted = choose(place, header)
    if len(rows) == 1:
        raise InputError(f"{path}: holds a header and no numbers; expected a line for each point")
    cells = [_fields(path, n, line, separator) for n, line in rows[1:]]
    numbers = np.array([n for n, _ in rows[1:]])
    for n, row in zip(numbers, cells, strict=True):
        if len(row) != len(header):
            expected = f"{len(header)} as in the header"
            if separator == "," and len(row) > len(header):
                expected += ", and decimals with a point"
            raise InputError(f"{path}, line {n}: holds {len(row)} fields; expected {expected}")
    labels = [row[header.index("test")] for row in cells] if "test" in header else None
    if labels is not None and "" in labels:
        raise InputError(f"{path}, line {numbers[labels.index('')]}: test is ''; expected a number or a name")
    columns = {}
    for name in wanted:
        texts = [row[header.index(name)] for row in cells]
        columns[name] = np.array([_number(text) for text in texts])
        bad = ~np.isfinite(columns[name])
        if bad.any():
            k = int(np.argmax(bad))
            place = f"line {numbers[k]}" if labels is None else f"line {numbers[k]}, test {labels[k]}"
            expected = "a finite number" + (" with a decimal point" if "," in texts[k] else "")
            raise InputError(f"{path}, {place}: {name} is {quoted(texts[k])}; expected {expected}")
    synthetic = any("SYNTHETIC" in line for _, line in numbered if line.startswith("#"))
    table = Table(path, columns, numbers, in_lines=True, synthetic=synthetic)
    return [table] if labels is None else split_tests(table, labels)


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
