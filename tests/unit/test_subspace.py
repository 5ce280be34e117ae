"""The check by a subspace model: exact modes of held records, the shipped records' true ones, and no answer at all."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from held_plant import PLANTS, held_response
from scipy.signal import fftconvolve

from data.thesis import model_named
from identification.fitting.subspace_check import check_modes
from identification.model.modes import Mode
from identification.model.plant import PlantModel
from identification.model.reports import SubspaceCheck
from identification.sweeps.read_sweeps import read_sweeps
from identification.sweeps.response import Record

DATA = Path(__file__).resolve().parents[2] / "data" / "elevation"
T = 2e-3
BAND = (2 * np.pi * 2, 2 * np.pi * 90)


def _record(plant: PlantModel, samples: int = 4096, noise: float = 0.0) -> Record:
    """A held sweep from 2 to 90 Hz; noise relative to the output's differences."""
    x = np.clip(np.arange(samples) / (0.8 * samples), 0, 1)
    fade = np.sin(np.pi / 2 * np.clip(np.minimum(x, 1 - x) / 0.03, 0, 1)) ** 2
    u = fade * np.sin(2 * np.pi * 0.8 * samples * T * (2 * x + 44 * x**2))
    y = held_response(plant, T, u)
    sigma = noise * np.sqrt(np.mean(np.diff(y) ** 2))
    return Record(T, u, y + sigma * np.random.default_rng(0).standard_normal(samples), True)


def _errors(plant: PlantModel, check: SubspaceCheck) -> tuple[list[float], list[float]]:
    """Relative errors of omega and zeta of the plant's modes, all of them found."""
    assert check.reason is None
    truth = [*plant.zero_modes, *plant.pole_modes]
    assert [mode.kind for mode in check.modes] == ["zero"] * len(plant.zero_modes) + ["pole"] * len(plant.pole_modes)
    assert all(mode.found_omega is not None and mode.found_zeta is not None for mode in check.modes)
    pairs = list(zip(check.modes, truth, strict=True))
    return (
        [abs((found.found_omega or 0.0) / mode.omega - 1) for found, mode in pairs],
        [abs((found.found_zeta or 0.0) / mode.zeta - 1) for found, mode in pairs],
    )


@pytest.mark.parametrize("name", PLANTS)
def test_the_modes_of_a_held_record_are_exact(name: str) -> None:
    """Zeros too, though the hold moves them: with as many zeros as poles it takes a third of zeta."""
    omega, zeta = _errors(PLANTS[name], check_modes(PLANTS[name], _record(PLANTS[name]), BAND))
    assert max(omega) < 1e-4
    assert max(zeta) < 5e-3


@pytest.mark.parametrize("name", ["integrator", "no integrator, real pole", "as many zeros as poles"])
def test_noise_and_a_fit_that_is_off(name: str) -> None:
    """Noise of 1 %; the fit that is checked has every omega 2 % too high, and every zeta by a half."""
    plant = PLANTS[name]
    zeros, poles = (
        tuple(Mode(1.02 * mode.omega, 1.5 * mode.zeta) for mode in modes)
        for modes in (plant.zero_modes, plant.pole_modes)
    )
    fit = replace(plant, zero_modes=zeros, pole_modes=poles)
    omega, zeta = _errors(plant, check_modes(fit, _record(plant, noise=0.01), BAND))
    assert max(omega) < 3e-3
    assert max(zeta) < 0.2


def test_the_modes_of_a_shipped_record() -> None:
    """The record's own truth to 0.2 % in frequency and 10 % in damping, told the nominal plant."""
    test = read_sweeps([DATA / "synthetic_test_6_raw.csv"])[0]
    truth = pd.read_csv(DATA / "synthetic_truth.csv", comment="#").iloc[5]
    zeros, poles = (
        tuple(Mode(truth[f"{kind}_omega_{i}"], truth[f"{kind}_zeta_{i}"]) for i in (1, 2)) for kind in ("zero", "pole")
    )
    assert test.record is not None
    check = check_modes(model_named("implied").plant, test.record, (test.omega[0], test.omega[-1]))
    omega, zeta = _errors(PlantModel(1.0, zeros, poles, 0.0), check)
    assert max(omega) < 2e-3
    assert max(zeta) < 0.1
    assert str(check).startswith("N4SID of order 16: zero 17")


def test_modes_that_the_record_does_not_have() -> None:
    """One that is not there is not found; one beyond the band, or without oscillation, is not asked for."""
    plant = PLANTS["no integrator, real pole"]
    fit = replace(plant, pole_modes=(Mode(300.0, 0.02), Mode(900.0, 0.02), Mode(100.0, 1.2)))
    check = check_modes(fit, _record(plant), BAND)
    assert [(mode.omega, mode.found_omega) for mode in check.modes] == [(300.0, None)]
    assert "no pole near 300 rad/s" in str(check)
    assert "no mode in the band" in str(check_modes(replace(plant, pole_modes=()), _record(plant), BAND))


