"""The table of a user's run: its numbers are those of the run, and the run is long enough to be judged by its end."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from design.chapters_3_4.design_extended import design_extended
from design.design_file import Design
from experiments.__main__ import main
from experiments.engine.simulate import simulate
from experiments.runs.design_loop import design_loop
from experiments.runs.references import Reference, SampledReference, sinusoid
from experiments.tracking import tracking_tables
from identification.model.additive_bound import AdditiveBound
from identification.model.model_file import IdentifiedModel
from identification.model.plant import PlantModel

LIMITS = (-4.0, 6.0)


@pytest.fixture(scope="module")
def design() -> Design:
    """For 2 exp(-0.05 s)/s and a reference of 1.5 rad/s."""
    bound = AdditiveBound.printed_form(gain=0.01, corner=100.0, omega=300.0, zeta=0.1)
    return design_extended(IdentifiedModel(PlantModel(2.0, (), (), 0.05), bound), [1.5], 4.0, [(2.0, 1.0)])


@pytest.mark.parametrize(("amplitude", "fits"), [(5.0, True), (7.0, False)])
def test_its_numbers_are_those_of_the_run(design: Design, amplitude: float, fits: bool) -> None:
    reference = sinusoid(amplitude, 1.5, 1.2)
    tables = tracking_tables(design, reference, LIMITS, ("none", "corrected"))
    table, summary = tables["tracking"], tables["tracking_summary"].set_index("run")
    time_s = table["time_s"].to_numpy()
    run = simulate(design_loop(design, reference, "corrected"), LIMITS, time_s)
    np.testing.assert_allclose(table["error_corrected"], run.outputs["error"], atol=1e-9)
    row = summary.loc["corrected"]
    assert (row["lower_limit"], row["limit"]) == LIMITS
    # y = K/s u with K = 2: the steady control is the reference's slope over 2
    assert row["steady_greatest"] == pytest.approx(amplitude * 1.5 / 2, rel=1e-5)
    assert row["steady_least"] == pytest.approx(-amplitude * 1.5 / 2, rel=1e-5)
    assert (LIMITS[0] < row["steady_least"]) == fits
    assert row["asked_control"] == pytest.approx(np.abs(run.control).max())
    last = time_s >= time_s[-1] - 2 * np.pi / 1.5
    error = run.outputs["error"][last]
    assert abs(row["offset"]) + row["ripple"] == pytest.approx(np.abs(error).max(), rel=1e-6)
    assert (np.abs(error).max() < 1e-3 * amplitude) == fits
    linear = simulate(design_loop(design, reference, "none"), (-np.inf, np.inf), time_s)
    assert row["linear_control"] == pytest.approx(np.abs(linear.control).max())


def test_a_fast_reference_is_run_until_a_slow_loop_has_settled() -> None:
    """Five periods of it last 0.6 s, the slowest pole's time constant a second: then the error would not be steady."""
    bound = AdditiveBound.printed_form(gain=0.001, corner=100.0, omega=300.0, zeta=0.1)
    slow = design_extended(IdentifiedModel(PlantModel(2.0, (), (), 0.01), bound), [50.0], 4.0, [(2.0, 2500.0)])
    row = tracking_tables(slow, sinusoid(1.0, 50.0, 0.3), 100.0)["tracking_summary"].iloc[0]
    assert row["relative_error_percent"] < 0.01
    assert row["last_saturation_s"] == 0


def test_a_constant_lasts_until_the_limits_have_let_the_plant_fill() -> None:
    """y' = 2 u(t - 0.05) comes to 10 in 10/(2 limit) seconds at the earliest, however fast the loop is."""
    bound = AdditiveBound.printed_form(gain=0.01, corner=100.0, omega=300.0, zeta=0.1)
    design = design_extended(IdentifiedModel(PlantModel(2.0, (), (), 0.05), bound), [0.0], 4.0)
    reference = Reference((10.0,), (0.0,), (np.pi / 2,), 0.0)
    filled = tracking_tables(design, reference, 0.05)["tracking_summary"].set_index("run").loc["corrected"]
    assert filled["until_s"] - filled["span_s"] > 100.0
    assert 100.0 * 0.99 < filled["recovery_s"] < 101.0
    assert filled["settled"] == 1
    assert filled["relative_error_percent"] < 0.01
    hopeless = tracking_tables(design, reference, 1e-4)["tracking_summary"].set_index("run").loc["corrected"]
    assert hopeless["until_s"] < 50_000.0 * 0.99
    assert hopeless["settled"] == 0
    assert np.isnan(hopeless["recovery_s"])


def test_samples_end_as_a_constant_and_a_slow_actuator_has_no_promise(design: Design) -> None:
    samples = SampledReference(np.array([0.0, 2.0, 12.0]), np.array([0.0, 3.0, 3.0]))
    tables = tracking_tables(design, samples, LIMITS, rate_limit=5.0)
    row = tables["tracking_summary"].set_index("run").loc["corrected"]
    assert tables["tracking"]["time_s"].iloc[-1] == 12.0
    assert row["steady_least"] == row["steady_greatest"] == 0.0  # the plant integrates
    assert np.isnan(row["guaranteed_sector"])


def test_the_commands_write_their_tables(design: Design, tmp_path: Path) -> None:
    path, folder = tmp_path / "design.json", tmp_path / "out"
    folder.mkdir()
    path.write_text(json.dumps(json.loads(design.to_json())), encoding="utf-8")
    words = [str(path), "--amplitude", "5", "--limit", "-4", "6", "--output", str(folder)]
    refused = CliRunner().invoke(main, ["tracking", str(path), "--limit", "6", "-4", "--output", str(folder)])
    assert (refused.exit_code, list(folder.iterdir())) == (2, [])
    assert "expected the lower limit first" in refused.output
    result = CliRunner().invoke(main, ["tracking", *words])
    assert result.exit_code == 0, result.output
    assert {each.name for each in folder.iterdir()} == {"tracking.csv", "tracking_summary.csv"}
