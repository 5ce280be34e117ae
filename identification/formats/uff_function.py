"""A universal file -> the functions in its data sets 58 and 58b.

They are read here and not by pyuff, which takes what fills the last record for values (its issue 22), ends binary
data wherever they look like an end (61, 88), and knows neither exponents with a D (32) nor blanks that fill a line.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

import numpy as np

from identification.base.arrays import Array, Real
from identification.base.errors import InputError
from identification.base.files import read_bytes
from identification.formats.columns import quoted
from identification.formats.sizes import require_size

SET = re.compile(rb"(?<![^\r\n]) {4}-1[ \t]*(?=[\r\n]|\Z)")  # stands before and after each
END = re.compile(rb" {4}-1[ \t]*(?=[\r\n]|\Z)")  # binary data have no end of line before it
UNDECLARED = ("", "none", "unknown", "null")  # unit
LINE = re.compile(rb"([^\r\n]*)(?:\r\n|\r|\n|\Z)")
JOINED = re.compile(rb"(?<=[\d.])[-+]")  # the sign of a number that the one before leaves no blank for
HEADER = 11  # lines, five of them text
COLUMNS = (0, 5, 15, 20, 30, 41, 51, 55, 66, 76, 80)  # of the sixth line, where its fields begin
ORDINATES = {"2": ("f4", 1), "4": ("f8", 1), "5": ("f4", 2), "6": ("f8", 2)}  # its precision, and how many make a value
BYTE_ORDERS = {"1": "<", "2": ">"}
IEEE = "2"
QUANTITIES = {
    "8": "displacement",
    "9": "force",
    "11": "velocity",
    "12": "acceleration",
    "13": "force",
    "15": "pressure",
}


class End(NamedTuple):
    """A point of a structure and an axis: 1, 2, 3 for x, y, z, negative against it, from 4 on turns about them."""

    node: int
    direction: int

    def __str__(self) -> str:
        return f"node {self.node}, direction {self.direction}"


@dataclass(frozen=True)
class Function:
    """A function of frequency or time between two points.

    Parameters
    ----------
    number
        Of the data set in the file, from 1.
    kind
        The function type, 4 for a frequency response.
    text
        The five lines of text.
    ends
        The response's and the reference's.
    abscissa_unit
        As it is written.
    ordinate
        Which quantity over which, with their units, or nothing if the file does not say it.
    x
        (N,) abscissa.
    values
        (N,) ordinate, real or complex.

    References
    ----------
    Structural Dynamics Research Laboratory, University of Cincinnati, "Universal Dataset Number 58".
    """

    number: int
    kind: int
    text: tuple[str, ...]
    ends: tuple[End, End]
    abscissa_unit: str
    ordinate: str
    x: Real
    values: Array


def read_functions(path: Path) -> Iterator[Function]:
    """The functions of a universal file, in their order; other data sets are left out.

    Raises
    ------
    InputError
        The file cannot be read; a data set 58 is incomplete, or holds something that is no number.
    """
    require_size(path)
    content = read_bytes(path)
    number, end = 0, 0
    while start := SET.search(content, end):
        number += 1
        (name,), end = _lines(content, _lines(content, start.end(), 1)[1], 1)
        is_binary = name[6:7].lower() == "b"
        if name[:6].strip() == "58":
            try:
                function, end = _function(content, number, end, name[7:].split() if is_binary else None)
            except ValueError as error:
                place = f"{path}, data set {number}"
                raise InputError(f"{place}: cannot be read ({error}); expected a complete data set 58") from None
            yield function
        last = (END if is_binary else SET).search(content, end)
        end = last.end() if last else len(content)


def _lines(content: bytes, position: int, count: int) -> tuple[list[str], int]:
    """So many lines from ``position`` on, empty behind the end, and where the next begins."""
    lines = []
    for _ in range(count):
        if line := LINE.match(content, position):
            position = line.end()
        lines.append(line[1].decode("latin-1") if line else "")
    return lines, position


def _function(content: bytes, number: int, position: int, binary: list[str] | None) -> tuple[Function, int]:
    """The function whose lines follow the one with the data set's number, and where its values end.

    ``binary`` has what that line says of binary values.
    """
    (*text, identity, form, abscissa, numerator, denominator, _), position = _lines(content, position, HEADER)
    fields = [identity[first:last] for first, last in pairwise(COLUMNS)]
    kind, rsp_node, rsp_direction, ref_node, ref_direction = (_whole(fields[k]) for k in (0, 5, 6, 8, 9))
    words = form.split()
    if len(words) < 5 or words[0] not in ORDINATES:
        raise ValueError(f"the form of its values is {quoted(form.strip())}")
    precision, parts = ORDINATES[words[0]]
    count, is_even = _whole(words[1]), _whole(words[2]) == 1
    width = parts + (not is_even)
    if binary is None:
        last = SET.search(content, position)
        end = last.start() if last else len(content)
        numbers = np.fromiter(_numbers(content[position:end]), float)
        if numbers[count * width :].any():
            raise ValueError(f"{numbers.size / width:g} of {count} values")
    else:
        if len(binary) < 2 or binary[0] not in BYTE_ORDERS or binary[1] != IEEE:
            raise ValueError(f"its binary numbers are of the kind {quoted(' '.join(binary[:2]))}")
        kind_of_number = np.dtype(BYTE_ORDERS[binary[0]] + precision)
        whole = min(count * width, (len(content) - position) // kind_of_number.itemsize)
        with np.errstate(all="ignore"):
            numbers = np.frombuffer(content, kind_of_number, max(whole, 0), position).astype(float)
        end = position + numbers.size * kind_of_number.itemsize
    if not 0 < count * width <= numbers.size:
        raise ValueError(f"{numbers.size // width} of {count} values")
    table = numbers[: count * width].reshape(count, width)
    with np.errstate(all="ignore"):  # of what is not finite, which is refused with its place
        x = np.asarray(_real(words[3]) + _real(words[4]) * np.arange(count) if is_even else table[:, 0])
    values = np.ascontiguousarray(table[:, -2:]).view(complex)[:, 0] if parts == 2 else table[:, -1]
    ends = End(rsp_node, rsp_direction), End(ref_node, ref_direction)
    lines = tuple(line.strip() for line in text)
    quantities = [quantity for line in (numerator, denominator) if (quantity := _quantity(line))]
    ordinate = " over ".join(quantities) if len(quantities) == 2 else ""
    return Function(number, kind, lines, ends, abscissa[46:66].strip(), ordinate, x, values), end


def _quantity(line: str) -> str:
    """What a line about an ordinate says that it is, with its unit if it names one."""
    name, unit = QUANTITIES.get(line[:10].strip(), ""), line[46:66].strip()
    return name and (name if unit.lower() in UNDECLARED else f"{name} in {quoted(unit)}")


def _numbers(text: bytes) -> Iterator[float]:
    apart = JOINED.sub(rb" \g<0>", text)
    return (_real(word[0].decode("latin-1")) for word in re.finditer(rb"\S+", apart))


def _real(word: str) -> float:
    try:
        return float(word.upper().replace("D", "E"))
    except ValueError:
        raise ValueError(f"{quoted(word)} is not a number") from None


def _whole(word: str) -> int:
    """The whole number, 0 if there is none, as Fortran reads it."""
    if not re.fullmatch(r"[ \t]*([-+]?\d{1,18})?[ \t]*", word, re.ASCII):
        raise ValueError(f"{quoted(word.strip())} is not a whole number")
    return int(word.strip() or 0)
