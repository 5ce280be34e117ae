"""The tables behind Fig. A.9, for plants that are not the thesis's: closed forms, and runs of their own."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pandas as pd
import pytest

from design.chapters_3_4.design_extended import design_extended
from design.design_file import Design
from experiments.drive.sampled_loop import Drive, simulate_sampled
from experiments.engine.simulate import DivergenceError
from experiments.thesis.printed_choices import thesis_reference
from experiments.thesis.studies import hidden_modes
from identification.base.errors import InputError
from identification.model.additive_bound import AdditiveBound
from identification.model.model_file import IdentifiedModel
from identification.model.modes import Mode
from identification.model.plant import PlantModel

LIMIT = 1500.0
BOUND = AdditiveBound.printed_form(1e-3, 20.0, 280.0, 0.1)


def design_of(plant: PlantModel) -> Design:
    return design_extended(IdentifiedModel(plant, BOUND), [1.2], sector=0.8)


ONE = PlantModel(-3.0, (Mode(40.0, 0.05),), (Mode(60.0, 0.03),), 0.05)


@pytest.fixture(scope="module")
def one() -> Design:
    return design_of(ONE)


def tables_of(design: Design, monkeypatch: pytest.MonkeyPatch) -> dict[str, pd.DataFrame]:
    monkeypatch.setattr(hidden_modes, "PERIODS", 25)
    return hidden_modes.hidden_modes_tables(design, LIMIT)


@pytest.mark.parametrize(
    ("plant", "expected"),
    [
        (ONE, lambda step, t: 3.0 * step / 2 * t),
        (PlantModel(2.0, (), (), 0.04, 2, real_zeros=(-70.0,)), lambda step, t: -2.0 * step / 2 * t**2 / 2),
    ],
    ids=["one integrator", "two"],
)
def test_the_thesis_form_drifts_by_half_a_step(
    plant: PlantModel, expected: Callable[[float, Any], Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    tables = tables_of(design_of(plant), monkeypatch)
    table, summary = tables["hidden_modes"], tables["hidden_modes_summary"].set_index("run")
    facts = summary.loc["thesis"]
    T = 25 * 2 * math.pi / 1.2
    assert facts["duration_s"] == pytest.approx(T)
    assert facts["resolution"] == 2 * LIMIT / 65536
    assert facts["expected_drift"] == pytest.approx(expected(facts["resolution"], T))
    assert facts["drift"] == pytest.approx(facts["expected_drift"], rel=0.05)
    late = table[table["time_s"] > T / 10]
    np.testing.assert_allclose(
        late["drift_thesis"], expected(facts["resolution"], late["time_s"]), atol=0.1 * abs(facts["drift"])
    )
    assert summary.loc["coprime", "largest_drift"] < 0.02 * facts["largest_drift"]


def test_the_tables_are_the_runs(one: Design, monkeypatch: pytest.MonkeyPatch) -> None:
    tables = tables_of(one, monkeypatch)
    table, summary = tables["hidden_modes"], tables["hidden_modes_summary"]
    rate, step = summary["rate_hz"].iloc[0], summary["resolution"].iloc[0]
    at = np.round(table["time_s"] * rate).astype(int)
    np.testing.assert_allclose(at / rate, table["time_s"])
    for row in summary.itertuples():
        rounded, plain = (
            simulate_sampled(
                *(one, thesis_reference("extended", [1.2]), "corrected"),
                Drive(rate, "tustin", (-LIMIT, LIMIT), resolution=each),
                until_s=row.duration_s,
                form=row.run,
            )
            for each in (step, 0.0)
        )
        drift = rounded.output - plain.output
        np.testing.assert_array_equal(table[f"drift_{row.run}"], drift[at])
        assert (row.drift, row.largest_drift) == (drift[-1], np.abs(drift).max())


@pytest.mark.parametrize(
    "plant",
    [
        PlantModel(2.0, (), (), 0.05, 0, real_poles=(3.0, -1.0)),
        PlantModel(2.0, (), (), 0.05, -1, real_poles=(3.0, 4.0)),
    ],
    ids=["an unstable pole", "a zero at s = 0"],
)
def test_no_drift_is_expected_of_other_plants(plant: PlantModel, monkeypatch: pytest.MonkeyPatch) -> None:
    summary = tables_of(design_of(plant), monkeypatch)["hidden_modes_summary"]
    assert summary["expected_drift"].isna().all()
    coprime, thesis = summary["largest_drift"]
    assert coprime < 1.0
    assert (thesis > 1e30) == bool(plant.unstable_poles)


def test_a_run_that_diverges_has_empty_cells(one: Design, monkeypatch: pytest.MonkeyPatch) -> None:
    def diverging(*_arguments: object, **_options: object) -> None:
        raise DivergenceError(1.0)

    monkeypatch.setattr(hidden_modes, "simulate_sampled", diverging)
    tables = tables_of(one, monkeypatch)
    assert tables["hidden_modes"][["drift_thesis", "drift_coprime"]].isna().all(axis=None)
    assert tables["hidden_modes_summary"][["drift", "largest_drift"]].isna().all(axis=None)


def test_a_fast_controller_runs_for_fewer_periods(one: Design, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(hidden_modes, "MOST_SAMPLES", 2000)
    facts = tables_of(one, monkeypatch)["hidden_modes_summary"].iloc[0]
    assert facts["duration_s"] * facts["rate_hz"] == pytest.approx(2000)
    assert facts["expected_drift"] == pytest.approx(3.0 * facts["resolution"] / 2 * facts["duration_s"])


def test_an_infinite_limit_is_refused(one: Design) -> None:
    with pytest.raises(InputError, match="the limit is inf; expected a finite one"):
        hidden_modes.hidden_modes_tables(one, math.inf)
