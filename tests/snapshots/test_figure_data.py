"""The data of every figure, for the set ``implied`` and the shipped sweeps, is what it was last time.

So is what the figures draw of it. Every row of every table and every point of every line is kept.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from click.testing import CliRunner
from drawn import drawn
from made_up_comparison import made_up_comparison
from made_up_conditions import made_up_conditions
from matplotlib.figure import Figure
from pytest_regressions.file_regression import FileRegressionFixture
from strict import Strict, collected, flagged, read_snapshot, table_of

from data.thesis import THESIS, model_named
from design.chapters_3_4.design_extended import design_extended
from design.design_file import Design, read_design
from experiments.__main__ import main
from experiments.campaign.distributions import campaign_tables
from experiments.thesis.studies import hidden_modes, trade_off
from experiments.thesis.studies.additive_error import additive_error_tables
from experiments.thesis.studies.chapter_2 import delay_free_tables
from experiments.thesis.studies.chapter_4 import extended_tables
from experiments.thesis.studies.f_gamma import f_gamma_tables
from experiments.thesis.studies.hidden_modes import hidden_modes_tables
from experiments.thesis.studies.interpolation import interpolation_tables
from experiments.thesis.studies.pid import pid_tables
from experiments.thesis.studies.robustness import robustness_tables
from experiments.thesis.studies.sampled_rates import sampled_rates_tables
from experiments.thesis.studies.trade_off import trade_off_tables
from identification.sweeps.read_sweeps import read_sweeps
from paper_figures.thesis.figure_registry import figure_module, figure_names

LOOPS = ("pid", "delay_free", "extended", "sampled", "hidden_modes")
EXPERIMENTS = (*LOOPS, "additive_error", "f_gamma", "trade_off", "interpolation", "robustness", "campaign")
TABLES = [*(f"{name}{part}" for name in EXPERIMENTS for part in ("", "_summary"))]
TABLES += ["interpolation_map", "campaign_distance"]
DESIGN = "design_delay_free"
STORED = Path(__file__).with_suffix("")


def made_up_limits() -> dict[str, pd.DataFrame]:
    """Tables for Fig. A.4, which has no others here.

    The ends of their intervals are as exact as the intervals are narrow, so that no snapshot can hold them;
    tests/unit/test_physical_limits.py does. What is drawn of a table is held all the same.
    """
    start, limit = np.arange(0.0, 4.0, 0.25), np.arange(5.0, 13.0)
    runs = {"none": 3.0, "thesis": 2.0, "corrected": 1.5}
    rest = {"start_s": start, "rest_lower": 40 / (1 + start) ** 3, "rest_upper": 41 / (1 + start) ** 3, "limit": 12.0}
    rest |= {f"tail_{run}": 41 * times / (1 + start) ** 2 for run, times in runs.items()}
    periodic = {"limit": limit, "required": 11.5, "periodic_lower": 12 / limit - 0.9, "periodic_upper": 12 / limit}
    periodic |= {f"peak_{run}": np.where(limit < 6 + times, np.nan, times * 12 / limit) for run, times in runs.items()}
    made_up = {"limits_extended_summary": pd.DataFrame(rest), "limits_delay_free": pd.DataFrame(periodic)}
    settling = {f"settling_{name}_s": 1.5 for name in ("upper", *runs)}
    return made_up | {
        "limits_extended": pd.DataFrame({"limit": limit} | settling),
        "limits_delay_free_summary": pd.DataFrame({"limit": limit}),
    }


def made_up() -> dict[str, pd.DataFrame]:
    """Tables that no snapshot holds.

    Those of Fig. A.7 are a search: with the thesis's anti-windup the control chatters, so that what comes nearest
    depends on the last digit. tests/unit/test_unprinted_conditions.py holds the intervals that it finds. Those of
    Fig. A.8 hang on the tolerance of a solver; tests/unit/test_comparison.py holds what they say.
    """
    return made_up_limits() | made_up_conditions() | made_up_comparison()


NOT_KEPT = set(made_up())


@cache
def sweeps() -> tuple[object, ...]:
    return tuple(read_sweeps(sorted((THESIS.parent / "elevation").glob("*_frf.csv"))))


@pytest.fixture(scope="module")
def campaign(extended_design: Design, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The file of a small campaign."""
    folder = tmp_path_factory.mktemp("campaign")
    design, output = folder / "design.json", folder / "campaign.parquet"
    design.write_text(extended_design.to_json(), encoding="utf-8")
    arguments = ["thesis", "campaign", str(design), "--plants", "40", "--seed", "1", "--output", str(output)]
    result = CliRunner().invoke(main, arguments)
    assert result.exit_code == 0, result.output
    return output


@pytest.fixture(scope="module")
def stored_design(delay_free_design: Design, tmp_path_factory: pytest.TempPathFactory) -> Design:
    """The design of chapter 2 with the numbers of its snapshot.

    The H-infinity synthesis knows its last digits to 9e-9, which the run without anti-windup makes 1e-6 of; from the
    same digits the loops are known to 1e-12. So the design is one snapshot and the loops of the stored one another.
    """
    stored = {name: values[0].item() for name, values in read_snapshot(STORED / f"{DESIGN}.npz").items()}
    numbers = {name: value for name, value in stored.items() if not isinstance(value, str)}
    path = tmp_path_factory.mktemp("design") / "design.json"
    content = with_leaves(json.loads(delay_free_design.to_json()), numbers)
    path.write_text(json.dumps(content), encoding="utf-8")
    return read_design(path)


