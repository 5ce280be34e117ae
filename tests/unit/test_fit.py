"""Responses -> plant: exact without noise, calibrated with it, indifferent to units, and honest about failure."""

from __future__ import annotations

from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from numpy.typing import NDArray

from identification.base.errors import InputError
from identification.fitting.dead_time import group_delay
from identification.fitting.fit_plant import FitResult, fit_plant
from identification.fitting.least_squares import log_jacobian, response_of
from identification.fitting.likelihood import noise_levels
from identification.model.modes import Mode
from identification.model.plant import PlantModel
from identification.model.structure import Structure, Wanted
from identification.sweeps.read_sweeps import read_sweeps
from identification.sweeps.response import FrequencyResponse

DATA = Path(__file__).resolve().parents[2] / "data" / "elevation"
ONE_PAIR = PlantModel(-4.0, (Mode(60.0, 0.02),), (Mode(90.0, 0.05),), 6e-3)
A_PAIR = Wanted(1, (1, 1), (0, 0))
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
    "real pole": PlantModel(5.0, (Mode(110.0, 0.03),), (Mode(160.0, 0.02),), 3e-3, 0, real_poles=(45.0,)),
    "real zero": PlantModel(-5.0, (), (Mode(160.0, 0.02),), 3e-3, 1, real_zeros=(45.0,)),
    "more pole modes": PlantModel(2.0, (Mode(110.0, 0.03),), (Mode(60.0, 0.05), Mode(160.0, 0.02)), 3e-3, 0),
    "double integrator": PlantModel(90.0, (), (Mode(150.0, 0.02),), 10e-3, 2),
    "everything": PlantModel(-90.0, (Mode(60.0, 0.03),), (Mode(150.0, 0.02),), 10e-3, 2, (100.0,), (220.0,)),
    "a gain with dead time": PlantModel(3.0, (), (), 10e-3, 0),
}


def _structure(plant: PlantModel) -> Structure:
    zeros = 2 * len(plant.zero_modes) + len(plant.real_zeros)
    poles = 2 * len(plant.pole_modes) + len(plant.real_poles)
    return Structure(plant.integrators, zeros, poles, delayed=plant.delay_s > 0)


def _theta(plant: PlantModel) -> NDArray[np.float64]:
    values = [parameter.value for parameter in plant.parameters]
    return np.append(np.log(np.abs(values[:-1])), values[-1])


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
    """The structure too; the delay to 1e-9 s when it is zero."""
    result = fit_plant([_test(plant, lines=100)])
    assert result.structure == _structure(plant)
    assert np.sign(result.plant.gain) == np.sign(plant.gain)
    np.testing.assert_allclose(_theta(result.plant)[:-1], _theta(plant)[:-1], rtol=0, atol=1e-7)
    assert result.plant.delay_s == pytest.approx(plant.delay_s, rel=1e-7, abs=1e-9)


@pytest.mark.parametrize("plant", PLANTS.values(), ids=PLANTS.keys())
def test_jacobian_against_differences(plant: PlantModel) -> None:
    structure, theta, omega = _structure(plant), _theta(plant), np.linspace(20.0, 320.0, 50)
    step = 1e-6
    for k in range(theta.size):
        moved = np.zeros_like(theta)
        moved[k] = step
        ratio = response_of(structure, theta + moved, omega) / response_of(structure, theta - moved, omega)
        np.testing.assert_allclose(log_jacobian(structure, theta, omega)[:, k], np.log(ratio) / (2 * step), atol=1e-6)


@pytest.mark.parametrize("plant", PLANTS.values(), ids=PLANTS.keys())
def test_response_is_the_plants(plant: PlantModel) -> None:
    structure, theta, omega = _structure(plant), _theta(plant), np.linspace(20.0, 320.0, 50)
    sign = np.sign(plant.gain)
    np.testing.assert_allclose(sign * response_of(structure, theta, omega), plant(1j * omega), rtol=1e-12)
    assert structure.plant(theta, sign)(1j) == pytest.approx(plant(1j), rel=1e-12)


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
    a2, b2, _ = noise_levels(error, power, excitation)
    assert np.sqrt(a2) == pytest.approx(floor, rel=0.05, abs=0.05 * relative)
    assert np.sqrt(b2) == pytest.approx(relative, rel=0.05, abs=0.05 * floor)


