"""What a caller of the faces may give: names, numbers and lists as they come; a sentence for what cannot be meant."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import design
import experiments
import identification
import paper_figures
from design.design_file import Design
from identification.base.errors import InputError
from identification.model.model_file import IdentifiedModel

PLANT = identification.PlantModel(
    np.float32(2.0), (identification.Mode(np.int64(40), 0.05),), (identification.Mode(60, np.float64(0.02)),), 0
)
OMEGA = np.geomspace(1.0, 300.0, 60)
TEST = identification.FrequencyResponse(list(OMEGA), list(PLANT(1j * OMEGA) * (1 + 1e-3j)), None, "mine")


def test_numbers_of_numpy_are_numbers() -> None:
    assert identification.IdentifiedModel(PLANT, identification.AdditiveBound(0.1, (), (), (), (5.0,))).to_json()
    with pytest.raises(InputError, match="omega is True"):
        identification.Mode(True, 0.1)


@pytest.mark.parametrize("modes", [1, np.int64(1), [1, 1], (1, 1)])
def test_counts_as_they_come(modes: int) -> None:
    model = identification.fit(TEST, modes=modes, real=0, integrators=1)
    assert (len(model.plant.zero_modes), len(model.plant.pole_modes)) == (1, 1)


@pytest.mark.parametrize(
    ("options", "part"),
    [
        ({"modes": 2.0}, "modes is 2.0; expected a number from 0 to 8"),
        ({"modes": "2"}, "modes is '2'"),
        ({"modes": (2, 2, 2)}, "modes is"),
        ({"modes": 50}, "modes is 50"),
        ({"real": 4}, "real is 4; expected a number from 0 to 3"),
        ({"integrators": 3}, "integrators is 3; expected an integer from -2 to 2"),
    ],
)
def test_counts_that_are_none(options: dict[str, int], part: str) -> None:
    with pytest.raises(InputError, match=part):
        identification.fit([TEST], **options)


def test_files_by_their_names(tmp_path: Path, extended_design: Design, implied: IdentifiedModel) -> None:
    (tmp_path / "design.json").write_text(extended_design.to_json(), encoding="utf-8")
    (tmp_path / "model.json").write_text(implied.to_json(), encoding="utf-8")
    assert design.read_design(str(tmp_path / "design.json")) == extended_design
    assert identification.read_model(str(tmp_path / "model.json")).plant == implied.plant
    with pytest.raises(InputError, match=r"x\.csv: no such file"):
        identification.read_sweeps("x.csv")


def test_an_anti_windup_and_limits_as_they_come(extended_design: Design) -> None:
    reference = experiments.sinusoid(50.0, 1.5)
    kinds = ("corrected", extended_design.corrected, extended_design.compensator("corrected"))
    runs = [
        experiments.simulate(extended_design, limits, reference, kind, until_s=0.5, samples=3)
        for kind, limits in zip(kinds, (12.0, [-12.0, 12.0], np.array([-12, 12])), strict=True)
    ]
    assert all(np.array_equal(run.control, runs[0].control) for run in runs)
    drive = experiments.Drive(2000.0, "tustin", 12.0)
    sampled = [experiments.simulate_sampled(extended_design, reference, kind, drive, 0.1) for kind in kinds]
    assert all(np.array_equal(run.control, sampled[0].control) for run in sampled)
    assert experiments.guarantee(extended_design, "corrected").sector > 0.9
    assert experiments.guarantee(extended_design, None).sector == 0.0
    with pytest.raises(InputError, match="there is no anti-windup 'his'"):
        experiments.simulate(extended_design, 12.0, reference, "his")
    with pytest.raises(InputError, match="expected one number, or a lower and an upper one"):
        experiments.simulate(extended_design, [1.0, 2.0, 3.0], reference)
    steps = experiments.SampledReference([0, 1], [0, 2])
    assert experiments.simulate(extended_design, 12.0, steps, samples=2).time_s[-1] == 1.0


def test_what_cannot_be_meant(implied: IdentifiedModel) -> None:
    with pytest.raises(InputError, match="the method is 'foo'; expected one of zeros, lagrange, poles"):
        design.extended(implied, [1.5], 4.0, [(2.0, 1.0)], method="foo")
    with pytest.raises(InputError, match="no run was given"):
        paper_figures.plot_run({})


def test_objects_say_in_a_line_what_they_are(extended_design: Design, implied: IdentifiedModel) -> None:
    run = experiments.simulate(extended_design, 12.0, experiments.sinusoid(50.0, 1.5), until_s=1.0)
    for each in (TEST, implied, extended_design, run, design.audit(extended_design)):
        assert "\n" not in repr(each)
        assert len(repr(each)) < 140
