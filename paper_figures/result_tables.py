"""Tables of results as the figures need them; what a table lacks is said in a sentence."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from io import StringIO
from pathlib import Path
from traceback import walk_tb

import pandas as pd

from identification.base.errors import InputError, MissingFile
from identification.base.files import is_there, read_text


def read_table(path: Path, figure: str = "summary") -> pd.DataFrame:
    """Return a table of results, its ``#`` lines left out.

    Parameters
    ----------
    path
        The CSV file.
    figure
        Name of the figure that needs it, for the message.

    Raises
    ------
    MissingFile
        There is no such file.
    InputError
        The file is no table or has no rows.
    """
    if not is_there(path):
        raise MissingFile(f"{path}: no such table, which {figure} needs")
    try:
        table = pd.read_csv(StringIO(read_text(path)), comment="#")
    except (pd.errors.ParserError, pd.errors.EmptyDataError):
        raise InputError(f"{path}: not a table of comma-separated values, which {figure} needs") from None
    if table.empty:
        raise InputError(f"{path}: no rows below the names of the columns, which {figure} needs")
    return table


@contextmanager
def missing_columns_named(tables: Mapping[str, pd.DataFrame], results: Path, figure: str) -> Iterator[None]:
    """Turn the KeyError of a table that lacks a column into a sentence; every other KeyError goes on.

    Raises
    ------
    InputError
        A column that was asked for is missing from one of the tables, or from rows taken out of one.
    """
    try:
        yield
    except KeyError as error:
        column = error.args[0]
        for frame, _ in walk_tb(error.__traceback__):
            asked = frame.f_locals.get("self")
            if not isinstance(asked, pd.DataFrame) or column in asked.columns:
                continue
            for name, table in tables.items():
                if asked.columns.equals(table.columns):
                    raise InputError(f"{results / name}.csv: no column {column}, which {figure} needs") from None
        raise
