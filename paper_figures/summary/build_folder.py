"""What a build folder holds: designs and tables, or the sentences with which they were refused."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from functools import partial
from io import StringIO
from pathlib import Path
from traceback import walk_tb
from typing import TYPE_CHECKING, TypeVar

import pandas as pd

from identification.base.errors import InputError
from identification.base.files import read_text

if TYPE_CHECKING:
    from design.design_file import Design

Result = TypeVar("Result")


def read_build(build: Path, figure: str) -> tuple[dict[str, Design | str], dict[str, pd.DataFrame | str]]:
    """Return the designs and the summaries of the experiments in a build folder, or why each was refused.

    Parameters
    ----------
    build
        The folder of the designs, with the tables in its folder results.
    figure
        What needs them, for the message.

    Raises
    ------
    InputError
        A file is not what it should be.
    """
    from design.design_file import read_design
    from paper_figures.summary.of_designs import FOLLOWING

    designs = read_attempts({name: build / f"design_{name}" for name in FOLLOWING}, ".json", read_design)
    stems = {name: build / "results" / name for names in FOLLOWING.values() for name in names}
    return designs, read_attempts(stems, "_summary.csv", partial(read_table, figure=figure))


def summaries(outcomes: Mapping[str, pd.DataFrame | str]) -> dict[str, pd.DataFrame]:
    """Return the tables among outcomes by the names of their files."""
    return {f"{name}_summary": table for name, table in outcomes.items() if isinstance(table, pd.DataFrame)}


def read_attempts(stems: Mapping[str, Path], end: str, read: Callable[[Path], Result]) -> dict[str, Result | str]:
    """Return what commands wrote, or the sentences with which they refused.

    Parameters
    ----------
    stems
        For each name the path of its file without ``end``; a refusal stands in STEM.refused.txt. A name that has
        neither is left out.
    end
        Of the files.
    read
        What reads one.

    Raises
    ------
    InputError
        ``read`` refuses a file.
    """
    found: dict[str, Result | str] = {}
    for name, stem in stems.items():
        path, refusal = (stem.with_name(stem.name + ending) for ending in (end, ".refused.txt"))
        if path.is_file():
            found[name] = read(path)
        elif refusal.is_file() and (lines := read_text(refusal).strip().splitlines()):
            found[name] = lines[-1].removeprefix("Error: ").rstrip(".")
    return found


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
    InputError
        The file is missing, is no table or has no rows.
    """
    if not path.is_file():
        raise InputError(f"{path}: no such table, which {figure} needs")
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