def test_standard_errors_are_calibrated() -> None:
    """40 noisy tests of one plant: (estimate - true)/error has unit variance; 40 draws leave it 22 % (5 sd: 112 %)."""
    tests = [_test(ONE_PAIR, noise=0.05, seed=seed, lines=300) for seed in range(40)]
    result = fit_plant(tests, A_PAIR)
    z = np.array([(test.theta - _theta(ONE_PAIR)) / test.errors for test in result.tests])
    assert np.all(np.abs(np.mean(z, axis=0)) < 4 / np.sqrt(40))
    assert np.mean(z**2) == pytest.approx(1.0, abs=0.3)
    assert np.all(np.mean(z**2, axis=0) < 2.1)
    assert result.nominal.scatter is not None
    assert not result.nominal.scattered
    np.testing.assert_allclose(result.nominal.scatter, result.nominal.noise, rtol=0.6)


def test_weak_excitation_is_weighed() -> None:
    """Half of the lines a hundred times noisier, and known to be: the errors are those of the good half."""
    test = _test(ONE_PAIR, noise=0.02, seed=3)
    excitation = np.where(np.arange(600) % 2, 1e4, 1.0)
    worse = np.where(np.arange(600) % 2, 100.0, 1.0) * (test.response - ONE_PAIR(1j * test.omega))
    known = fit_plant([replace(test, response=ONE_PAIR(1j * test.omega) + worse, excitation=excitation)], A_PAIR)
    good = replace(test, omega=test.omega[::2], response=test.response[::2])
    np.testing.assert_allclose(known.nominal.errors, fit_plant([good], A_PAIR).nominal.errors, rtol=0.3)
    assert np.all(np.abs(_theta(known.plant) - _theta(ONE_PAIR)) < 4 * known.nominal.errors)


def test_same_data_same_numbers() -> None:
    test = _test(ONE_PAIR, noise=0.05, seed=4, lines=200)
    np.testing.assert_equal(asdict(fit_plant([test]).nominal), asdict(fit_plant([test]).nominal))


def test_averaging_fits_and_not_responses() -> None:
    """Resonances that differ from test to test: the mean response looks damped, the mean of the fits is not."""
    omegas = 90.0 * np.exp(0.03 * np.linspace(-1, 1, 6))
    plants = [replace(ONE_PAIR, pole_modes=(Mode(omega, 0.02),)) for omega in omegas]
    tests = [_test(plant, 0.01, seed, 200) for seed, plant in enumerate(plants)]
    together = replace(tests[0], response=np.mean([test.response for test in tests], axis=0))
    assert fit_plant(tests, A_PAIR).plant.pole_modes[0].zeta == pytest.approx(0.02, rel=0.02)
    assert fit_plant([together], Wanted(modes=(1, 1))).plant.pole_modes[0].zeta > 0.025


def test_too_few_lines() -> None:
    expected = "test 0: holds 15 lines; expected 16 or more for 1 integrator, 3 zero modes, 3 pole modes"
    with pytest.raises(InputError, match=expected):
        fit_plant([_test(ONE_PAIR, lines=15)], Wanted(1, (3, 3)))


def test_modes_that_are_not_there() -> None:
    with pytest.raises(InputError, match="do not determine 1 integrator, 3 zero modes, 3 pole modes"):
        fit_plant([_test(ONE_PAIR)], Wanted(1, (3, 3), (0, 0)))


def test_an_improper_plant_is_not_fitted() -> None:
    with pytest.raises(InputError, match="2 zero modes, 1 pole mode make an improper plant"):
        fit_plant([_test(ONE_PAIR)], Wanted(0, (2, 1)))


@pytest.mark.parametrize(
    ("wanted", "structure"),
    [
        (Wanted(modes=(1, 2)), Structure(1, 2, 4)),
        (Wanted(integrators=1, modes=(1, 1), real=(0, 1)), Structure(1, 2, 3)),
        (Wanted(real=(1, 1)), Structure(1, 3, 3)),
    ],
    ids=str,
)
def test_what_is_asked_for_is_fitted(wanted: Wanted, structure: Structure) -> None:
    """A plant with one integrator and one mode pair, asked for otherwise; the rest is what the data say."""
    found = fit_plant([_test(ONE_PAIR, 0.03, lines=300)], wanted).structure
    assert wanted.admits(found)
    assert found == structure


