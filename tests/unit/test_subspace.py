"""The check by a subspace model: the shipped records' true modes, a held record's exact ones, and no answer at all."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy.signal import lfilter

from identification import subspace
from identification.frequency_response import Record, read_sweeps
from identification.model import read_model
from identification.plant import Mode, PlantModel
from identification.subspace import check_modes

DATA = Path(__file__).resolve().parents[2] / "data" / "elevation"


def test_the_modes_of_a_shipped_record() -> None:
    """The record's own truth to 0.5 % in frequency and 25 % in damping, told only the number of states."""
    test = read_sweeps([DATA / "synthetic_test_1_raw.csv"])[0]
    truth = pd.read_csv(DATA / "synthetic_truth.csv", comment="#").iloc[0]
    assert test.record is not None
    check = check_modes(read_model("implied").plant, test.record, (test.omega[0], test.omega[-1]))
    assert check.reason is None
    assert [mode.kind for mode in check.modes] == ["zero", "zero", "pole", "pole"]
    for mode, name in zip(check.modes, ("zero_1", "zero_2", "pole_1", "pole_2"), strict=True):
        kind, number = name.split("_")
        assert mode.found_omega == pytest.approx(truth[f"{kind}_omega_{number}"], rel=0.005)
        assert mode.found_zeta == pytest.approx(truth[f"{kind}_zeta_{number}"], rel=0.25)
    assert str(check).startswith("N4SID of order 14: zero 17")


def _record(damping: float, samples: int = 3000) -> Record:
    """Held noise through the exact zero-order hold of 1/(1 + 2 zeta s/10 + (s/10)^2)/s, sampled every 0.05 s."""
    root = 10 * complex(-damping, np.sqrt(1 - damping**2))
    z = np.exp(0.05 * root)
    u = np.random.default_rng(0).standard_normal(samples)
    y = lfilter([0.0, 1.0, 0.5], np.poly([z, z.conjugate(), 1.0]).real, u)
    return Record(0.05, u, y, True)


def test_the_pole_of_a_held_record_is_exact() -> None:
    """log(z)/T is the pole whatever the fit says it is, but for what N4SID makes of a finite record."""
    plant = PlantModel(1.0, (), (Mode(10.4, 0.05),), 0.0)
    (mode,) = check_modes(plant, _record(0.03), (1.0, 30.0)).modes
    assert mode.found_omega == pytest.approx(10.0, rel=2e-4)
    assert mode.found_zeta == pytest.approx(0.03, rel=1e-2)


def test_a_mode_that_the_record_does_not_have() -> None:
    plant = PlantModel(1.0, (), (Mode(25.0, 0.02),), 0.0)
    check = check_modes(plant, _record(0.03), (1.0, 30.0))
    assert check.modes[0].found_omega is None
    assert "no pole near 25 rad/s" in str(check)


def test_no_answer_is_said_and_nothing_leaks(
    monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    def leaves(*_: object, **__: object) -> None:
        print("sippy says something")
        raise SystemExit(1)

    monkeypatch.setattr(subspace.sippy_unipi, "system_identification", leaves)
    plant = PlantModel(1.0, (), (Mode(10.0, 0.03),), 0.0)
    check = check_modes(plant, _record(0.03), (1.0, 30.0))
    assert check.modes == ()
    assert str(check) == "N4SID of order 7: no answer (SystemExit: 1)"
    assert capfd.readouterr() == ("", "")
    assert "expected 140 to" in str(check_modes(plant, _record(0.03, 100), (1.0, 30.0)))
    assert "more than 40 states" in str(check_modes(PlantModel(1.0, (), (), 5.0), _record(0.03), (1.0, 30.0)))
