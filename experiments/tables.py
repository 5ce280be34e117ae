"""Tables -> CSV files, all of them or none."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path

import pandas as pd

from identification.files import write_whole


def write_tables(tables: Mapping[Path, pd.DataFrame], inputs: Iterable[Path] = ()) -> None:
    """Write tables as CSV with 12 significant digits, all of them or none; NaN is written as an empty cell."""
    write_whole(
        {
            path: lambda partial, table=table: table.to_csv(  # type: ignore[misc]
                partial, index=False, float_format="%.12g", lineterminator="\n"
            )
            for path, table in tables.items()
        },
        inputs,
    )
