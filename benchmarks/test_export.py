"""One step of an exported controller in C beside one of the compiled run of `sampled`, which moves the plant too."""

from __future__ import annotations

import ctypes
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from data.thesis import model_named
from design.chapters_3_4.design_extended import design_extended
from experiments.drive.sampled_loop import Drive, simulate_sampled
from experiments.export import c_code
from experiments.export.check_run import check_run
from experiments.export.controller import sampled_controller
from experiments.runs.references import sinusoid

LIMITS, STEPS = (-12.0, 12.0), 100_000
DRIVEN = """#include "axis.h"
void run(axis_state *state, const {real} *r, const {real} *y, {real} *u, int n);
void run(axis_state *state, const {real} *r, const {real} *y, {real} *u, int n)
{{
    for (int k = 0; k < n; ++k) {{
        u[k] = axis_step(state, r[k], y[k]);
    }}
}}
"""


@pytest.mark.parametrize("rate_hz", [2000.0, 20000.0])
@pytest.mark.parametrize("precision", ["double", "float"])
def test_a_step_in_c(against: Callable[..., None], tmp_path: Path, precision: str, rate_hz: float) -> None:
    """Chapter 4's controller on this machine, compiled as its header asks for."""
    compiler = shutil.which("cc")
    assert compiler, "found no C compiler; expected cc"
    design = design_extended(model_named("implied"), [1.5], 4.0, [(2.0, 1.0)])
    controller = sampled_controller(design, "corrected", LIMITS, rate_hz, "tustin", "axis")
    for name, text in c_code.files(controller, check_run(design, controller), precision).items():
        (tmp_path / name).write_text(text)
    (tmp_path / "run.c").write_text(DRIVEN.format(real=precision))
    flags = ["-std=c99", "-O2", "-ffp-contract=off", "-shared", "-fPIC"]
    subprocess.run([compiler, *flags, "axis.c", "run.c", "-o", "run.so"], cwd=tmp_path, check=True)
    call = ctypes.CDLL(str(tmp_path / "run.so")).run

    until_s = (STEPS - 1) / rate_hz
    drive, reference = Drive(rate_hz, "tustin", LIMITS), sinusoid(50.0, 1.5)
    run = simulate_sampled(design, reference, "corrected", drive, until_s)
    kind = c_code.PRECISIONS[precision]
    r, y, u = (np.ascontiguousarray(each, dtype=kind) for each in (run.reference, run.output, np.zeros(STEPS)))

    def ours() -> None:
        state = ctypes.create_string_buffer(1 << 20)  # all 0 is at rest
        call(state, *(each.ctypes.data_as(ctypes.c_void_p) for each in (r, y, u)), STEPS)

    def error(_: object, peer: object) -> str:
        off = np.abs(u - np.clip(run.control, *LIMITS)).max()
        return f"{STEPS} steps, {controller.remembered} samples of dead time; off by {off:.3g}"

    against(ours, lambda: simulate_sampled(design, reference, "corrected", drive, until_s), error=error)
