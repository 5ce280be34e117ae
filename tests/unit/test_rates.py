"""The runs on a computer under a reference of samples."""

from __future__ import annotations

import numpy as np
import pytest

from design.chapters_3_4.design_extended import design_extended
from experiments.drive.sampled_loop import METHODS, Drive, simulate_sampled
from experiments.rates import rates_tables
from experiments.runs.references import SampledReference
from identification.model.additive_bound import AdditiveBound
from identification.model.model_file import IdentifiedModel
from identification.model.plant import PlantModel


def test_samples_are_run_at_the_computers_rate_by_every_method() -> None:
    bound = AdditiveBound.printed_form(gain=0.01, corner=100.0, omega=300.0, zeta=0.1)
    design = design_extended(IdentifiedModel(PlantModel(2.0, (), (), 0.05), bound), [0.0], 4.0)
    samples = SampledReference(np.array([0.0, 1.0, 1.0, 10.0]), np.array([0.0, 0.0, 1.0, 1.0]))
    rows = rates_tables(design, samples, (-0.5, 0.5), rate=40.0)["rates"]
    rows = rows[(rows["run"] == "corrected") & (rows["rate_hz"] == 40.0)].set_index("method")
    assert set(rows.index) == set(METHODS)
    for method in METHODS:
        run = simulate_sampled(design, samples, "corrected", Drive(40.0, method, (-0.5, 0.5)), 10.0)
        left = np.abs(run.error[run.time_s >= 8.0]).max()
        assert rows["steady_error"][method] == pytest.approx(left, rel=1e-9, abs=1e-12)
        assert left < 0.01
        away = run.time_s[np.abs(run.error) > 0.005]  # 1 % of half the distance of the extremes
        assert rows["settling_s"][method] == pytest.approx(away[-1] + 1 / 40, abs=0.05)
    assert (rows["stable"] == 1).all()
