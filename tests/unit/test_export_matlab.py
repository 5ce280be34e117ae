"""Exports for MATLAB, Octave and Simulink: run by Octave where it is installed, and against the sampled loop."""

from __future__ import annotations

import math
import os
import shutil
import subprocess
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from block_diagram import Diagram
from scipy.io import loadmat
from test_coprime_form import PLANTS, design_of

from design.blocks.block import plant_block
from design.design_file import Design
from experiments.drive.sampled_loop import Drive, simulate_sampled
from experiments.export import matlab, simulink
from experiments.export.check_run import CheckRun, check_run
from experiments.export.controller import sampled_controller
from experiments.runs.references import SampledReference

CASES = {
    "matched": ("two integrators", 33.0, "matched", "corrected", (-1.0, 1.5)),
    "tustin": ("no dead time", 150.0, "tustin", "thesis", (-math.inf, 0.7)),
    "held": ("none", 40.0, "exact", "none", (-2.0, 1.0)),
}
TOLERANCE = 1e-8  # of the largest number of a run: the sums are taken in another order
STAND_INS = {
    "new_system": "function new_system(name)\n  global model\n  model = struct('system', name);\n"
    "  model.blocks = {};\n  model.lines = {};\nend\n",
    "add_block": "function add_block(library, name, varargin)\n  global model\n  values = varargin;\n"
    "  for k = 2:2:numel(values)\n    if ~any(strcmp(values{k - 1}, {'VariableName', 'SaveFormat', 'Inputs'}))\n"
    "      values{k} = evalin('base', values{k});\n    end\n  end\n"
    "  model.blocks{end + 1} = [{library, name}, values];\nend\n",
    "add_line": "function add_line(system, from, to, varargin)\n  global model\n"
    "  model.lines{end + 1} = {system, from, to};\nend\n",
    "set_param": "function set_param(varargin)\nend\n",
    "open_system": "function open_system(varargin)\n  global model\n  save('-v6', 'built.mat', 'model');\nend\n",
}


@cache
def case_of(name: str) -> tuple[Design, CheckRun, dict[str, Any], dict[str, Any]]:
    plant, rate, method, anti_windup, limits = CASES[name]
    design = design_of(PLANTS[plant])
    controller = sampled_controller(design, anti_windup, limits, rate, method, name)
    run = check_run(design, controller)
    return design, run, *(each.files(controller, run, design.loop_plant) for each in (matlab, simulink))


@pytest.fixture(scope="module")
def octave(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str, str], Any]:
    """Everything of one process: it runs the loops, and the scripts for Simulink against stand-ins."""
    found = shutil.which("octave-cli")
    if found is None:
        pytest.skip("no Octave")
    folder, commands = tmp_path_factory.mktemp("octave"), ["warning('off', 'all');"]
    for name, text in STAND_INS.items():
        (folder / f"{name}.m").write_text(text)
    for name in CASES:
        for files in case_of(name)[2:]:
            for file, content in files.items():
                (folder / file).write_bytes(content if isinstance(content, bytes) else content.encode())
        commands.append(f"run = {name}_loop();")
        commands.append("for field = {'plant', 'forward', 'feedback', 'windup'}, run.(field{1}) = 0; end;")
        commands.append("[num, den] = tfdata(run.plant_tf, 'v');")
        commands.append("run.num = num; run.den = den; run = rmfield(run, {'plant_tf', 'plant_ss',")
        commands.append("'feedback_memories', 'windup_memories'});")
        commands.append(f"save('-v6', '{name}_run.mat', '-struct', 'run');")
        commands.append(f"found = {name}_loop([1 1 -1 0 2]);")
        commands.append("other = struct('output', found.output, 'command', found.command);")
        commands.append(f"save('-v6', '{name}_other.mat', '-struct', 'other');")
        commands.append(f"{name}_loop(1);")  # draws, but where nothing can, as here
        commands.append(f"{name}_simulink(); movefile('built.mat', '{name}_built.mat');")
    (folder / "everything.m").write_text("\n".join(commands) + "\n")
    environment = {key: value for key, value in os.environ.items() if key in ("PATH", "HOME", "LANG")}
    ran = subprocess.run(
        [found, "--quiet", "everything.m"], cwd=folder, env=environment, capture_output=True, text=True
    )
    assert (folder / f"{name}_built.mat").exists(), ran.stderr
    return lambda name, what: loadmat(folder / f"{name}_{what}.mat", squeeze_me=True)


