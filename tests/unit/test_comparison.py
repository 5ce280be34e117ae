"""The anti-windups beside each other: what the table says is what the runs do."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from click.testing import CliRunner

from design.anti_windup.other_anti_windups import OTHERS
from design.chapters_3_4.design_extended import design_extended
from design.design_file import Design
from experiments.__main__ import main
from experiments.comparison import comparison_tables
from experiments.engine.simulate import simulate
from experiments.runs.design_loop import design_loop
from experiments.runs.disturbances import Disturbances, steps
from experiments.runs.references import Reference, SampledReference, sinusoid
from identification.model.additive_bound import AdditiveBound
from identification.model.model_file import IdentifiedModel
from identification.model.modes import Mode
from identification.model.plant import PlantModel

BOUND = AdditiveBound.printed_form(gain=0.01, corner=100.0, omega=300.0, zeta=0.1)
REFERENCE = sinusoid(10.0, 1.5, 1.2)
PERIOD = 2 * np.pi / 1.5


@pytest.fixture(scope="module")
def late_integrator() -> Design:
    return design_extended(IdentifiedModel(PlantModel(2.0, (), (), 0.05), BOUND), [1.5], 4.0, [(2.0, 1.0)])


@pytest.fixture(scope="module")
def table(late_integrator: Design) -> pd.DataFrame:
    """Under 0.9 times the control that tracking needs."""
    return comparison_tables(late_integrator, REFERENCE, 0.9 * 7.5)["compare"]


def test_every_anti_windup_has_its_rows(table: pd.DataFrame) -> None:
    assert list(table["run"][::2]) == ["none", "thesis", "corrected", *OTHERS]
    assert list(table["upset"]) == ["start", "pulse"] * (len(table) // 2)
    refused = table[table["refused"].notna()]
    assert set(refused["run"]) == {"internal-model"}
    assert refused[["recovery_s", "peak_error", "guarantee"]].isna().all(axis=None)
    assert table["required"].iloc[0] == pytest.approx(7.5)
    guarantees = dict(zip(table["run"], table["guarantee"], strict=True))
    assert guarantees["observer"] == guarantees["corrected"] == "global"
    assert guarantees["none"] == guarantees["back-calculation"] == "none"


def test_no_run_is_below_the_physical_limit(table: pd.DataFrame) -> None:
    start = table[(table["upset"] == "start") & table["refused"].isna()]
    assert start["least_peak_error"].min() > 0.1
    assert (start["peak_error"] >= start["least_peak_error"]).all()


@pytest.mark.parametrize(("given", "low", "limit"), [(None, -1.2 * 7.5, 1.2 * 7.5), ((-6.0, 9.5), -6.0, 9.5)])
def test_the_numbers_are_those_of_a_run(
    late_integrator: Design, given: tuple[float, float] | None, low: float, limit: float
) -> None:
    """The loop without saturation is y_lin of the saturated one here; it comes from another run there."""
    tables, begin = comparison_tables(late_integrator, REFERENCE, given), 4 * PERIOD
    pulse = Disturbances(input=steps([((limit - low) / 2, begin), (0.0, begin + PERIOD / 10)]))
    time_s = np.linspace(0.0, 8 * PERIOD, 16001)
    run = simulate(design_loop(late_integrator, REFERENCE, "observer", None, pulse), (low, limit), time_s)
    away = np.abs(run.outputs["output"] - run.outputs["y_lin"]) > 0.1
    rows = tables["compare"].query("run == 'observer'").set_index("upset")
    for upset, start_s in (("start", 0.0), ("pulse", begin)):
        counts = (time_s >= start_s - 1e-9) & (time_s <= start_s + 4 * PERIOD + 1e-9)
        assert rows[["lower_limit", "limit"]].loc[upset].tolist() == pytest.approx([low, limit])
        recovery = time_s[counts & away][-1] - start_s
        if recovery > 3 * PERIOD:  # less than a period without an excursion is no recovery
            recovery = np.nan
        assert rows["recovery_s"][upset] == pytest.approx(recovery, abs=5e-3, nan_ok=True)
        assert rows["largest_control"][upset] == pytest.approx(np.abs(run.control[counts]).max() / limit, rel=1e-6)
        events = run.events_s[(run.events_s >= start_s) & (run.events_s <= start_s + 4 * PERIOD)]
        assert rows["crossings"][upset] == len(events) > 0
        assert rows["last_saturation_s"][upset] == pytest.approx(events[-1] - start_s)
        late = counts & (time_s >= start_s + rows["from_s"][upset] + 1e-9)
        assert rows["peak_error"][upset] == pytest.approx(np.abs(run.outputs["error"][late]).max(), rel=1e-2)


def test_what_is_off_again_every_period_has_not_recovered(table: pd.DataFrame) -> None:
    """The limits are 0.9 of what tracking needs: around every crest of the control no run can follow."""
    assert table["recovery_s"].isna().all()


def test_samples_count_for_as_long_as_they_last(late_integrator: Design) -> None:
    """Of a step to 1 at 2 s that is held to 20 s; the disturbance comes then."""
    samples = SampledReference(np.array([0.0, 2.0, 2.0, 20.0]), np.array([0.0, 0.0, 1.0, 1.0]))
    tables = comparison_tables(late_integrator, samples, 0.5)
    runs, rows = tables["compare_runs"], tables["compare"].query("run == 'corrected'").set_index("upset")
    assert runs["time_s"].iloc[-1] == pytest.approx(40.0, rel=1e-3)
    # y' = 2 u(t - 0.05): at the limit y takes 0.99 s to the 1 % of 0.5, and the loop without limits is there before
    assert 2.0 + 0.99 + 0.05 < rows["recovery_s"]["start"] < 10.0
    calm = runs[(runs["time_s"] > 0.0) & (runs["time_s"] < 2.0)]
    assert (calm["control_corrected"] == 0).all()
    assert runs["control_corrected"][runs["time_s"] > 20.0].abs().max() > 0.1


def test_the_command_writes_both_tables_or_none(late_integrator: Design, tmp_path: Path) -> None:
    path, folder = tmp_path / "design.json", tmp_path / "out"
    folder.mkdir()
    path.write_text(late_integrator.to_json(), encoding="utf-8")
    words = ["compare", str(path), "--amplitude", "10", "--output", str(folder)]
    refused = CliRunner().invoke(main, [*words, "--limit", "-1"])
    assert (refused.exit_code, list(folder.iterdir())) == (2, [])
    assert "expected a positive number" in refused.output
    assert CliRunner().invoke(main, words).exit_code == 0
    assert {each.name for each in folder.iterdir()} == {"compare.csv", "compare_runs.csv"}


def test_a_run_that_diverges_leaves_the_others_alone() -> None:
    """Of a plant with a zero at s = 0 conditioning drives an unstable inverse of the controller."""
    plant = PlantModel(2.0, (), (Mode(14.0, 0.03),), 0.02, -1)
    table = comparison_tables(design_extended(IdentifiedModel(plant, BOUND), [1.5]), sinusoid(1.0, 1.5))["compare"]
    pulse = table[table["upset"] == "pulse"].set_index("run")
    assert np.isnan(pulse["largest_control"]["conditioning"])
    assert np.isfinite(pulse["last_error"]["corrected"])


def test_a_constant_reference_leaves_the_plant_time_enough() -> None:
    plant = PlantModel(2.0, (), (), 0.01, 0, (), (3.0,))
    design = design_extended(IdentifiedModel(plant, BOUND), [0.0])
    table = comparison_tables(design, Reference((1.0,), (0.0,), (np.pi / 2,), 0.0))["compare"]
    start = table[table["upset"] == "start"].set_index("run")
    # under 1.2 times what it needs the output takes ln(1.2/(1.2 - 1))/3 s at least, to the 1 % that count
    assert start["recovery_s"]["corrected"] > np.log(1.2 / 0.21) / 3
