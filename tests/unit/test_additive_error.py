"""The additive error of tests against a model: of held records without their aliases, and from folders."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from click.testing import CliRunner

from experiments.__main__ import main
from experiments.thesis.studies.additive_error import additive_error_tables
from identification.model.additive_bound import AdditiveBound
from identification.model.model_file import IdentifiedModel
from identification.model.modes import Mode
from identification.model.plant import PlantModel
from identification.model.pulse_response import aliases
from identification.sweeps.response import FrequencyResponse, Record

PLANT = PlantModel(2.0, (Mode(60.0, 0.05),), (Mode(90.0, 0.04),), 0.004)
MODEL = IdentifiedModel(PLANT, AdditiveBound.printed_form(0.3, 40.0, 60.0, 0.2))


@pytest.mark.parametrize(("held", "error"), [(True, 0.0), (False, 1.0)])
def test_aliases_of_a_held_input_are_no_error(held: bool, error: float) -> None:
    omega = np.geomspace(1.0, 250.0, 40)
    alias = aliases(PLANT, 0.01, omega)
    record = Record(0.01, np.zeros(2), np.zeros(2), held)
    test = FrequencyResponse(omega, PLANT(1j * omega) + alias, None, "a", record=record)
    table = additive_error_tables(MODEL, [test])["additive_error"]
    assert table["error"].to_numpy() == pytest.approx(error * np.abs(alias), abs=1e-12)


def test_a_folder_and_a_file_of_two_tests(tmp_path: Path) -> None:
    rows = [f"{test},{f},{-20 - test},{-90 - f}" for test in (1, 2) for f in range(1, 20)]
    folder, output = tmp_path / "sweeps", tmp_path / "results"
    folder.mkdir()
    output.mkdir()
    (folder / "two.csv").write_text("test,frequency_hz,magnitude_db,phase_deg\n" + "\n".join(rows), encoding="utf-8")
    result = CliRunner().invoke(main, ["thesis", "additive-error", "implied", str(folder), "--output", str(output)])
    assert result.exit_code == 0, result.output
    assert pd.read_csv(output / "additive_error_summary.csv")["tests"].tolist() == [2]