@pytest.fixture(scope="module")
def tables(extended_design: Design, stored_design: Design, campaign: Path) -> dict[str, pd.DataFrame]:
    implied = model_named("implied")
    chosen = extended_design.free
    robust = design_extended(
        implied,
        extended_design.reference_omegas,
        chosen.a,
        chosen.pairs,
        robust_level=0.9,
    )
    return (
        pid_tables()
        | additive_error_tables(implied, sweeps())  # type: ignore[arg-type]
        | f_gamma_tables(implied.additive_bound)
        | delay_free_tables(stored_design)
        | extended_tables(extended_design)
        | short_trade_off(extended_design)
        | interpolation_tables(extended_design)
        | sampled_rates_tables(extended_design)
        | short_hidden_modes(extended_design)
        | campaign_tables(campaign)
        | robustness_tables({"design_extended": extended_design, "design_robust": robust})
    )


def short_trade_off(design: Design) -> dict[str, pd.DataFrame]:
    """That of Fig. A.1 for the first, the middle and the last of its recovery times."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(trade_off, "RECOVERIES", 3)
        return trade_off_tables(design)


def short_hidden_modes(design: Design) -> dict[str, pd.DataFrame]:
    """Those of Fig. A.9 for a minute and a half instead of a quarter of an hour."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(hidden_modes, "PERIODS", 20)
        return hidden_modes_tables(design)


def columns_of(table: pd.DataFrame) -> dict[str, np.ndarray]:
    """All columns and rows."""
    columns: dict[str, np.ndarray] = {}
    for name in table:
        columns |= flagged(str(name), table[name])
    return columns


@cache
def stored_table(name: str) -> pd.DataFrame:
    """The table as its snapshot has it: the same bits on every machine."""
    return table_of(read_snapshot(STORED / f"{name}.npz"))


def leaves(part: Any, path: str = "") -> Iterator[tuple[str, Any]]:
    """The values of nested objects and lists, each with its path."""
    inner = part.items() if isinstance(part, dict) else enumerate(part) if isinstance(part, list) else None
    if inner is None:
        yield path[1:], part
    else:
        for key, value in inner:
            yield from leaves(value, f"{path}.{key}")


def with_leaves(part: Any, values: Mapping[str, Any], path: str = "") -> Any:
    """The same nested objects and lists, some of their values replaced."""
    if isinstance(part, dict):
        return {key: with_leaves(value, values, f"{path}.{key}") for key, value in part.items()}
    if isinstance(part, list):
        return [with_leaves(value, values, f"{path}.{key}") for key, value in enumerate(part)]
    return values.get(path[1:], part)


def design_columns(design: Design) -> dict[str, np.ndarray]:
    """Every member of design.json, a column each; reasons are prose and left out."""
    columns = {}
    for path, value in leaves(json.loads(design.to_json())):
        if not path.endswith("reason"):
            exact = isinstance(value, (bool, str)) or value is None
            columns[path] = np.array([str(value) if exact else value])
    return columns


def test_delay_free_design(delay_free_design: Design, strict_snapshot: Strict) -> None:
    strict_snapshot(DESIGN, design_columns(delay_free_design), rows=False)


@pytest.mark.parametrize("name", TABLES)
def test_table(name: str, tables: dict[str, pd.DataFrame], strict_snapshot: Strict) -> None:
    strict_snapshot(name, columns_of(tables[name]))


@pytest.mark.parametrize("name", figure_names())
def test_drawing(name: str, strict_snapshot: Strict, file_regression: FileRegressionFixture) -> None:
    """What the figure draws from the stored tables, so that nothing but the drawing can change it."""
    listing, coordinates = drawn(draw_stored(name))
    failures: list[BaseException] = []
    for check in (
        lambda: strict_snapshot(name, coordinates, rows=False),
        lambda: file_regression.check(listing, basename=name, extension=".txt"),
    ):
        with collected(failures):
            check()
    if failures:
        raise failures[0]


def tables_stored(name: str) -> dict[str, pd.DataFrame]:
    """The stored tables of a figure, and made-up ones in place of those that have no snapshot."""
    others = made_up()
    return {table: others[table] if table in others else stored_table(table) for table in figure_module(name).TABLES}


def draw_stored(name: str) -> Figure:
    """Return a figure of the stored tables."""
    return figure_module(name).draw(tables_stored(name))


@pytest.mark.parametrize("name", figure_names())
def test_every_figure_draws_from_tables_that_are_kept(name: str, tables: dict[str, pd.DataFrame]) -> None:
    assert set(figure_module(name).TABLES) <= set(tables) | NOT_KEPT


def test_every_table_is_kept(tables: dict[str, pd.DataFrame]) -> None:
    assert set(tables) == set(TABLES)


def test_no_file_is_left_over() -> None:
    """A file that no test reads any more would say that something is held that is not."""
    kept = {f"{name}{suffix}" for name in TABLES for suffix in (".csv", ".npz")} | {f"{DESIGN}.npz"}
    kept |= {f"{name}{suffix}" for name in figure_names() for suffix in (".txt", ".npz")}
    assert {path.name for path in STORED.iterdir()} == kept
