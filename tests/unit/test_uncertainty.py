"""The additive bound covers every test at and between its lines, as tightly as linear programs prove possible."""

from __future__ import annotations

from functools import cache
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.optimize import differential_evolution

from identification.base.errors import InputError
from identification.bound import bound_residuals as module
from identification.bound.bound_residuals import bound_residuals
from identification.bound.envelope import envelope_of
from identification.bound.orders import HIGHEST_ORDER
from identification.model.additive_bound import AdditiveBound
from identification.model.modes import Mode
from identification.model.plant import PlantModel
from identification.model.reports import BoundReport
from identification.sweeps.response import FrequencyResponse

Real = NDArray[np.float64]

PLANT = PlantModel(7.0, (Mode(40.0, 0.01),), (Mode(65.0, 0.02),), 8e-3)
RESONANT = AdditiveBound.printed_form(0.01, 20.0, 70.0, 0.02)
FLAT = AdditiveBound.printed_form(0.01, 8.0, 50.0, 0.9)
OF_ORDER = {
    1: AdditiveBound(0.02, (), (), (), (60.0,)),
    2: RESONANT,
    3: AdditiveBound(0.02, (Mode(40.0, 0.3),), (Mode(110.0, 0.05),), (), (300.0,)),
    4: AdditiveBound(0.02, (Mode(40.0, 0.4),), (Mode(70.0, 0.05), Mode(200.0, 0.1)), (120.0,)),
}


def _test(bound: AdditiveBound, omega: Real, name: str = "exact", share: Real | float = 1.0) -> FrequencyResponse:
    """A test whose residual is the share of a bound, with a phase that turns."""
    residual = share * np.abs(bound(1j * omega)) * np.exp(1j * 9.0 * np.arange(omega.size))
    return FrequencyResponse(omega, PLANT(1j * omega) + residual, None, name)


def _tests(bound: AdditiveBound, scale: float = 1.0, count: int = 3) -> list[FrequencyResponse]:
    """Tests whose residuals lie at random below a bound."""
    rng = np.random.default_rng(1)
    tests = []
    for i in range(count):
        omega = scale * np.geomspace(10.0, 400.0 - i, 300)
        share = rng.uniform(0, 1, omega.size) * np.exp(2j * np.pi * rng.uniform(0, 1, omega.size))
        residual = share * np.abs(bound(1j * omega / scale))
        tests.append(FrequencyResponse(omega, PLANT(1j * omega) + residual, None, f"test {i}"))
    return tests


@cache
def _report(behind: AdditiveBound, order: int = 2) -> BoundReport:
    """The bound of tests whose residuals lie at random below another one."""
    return bound_residuals(PLANT, _tests(behind), order=order)


def _ratios(bound: AdditiveBound, tests: list[FrequencyResponse], plant: PlantModel = PLANT) -> Real:
    """|W_a| over the residual at every line."""
    return np.concatenate(
        [np.abs(bound(1j * t.omega)) / np.maximum(np.abs(plant(1j * t.omega) - t.response), 1e-300) for t in tests]
    )


def _apart(bound: AdditiveBound, models: list[PlantModel], omega: Real) -> float:
    """The largest |P - P_test|/|W_a|."""
    return max(
        float(np.max(np.abs(PLANT(1j * omega) - model(1j * omega)) / np.abs(bound(1j * omega)))) for model in models
    )


@pytest.mark.parametrize("order", [1, 2, 3, 4])
@pytest.mark.parametrize("behind", [RESONANT, FLAT], ids=["resonant", "flat"])
def test_covers_and_touches(behind: AdditiveBound, order: int) -> None:
    tests = _tests(behind)
    report = _report(behind, order)
    assert report.bound.order == order
    ratios = _ratios(report.bound, tests)
    assert np.min(ratios) >= 1
    assert np.min(ratios) < 1 + 1e-8
    assert [touch.ratio for touch in report.touches] == sorted(touch.ratio for touch in report.touches)
    for touch in report.touches:
        touched = next(test for test in tests if test.name == touch.test)
        line = int(np.argmin(np.abs(touched.omega - touch.omega)))
        residual = np.abs(PLANT(1j * touched.omega[line]) - touched.response[line])
        assert np.abs(report.bound(1j * touched.omega[line])) == pytest.approx(touch.ratio * residual, rel=1e-8)
        assert not touch.between_lines


@pytest.mark.parametrize("order", OF_ORDER)
def test_recovers_a_bound_of_its_order(order: int) -> None:
    behind = OF_ORDER[order]
    omega = np.geomspace(10.0, 400.0, 600)
    report = bound_residuals(PLANT, [_test(behind, omega)], order=order)
    np.testing.assert_allclose(np.abs(report.bound(1j * omega)), np.abs(behind(1j * omega)), rtol=2e-2)
    assert report.largest_excess == pytest.approx(1.0, abs=0.02)
    assert report.mean_excess == pytest.approx(1.0, abs=5e-3)
    assert report.at_lines.mean == pytest.approx(report.mean_excess, abs=1e-3)


