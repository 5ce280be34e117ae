"""The exported co-simulation unit, judged and run by FMPy."""

from __future__ import annotations

import dataclasses
import platform
from pathlib import Path

import numpy as np
import pytest
from compiled_controller import compiler

from design.design_file import Design
from experiments.export import fmu
from experiments.export.check_run import check_run
from experiments.export.controller import sampled_controller
from identification.base.errors import InputError
from identification.model.signals import Signals

RATE_HZ = 500.0


@pytest.mark.skipif(platform.machine() not in ("x86_64", "AMD64"), reason="FMI 2.0 names no other machine")
@pytest.mark.parametrize("finer", [1, 3])
def test_fmpy_takes_and_runs_it(extended_design: Design, tmp_path: Path, finer: int) -> None:
    """Step by step, or with three communication steps a sample, it gives the commands of the sampled loop."""
    compiler()
    fmpy, validation = pytest.importorskip("fmpy"), pytest.importorskip("fmpy.validation")
    controller = sampled_controller(extended_design, "corrected", (-12.0, 10.0), RATE_HZ, "tustin", "axis")
    controller = dataclasses.replace(controller, signals=Signals("motor current", "A", "angle <2>", "°"))
    run = check_run(extended_design, controller)
    files = fmu.files(controller, run)
    assert files["axis.fmu"] == fmu.files(controller, run)["axis.fmu"]
    path = tmp_path / "axis.fmu"
    path.write_bytes(files["axis.fmu"])
    assert validation.validate_fmu(str(path)) == []
    kept = 200
    fields = [("time", float), ("reference_angle_2", float), ("measured_angle_2", float)]
    given = np.array(list(zip(np.arange(kept) / RATE_HZ, run.reference, run.measurement, strict=False)), dtype=fields)
    found = fmpy.simulate_fmu(
        str(path), stop_time=(kept - 1) / RATE_HZ, step_size=1 / RATE_HZ / finer, output_interval=1 / RATE_HZ / finer,
        input=given, output=["command_motor_current", "unsaturated_motor_current", "invalid"],
    )  # fmt: skip
    last = slice(finer, None, finer)  # the communication points just after each sample
    np.testing.assert_array_equal(found["unsaturated_motor_current"][last], run.control[: kept - 1])
    np.testing.assert_array_equal(found["command_motor_current"][last], run.command[: kept - 1])
    assert not found["invalid"].any()


def test_without_a_compiler_it_is_refused(extended_design: Design, monkeypatch: pytest.MonkeyPatch) -> None:
    controller = sampled_controller(extended_design, "none", (-12.0, 10.0), RATE_HZ, "tustin", "axis")
    run = check_run(extended_design, controller)
    monkeypatch.setenv("PATH", "")
    with pytest.raises(InputError, match="C compiler"):
        fmu.files(controller, run)
