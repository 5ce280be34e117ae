"""The additive bound covers every residual of every test, touches one, and finds a bound that is there."""

from __future__ import annotations

import numpy as np
import pytest

from identification.files import InputError
from identification.frequency_response import FrequencyResponse
from identification.plant import AdditiveBound, Mode, PlantModel
from identification.uncertainty import bound_residuals

PLANT = PlantModel(7.0, (Mode(40.0, 0.01),), (Mode(65.0, 0.02),), 8e-3)
RESONANT = AdditiveBound.printed_form(0.01, 20.0, 70.0, 0.02)
FLAT = AdditiveBound.printed_form(0.01, 8.0, 50.0, 0.9)


def _tests(bound: AdditiveBound, scale: float = 1.0, count: int = 3) -> list[FrequencyResponse]:
    """Tests whose residuals lie at random below a bound."""
    rng = np.random.default_rng(1)
    tests = []
    for i in range(count):
        omega = scale * np.geomspace(10.0, 400.0 - i, 500)
        share = rng.uniform(0, 1, omega.size) * np.exp(2j * np.pi * rng.uniform(0, 1, omega.size))
        residual = share * np.abs(bound(1j * omega / scale))
        tests.append(FrequencyResponse(omega, PLANT(1j * omega) + residual, None, f"test {i}"))
    return tests


@pytest.mark.parametrize("bound", [RESONANT, FLAT], ids=["resonant", "flat"])
def test_covers_and_touches(bound: AdditiveBound) -> None:
    tests = _tests(bound)
    report = bound_residuals(PLANT, tests)
    ratios = np.concatenate(
        [np.abs(report.bound(1j * t.omega)) / np.abs(PLANT(1j * t.omega) - t.response) for t in tests]
    )
    assert np.min(ratios) >= 1
    assert np.min(ratios) < 1 + 1e-8
    touched = next(test for test in tests if test.name == report.touches_test)
    line = int(np.argmin(np.abs(touched.omega - report.touches_omega)))
    residual = np.abs(PLANT(1j * touched.omega[line]) - touched.response[line])
    assert np.abs(report.bound(1j * touched.omega[line])) == pytest.approx(residual, rel=1e-8)


@pytest.mark.parametrize("bound", [RESONANT, FLAT], ids=["resonant", "flat"])
def test_is_no_looser_than_the_bound_behind_the_residuals(bound: AdditiveBound) -> None:
    tests = _tests(bound)
    report = bound_residuals(PLANT, tests)
    omega = np.geomspace(10.0, 400.0, 200)
    over = np.abs(report.bound(1j * omega)) / np.abs(bound(1j * omega))
    assert np.exp(np.mean(np.log(over))) < 1.02
    assert report.mean_excess < 1.25
    assert report.largest_excess < 3


def test_finds_the_resonance() -> None:
    report = bound_residuals(PLANT, _tests(RESONANT))
    assert report.bound.resonance.omega == pytest.approx(70.0, rel=0.01)
    assert report.bound.resonance.zeta == pytest.approx(0.02, rel=0.3)


def test_units_do_not_matter() -> None:
    """In other units of time and output the bound is the same curve."""
    tests = _tests(RESONANT)
    plain = bound_residuals(PLANT, tests).bound
    fast = PlantModel(7e5, (Mode(4e3, 0.01),), (Mode(6.5e3, 0.02),), 8e-5)
    scaled = [
        FrequencyResponse(1e2 * t.omega, fast(1e2j * t.omega) - 1e3 * (PLANT(1j * t.omega) - t.response), None, t.name)
        for t in tests
    ]
    found = bound_residuals(fast, scaled).bound
    omega = tests[0].omega
    np.testing.assert_allclose(np.abs(found(1e2j * omega)), 1e3 * np.abs(plain(1j * omega)), rtol=1e-3)


def test_nothing_to_bound() -> None:
    omega = np.linspace(1.0, 9.0, 20)
    with pytest.raises(InputError, match="meets every test exactly"):
        bound_residuals(PLANT, [FrequencyResponse(omega, PLANT(1j * omega), None, "exact")])