@pytest.mark.parametrize("name", CASES)
def test_the_mat_file_holds_the_loop(name: str, tmp_path: Path) -> None:
    """Read back, its blocks run by what reads nothing else give the run of its test."""
    _, run, files, others = case_of(name)
    assert files[f"{name}.mat"] == others[f"{name}.mat"]
    (tmp_path / "read.mat").write_bytes(files[f"{name}.mat"])
    data = loadmat(tmp_path / "read.mat", simplify_cells=True)
    np.testing.assert_array_equal(data["test"]["command"], run.command)
    assert (data["rate_hz"], *data["limits"]) == (CASES[name][1], *CASES[name][4])
    block = data["plant"]["sampled"]
    late, n = np.atleast_1d(block["lags"]), np.atleast_1d(block["b"]).size
    A, b, c = np.reshape(block["A"], (n, n)), np.atleast_1d(block["b"]), np.atleast_1d(block["C"])
    x, p = np.zeros(n), []
    for given in run.command:
        p.append(c @ x + block["d"] * given)
        x = A @ x + b * given
    found = np.convolve(p, late)[: len(p)]
    np.testing.assert_allclose(found, run.measurement, rtol=0, atol=1e-7 * np.abs(run.measurement).max())


@pytest.mark.parametrize("name", CASES)
def test_octave_runs_the_sampled_loop(name: str, octave: Callable[[str, str], Any]) -> None:
    design, run, _, _ = case_of(name)
    found = octave(name, "run")
    size = max(np.abs(run.measurement).max(), np.abs(run.control).max())
    for key, expected in (("output", run.measurement), ("unsaturated_command", run.control), ("command", run.command)):
        np.testing.assert_allclose(found[key], expected, rtol=0, atol=TOLERANCE * size, err_msg=key)
    assert found["difference"] < TOLERANCE * size
    s = np.array([0.7 + 1j, 3 - 20j])
    P = plant_block(design.loop_plant).without_delay()
    np.testing.assert_allclose(
        np.polyval(np.atleast_1d(found["num"]), s) / np.polyval(np.atleast_1d(found["den"]), s), P(s), rtol=1e-9
    )


@pytest.mark.parametrize("name", CASES)
def test_octave_runs_any_reference(name: str, octave: Callable[[str, str], Any]) -> None:
    design, _, _, _ = case_of(name)
    _, rate, method, anti_windup, limits = CASES[name]
    values = np.array([1.0, 1.0, -1.0, 0.0, 2.0])
    reference = SampledReference(np.arange(5) / rate, values)
    run = simulate_sampled(design, reference, anti_windup, Drive(rate, method, limits), 4 / rate)
    found = octave(name, "other")
    np.testing.assert_allclose(found["output"], run.output, rtol=0, atol=1e-9 * np.abs(run.control).max())
    expected = np.clip(run.control, *limits)
    np.testing.assert_allclose(found["command"], expected, rtol=0, atol=1e-9 * np.abs(run.control).max())


@pytest.mark.parametrize("name", CASES)
def test_the_described_model_is_the_sampled_loop(name: str, octave: Callable[[str, str], Any]) -> None:
    """The blocks and lines that Octave recorded, each parameter evaluated, interpreted block by block."""
    built = octave(name, "built")["model"]
    fields = dict(zip(built.dtype.names, built.item(), strict=True))
    blocks, sources = {}, {}
    for library, path, *pairs in fields["blocks"]:
        system, block = str(path).split("/", 1)
        assert (system, block in blocks, str(library).split("/")[0]) == (f"{name}_model", False, "simulink")
        blocks[block] = (str(library).rsplit("/", 1)[1], dict(zip(pairs[::2], pairs[1::2], strict=True)))
        sources[block] = {}
    for system, start, end in fields["lines"]:
        (source, out), (target, port) = (str(each).rsplit("/", 1) for each in (start, end))
        assert (system, source in blocks, int(port) in sources[target]) == (f"{name}_model", True, False)
        sources[target][int(port)] = (source, int(out))
    _, run, _, _ = case_of(name)
    found = Diagram(blocks, sources).run(run.reference[:400])
    size = max(np.abs(run.measurement).max(), np.abs(run.control).max())
    for key, expected in (
        ("output", run.measurement),
        ("unsaturated_command", run.control),
        ("limited_command", run.command),
    ):
        np.testing.assert_allclose(found[key], expected[:400], rtol=0, atol=TOLERANCE * size, err_msg=key)
