"""The data of every figure, for the set ``implied`` and the shipped sweeps, is what it was last time."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from click.testing import CliRunner
from pytest_regressions.file_regression import FileRegressionFixture
from strict import Strict

from design.contract import Design
from design.extended import design_extended
from experiments.__main__ import main
from experiments.additive_error import additive_error_tables
from experiments.campaign_tables import campaign_tables
from experiments.delay_free import delay_free_tables
from experiments.extended import extended_tables
from experiments.f_gamma import f_gamma_tables
from experiments.interpolation_regions import interpolation_tables
from experiments.pid import pid_tables
from experiments.robustness import robustness_tables
from experiments.sampled_rates import sampled_rates_tables
from experiments.trade_off import trade_off_tables
from identification.frequency_response import read_sweeps
from identification.model import read_model
from identification.thesis import DATA
from paper_figures.__main__ import figure_module, figure_names

LOOPS = ("pid", "delay_free", "extended", "sampled")
EXPERIMENTS = (*LOOPS, "additive_error", "f_gamma", "trade_off", "interpolation", "robustness", "campaign")
TABLES = [*(f"{name}{part}" for name in EXPERIMENTS for part in ("", "_summary"))]
TABLES += ["interpolation_map", "campaign_distance"]
MOST_ROWS = 120
# The ends of their intervals are as exact as the intervals are narrow; tests/unit/test_physical_limits.py holds them.
ENCLOSED = {f"limits_{kind}{part}" for kind in ("delay_free", "extended") for part in ("", "_summary")}


@cache
def sweeps() -> tuple[object, ...]:
    return tuple(read_sweeps(sorted((DATA / "elevation").glob("*_frf.csv"))))


@pytest.fixture(scope="module")
def campaign(extended_design: Design, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The file of a small campaign."""
    folder = tmp_path_factory.mktemp("campaign")
    design, output = folder / "design.json", folder / "campaign.parquet"
    design.write_text(extended_design.to_json(), encoding="utf-8")
    arguments = ["campaign", str(design), "--plants", "40", "--seed", "1", "--output", str(output)]
    result = CliRunner().invoke(main, arguments)
    assert result.exit_code == 0, result.output
    return output


@pytest.fixture(scope="module")
def tables(extended_design: Design, delay_free_design: Design, campaign: Path) -> dict[str, pd.DataFrame]:
    implied = read_model("implied")
    chosen = extended_design.parameters
    robust = design_extended(implied, extended_design.reference_omegas, chosen["a"], chosen["pairs"], robust_level=0.9)
    return (
        pid_tables()
        | additive_error_tables(implied, sweeps())  # type: ignore[arg-type]
        | f_gamma_tables(implied.additive_bound)
        | delay_free_tables(delay_free_design)
        | extended_tables(extended_design)
        | trade_off_tables(extended_design)
        | interpolation_tables(extended_design)
        | sampled_rates_tables(extended_design)
        | campaign_tables(campaign)
        | robustness_tables({"design_extended": extended_design, "design_robust": robust})
    )


def columns_of(table: pd.DataFrame) -> dict[str, np.ndarray]:
    """Numeric columns, thinned evenly; names of rows become their numbers, an empty cell a flag beside a zero.

    What a column's runs share is its scale: an error of 1e-6 beside one of 36 is known to 1e-7 of the latter.
    """
    kept = table.iloc[:: max(1, len(table) // MOST_ROWS)]
    kept = kept.assign(**{name: pd.factorize(kept[name])[0] for name in ("run", "method") if name in kept})
    columns: dict[str, np.ndarray] = {}
    for name in kept:
        values = kept[name].to_numpy(dtype=float)
        if np.isnan(values).any():
            columns[f"{name}.is_empty"] = np.isnan(values).astype(float)
            values = np.nan_to_num(values, nan=0.0)
        columns[str(name)] = values
    return columns


@pytest.mark.parametrize("name", TABLES)
def test_table(name: str, tables: dict[str, pd.DataFrame], strict_snapshot: Strict) -> None:
    strict_snapshot(name, columns_of(tables[name]))


@pytest.mark.parametrize("name", figure_names())
def test_every_figure_draws_from_tables_that_are_kept(name: str, tables: dict[str, pd.DataFrame]) -> None:
    assert set(figure_module(name).TABLES) <= set(tables) | ENCLOSED


@pytest.mark.parametrize("name", [name for name in figure_names() if not figure_module(name).TABLES])
def test_diagram(name: str, file_regression: FileRegressionFixture) -> None:
    """Every text of a block diagram with its place, in inches."""
    figure = figure_module(name).draw({})
    lines = []
    for axes in figure.axes:
        for text in axes.texts:
            x, y = text.get_position()
            lines.append(f"{text.get_text()}\t{x:.3f}\t{y:.3f}")
    assert lines
    file_regression.check("\n".join(sorted(lines)) + "\n", basename=name, extension=".txt")
