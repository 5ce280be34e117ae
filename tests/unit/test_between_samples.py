"""The error between the samples beside a run of the loop by the exact solution of its plant, an integrator."""

from __future__ import annotations

import math

import numpy as np
import pytest

from design.chapters_3_4.design_extended import design_extended
from experiments.drive.between_samples import error_between
from experiments.drive.sampled_loop import Drive, simulate_sampled
from experiments.runs.references import sinusoid
from identification.model.additive_bound import AdditiveBound
from identification.model.model_file import IdentifiedModel
from identification.model.plant import PlantModel


def test_the_error_is_that_of_the_plant_between_the_samples_of_a_run() -> None:
    bound = AdditiveBound.printed_form(gain=0.01, corner=100.0, omega=300.0, zeta=0.1)
    design = design_extended(IdentifiedModel(PlantModel(2.0, (), (), 0.05), bound), [1.5], 4.0, [(2.0, 1.0)])
    plant, omega, rate = design.loop_plant, 1.5, 4.0
    drive = Drive(rate, "matched", (-math.inf, math.inf))
    run = simulate_sampled(design, sinusoid(1.0, omega), None, drive, 200.0)
    fine = np.arange(int(190 * 64 * rate), int(199 * 64 * rate)) / (64 * rate)
    whole = np.append(0.0, np.cumsum(run.saturated_control) / rate)
    late = fine - plant.delay_s
    output = plant.gain * np.interp(late, np.append(run.time_s, run.time_s[-1] + 1 / rate), whole)
    worst = float(np.abs(np.sin(omega * fine) - output).max())
    found = error_between(design, drive, (1.0,), (omega,))
    assert found == pytest.approx(worst, rel=2e-2)
    assert found > 10 * float(np.abs(run.error[run.time_s > 190]).max())
