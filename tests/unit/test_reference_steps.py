"""A sampled reference steps where two samples have one time."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from design.design_file import Design
from experiments.engine.simulate import simulate
from experiments.runs.design_loop import design_loop
from experiments.runs.reference_file import read_reference
from experiments.runs.references import SampledReference
from identification.base.errors import InputError


def _file(tmp_path: Path, times: str) -> Path:
    rows = "".join(f"{time},{5 * k}\n" for k, time in enumerate(times.split()))
    path = tmp_path / "reference.csv"
    path.write_text(f"time_s,reference\n{rows}", encoding="utf-8")
    return path


def test_the_second_of_two_values_holds_from_their_time_on(tmp_path: Path) -> None:
    reference = read_reference(_file(tmp_path, "0 1 1 2"))
    times = np.array([0.0, 0.5, np.nextafter(1.0, 0.0), 1.0, 1.5, 3.0])
    np.testing.assert_allclose(reference(times), [0, 2.5, 5, 10, 12.5, 15], rtol=1e-12)
    resets = reference.generator().resets
    np.testing.assert_allclose(np.column_stack([resets.times_s, resets.values]), [[1, 10, 5], [2, 15, 0]], rtol=1e-12)


@pytest.mark.parametrize("limit", [5.0, np.inf])
def test_a_late_step_is_an_early_one_later(extended_design: Design, limit: float) -> None:
    late_s, times = 0.1, np.linspace(0.0, 0.4, 41)
    kind = extended_design.compensator("corrected")
    steps = [SampledReference(np.array([0.0, at, at]), np.array([0.0, 0.0, 20.0])) for at in (0.02, 0.02 + late_s)]
    early, late = (
        simulate(design_loop(extended_design, step, kind), (-limit, limit), times + step.time_s[-1]) for step in steps
    )
    np.testing.assert_allclose(late.control, early.control, atol=1e-4 * np.max(np.abs(early.control)))
    np.testing.assert_allclose(late.outputs["output"], early.outputs["output"], atol=1e-5)


@pytest.mark.parametrize("times", ["0 2 1", "0 1 1 1", "3 3 3"])
def test_other_times_are_refused(tmp_path: Path, times: str) -> None:
    with pytest.raises(InputError, match=r"time_s is \d after \d; expected increasing times, or two rows of one time"):
        read_reference(_file(tmp_path, times))
    with pytest.raises(InputError, match=r"do not increase; expected increasing times, or two samples at one time"):
        SampledReference(np.array(times.split()), np.arange(len(times.split())))
