"""Responses -> plant: exact without noise, calibrated with it, indifferent to units, and honest about failure."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from numpy.typing import NDArray

from identification.files import InputError
from identification.fit import FitResult, fit_plant, fit_to_dict
from identification.frequency_response import FrequencyResponse, read_sweep
from identification.likelihood import log_jacobian, noise_levels, response_of
from identification.one_test import plant_from_theta
from identification.plant import Mode, PlantModel
from identification.start import group_delay

DATA = Path(__file__).resolve().parents[2] / "data" / "elevation"
ONE_PAIR = PlantModel(-4.0, (Mode(60.0, 0.02),), (Mode(90.0, 0.05),), 6e-3)
PLANTS = {
    "integrator": PlantModel(2.5, (), (), 0.0),
    "integrator with dead time": PlantModel(-0.3, (), (), 20e-3),
    "one pair": ONE_PAIR,
    "one pair, no dead time": replace(ONE_PAIR, delay_s=0.0),
    "two pairs": PlantModel(7.0, (Mode(40.0, 0.01), Mode(200.0, 0.04)), (Mode(65.0, 0.02), Mode(215.0, 0.1)), 8e-3),
    "three pairs": PlantModel(
        1e3,
        (Mode(35.0, 0.03), Mode(120.0, 0.01), Mode(230.0, 0.05)),
        (Mode(50.0, 0.02), Mode(100.0, 0.03), Mode(260.0, 0.04)),
        12e-3,
    ),
}


def _theta(plant: PlantModel) -> NDArray[np.float64]:
    modes = [value for mode in (*plant.zero_modes, *plant.pole_modes) for value in (mode.omega, mode.zeta)]
    return np.array([np.log(abs(plant.gain)), *np.log(modes), plant.delay_s])


def _test(plant: PlantModel, noise: float = 0.0, seed: int = 0, lines: int = 600) -> FrequencyResponse:
    """A response from 20 to 320 rad/s with complex noise, relative and a tenth of that of the median as floor."""
    omega = np.linspace(20.0, 320.0, lines)
    response = plant(1j * omega)
    sigma = noise * np.hypot(np.abs(response), 0.1 * np.median(np.abs(response)))
    normal = np.random.default_rng(seed).standard_normal((2, lines))
    error = sigma * (normal[0] + 1j * normal[1]) / np.sqrt(2)
    return FrequencyResponse(omega, response + error, None, f"test {seed}")


@pytest.mark.parametrize("plant", PLANTS.values(), ids=PLANTS.keys())
def test_without_noise_the_plant_comes_back(plant: PlantModel) -> None:
    """The number of modes too; the delay to 1e-9 s when it is zero."""
    result = fit_plant([_test(plant)])
    assert result.modes == len(plant.pole_modes)
    assert np.sign(result.plant.gain) == np.sign(plant.gain)
    np.testing.assert_allclose(_theta(result.plant)[:-1], _theta(plant)[:-1], rtol=0, atol=1e-7)
    assert result.plant.delay_s == pytest.approx(plant.delay_s, rel=1e-7, abs=1e-9)


@pytest.mark.parametrize("plant", PLANTS.values(), ids=PLANTS.keys())
def test_jacobian_against_differences(plant: PlantModel) -> None:
    theta, omega = _theta(plant), np.linspace(20.0, 320.0, 50)
    step = 1e-6
    for k in range(theta.size):
        moved = np.zeros_like(theta)
        moved[k] = step
        difference = np.log(response_of(theta + moved, omega) / response_of(theta - moved, omega)) / (2 * step)
        np.testing.assert_allclose(log_jacobian(theta, omega)[:, k], difference, rtol=1e-6, atol=1e-7)


def test_response_is_the_plants() -> None:
    plant, omega = PLANTS["three pairs"], np.linspace(20.0, 320.0, 50)
    np.testing.assert_allclose(response_of(_theta(plant), omega), plant(1j * omega), rtol=1e-12)
    assert plant_from_theta(_theta(plant), 1.0)(1j) == pytest.approx(plant(1j), rel=1e-12)


def test_group_delay_without_unwrapping() -> None:
    """Sharp zeros and poles turn the phase by half a turn between two lines; the delay's estimate does not care."""
    plant = PLANTS["three pairs"]
    sharp = replace(plant, zero_modes=tuple(Mode(mode.omega, 1e-4) for mode in plant.zero_modes))
    test = _test(sharp)
    assert group_delay(test.omega, test.response) == pytest.approx(plant.delay_s, abs=3 / 300)


