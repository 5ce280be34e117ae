"""Tables -> CSV files, all of them or none."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from pathlib import Path

import pandas as pd

from identification.files import write_whole


def write_tables(tables: Mapping[Path, pd.DataFrame], inputs: Iterable[Path] = ()) -> None:
    """Write tables as CSV, all of them or none, see :func:`csv_writer`."""
    write_whole({path: csv_writer(table) for path, table in tables.items()}, inputs)


def csv_writer(table: pd.DataFrame) -> Callable[[Path], object]:
    """What writes a table as CSV with 12 significant digits; NaN is written as an empty cell."""
    return lambda path: table.to_csv(path, index=False, float_format="%.12g", lineterminator="\n")
