"""What the folder of a refit holds by now: axis, designs and tables, or the sentences with which they were refused."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import TypeVar

import pandas as pd

from design.design_file import Design, read_design
from experiments.tables import read_cells
from identification.base.files import is_file, read_text
from paper_figures.result_tables import read_table

Result = TypeVar("Result")

DESIGNS = {"design": "the extended design", "design_delay_free": "the delay-free design"}
"""The designs of a refit, files NAME.json, and what they are called."""

TABLES = {
    "tracking": "_summary.csv",
    "compare": ".csv",
    "rates": ".csv",
    "limits_extended": ".csv",
    "campaign": "_summary.csv",
}
"""Its tables that the page reads, of the extended design, and how their files end."""

AXIS = ("key", "value", "source", "why")
"""The columns of axis.csv."""


@dataclass(frozen=True)
class Found:
    """What there is of a refit, each by its name; a sentence stands in place of what was refused.

    Parameters
    ----------
    axis
        The settings, a row each with the columns :data:`AXIS`; None where nobody settled them.
    designs, tables
        Of :data:`DESIGNS` and :data:`TABLES`, those that were made or refused.
    """

    axis: pd.DataFrame | str | None = None
    designs: Mapping[str, Design | str] = field(default_factory=dict)
    tables: Mapping[str, pd.DataFrame | str] = field(default_factory=dict)

    @property
    def files(self) -> dict[str, pd.DataFrame]:
        """The tables that were not refused by the names of their files."""
        return {f"{name}{TABLES[name].removesuffix('.csv')}": table for name, table in self.made.items()}

    @property
    def made(self) -> dict[str, pd.DataFrame]:
        """The tables that were not refused."""
        return {name: table for name, table in self.tables.items() if isinstance(table, pd.DataFrame)}

    @property
    def has_file(self) -> bool:
        """Whether the reference is that of a file."""
        return isinstance(self.axis, pd.DataFrame) and "reference" in set(self.axis["key"])

    def design(self, name: str) -> Design | None:
        """A design, if it was made."""
        found = self.designs.get(name)
        return found if isinstance(found, Design) else None


def read_refit(build: Path) -> Found:
    """Read what a refit has made so far; raises InputError where a file is not what it should be."""
    axis = read_attempts({"axis": build / "axis"}, ".csv", partial(read_cells, columns=AXIS))
    designs = read_attempts({name: build / name for name in DESIGNS}, ".json", read_design)
    tables: dict[str, pd.DataFrame | str] = {}
    for name, end in TABLES.items():
        tables |= read_attempts({name: build / "results" / name}, end, partial(read_table, figure="summary"))
    return Found(axis.get("axis"), designs, tables)


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
