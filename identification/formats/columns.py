"""The columns of one test, whatever file they come from: which names make a test, and where a number stands."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from pathlib import Path
from typing import NoReturn

import numpy as np

from identification.base.arrays import Array, Flags, Whole
from identification.base.errors import InputError

POLAR = (("magnitude_db", "magnitude"), ("phase_deg", "phase_rad"))
CARTESIAN = ("real", "imag")
COMPLEX = "response"
FREQUENCIES = ("frequency_hz", "omega")
FIRST = (*FREQUENCIES, "time_s")
INPUTS = ("input", "input_held")
OF_RESPONSE = {*FREQUENCIES, *POLAR[0], *POLAR[1], *CARTESIAN, COMPLEX, "coherence"}
OF_RECORD = {"time_s", *INPUTS, "output"}
KNOWN = OF_RESPONSE | OF_RECORD | {"test"}

KINDS = [
    *({frequency, magnitude, phase} for frequency in FREQUENCIES for magnitude in POLAR[0] for phase in POLAR[1]),
    *({frequency, *CARTESIAN} for frequency in FREQUENCIES),
    *({frequency, COMPLEX} for frequency in FREQUENCIES),
    *({"time_s", measured, "output"} for measured in INPUTS),
]
EXCLUSIVE: list[tuple[set[str], ...]] = [
    *(({first}, {second}) for first, second in (FREQUENCIES, *POLAR, INPUTS)),
    ({*POLAR[0], *POLAR[1]}, {*CARTESIAN}, {COMPLEX}),
    (OF_RESPONSE, OF_RECORD),
]
MOST_NAMES = 12  # in one sentence
MOST_CHARACTERS = 40  # of something found


@dataclass(frozen=True)
class Table:
    """The numbers of one test.

    Parameters
    ----------
    path
        The file.
    columns
        Each (N,), complex for ``response``, else real.
    numbers
        (N,) where each row stands: its line in the file, or its index from 1 in the file's variables.
    in_lines
        Which of the two ``numbers`` are.
    test
        What the file calls this test, or None if it holds no other.
    synthetic
        The file says of itself that it is synthetic.
    remarks
        What the reader left out or changed.
    """

    path: Path
    columns: Mapping[str, Array]
    numbers: Whole
    in_lines: bool
    test: str | None = None
    synthetic: bool = False
    remarks: tuple[str, ...] = ()

    def refuse(self, sentence: str) -> NoReturn:
        """Raise InputError with a sentence about the test as a whole."""
        raise InputError(f"{self.path}{self._test}: {sentence}")

    def refuse_row(self, row: int, column: str, expected: str, found: str | None = None) -> NoReturn:
        """Raise InputError about the number in one row of a column."""
        found = f"is {self.columns[column][row]:.15g}" if found is None else found
        if self.in_lines:
            raise InputError(f"{self.path}, {self.at(row, column)}{self._test}: {column} {found}; expected {expected}")
        self.refuse(f"{self.at(row, column)} {found}; expected {expected}")

    def refuse_any(self, bad: Flags, column: str, expected: str) -> None:
        """Raise InputError at the first row where ``bad`` holds, if there is one."""
        if bad.any():
            self.refuse_row(int(np.argmax(bad)), column, expected)

    def at(self, row: int, column: str) -> str:
        """The row as the file's reader counts it: a line, or an element of a variable."""
        number = self.numbers[row]
        return f"line {number}" if self.in_lines else f"{column}({number})"

    @property
    def _test(self) -> str:
        return "" if self.test is None else f", test {self.test}"


def split_tests(table: Table, labels: Sequence[str]) -> list[Table]:
    """One table for each of the N rows' labels, in the order in which they first come; a test's rows may lie apart.

    A label that all rows share tells nothing apart and is left out.
    """
    rows: dict[str, list[int]] = {}
    for row, label in enumerate(labels):
        rows.setdefault(label, []).append(row)
    if len(rows) < 2:
        return [table]
    return [replace(rows_of(table, np.array(chosen)), test=label) for label, chosen in rows.items()]


def choose_columns(place: str, names: Sequence[str], noun: str) -> list[str]:
    """The columns among ``names`` that make a test: frequency or time first, ``coherence`` included, ``test`` not.

    Raises
    ------
    InputError
        A column is missing, comes twice, is spelt almost as a known one, or says what another says too.
    """
    spelt = {_bare(name): name for name in KNOWN}
    for name in names:
        meant = spelt.get(_bare(name), name)
        if meant != name:
            raise InputError(f"{place}: one of the {noun} is {quoted(name)}; expected '{meant}' or another name")
    found = [name for name in names if name in KNOWN]
    for name in found:
        if found.count(name) > 1:
            raise InputError(f"{place}: the {noun} hold '{name}' twice; expected it once")
    for group in EXCLUSIVE:
        for one, other in combinations(group, 2):
            both = [next((name for name in found if name in side), None) for side in (one, other)]
            if None not in both:
                raise InputError(f"{place}: the {noun} hold both '{both[0]}' and '{both[1]}'; expected one of them")
    chosen = [name for name in found if name != "test"]
    if set(chosen) - {"coherence"} not in KINDS:
        shown = ", ".join(map(quoted, names[:MOST_NAMES]))
        more = f" and {len(names) - MOST_NAMES} more" if len(names) > MOST_NAMES else ""
        raise InputError(
            f"{place}: the {noun} are {shown}{more}; expected frequency_hz, magnitude_db, phase_deg "
            "or frequency_hz, real, imag or frequency_hz, response or time_s, input, output "
            "(or omega, magnitude, phase_rad, input_held in their place), or --columns NAME=OURS"
        )
    return sorted(chosen, key=lambda name: name not in FIRST)


def rows_of(table: Table, rows: Whole) -> Table:
    """The table with the chosen rows, in their order."""
    columns = {name: values[rows] for name, values in table.columns.items()}
    return replace(table, columns=columns, numbers=table.numbers[rows])


def quoted(text: str) -> str:
    """Some text from a file in quotes, in one line, cut where it is long."""
    return repr(text if len(text) <= MOST_CHARACTERS else f"{text[: MOST_CHARACTERS - 3]}...")


def _bare(name: str) -> str:
    return re.sub(r"[\W_]", "", name.casefold())
