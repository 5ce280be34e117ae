"""Tables of results as the figures need them; what a table lacks is said in a sentence."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from io import StringIO
from pathlib import Path
from traceback import walk_tb
from warnings import catch_warnings, filterwarnings, simplefilter

import pandas as pd

from identification.base.errors import InputError, MissingFile, shown
from identification.base.files import is_there, read_text

TEXTS = ["run", "method", "case", "set", "delay", "weights", "search", "outcome", "reading"]
TEXTS += ["upset", "refused", "guarantee"]
"""Columns of words; all others hold numbers."""


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
        The file is no table, has no rows, or holds a word where a number belongs.
    """
    if not is_there(path):
        raise MissingFile(f"{path}: no such table, which {figure} needs")
    try:
        table = pd.read_csv(StringIO(read_text(path)), comment="#")
    except (pd.errors.ParserError, pd.errors.EmptyDataError):
        raise InputError(f"{path}: is not a table of comma-separated values, which {figure} needs") from None
    if table.empty:
        raise InputError(f"{path}: holds a header and no rows, which {figure} needs")
    for column in table.columns.difference(TEXTS):
        cells = table[column].dropna()
        if (odd := cells[pd.to_numeric(cells, errors="coerce").isna()]).any():
            raise InputError(f"{path}: {shown(odd.iloc[0])} in the column {column}; expected a number or nothing")
    return table


@contextmanager
def sentences_of(
    tables: Mapping[str, pd.DataFrame], results: Path, figure: str, model: Path | None = None
) -> Iterator[None]:
    """Turn whatever goes wrong as a figure is drawn of tables, or a page is written, into a sentence on them.

    Parameters
    ----------
    tables
        By their names, files NAME.csv in ``results``.
    results
        The folder of the tables.
    figure
        What is drawn; without tables and model all errors go on.
    model
        The model that it is drawn of, too.

    Raises
    ------
    InputError
        A column that was asked for is missing from one of the tables, or from rows taken out of one; or the numbers
        are none that can be drawn.
    """
    try:
        with catch_warnings():
            for warning in (RuntimeWarning, UserWarning):  # of numbers that have no logarithm, of axes without length
                simplefilter("error", warning)
            filterwarnings("ignore", "Glyph .* missing from font")
            yield
    except (InputError, ImportError, MemoryError):
        raise
    except Exception as error:
        if isinstance(error, KeyError) and (name := _lacking(error, tables)):
            raise InputError(f"{results / name}.csv: no column {error.args[0]}, which {figure} needs") from None
        if not tables and model is None:
            raise
        of = [*([str(model)] if model else []), *([f"{', '.join(tables)} in {results}"] if tables else [])]
        said = f"{figure} cannot be drawn from {' and '.join(of)} ({shown(str(error))})"
        raise InputError(f"{said}; expected files as the commands write them") from error


def _lacking(error: KeyError, tables: Mapping[str, pd.DataFrame]) -> str | None:
    """The name of the table, if there is one, whose column of the error's name was asked for and is not there."""
    column = error.args[0]
    for frame, _ in walk_tb(error.__traceback__):
        asked = frame.f_locals.get("self")
        if isinstance(asked, pd.DataFrame) and column not in asked.columns:
            for name, table in tables.items():
                if asked.columns.equals(table.columns):
                    return name
    return None
