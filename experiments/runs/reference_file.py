"""A CSV of time_s and reference -> a sampled reference."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from experiments.runs.references import SampledReference
from identification.base.digits import showing_difference
from identification.base.errors import InputError
from identification.formats.csv_file import read_columns

COLUMNS = ("time_s", "reference")


def read_reference(path: Path) -> SampledReference:
    """Read a reference from a CSV with the columns time_s (seconds) and reference (the plant's output unit).

    Two rows of one time are a jump.

    Raises
    ------
    InputError
        No such file, a column that is missing or there twice, what is no finite number, times that do not increase.
    """
    tables = read_columns(path, _choose)
    if len(tables) > 1:
        raise InputError(f"{path}: holds {len(tables)} tests; expected one reference")
    time_s, values = (tables[0].columns[name] for name in COLUMNS)
    step = np.diff(time_s)
    late = np.flatnonzero((step < 0) | ((step == 0) & (np.roll(step, 1) == 0) & (np.arange(step.size) > 0)))
    if len(late):
        before, after = showing_difference(*time_s[late[0] : late[0] + 2])
        line = tables[0].numbers[late[0] + 1]
        raise InputError(
            f"{path}, line {line}: time_s is {after} after {before}; expected increasing times, or two rows of one "
            "time for a jump"
        )
    return SampledReference(time_s, values)


def _choose(place: str, header: list[str]) -> dict[str, tuple[int, float]]:
    for name in COLUMNS:
        if header.count(name) != 1:
            raise InputError(
                f"{place}: found {header.count(name)} columns {name} in '{','.join(header)}'; expected one each of "
                "time_s and reference"
            )
    return {name: (header.index(name), 1.0) for name in COLUMNS} | (
        {"test": (header.index("test"), 1.0)} if "test" in header else {}
    )
