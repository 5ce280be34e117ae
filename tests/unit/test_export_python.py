"""The export for python-control: its file run as it is, against the sampled loop and python-control's own steps."""

from __future__ import annotations

import math
import runpy
from pathlib import Path
from typing import Any

import control
import numpy as np
import pytest
from test_coprime_form import PLANTS, design_of

from design.blocks.block import plant_block
from experiments.export import python_file
from experiments.export.check_run import check_run
from experiments.export.controller import sampled_controller

CASES = [
    ("two integrators", 33.0, "matched", "corrected", (-1.0, 1.5)),
    ("no dead time", 150.0, "tustin", "thesis", (-math.inf, 0.7)),
    ("none", 40.0, "exact", "none", (-2.0, math.inf)),
]


@pytest.mark.parametrize(("plant", "rate", "method", "anti_windup", "limits"), CASES)
def test_the_file_runs_the_sampled_loop(
    plant: str, rate: float, method: str, anti_windup: str, limits: Any, tmp_path: Path, capsys: pytest.CaptureFixture
) -> None:
    design = design_of(PLANTS[plant])
    made = sampled_controller(design, anti_windup, limits, rate, method, "drive")
    run = check_run(design, made)
    for name, text in python_file.files(made, run, design.loop_plant).items():
        (tmp_path / name).write_text(text, encoding="utf-8")
    file = runpy.run_path(str(tmp_path / "drive.py"), run_name="__main__")
    said = capsys.readouterr().out
    assert said.endswith("from the output and the commands of drive_test.csv\n")
    size = max(np.abs(run.measurement).max(), np.abs(run.control).max())
    assert float(said.split()[2]) < 1e-9 * size
    np.testing.assert_allclose(file["loop"](run.reference[:200])[1], run.control[:200], rtol=0, atol=1e-9 * size)

    system, P = file["controller"](), file["plant"]()
    assert (system.dt, system.input_labels, system.output_labels[0]) == (
        1 / rate,
        ["reference", "measurement"],
        "command",
    )
    assert len(set(system.state_labels)) == system.nstates
    asked = np.vstack([run.reference, run.measurement])[:, :60]
    answer = control.input_output_response(system, np.arange(60) / rate, asked).outputs
    np.testing.assert_allclose(answer, np.vstack([run.command, run.control])[:, :60], rtol=0, atol=1e-9 * size)
    s = np.array([0.7 + 1j, 3 - 20j])
    np.testing.assert_allclose(P(s), plant_block(design.loop_plant).without_delay()(s), rtol=1e-9)
    for block, own in zip(file["blocks"](), (made.forward, made.feedback, made.theta), strict=True):
        np.testing.assert_array_equal(np.asarray(block.A).ravel(), own.A.ravel())
        assert block.dt == 1 / rate
