"""A CSV -> its columns of numbers; a CSV of sweeps -> one table for each test in it."""

from __future__ import annotations

import cmath
import math
import sys
from array import array
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from identification.base.arrays import Array
from identification.base.errors import InputError
from identification.formats.columns import COMPLEX, FIRST, FREQUENCIES, Table, quoted, split_tests
from identification.formats.header import BLANKS, WIDE_BLANKS, Choose, Header, find_header, name_columns, split_fields
from identification.formats.reading import Reading
from identification.formats.sizes import require_size
from identification.formats.text_file import COMMENTS, read_any_text, text_lines

UNKNOWN = ("nan", "", "-")  # a coherence where nothing was excited
END = "END"  # what a network analyser writes after its last line


def read_csv(path: Path, reading: Reading) -> list[Table]:
    """Read the tests of a CSV of sweeps, see :func:`read_columns` and :mod:`identification.formats.spellings`."""
    return read_columns(path, lambda place, names: name_columns(place, names, reading.columns))


def read_columns(path: Path, choose: Choose) -> list[Table]:
    """Read the tests of a CSV: a header line with the columns' names, then a line for each point.

    ``choose`` gets what to call the header's place and its names, and gives the columns to read; the header is the
    first line for which it does. A column ``test`` tells tests apart. What the header is separated by, commas,
    semicolons, tabs or blanks, separates every line. Decimals have a point, or all a comma where no comma separates.
    Blank lines and comments are left out, and so are columns of other names.

    Raises
    ------
    InputError
        The file cannot be read, lacks a column, or holds something that is no number.
    """
    require_size(path)
    text = read_any_text(path)
    header = find_header(path, text_lines(text), choose)
    wanted = sorted(header.columns.items(), key=lambda each: each[0] not in FIRST)
    test = header.columns["test"][0] if "test" in header.columns else None
    columns = [(name, column, array("d")) for name, (column, _) in wanted if name != "test"]
    commas = _has_decimal_commas(path, text, header)
    numbers, labels = array("q"), []
    for n, row in _rows(path, text, header):
        if test is not None and not row[test]:
            raise InputError(f"{path}, line {n}: test is ''; expected a number or a name")
        for name, column, values in columns:
            value = _number(row[column].replace(",", ".") if commas else row[column], name)
            if not cmath.isfinite(value) and not (name == "coherence" and row[column].lower() in UNKNOWN):
                at_zero = columns[0][0] in FREQUENCIES and values is not columns[0][2] and columns[0][2][-1] == 0
                if not at_zero:  # which is left out
                    place = f"line {n}" if test is None else f"line {n}, test {row[test]}"
                    expected = "a finite number" + (" with a decimal point" if "," in row[column] else "")
                    said = quoted(row[column])
                    raise InputError(f"{path}, {place}: {header.names[column]} is {said}; expected {expected}")
            values.append(value.real)
            if name == COMPLEX:
                values.append(value.imag)
        numbers.append(n)
        if test is not None:
            labels.append(sys.intern(row[test]))
    if not numbers:
        raise InputError(f"{path}: holds a header and no numbers; expected a line for each point")
    synthetic = any("SYNTHETIC" in line for _, line in text_lines(text) if line.startswith(COMMENTS))
    arrays = {name: _array(values, name) * header.columns[name][1] for name, _, values in columns}
    table = Table(path, arrays, np.array(numbers), in_lines=True, synthetic=synthetic)
    return [table] if test is None else split_tests(table, labels)


def _rows(path: Path, text: str, header: Header) -> Iterator[tuple[int, list[str]]]:
    """The fields of each line of numbers, with its number; they reach to the last column that is read, at least."""
    count = len(header.names)
    least = 1 + max(column for column, _ in header.columns.values())
    separator = BLANKS if header.separator == WIDE_BLANKS else header.separator
    for n, line in text_lines(text):
        if n <= header.line or line.startswith(COMMENTS):
            continue
        if line.strip() == END:
            return
        row = split_fields(f"{path}, line {n}", line, separator)
        if not any(row):
            continue
        if len(row) < least or any(row[count:]):
            expected = f"{count} as in the header"
            if separator == "," and len(row) > count:
                expected += ", and decimals with a point"
            raise InputError(f"{path}, line {n}: holds {len(row)} fields; expected {expected}")
        yield n, row


def _has_decimal_commas(path: Path, text: str, header: Header) -> bool:
    """Whether the numbers that are read have decimal commas, and none of them a point."""
    if header.separator == "," or "," not in text:
        return False
    read = [column for name, (column, _) in header.columns.items() if name != "test"]
    fields = [False, False]
    for _, row in _rows(path, text, header):
        for column in read:
            fields = [fields[0] or "," in row[column], fields[1] or "." in row[column]]
        if fields[1]:
            return False
    return fields[0]


def _array(values: array[float], name: str) -> Array:
    return np.array(values).view(complex) if name == COMPLEX else np.array(values)


def _number(text: str, name: str) -> complex:
    """The number that a field holds, or NaN."""
    if name == COMPLEX:
        text = text.replace(" ", "").removeprefix("(").removesuffix(")").replace("i", "j").replace("+-", "-")
    try:
        return math.nan if "_" in text else complex(text) if name == COMPLEX else float(text)
    except ValueError:
        return math.nan