def test_group_delay_of_a_pure_delay_on_coarse_lines() -> None:
    """0.5 s on steps up to 30 rad/s is five half turns a line: only that the steps differ tells."""
    omega = np.geomspace(1.0, 300.0, 60)
    assert group_delay(omega, np.exp(-0.5j * omega)) == pytest.approx(0.5, abs=1e-6)


@pytest.mark.parametrize(("floor", "relative"), [(0.02, 0.05), (0.0, 0.05), (0.02, 1e-8)])
def test_noise_levels(floor: float, relative: float) -> None:
    """20000 exponential errors give each level to 5 %, and one that is not there to 5 % of the other."""
    rng = np.random.default_rng(5)
    power, excitation = rng.uniform(0, 2, 20000) ** 4, rng.uniform(0.5, 2, 20000)
    error = (floor**2 + relative**2 * power) * excitation * rng.exponential(size=20000)
    a2, b2 = noise_levels(error, power, excitation)
    assert np.sqrt(a2) == pytest.approx(floor, rel=0.05, abs=0.05 * relative)
    assert np.sqrt(b2) == pytest.approx(relative, rel=0.05, abs=0.05 * floor)


def test_standard_errors_are_calibrated() -> None:
    """40 noisy tests of one plant: (estimate - true)/error has unit variance; 40 draws leave it 22 % (5 sd: 112 %)."""
    tests = [_test(ONE_PAIR, noise=0.05, seed=seed, lines=300) for seed in range(40)]
    result = fit_plant(tests, modes=1)
    z = np.array([(test.theta - _theta(ONE_PAIR)) / test.errors for test in result.tests])
    assert np.all(np.abs(np.mean(z, axis=0)) < 4 / np.sqrt(40))
    assert np.mean(z**2) == pytest.approx(1.0, abs=0.3)
    assert np.all(np.mean(z**2, axis=0) < 2.1)
    assert result.scatter is not None
    np.testing.assert_allclose(result.scatter, result.noise, rtol=0.6)


def test_units_do_not_matter() -> None:
    """c H has gain c K; time in another unit scales every omega and the gain, and divides the delay."""
    test = _test(ONE_PAIR, noise=0.03, seed=1)
    plain, errors = fit_plant([test]).plant, fit_plant([test]).errors
    scaled = fit_plant([replace(test, omega=1e3 * test.omega, response=-50 * test.response)])
    expected = _theta(plain) + np.array([np.log(5e4), np.log(1e3), 0, np.log(1e3), 0, 0])
    expected[-1] = plain.delay_s / 1e3
    tolerance = 1e-5 * np.append(errors[:-1], errors[-1] / 1e3)
    assert np.all(np.abs(_theta(scaled.plant) - expected) < tolerance)
    assert scaled.plant.gain > 0 > plain.gain


def test_weak_excitation_is_weighed() -> None:
    """Half of the lines a hundred times noisier, and known to be: the errors are those of the good half."""
    test = _test(ONE_PAIR, noise=0.02, seed=3)
    excitation = np.where(np.arange(600) % 2, 1e4, 1.0)
    worse = np.where(np.arange(600) % 2, 100.0, 1.0) * (test.response - ONE_PAIR(1j * test.omega))
    known = fit_plant([replace(test, response=ONE_PAIR(1j * test.omega) + worse, excitation=excitation)])
    good = replace(test, omega=test.omega[::2], response=test.response[::2])
    np.testing.assert_allclose(known.errors, fit_plant([good]).errors, rtol=0.3)
    assert np.all(np.abs(_theta(known.plant) - _theta(ONE_PAIR)) < 4 * known.errors)


def test_same_data_same_bytes() -> None:
    test = _test(ONE_PAIR, noise=0.05, seed=4)
    assert fit_to_dict(fit_plant([test])) == fit_to_dict(fit_plant([test]))