@pytest.mark.parametrize("behind", [RESONANT, FLAT], ids=["resonant", "flat"])
def test_is_no_looser_than_the_bound_behind_the_residuals(behind: AdditiveBound) -> None:
    report = _report(behind)
    omega = np.geomspace(10.0, 400.0, 200)
    over = np.abs(report.bound(1j * omega)) / np.abs(behind(1j * omega))
    assert np.exp(np.mean(np.log(over))) < 1.02
    assert report.mean_excess < 1.25
    assert report.largest_excess < 3


def test_finds_the_resonance() -> None:
    report = _report(RESONANT)
    assert report.bound.is_printed_form
    assert report.bound.resonance.omega == pytest.approx(70.0, rel=0.01)
    assert report.bound.resonance.zeta == pytest.approx(0.02, rel=0.3)


@pytest.mark.parametrize(("behind", "order"), [(RESONANT, 2), (RESONANT, 3), (FLAT, 5)])
def test_is_as_tight_as_was_proved_possible(behind: AdditiveBound, order: int) -> None:
    report = _report(behind, order)
    assert 1 < report.least_excess < report.largest_excess * (1 + 1e-9)
    assert report.largest_excess < 1.06 * report.least_excess


@pytest.mark.parametrize(("behind", "highest"), [(RESONANT, 4), (FLAT, 5)], ids=["resonant", "flat"])
def test_more_poles_are_never_looser(behind: AdditiveBound, highest: int) -> None:
    largest = [_report(behind, order).largest_excess for order in range(1, highest + 1)]
    assert all(more < 1.06 * fewer for fewer, more in pairwise(largest))


def test_no_other_search_goes_below_what_was_proved() -> None:
    """Differential evolution over (2.22) at the lines, where gain follows from covering."""
    tests = _tests(RESONANT)
    omega = np.concatenate([test.omega for test in tests])
    residual = np.abs(PLANT(1j * omega) - np.concatenate([test.response for test in tests]))
    envelope = envelope_of(omega, residual)

    def largest(logs: Real) -> float:
        corner, resonance, zeta = np.exp(logs)
        shape = AdditiveBound.printed_form(1.0, corner, resonance, zeta)
        gain = np.max(residual / np.abs(shape(1j * omega)))
        return float(np.log(np.max(gain * np.abs(shape(1j * envelope.omega)) / envelope.level)))

    bounds = [(0.0, np.log(4000.0)), (0.0, np.log(4000.0)), (np.log(1e-3), np.log(5.0))]
    found = float(np.exp(differential_evolution(largest, bounds, seed=1, popsize=12, maxiter=60, tol=1e-6).fun))
    report = _report(RESONANT)
    assert report.least_excess < found * (1 + 1e-9)
    assert found < 1.01 * report.least_excess
    assert report.largest_excess < 1.06 * found


def test_is_the_same_every_time() -> None:
    assert bound_residuals(PLANT, _tests(FLAT), order=3) == _report(FLAT, 3)


@pytest.mark.parametrize("order", [1, 2])
def test_covers_a_resonance_that_moved_between_coarse_lines(order: int) -> None:
    """P and P_test part on a peak that no line sees; so does the bound of the lines alone."""
    moved = PlantModel(7.0, PLANT.zero_modes, (Mode(65.1, 0.002),), 8e-3)
    lines = np.arange(10.0, 401.0, 10.0)
    tests = [FrequencyResponse(lines, moved(1j * lines), None, "moved")]
    between = np.concatenate([np.linspace(10.0, 400.0, 5_001), np.linspace(64.0, 66.0, 10_001)])
    blind = bound_residuals(PLANT, tests, order=order)
    report = bound_residuals(PLANT, tests, [moved], order)
    assert blind.between_lines is None
    assert _apart(blind.bound, [moved], between) > 3
    assert _apart(report.bound, [moved], between) < 1
    assert np.all(_ratios(report.bound, tests) >= 1)
    assert report.between_lines is not None
    assert report.at_lines.mean > 1.3 * blind.at_lines.mean
    assert report.touches[0].between_lines
    assert report.touches[0].omega == pytest.approx(65.1, rel=0.01)
    assert report.touches[0].test == "moved"


def test_keeps_lines_and_what_is_between_them_apart() -> None:
    """Fits that are the nominal plant say nothing and change nothing."""
    tests = _tests(FLAT)
    plain, same = _report(FLAT), bound_residuals(PLANT, tests, [PLANT] * 3)
    assert same.between_lines is None
    assert same.bound == plain.bound
    assert same.at_lines == plain.at_lines
    moved = PlantModel(7.0, PLANT.zero_modes, (Mode(65.5, 0.02),), 8e-3)
    report = bound_residuals(PLANT, tests, [moved] * 3)
    omega = np.geomspace(10.0, 400.0, 20_000)
    ratio = np.abs(report.bound(1j * omega)) / np.abs(PLANT(1j * omega) - moved(1j * omega))
    assert report.between_lines is not None
    assert np.max(ratio) > report.between_lines.largest > report.between_lines.mean > 1
    assert report.largest_excess >= report.least_excess