def test_soft_loss_and_outliers() -> None:
    """One line in ten off by the whole response: the soft loss finds the plant, with errors far below least squares."""
    test, rng = _test(ONE_PAIR, noise=0.02, seed=6), np.random.default_rng(6)
    turned = 1 + np.where(rng.permutation(600) < 60, np.exp(2j * np.pi * rng.random(600)), 0.0)
    broken = replace(test, response=test.response * turned)
    hard = fit_plant([broken], A_PAIR)
    soft = fit_plant([broken], soft=True)
    assert soft.structure == Structure(1, 2, 2)
    assert np.all(np.abs(_theta(soft.plant) - _theta(ONE_PAIR)) < 4 * soft.nominal.errors)
    assert np.all(soft.nominal.errors < 0.5 * hard.nominal.errors)


def test_soft_errors_are_calibrated_on_gaussian_noise() -> None:
    """The sandwich is right for errors of another distribution than the loss's; 30 draws leave 26 %."""
    tests = [_test(ONE_PAIR, noise=0.05, seed=seed, lines=100) for seed in range(30)]
    result = fit_plant(tests, A_PAIR, soft=True)
    z = np.array([(test.theta - _theta(ONE_PAIR)) / test.errors for test in result.tests])
    assert np.mean(z**2) == pytest.approx(1.0, abs=0.25)


def test_intervals_hold_the_truth_when_tests_scatter() -> None:
    """Plants that differ from test to test by far more than noise: Student's intervals of three hold the mean plant.

    Of 25 campaigns times 4 scattering parameters 95 % are expected to be held; 4 sd of 100 draws are 8.7 %.
    """
    held, seen = [], []
    for campaign in range(25):
        rng = np.random.default_rng([9, campaign])
        tests = []
        for k in range(3):
            zero, pole = (
                Mode(omega * np.exp(0.01 * rng.standard_normal()), zeta * np.exp(0.1 * rng.standard_normal()))
                for omega, zeta in ((60.0, 0.02), (90.0, 0.05))
            )
            tests.append(
                _test(replace(ONE_PAIR, zero_modes=(zero,), pole_modes=(pole,)), 0.01, 100 * campaign + k, 100)
            )
        result = fit_plant(tests, A_PAIR)
        seen.append(result.nominal.scattered)
        lower, upper = result.nominal.intervals
        truth = np.exp(_theta(ONE_PAIR))
        held.append(((lower < truth) & (truth < upper))[1:5])
    assert all(seen)
    assert 0.86 < np.mean(held) <= 1.0


def test_a_ripple_that_is_no_noise() -> None:
    """A random ripple over some lines, the same in two tests: no modes for it, intervals widened, and said so."""
    smooth = np.convolve(np.random.default_rng(8).standard_normal((2, 220)).T @ [1, 1j], np.hanning(21) / 3, "valid")
    ripple = 1 + 0.03 * smooth
    tests = [
        replace(test, response=test.response * ripple) for test in (_test(ONE_PAIR, 0.003, k, 200) for k in range(2))
    ]
    result = fit_plant(tests)
    assert result.structure == Structure(1, 2, 2)
    assert result.overdispersion > 1
    assert np.all(result.nominal.misfit > result.nominal.noise)
    assert np.all(np.abs(_theta(result.plant) - _theta(ONE_PAIR)) < 4 * result.nominal.errors)


def test_no_plant_near_the_data() -> None:
    rng = np.random.default_rng(0)
    nonsense = rng.standard_normal(200) + 1j * rng.standard_normal(200)
    with pytest.raises(InputError, match="no stable plant"):
        fit_plant([FrequencyResponse(np.linspace(1.0, 9.0, 200), nonsense, None, "nonsense")])


def test_tests_that_disagree_about_the_sign() -> None:
    test = _test(ONE_PAIR, 0.01, lines=100)
    with pytest.raises(InputError, match="the gain is positive in b and negative in a; expected tests of one plant"):
        fit_plant([replace(test, name="a"), replace(test, name="b", response=-test.response)], A_PAIR)


@pytest.fixture(scope="module")
def shipped() -> dict[str, FitResult]:
    """The fits of the six shipped responses of the analyser, with the structure sought, and of three raw records."""
    return {
        kind: fit_plant(read_sweeps([DATA / f"synthetic_test_{i}_{kind}.csv" for i in range(1, 1 + count)]), wanted)
        for kind, count, wanted in (("frf", 6, None), ("raw", 3, Wanted(1, (2, 2), (0, 0))))
    }


