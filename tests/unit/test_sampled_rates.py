"""The tables behind Fig. A.5, for a plant that is not the thesis's, against runs of their own."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from design.chapters_3_4.design_extended import design_extended
from design.design_file import Design
from experiments.drive.sampled_loop import Drive, simulate_sampled
from experiments.engine.simulate import DivergenceError, simulate
from experiments.runs.design_loop import design_loop
from experiments.thesis.printed_choices import thesis_reference
from experiments.thesis.studies import sampled_rates
from identification.model.additive_bound import AdditiveBound
from identification.model.model_file import IdentifiedModel
from identification.model.modes import Mode
from identification.model.plant import PlantModel

LIMIT = 80.0


@pytest.fixture(scope="module")
def design(implied: IdentifiedModel) -> Design:
    plant = PlantModel(-0.4, (Mode(20.0, 0.03),), (Mode(32.0, 0.02),), 0.06)
    bound = AdditiveBound.printed_form(0.002, 2.0, 30.0, 0.02)
    return design_extended(IdentifiedModel(plant, bound), [0.5], 1.5, [(1.0, 0.25)])


@pytest.fixture(scope="module")
def tables(design: Design) -> dict[str, pd.DataFrame]:
    return sampled_rates.sampled_rates_tables(design, LIMIT)


def test_the_table_over_time_is_the_runs(design: Design, tables: dict[str, pd.DataFrame]) -> None:
    table, summary = tables["sampled"], tables["sampled_summary"]
    facts = summary.iloc[0]
    rate, reference = facts["shown_hz"], thesis_reference("extended", [0.5])
    assert facts["limit"] == LIMIT
    assert facts["quantum"] == 2 * LIMIT / 4096
    assert rate == pytest.approx(16 * facts["root"] / (2 * np.pi))
    assert facts["full_range_s"] == pytest.approx(4 * np.pi / facts["root"])
    roots = [root for block in design.controller_parts() for root in block.zeros + block.poles]
    assert facts["root"] == np.abs(roots).max()
    assert facts["period_s"] == pytest.approx(4 * np.pi)
    for name in ("none", "corrected"):
        kind = None if name == "none" else design.compensator(name)
        continuous = simulate(design_loop(design, reference, kind), (-LIMIT, LIMIT), table["time_s"].to_numpy())
        np.testing.assert_allclose(table[f"error_{name}"], continuous.outputs["error"], rtol=0, atol=1e-9)
        drive = Drive(
            rate, "tustin", (-LIMIT, LIMIT), facts["quantum"], 2 * LIMIT / facts["full_range_s"], input_delay_s=1 / rate
        )
        run = simulate_sampled(design, reference, kind, drive, table["time_s"].iloc[-1], form="thesis")
        at = np.round(table["time_s"] * rate).astype(int)
        np.testing.assert_allclose(table[f"error_{name}_drive"], run.error[at], rtol=0, atol=1e-9)
        row = summary[(summary["run"] == name) & (summary["method"] == "tustin") & (summary["rate_hz"] == rate)]
        last = run.time_s >= run.time_s[-1] - facts["period_s"]
        # the summary's run ends less than a row later
        assert row["steady_error"].iloc[0] == pytest.approx(np.abs(run.error[last]).max(), rel=0.05)


def test_a_row_for_each_run_method_and_rate(tables: dict[str, pd.DataFrame]) -> None:
    summary = tables["sampled_summary"]
    assert len(summary) == 3 * (1 + 2 * 6)
    assert (summary["rate_hz"].isna() == (summary["method"] == "continuous")).all()
    assert not summary.duplicated(["run", "method", "rate_hz"]).any()
    held = summary[(summary["run"] == "corrected") & (summary["method"] == "exact")].iloc[-3:]
    # the model of the reference is half a sample late: amplitude omega T_s/2
    np.testing.assert_allclose(held["steady_error"], 50 * 0.5 / held["rate_hz"] / 2, rtol=0.03)


def test_a_run_that_diverges_has_empty_cells(
    design: Design, tables: dict[str, pd.DataFrame], monkeypatch: pytest.MonkeyPatch
) -> None:
    summary = tables["sampled_summary"]
    gone = summary[summary["steady_error"].isna()]
    assert set(zip(gone["run"], gone["method"], strict=True)) == {("thesis", "exact")}
    assert gone["settling_s"].isna().all()

    def diverging(*_arguments: object, **_options: object) -> None:
        raise DivergenceError(1.0)

    monkeypatch.setattr(sampled_rates, "simulate_sampled", diverging)
    table = sampled_rates.sampled_rates_tables(design, LIMIT)["sampled"]
    assert table["error_none_drive"].isna().all()
    assert np.isfinite(table["error_none"]).all()