def test_twice_the_same_answer_and_no_state_changed() -> None:
    plant = PLANTS["integrator"]
    record = _record(plant, noise=0.01)
    kept = record.input.copy(), record.output.copy()
    before = np.geterr(), np.random.get_state()[1].tolist()  # noqa: NPY002
    assert check_modes(plant, record, BAND) == check_modes(plant, record, BAND)
    assert (np.geterr(), np.random.get_state()[1].tolist()) == before  # noqa: NPY002
    np.testing.assert_array_equal(record.input, kept[0])
    np.testing.assert_array_equal(record.output, kept[1])


@pytest.mark.parametrize("failure", [SystemExit(1), ValueError("no"), np.linalg.LinAlgError("SVD"), MemoryError()])
def test_no_answer_is_said_and_nothing_leaks(
    failure: BaseException, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    def fails(*_: object, **__: object) -> None:
        print("sippy says something")
        np.log(np.zeros(1))
        raise failure

    monkeypatch.setattr("sippy_unipi.system_identification", fails)
    plant = PLANTS["no integrator, real pole"]
    check = check_modes(plant, _record(plant), BAND)
    assert check.modes == ()
    assert str(check).startswith(f"N4SID of order 14: no answer ({type(failure).__name__}")
    assert capfd.readouterr() == ("", "")


def test_without_its_package_the_check_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("identification.fitting.subspace_check.find_spec", lambda name: None)
    plant = PLANTS["no integrator, real pole"]
    said = str(check_modes(plant, _record(plant), BAND))
    assert said.endswith('no answer (sippy-unipi is missing; pip install "antiwindup-thesis[check]")')


def test_records_that_give_no_answer() -> None:
    plant = PLANTS["no integrator, real pole"]
    record = _record(plant)
    short = Record(T, record.input[:150], record.output[:150], True)
    assert "the record has 150 samples of 0.002 s; expected 160 or more" in str(check_modes(plant, short, BAND))
    late = replace(plant, delay_s=10.0)
    assert "the record has 0 samples of 0.002 s after the dead time of 4998; expected 160" in str(
        check_modes(late, record, BAND)
    )
    still = replace(record, output=np.ones_like(record.output))
    assert check_modes(plant, still, BAND).reason is not None
    rich = PlantModel(1.0, (), tuple(Mode(10.0 * k, 0.01) for k in range(1, 16)), 0.0)
    assert "expected a plant that needs 40 states or fewer" in str(check_modes(rich, record, BAND))


@pytest.mark.parametrize("samples", [300, 100_000])
def test_records_of_any_length(samples: int) -> None:
    """A short one has fewer rows; of a long one pieces are added up, though each has but a part of the sweep's band."""
    plant, end = PLANTS["no integrator, real pole"], 0.8 * samples * T
    t = np.arange(samples) * T
    u = np.where(t < end, np.sin(2 * np.pi * (5 * t + 40 * t**2 / end)), 0.0)
    pulse = held_response(plant, T, np.eye(1, min(samples, 3000))[0])
    y = fftconvolve(u, pulse)[:samples]
    noise = 1e-3 * np.std(y) * np.random.default_rng(1).standard_normal(samples)
    omega, zeta = _errors(plant, check_modes(plant, Record(T, u, y + noise, True), BAND))
    assert max(omega) < 2e-3
    assert max(zeta) < 0.1


def test_a_plant_without_modes_is_answered_too() -> None:
    plant = replace(PLANTS["no integrator, real pole"], pole_modes=(), integrators=2)
    assert str(check_modes(plant, _record(plant), BAND)).endswith("the plant has no mode in the band to check")


def test_zeros_in_the_right_half_plane() -> None:
    plant = replace(PLANTS["integrator"], zero_modes=(Mode(300.0, -0.1),))
    omega, zeta = _errors(plant, check_modes(plant, _record(plant), BAND))
    assert max(omega) < 1e-3
    assert max(zeta) < 5e-2


def test_a_zero_at_the_origin_is_not_differenced() -> None:
    """A tachometer in place of the encoder."""
    position = PLANTS["no integrator, real pole"]
    record = _record(position)
    moving = replace(record, output=np.gradient(record.output, T))
    check = check_modes(replace(position, integrators=-1), moving, BAND)
    assert check.reason is None
    assert [round(mode.found_omega or 0.0) for mode in check.modes] == [200]