def test_averaging_fits_and_not_responses() -> None:
    """Resonances that differ from test to test: the mean response looks damped, the mean of the fits is not."""
    omegas = 90.0 * np.exp(0.03 * np.linspace(-1, 1, 6))
    tests = [_test(replace(ONE_PAIR, pole_modes=(Mode(omega, 0.02),)), 0.01, seed) for seed, omega in enumerate(omegas)]
    together = replace(tests[0], response=np.mean([test.response for test in tests], axis=0))
    assert fit_plant(tests).plant.pole_modes[0].zeta == pytest.approx(0.02, rel=0.02)
    assert fit_plant([together], modes=1).plant.pole_modes[0].zeta > 0.025


def test_too_few_lines() -> None:
    with pytest.raises(InputError, match="test 0: holds 15 lines; expected 16 or more for 3 mode pairs"):
        fit_plant([_test(ONE_PAIR, lines=15)], modes=3)


def test_modes_that_are_not_there() -> None:
    with pytest.raises(InputError, match="the data do not determine 3 mode pairs; expected fewer"):
        fit_plant([_test(ONE_PAIR)], modes=3)


def test_no_plant_near_the_data() -> None:
    rng = np.random.default_rng(0)
    nonsense = rng.standard_normal(200) + 1j * rng.standard_normal(200)
    with pytest.raises(InputError, match="no stable minimum phase plant"):
        fit_plant([FrequencyResponse(np.linspace(1.0, 9.0, 200), nonsense, None, "nonsense")])


def test_tests_that_disagree_about_the_sign() -> None:
    test = _test(ONE_PAIR, 0.01)
    with pytest.raises(InputError, match="the gain is positive in b and negative in a; expected tests of one plant"):
        fit_plant([replace(test, name="a"), replace(test, name="b", response=-test.response)])


@pytest.fixture(scope="module")
def shipped() -> dict[str, FitResult]:
    """The fits of the six shipped tests, from the analyser's responses and from the raw records."""
    return {
        kind: fit_plant([read_sweep(DATA / f"synthetic_test_{i}_{kind}.csv") for i in range(1, 7)])
        for kind in ("frf", "raw")
    }


@pytest.fixture(scope="module")
def truth() -> NDArray[np.float64]:
    """(6, 10) theta of the plants behind the shipped tests."""
    table = pd.read_csv(DATA / "synthetic_truth.csv", comment="#").drop(columns="test").to_numpy()
    return np.column_stack([np.log(table[:, :-1]), table[:, -1]])


@pytest.mark.parametrize("kind", ["frf", "raw"])
def test_shipped_tests(shipped: dict[str, FitResult], truth: NDArray[np.float64], kind: str) -> None:
    """Each test within its errors of its own truth, and the mean within the noise of the true mean.

    Sixty squared deviations over their variances have mean 60 and standard deviation 11. The noise on the input makes
    every gain 7e-4 too small, which the files say and which is as large as a gain's error.
    """
    result = shipped[kind]
    assert result.modes == 2
    z = np.array([(test.theta - true) / test.errors for test, true in zip(result.tests, truth, strict=True)])
    assert np.sum(z**2) < 60 + 4 * 11
    assert np.max(np.abs(z)) < 4.5
    deviation = np.mean([test.theta for test in result.tests], axis=0) - truth.mean(axis=0)
    deviation[0] += 7e-4
    assert np.all(np.abs(deviation) < 4 * result.noise)
    assert np.all(np.abs(deviation) < result.errors)


def test_raw_records_and_analyser_responses_agree(shipped: dict[str, FitResult]) -> None:
    """They come from the same records, so they agree better than their errors."""
    for raw, frf in zip(shipped["raw"].tests, shipped["frf"].tests, strict=True):
        assert np.all(np.abs(raw.theta - frf.theta) < 3 * frf.errors)


def test_the_spread_of_the_shipped_tests_is_seen(shipped: dict[str, FitResult], truth: NDArray[np.float64]) -> None:
    """The scatter is that of the true parameters to 20 %, but for what noise adds."""
    scatter = shipped["frf"].scatter
    assert scatter is not None
    np.testing.assert_allclose(scatter, truth.std(axis=0, ddof=1) / np.sqrt(6), rtol=0.2)
