"""The error between the samples beside a run of the loop by the exact solution of its plant, an integrator."""

from __future__ import annotations

import math

import numpy as np
import pytest

from design.design_file import Design
from experiments.drive.between_samples import error_between
from experiments.drive.sampled_loop import Drive, simulate_sampled
from experiments.runs.references import sinusoid


def test_the_error_is_that_of_the_plant_between_the_samples_of_a_run(late_integrator: Design) -> None:
    plant, omega, rate = late_integrator.loop_plant, 1.5, 4.0
    assert plant.integrators == 1 and not plant.modes if hasattr(plant, "modes") else plant.integrators == 1
    drive = Drive(rate, "matched", (-math.inf, math.inf))
    run = simulate_sampled(late_integrator, sinusoid(1.0, omega), None, drive, 200.0)
    fine = np.arange(int(190 * 64 * rate), int(199 * 64 * rate)) / (64 * rate)
    whole = np.append(0.0, np.cumsum(run.saturated_control) / rate)
    late = fine - plant.delay_s
    output = plant.gain * np.interp(late, np.append(run.time_s, run.time_s[-1] + 1 / rate), whole)
    worst = float(np.abs(np.sin(omega * fine) - output).max())
    found = error_between(late_integrator, drive, (1.0,), (omega,))
    assert found == pytest.approx(worst, rel=2e-2)
    assert found > 10 * float(np.abs(run.error[run.time_s > 190]).max())
