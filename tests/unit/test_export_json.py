"""Exported JSON: the equations as the file and docs/how_to/export.md state them, run by what reads nothing else."""

from __future__ import annotations

import json
import math
from typing import Any

import numpy as np
import pytest
from scipy.signal import StateSpace, dlsim

from design.design_file import Design
from experiments.export import json_file
from experiments.export.check_run import check_run
from experiments.export.controller import sampled_controller


def run_of_file(content: dict[str, Any], reference: np.ndarray, measurement: np.ndarray) -> np.ndarray:
    """The control before the limits, by the file's own words."""
    blocks = {name: content[name] for name in ("forward", "feedback", "windup")}
    x = {name: np.zeros(len(block["b"])) for name, block in blocks.items()}
    p = {name: [[] for _ in block["d"]] for name, block in blocks.items()}
    low, high = content["limits"]["low"], content["limits"]["high"]
    low, high = -math.inf if low is None else low, math.inf if high is None else high
    control = []

    def row(name: str, o: int) -> float:
        return float(np.dot(blocks[name]["C"][o], x[name]))

    def memory(name: str, o: int) -> float:
        held = blocks[name]["memories"][o]
        past = [row(name, o), *reversed(p[name][o])]
        return sum(tap * past[held["first"] + j] for j, tap in enumerate(held["taps"]) if held["first"] + j < len(past))

    for r, y in zip(reference, measurement, strict=True):
        e = r - y - memory("windup", 1)
        v = row("forward", 0) + blocks["forward"]["d"][0] * e
        v = (v + sum(memory("feedback", o) for o in range(len(p["feedback"])))) / (1 - content["around"])
        u_0 = v - row("windup", 0)
        own = blocks["windup"]["d"][0] + content["through"]
        u_tilde = (u_0 - min(max(u_0, low), high)) / (1 + own)
        v, e, u = v - content["through"] * u_tilde, e - content["direct"] * u_tilde, u_0 - own * u_tilde
        assert u - min(max(u, low), high) == pytest.approx(u_tilde, abs=1e-9)
        control.append(u)
        for name, given in (("forward", e), ("feedback", v), ("windup", u_tilde)):
            block = blocks[name]
            for o, d in enumerate(block["d"]):
                p[name][o].append(row(name, o) + d * given)
            x[name] = np.array(block["A"]).reshape(2 * x[name].shape) @ x[name] + np.array(block["b"]) * given
    return np.array(control)


@pytest.mark.parametrize(
    ("method", "anti_windup", "limits"),
    [("tustin", "corrected", (-12.0, 10.0)), ("exact", "none", (-math.inf, 5.0))],
)
def test_the_equations_of_the_file(extended_design: Design, method: str, anti_windup: str, limits: Any) -> None:
    controller = sampled_controller(extended_design, anti_windup, limits, 500.0, method, "axis")
    run = check_run(extended_design, controller)
    files = json_file.files(controller, run)
    content = json.loads(files["axis.json"])
    found = run_of_file(content, run.reference[:300], run.measurement[:300])
    np.testing.assert_allclose(found, run.control[:300], rtol=1e-9, atol=1e-9 * np.abs(run.control).max())
    rows = [line.split(",") for line in files["axis_test.csv"].splitlines()]
    assert rows[0] == ["time_s", "reference", "measurement", "unsaturated_command", "command"]
    expected = (run.reference, run.measurement, run.control, np.clip(run.control, *limits))
    np.testing.assert_array_equal(np.array(rows[1:], dtype=float)[:, 1:], np.column_stack(expected))


def test_the_state_of_a_start_stands_still(extended_design: Design) -> None:
    """By scipy: under a constant input the answers of forward and feedback, from the file's states, stay."""
    controller = sampled_controller(extended_design, "corrected", (-12.0, 10.0), 500.0, "tustin", "axis")
    content = json.loads(json_file.files(controller, check_run(extended_design, controller))["axis.json"])
    for name in ("forward", "feedback"):
        block, state = content[name], np.array(content["start"][name])
        system = StateSpace(block["A"], np.array(block["b"])[:, None], block["C"], np.array(block["d"])[:, None], dt=1)
        _, answers, states = dlsim(system, np.ones((50, 1)), x0=state)
        np.testing.assert_allclose(states, np.tile(state, (50, 1)), rtol=1e-7, atol=1e-9 * np.abs(state).max())
        if name == "feedback":
            np.testing.assert_allclose(answers, np.tile(content["start"]["memories"], (50, 1)), rtol=1e-7, atol=1e-9)
