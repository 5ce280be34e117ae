"""The engine against python-control with second-order Pade, and against DOP853 by the method of steps."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path

import control
import numpy as np
import pytest

from design.contract import Design
from design.extended import design_extended
from experiments.closed_loop import simulate
from experiments.loops import design_loop
from experiments.pade import with_pade
from experiments.scenarios import thesis_reference
from identification.model import read_model

sys.path.append(str(Path(__file__).resolve().parents[1] / "tests" / "unit"))
from oracle import reference_run

LIMIT = 12.0


@pytest.fixture(scope="module")
def design() -> Design:
    return design_extended(read_model("implied"), [1.5], 4.0, [(2.0, 1.0)])


def test_against_python_control(design: Design, against: Callable[..., object]) -> None:
    """One second of the loop with the thesis's anti-windup; python-control's error there is 1e-3 and more."""
    loop = design_loop(design, thesis_reference("extended", [1.5]), design.compensator("thesis"))
    approximate = with_pade(loop, 2)
    time_s = np.linspace(0.0, 1.0, 1001)

    def update(_t: float, x: np.ndarray, _u: np.ndarray, _params: object) -> np.ndarray:
        return approximate.A @ x + approximate.B * np.clip(approximate.C @ x, -LIMIT, LIMIT)

    system = control.nlsys(update, None, inputs=0, outputs=None, states=len(approximate.x0))

    def peer() -> object:
        return control.input_output_response(system, time_s, X0=approximate.x0, solve_ivp_kwargs={"rtol": 1e-6})

    against(lambda: simulate(loop, (-LIMIT, LIMIT), time_s), peer, rounds=1)


def test_against_dop853_by_steps(design: Design, against: Callable[..., object]) -> None:
    """Half a second of the same loop, both to 1e-9 and better."""
    loop = design_loop(design, thesis_reference("extended", [1.5]), design.compensator("thesis"))
    time_s = np.linspace(0.0, 0.5, 51)
    against(
        lambda: simulate(loop, (-LIMIT, LIMIT), time_s),
        lambda: reference_run(loop, (-LIMIT, LIMIT), time_s, 1e-9),
        rounds=1,
    )
