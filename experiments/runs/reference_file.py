"""A CSV of time_s and reference -> a sampled reference."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from experiments.runs.references import SampledReference
from identification.base.errors import InputError
from identification.formats.csv_file import read_columns

COLUMNS = ("time_s", "reference")


def read_reference(path: Path) -> SampledReference:
    """Read a reference from a CSV with the columns time_s (seconds) and reference (the plant's output unit).

    Raises
    ------
    InputError
        No such file, a column that is missing or there twice, what is no finite number, times that do not increase.
    """
    tables = read_columns(path, _choose)
    if len(tables) > 1:
        raise InputError(f"{path}: holds {len(tables)} tests; expected one reference")
    time_s, values = (tables[0].columns[name] for name in COLUMNS)
    late = np.flatnonzero(np.diff(time_s) <= 0)
    if len(late):
        before, after = time_s[late[0] : late[0] + 2]
        line = tables[0].numbers[late[0] + 1]
        raise InputError(f"{path}, line {line}: time_s is {after:.9g} after {before:.9g}; expected increasing times")
    return SampledReference(time_s, values)


def _choose(place: str, header: list[str]) -> tuple[str, ...]:
    for name in COLUMNS:
        if header.count(name) != 1:
            raise InputError(
                f"{place}: found {header.count(name)} columns {name} in '{','.join(header)}'; expected one each of "
                "time_s and reference"
            )
    return COLUMNS