def test_each_test_counts_in_its_own_band_only() -> None:
    """Between lines a fit says nothing about frequencies that its test did not see."""
    far = PlantModel(7.0, PLANT.zero_modes, PLANT.pole_modes, 9e-3)
    low, high = np.geomspace(10.0, 30.0, 40), np.geomspace(100.0, 400.0, 40)
    tests = [_test(FLAT, low, "low"), _test(FLAT, high, "high")]
    report = bound_residuals(PLANT, tests, [far, PLANT])
    assert _apart(report.bound, [far], np.geomspace(10.0, 30.0, 5000)) < 1
    assert report.between_lines is not None
    assert report.between_lines.largest_omega <= 30.0


@settings(max_examples=8, deadline=None, derandomize=True)
@given(seed=st.integers(0, 2**32 - 1), lines=st.integers(12, 40), tests=st.integers(1, 2), order=st.integers(1, 3))
def test_random_residuals_are_covered(seed: int, lines: int, tests: int, order: int) -> None:
    rng = np.random.default_rng(seed)
    models, records = [], []
    for i in range(tests):
        omega = np.sort(rng.uniform(5.0, 5.0 * 10 ** rng.uniform(0.3, 3.0), lines))
        zero, pole = (
            Mode(m.omega * np.exp(0.01 * rng.normal()), m.zeta) for m in (*PLANT.zero_modes, *PLANT.pole_modes)
        )
        models.append(PlantModel(7.0 * np.exp(0.1 * rng.normal()), (zero,), (pole,), 8e-3))
        noise = 10 ** rng.uniform(-6, 0) * (rng.standard_normal(lines) + 1j * rng.standard_normal(lines))
        records.append(FrequencyResponse(omega, models[i](1j * omega) + noise, None, str(i)))
    report = bound_residuals(PLANT, records, models, order)
    assert np.all(_ratios(report.bound, records) >= 1)
    for record, model in zip(records, models, strict=True):
        assert _apart(report.bound, [model], np.linspace(record.omega[0], record.omega[-1], 5_001)) <= 1
    assert 1 <= report.least_excess <= report.largest_excess * (1 + 1e-9)
    assert np.isfinite([report.mean_excess, report.at_lines.mean]).all()


def test_residuals_of_extreme_size_are_covered() -> None:
    for scale in (1e-150, 1e150):
        tests = [_test(AdditiveBound.printed_form(scale, 20.0, 70.0, 0.02), np.geomspace(10.0, 400.0, 50), "extreme")]
        plant = PlantModel(7.0 * scale, PLANT.zero_modes, PLANT.pole_modes, 8e-3)
        tests[0].response[:] += plant(1j * tests[0].omega) - PLANT(1j * tests[0].omega)
        with np.errstate(over="raise"):
            bound = bound_residuals(plant, tests).bound
        assert np.all(_ratios(bound, tests, plant) >= 1)


@pytest.mark.parametrize("order", [0, HIGHEST_ORDER + 1, 2.5])
def test_an_order_that_is_none(order: int) -> None:
    with pytest.raises(InputError, match=r"order of the bound is .*; expected an integer from 1 to 8"):
        bound_residuals(PLANT, _tests(FLAT), order=order)


def test_too_few_lines_for_the_order() -> None:
    tests = [_test(FLAT, np.geomspace(10.0, 400.0, 8))]
    assert bound_residuals(PLANT, tests, order=2).bound.order == 2
    with pytest.raises(InputError, match="have 8 lines; expected 12 or more for a bound of order 3"):
        bound_residuals(PLANT, tests, order=3)


def test_one_fit_for_each_test() -> None:
    with pytest.raises(InputError, match="there are 2 fits; expected one for each of the 3 tests"):
        bound_residuals(PLANT, _tests(FLAT), [PLANT, PLANT])


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_what_is_not_finite_never_passes(value: float) -> None:
    tests = _tests(FLAT)
    tests[1].response[7] = value
    with pytest.raises(InputError, match=f"not finite at {tests[1].omega[7]:.6g} rad/s"):
        bound_residuals(PLANT, tests)


def test_a_bound_that_misses_is_an_error(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "MARGIN", -1e-3)
    with pytest.raises(InputError, match=r"W_a misses a residual by rounding errors \(.*\); expected other units"):
        bound_residuals(PLANT, _tests(FLAT))


def test_nothing_to_bound() -> None:
    omega = np.linspace(1.0, 9.0, 20)
    with pytest.raises(InputError, match="meets every test exactly"):
        bound_residuals(PLANT, [FrequencyResponse(omega, PLANT(1j * omega), None, "exact")])
