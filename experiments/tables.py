"""Tables -> CSV files, all of them or none; a CSV file of text -> a table."""

from __future__ import annotations

import csv
from collections.abc import Callable, Iterable, Mapping, Sequence
from io import StringIO
from pathlib import Path
from typing import TYPE_CHECKING

from identification.base.errors import LONGEST, InputError
from identification.base.files import read_text, require_folder, write_whole

if TYPE_CHECKING:  # a command line need not wait for it
    import pandas as pd


FORMAT = "%.12g"
BLOCK = 4096  # rows


def write_tables(tables: Mapping[Path, pd.DataFrame], inputs: Iterable[Path] = ()) -> None:
    """Write tables as CSV, all of them or none, see :func:`csv_writer`."""
    write_whole({path: csv_writer(table) for path, table in tables.items()}, inputs)


def write_into(folder: Path, tables: Mapping[str, pd.DataFrame]) -> None:
    """Write tables as NAME.csv into an existing folder, all of them or none.

    Raises
    ------
    InputError
        There is no such folder, or see :func:`write_tables`.
    """
    require_folder(folder)
    write_tables({folder / f"{name}.csv": table for name, table in tables.items()})


def read_cells(path: Path, columns: Sequence[str]) -> pd.DataFrame:
    """Read a CSV file whose columns are known; every cell is text as it stands there.

    Raises
    ------
    InputError
        The file cannot be read, has other columns or no rows, or a row has more or fewer cells.
    """
    import pandas as pd

    reader = csv.reader(StringIO(read_text(path), newline=""), strict=True)
    rows: list[list[str]] = []
    try:
        for row in reader:
            if rows and len(row) != len(columns):
                raise InputError(f"{path}, line {reader.line_num}: {len(row)} cells; expected {len(columns)}")
            rows.append(row)
    except csv.Error as error:
        raise InputError(f"{path}, line {reader.line_num}: {error}; expected comma-separated values") from None
    header = rows[0] if rows else []
    if header != list(columns):
        raise InputError(
            f"{path}: the columns are {', '.join(header)[:LONGEST] or 'none'}; expected {', '.join(columns)}"
        )
    if len(rows) == 1:
        raise InputError(f"{path}: holds a header and no rows; expected one or more")
    return pd.DataFrame(rows[1:], columns=list(columns), dtype=str)


def csv_writer(table: pd.DataFrame) -> Callable[[Path], object]:
    """What writes a table as CSV with 12 significant digits; NaN is written as an empty cell."""
    if len(table.columns) > 1 and all(dtype == "float64" for dtype in table.dtypes):
        return lambda path: _write_numbers(path, table)
    return lambda path: table.to_csv(path, index=False, float_format=FORMAT, lineterminator="\n")


def _write_numbers(path: Path, table: pd.DataFrame) -> None:
    """The same file as pandas writes, which calls functions for each cell and takes five times as long."""
    row = ",".join([FORMAT] * len(table.columns)) + "\n"
    with path.open("w", encoding="utf-8", newline="") as file:
        table[:0].to_csv(file, index=False, lineterminator="\n")
        for first in range(0, len(table), BLOCK):
            block = table[first : first + BLOCK].to_numpy()
            file.write((row * len(block) % tuple(block.ravel().tolist())).replace("nan", ""))
