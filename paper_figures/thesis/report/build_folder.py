"""What the folder of a build holds of the thesis's designs and experiments, or the sentences that refused them."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from pathlib import Path

import pandas as pd

from design.design_file import Design, read_design
from paper_figures.result_tables import read_table
from paper_figures.summary.build_folder import read_attempts
from paper_figures.thesis.report.of_designs import FOLLOWING


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
