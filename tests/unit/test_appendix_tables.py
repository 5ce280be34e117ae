"""The tables behind Fig. A.1 to A.3 against what they are computed from, for plants other than the thesis's too."""

from __future__ import annotations

import dataclasses

import numpy as np
import pandas as pd
import pytest

from design.anti_windup.judge import judge
from design.chapters_3_4.design_extended import design_extended
from design.design_file import Design
from experiments.thesis.studies import trade_off
from experiments.thesis.studies.interpolation import SENSITIVITY, interpolation_tables
from experiments.thesis.studies.robustness import robustness_tables
from identification.base.errors import InputError
from identification.model.additive_bound import AdditiveBound
from identification.model.model_file import IdentifiedModel
from identification.model.modes import Mode
from identification.model.plant import PlantModel

OTHER = PlantModel(-0.4, (Mode(20.0, 0.03),), (Mode(32.0, 0.02),), 0.06)


@pytest.fixture(scope="module")
def other(implied: IdentifiedModel) -> IdentifiedModel:
    bound = AdditiveBound.printed_form(0.002, 2.0, 30.0, 0.02)
    return dataclasses.replace(implied, plant=OTHER, additive_bound=bound)


@pytest.fixture(scope="module")
def other_design(other: IdentifiedModel) -> Design:
    return design_extended(other, [0.5], 1.5, [(1.0, 0.25)])


def test_trade_off_of_another_plant(
    other: IdentifiedModel, other_design: Design, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(trade_off, "SECTORS", (0.8, 0.97))
    monkeypatch.setattr(trade_off, "RECOVERIES", 3)
    ticks: list[None] = []
    tables = trade_off.trade_off_tables(other_design, lambda: ticks.append(None))
    table, summary = tables["trade_off"], tables["trade_off_summary"].set_index("run")
    assert len(table) == len(ticks) == 6
    for _, curve in table.groupby("recovery_s"):  # a larger sector costs f
        assert curve["f"].iloc[1] >= curve["f"].iloc[0] * (1 - 1e-3)
    own = judge(other.plant, other.additive_bound, other_design.compensator("corrected"))
    assert summary.loc["corrected", "f"] == own.f
    assert summary.loc["corrected", "lasting_offset"] == 0.0
    assert summary.loc["thesis", "lasting_offset"] < 0  # the gain is negative
    assert summary.loc["least", "f"] <= summary.loc["thesis", "f"] * (1 + 1e-6)
    assert np.isnan(summary.loc["thesis", "popov_sector"])
    for run in ("thesis", "corrected"):
        assert summary.loc[run, "fastest"] == max(
            abs(pole) for pole in other_design.compensator(run).theta1_tilde.poles
        )
    assert summary.loc["corrected", "fastest"] <= other_design.corrected.bandwidth


@pytest.fixture(scope="module")
def interpolation(extended_design: Design) -> dict[str, pd.DataFrame]:
    return interpolation_tables(extended_design)


def test_where_the_designs_of_q_work(interpolation: dict[str, pd.DataFrame]) -> None:
    """The thesis: Lagrange fails at high frequency, designing the poles works only there."""
    table, ranges = interpolation["interpolation"], interpolation["interpolation_summary"]
    lagrange = table[table["method"] == "lagrange"]
    assert lagrange["works"][lagrange["omega"] < 4].all()
    assert not lagrange["works"][lagrange["omega"] > 8].any()
    poles = table[table["method"] == "poles"]
    assert not poles["works"][poles["omega"] < 200].any()
    assert poles["works"][poles["omega"].between(300, 500)].all()
    assert table["stable"][table["method"] != "poles"].all()
    working = table[table["works"] == 1]
    assert (working["sensitivity"] <= SENSITIVITY).all()
    for row in ranges.itertuples():
        inside = table[(table["method"] == row.method) & table["omega"].between(row.lowest, row.highest)]
        assert inside["works"].all()
    assert sum(
        len(table[(table["method"] == row.method) & table["omega"].between(row.lowest, row.highest)])
        for row in ranges.itertuples()
    ) == len(working)


def test_the_map_holds_for_every_time_scale(other_design: Design, interpolation: dict[str, pd.DataFrame]) -> None:
    """Whether the poles design is stable depends on omega T_d and a T_d only."""
    tables = interpolation_tables(other_design)
    table, grid = tables["interpolation"], tables["interpolation_map"]
    a_delay = 1.5 * OTHER.delay_s
    nearest = grid["a_delay"].unique()[np.argmin(np.abs(np.log(grid["a_delay"].unique() / a_delay)))]
    row = grid[grid["a_delay"] == nearest]
    poles = table[table["method"] == "poles"]
    inside = poles["omega"].between(0.1 / OTHER.delay_s, 10 / OTHER.delay_s)
    read = np.interp(np.log(poles["omega"][inside] * OTHER.delay_s), np.log(row["omega_delay"]), row["margin"])
    assert np.mean((read > 0) == (poles["stable"][inside] == 1)) > 0.95
    np.testing.assert_array_equal(grid, interpolation["interpolation_map"])


def test_a_delay_free_design_has_no_q(delay_free_design: Design) -> None:
    with pytest.raises(InputError, match="expected 'extended'"):
        interpolation_tables(delay_free_design)


def test_robustness_of_another_plant(other: IdentifiedModel, other_design: Design) -> None:
    robust = design_extended(other, [0.5], 1.5, [(1.0, 0.25)], robust_level=0.4)
    tables = robustness_tables({"design_extended": other_design, "design_robust": robust})
    table, summary = tables["robustness"], tables["robustness_summary"].set_index("run")
    assert summary.loc["design_robust", "peak"] == pytest.approx(0.4, rel=0.05)
    assert summary.loc["design_robust", "peak"] <= 0.4 * (1 + 1e-6)
    for name in summary.index:
        # the table's grid against the audit's refined peak
        assert table[f"robustness_{name}"].max() == pytest.approx(summary.loc[name, "peak"], rel=1e-3)
        assert 1 / table[f"sensitivity_{name}"].max() == pytest.approx(summary.loc[name, "modulus"], rel=1e-2)
        assert summary.loc[name, "delay_greatest_s"] > OTHER.delay_s
    # with the model as the plant C S = K
    K = other_design.blocks["K"](1j * table["omega"].to_numpy())
    expected = np.abs(other.additive_bound(1j * table["omega"].to_numpy()) * K)
    np.testing.assert_allclose(table["robustness_design_extended"], expected, rtol=1e-6)


def test_designs_for_different_plants_are_refused(extended_design: Design, other_design: Design) -> None:
    with pytest.raises(InputError, match="for another plant or W_a"):
        robustness_tables({"one": extended_design, "two": other_design})