@pytest.fixture(scope="module")
def truth() -> NDArray[np.float64]:
    """(6, 10) theta of the plants behind the shipped tests."""
    table = pd.read_csv(DATA / "synthetic_truth.csv", comment="#").drop(columns="test").to_numpy()
    return np.column_stack([np.log(table[:, :-1]), table[:, -1]])


@pytest.mark.parametrize("kind", ["frf", "raw"])
def test_shipped_tests(shipped: dict[str, FitResult], truth: NDArray[np.float64], kind: str) -> None:
    """Each test within its errors of its own truth, and the mean within the noise of the true mean.

    n squared deviations over their variances have mean n and standard deviation sqrt(2 n). The noise on the input makes
    every gain 7e-4 too small, which the files say and which is as large as a gain's error.
    """
    result = shipped[kind]
    assert result.structure == Structure(1, 4, 4)
    truth = truth[: len(result.tests)]
    z = np.array([(test.theta - true) / test.errors for test, true in zip(result.tests, truth, strict=True)])
    assert np.sum(z**2) < z.size + 4 * np.sqrt(2 * z.size)
    assert np.max(np.abs(z)) < 4.5
    deviation = np.mean([test.theta for test in result.tests], axis=0) - truth.mean(axis=0)
    deviation[0] += 7e-4
    assert np.all(np.abs(deviation) < 4 * result.nominal.noise)
    assert np.all(np.abs(deviation) < result.nominal.errors)


def test_raw_records_and_analyser_responses_agree(shipped: dict[str, FitResult]) -> None:
    """They come from the same records, so they agree better than their errors."""
    for raw, frf in zip(shipped["raw"].tests, shipped["frf"].tests, strict=False):
        assert np.all(np.abs(raw.theta - frf.theta) < 3 * frf.errors)


def test_the_spread_of_the_shipped_tests_is_seen(shipped: dict[str, FitResult], truth: NDArray[np.float64]) -> None:
    """The scatter is that of the true parameters to 20 %, but for what noise adds."""
    scatter = shipped["frf"].nominal.scatter
    assert scatter is not None
    np.testing.assert_allclose(scatter, truth.std(axis=0, ddof=1) / np.sqrt(6), rtol=0.2)


def test_many_modes_of_each_kind() -> None:
    """Five pairs, and a real pole: more than noise could hide, found among all structures."""
    zeros = tuple(Mode(omega, 0.01) for omega in (35.0, 80.0, 150.0, 210.0, 280.0))
    poles = tuple(Mode(omega, 0.012) for omega in (50.0, 110.0, 170.0, 240.0, 300.0))
    plant = PlantModel(5.0, zeros, poles, 2e-3, 0, real_poles=(60.0,))
    result = fit_plant([_test(plant, 0.02, lines=300)])
    assert result.structure == _structure(plant)
    assert np.all(np.abs(_theta(result.plant) - _theta(plant)) < 5 * result.nominal.errors)


RIGHT = {
    "a zero mode": replace(ONE_PAIR, zero_modes=(Mode(60.0, -0.05),)),
    "one of two zero modes": PlantModel(
        2.0, (Mode(45.0, 0.04), Mode(120.0, -0.1)), (Mode(80.0, 0.03), Mode(200.0, 0.02)), 4e-3
    ),
    "a real zero": PlantModel(-3.0, (), (Mode(150.0, 0.05),), 5e-3, 1, (-70.0,), ()),
    "real zeros of both kinds": PlantModel(5.0, (), (Mode(90.0, 0.1),), 0.0, 0, (180.0, -40.0), (60.0,)),
}


@pytest.mark.parametrize("plant", RIGHT.values(), ids=RIGHT.keys())
def test_zeros_in_the_right_half_plane_come_back(plant: PlantModel) -> None:
    """Which zeros lie there is found, and costs no parameter; the interval of each number holds it."""
    result = fit_plant([_test(plant, 0.003, k, 200) for k in range(2)])
    assert [(p.kind, p.index) for p in result.plant.parameters] == [(p.kind, p.index) for p in plant.parameters]
    values = np.array([p.value for p in plant.parameters])
    found = np.array([p.value for p in result.plant.parameters])
    assert np.all(np.sign(found[:-1]) == np.sign(values[:-1]))
    lower, upper = result.nominal.intervals
    assert np.all(np.abs(found - values) < 2 * (upper - lower))
    assert result.structure.right == sum(
        2 if p.quantity else 1 for p in plant.parameters if p.value < 0 and p.kind in ("zero", "real_zero")
    )
