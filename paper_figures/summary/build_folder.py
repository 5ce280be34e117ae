"""What a build folder holds: designs and tables, or the sentences with which they were refused."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import TypeVar

import pandas as pd

from design.design_file import Design, read_design
from identification.base.files import is_file, read_text
from paper_figures.result_tables import read_table
from paper_figures.summary.of_designs import FOLLOWING

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
    designs = read_attempts({name: build / f"design_{name}" for name in FOLLOWING}, ".json", read_design)
    stems = {name: build / "results" / name for names in FOLLOWING.values() for name in names}
    return designs, read_attempts(stems, "_summary.csv", partial(read_table, figure=figure))


def summaries(outcomes: Mapping[str, pd.DataFrame | str]) -> dict[str, pd.DataFrame]:
    """Return the tables among outcomes by the names of their files."""
    return {f"{name}_summary": table for name, table in outcomes.items() if isinstance(table, pd.DataFrame)}


def read_attempts(stems: Mapping[str, Path], end: str, read: Callable[[Path], Result]) -> dict[str, Result | str]:
    """Return what commands wrote, or the sentences with which they refused, as a build keeps them.

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
        if is_file(path):
            found[name] = read(path)
        elif is_file(refusal) and (sentence := read_text(refusal).strip()):
            found[name] = sentence.rstrip(".")
    return found
