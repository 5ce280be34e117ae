"""W_a where nothing was measured: no needle beside the lines, what it is there, and levels that a user gives."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from flint import fmpq, fmpq_poly
from numpy.typing import NDArray

from identification.base.errors import InputError
from identification.bound.bound_residuals import bound_residuals
from identification.bound.envelope import envelope_of
from identification.bound.shape import Shape
from identification.model.additive_bound import AdditiveBound
from identification.model.modes import Mode
from identification.model.plant import PlantModel
from identification.model.reports import BoundReport
from identification.output.fit_facts import bound_remarks
from identification.sweeps.response import FrequencyResponse

Real = NDArray[np.float64]

PLANT = PlantModel(7.0, (Mode(40.0, 0.01),), (Mode(65.0, 0.02),), 8e-3)


def measured(omega: Real, residual: Real, plant: PlantModel = PLANT) -> FrequencyResponse:
    """A test whose residual has these lengths and phases that turn."""
    return FrequencyResponse(omega, plant(1j * omega) + residual * np.exp(9j * np.arange(omega.size)), None, "made up")


def random_residuals(rng: np.random.Generator, order: int) -> tuple[Real, Real]:
    """Lines and residuals: a slope, over eight decades, half of them zero, one far above, or a mode about an edge."""
    count = int(rng.integers(4 * order, 60))
    omega = 10 * np.sort(10 ** rng.uniform(0, rng.uniform(0.3, 3), count))
    kinds = [
        (omega / omega[0]) ** rng.uniform(-3, 3),
        10 ** rng.uniform(-8, 0, count),
        np.where(rng.uniform(size=count) < 0.5, 0.0, rng.uniform(0, 1, count)),
        np.where(np.arange(count) == rng.integers(count), 1e6, 1.0),
    ]
    for edge in (omega[0] * rng.uniform(0.7, 1.1), omega[-1] * rng.uniform(0.9, 1.4)):
        kinds.append(rng.uniform(0.3, 1, count) / np.abs(Mode(edge, 10 ** rng.uniform(-3, -1))(1j * omega)))
    residual = kinds[rng.integers(len(kinds))]
    return omega, np.where(residual.any(), residual, 1.0)


def extrema(bound: AdditiveBound) -> Real:
    """Where |W_a| is largest or smallest nearby, from the exact roots of the derivative of |W_a|^2 in omega^2."""

    def square(modes: tuple[Mode, ...], rates: tuple[float, ...]) -> fmpq_poly:
        product = fmpq_poly([1])
        for mode in modes:
            x, loss = (fmpq(*number.as_integer_ratio()) ** 2 for number in (mode.omega, mode.zeta))
            product *= fmpq_poly([1, (4 * loss - 2) / x, 1 / x**2])
        for rate in rates:
            product *= fmpq_poly([1, 1 / fmpq(*rate.as_integer_ratio()) ** 2])
        return product

    top, bottom = square(bound.zero_modes, bound.real_zeros), square(bound.pole_modes, bound.real_poles)
    slope = top.derivative() * bottom - top * bottom.derivative()
    roots = [] if slope.degree() < 1 else [root for root, _ in slope.numer().complex_roots()]
    real = [float(root.real.mid()) for root in roots if root.imag.contains(0)]
    return np.sqrt([root for root in real if root > 0])


@pytest.mark.parametrize("seed", range(8))
def test_nowhere_is_it_above_the_envelope_and_its_continuation_by_more_than_it_says(seed: int) -> None:
    """At its own extrema and on a dense grid, in the band and 1000 times beyond; and no extremum above the band."""
    order = 1 + seed % 4
    omega, residual = random_residuals(np.random.default_rng(seed), order)
    test = measured(omega, residual)
    report = bound_residuals(PLANT, [test], order=order)
    found = np.abs(PLANT(1j * omega) - test.response)
    assert np.all(np.abs(report.bound(1j * omega)) >= found)
    low, high = omega[0], omega[-1]
    at = np.concatenate([np.geomspace(low / 1e3, high * 1e3, 4000), extrema(report.bound)])
    level = envelope_of(omega, found)(np.clip(at, low, high)) * np.maximum(1.0, np.maximum(low / at, at / high))
    assert np.max(np.abs(report.bound(1j * at)) / level) < (1 + 2e-3) * report.largest_excess
    for mode in (*report.bound.zero_modes, *report.bound.pole_modes):
        near = min(1.0, mode.omega / low, high / mode.omega)
        assert mode.zeta**2 + near**2 > 1 - 1e-6


def test_a_resonance_that_the_lines_see_the_flank_of() -> None:
    """Residuals that rise towards a lowest line, at 34 rad/s of several tests: no peak of W_a below it."""
    omega = np.linspace(34.0, 120.0, 30)
    rng = np.random.default_rng(2)
    for steep in (2.0, 3.0, 4.0):
        tests = [measured(omega, rng.uniform(0.2, 1.0, 30) * (34.0 / omega) ** steep) for _ in range(5)]
        bound = bound_residuals(PLANT, tests).bound
        below = np.geomspace(3.4, 34.0, 2000)
        assert np.max(np.abs(bound(1j * below)) * below / 34.0) < 1.3 * np.abs(bound(34.0j))


@pytest.mark.parametrize("order", [3, 4])
def test_no_notch_slips_between_sparse_lines(order: int) -> None:
    """Residuals of one size at 20 lines: W_a is nowhere far below them."""
    omega = np.geomspace(10.0, 400.0, 20)
    rng = np.random.default_rng(order)
    residual = rng.uniform(0.5, 1.0, 20)
    bound = bound_residuals(PLANT, [measured(omega, residual)], order=order).bound
    between = np.append(np.geomspace(10.0, 400.0, 4000), [at for at in extrema(bound) if 10 < at < 400])
    assert np.abs(bound(1j * between)).min() > 0.999 * residual.min()


@pytest.mark.parametrize("slope", [-1.0, 1.0, -2.0])
def test_no_root_is_far_from_the_lines_without_need(slope: float) -> None:
    """A slope that a root at the edge follows nearly: within a factor 6 of the lines, and what that costs is little."""
    omega = np.geomspace(10.0, 100.0, 60)
    report = bound_residuals(PLANT, [measured(omega, omega**slope)])
    bound = report.bound
    rates = [-root.real for mode in bound.pole_modes for root in mode.roots if not root.imag] + [*bound.real_zeros]
    assert all(10.0 / 6 < rate < 600.0 for rate in rates)
    assert report.largest_excess < 1.1 * report.least_excess


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("levels", [(0.5, None), (None, 0.5), (0.03, 4.0)], ids=str)
def test_levels_given_are_covered(levels: tuple[float | None, float | None], order: int) -> None:
    """From 0 to the lowest line and from the highest to ten times it; the residuals stay covered."""
    omega = np.geomspace(10.0, 100.0, 60)
    test = measured(omega, np.full(60, 0.1))
    below, above = levels
    report = bound_residuals(PLANT, [test], order=order, below=below, above=above)
    magnitude = np.abs(report.bound(1j * np.append(0.0, np.geomspace(1e-3, 10.0, 3001))))
    assert magnitude.min() > (1 - 1e-4) * (below or 0.0)
    assert report.bound.gain >= (below or 0.0)
    assert np.abs(report.bound(1j * np.geomspace(100.0, 1000.0, 3001))).min() > (1 - 1e-4) * (above or 0.0)
    assert np.all(np.abs(report.bound(1j * omega)) >= np.abs(PLANT(1j * omega) - test.response))
    assert report.least_excess <= report.largest_excess
    assert report.largest_excess < 2 * report.least_excess


def test_levels_that_hold_anyway_change_nothing_measured() -> None:
    omega = np.geomspace(10.0, 100.0, 60)
    test = measured(omega, 0.1 * omega**-0.5)
    plain = bound_residuals(PLANT, [test])
    given = bound_residuals(PLANT, [test], below=1e-6, above=1e-9)
    assert given.mean_excess == pytest.approx(plain.mean_excess, rel=1e-2)
    assert given.bound.gain == pytest.approx(plain.bound.gain, rel=0.05)


@pytest.mark.parametrize("level", [0.0, -1.0, np.nan, np.inf, "0.1"])
def test_a_level_that_is_none(level: float) -> None:
    omega = np.geomspace(10.0, 100.0, 20)
    for side in ("below", "above"):
        with pytest.raises(InputError, match=f"the level {side} the lines is .*; expected a positive number"):
            bound_residuals(PLANT, [measured(omega, np.ones(20))], **{side: level})  # type: ignore[arg-type]


def test_what_it_is_outside_is_said_and_kept() -> None:
    omega = np.geomspace(10.0, 100.0, 60)
    test = measured(omega, 0.1 * omega**-0.5)
    for levels in ((None, None), (0.7, 0.2)):
        report = bound_residuals(PLANT, [test], below=levels[0], above=levels[1])
        outside = report.outside
        assert outside is not None
        assert (outside.low, outside.high, outside.below, outside.above) == (omega[0], omega[-1], *levels)
        assert outside.at_zero == report.bound.gain
        magnitude = np.abs(report.bound(1j * np.geomspace(1e-3, 10.0, 2000)))
        assert outside.most_below == pytest.approx(max(magnitude.max(), report.bound.gain), rel=1e-4)
        magnitude = np.abs(report.bound(1j * np.geomspace(100.0, 1e6, 2000)))
        assert outside.most_above == pytest.approx(magnitude.max(), rel=1e-4)
        assert outside.falling == pytest.approx(1e9 * np.abs(report.bound(1e9j)), rel=1e-6)
        said = bound_remarks(report)[-1]
        assert said.startswith("nothing was measured below 10 rad/s, where |W_a| ")
        assert said.count("is an assumption") == levels.count(None)
        assert ("covers the level of 0.7 given" in said) == (levels[0] is not None)
        kept = json.loads(json.dumps(report.to_dict()))
        assert kept["outside"]["said"] == said
        assert BoundReport.from_dict(kept, report.bound) == report
        del kept["outside"]
        assert BoundReport.from_dict(kept, report.bound) == replace(report, outside=None)


@pytest.mark.parametrize("order", [1, 2, 4, 8])
def test_residuals_of_every_kind_are_covered(order: int) -> None:
    """Few lines, single residuals, exact zeros at an edge, one line a million times the rest, rounding alone."""
    omega = np.geomspace(10.0, 100.0, 4 * order)
    one = np.where(np.arange(omega.size) == 2, 1.0, 0.0)
    kinds = [one, 1 - one, np.where(omega > 50.0, 1.0, 0.0), 1e-16 * np.abs(PLANT(1j * omega)), 1 + 1e6 * one]
    for residual in kinds[: 6 - order // 2]:
        test = measured(omega, residual)
        report = bound_residuals(PLANT, [test], order=order)
        assert np.all(np.abs(report.bound(1j * omega)) >= np.abs(PLANT(1j * omega) - test.response))
        assert np.isfinite([report.largest_excess, report.mean_excess, report.least_excess]).all()


def in_units(plant: PlantModel, gain: float, time: float) -> PlantModel:
    """The plant where a second is 1/time of the new unit and the output counts ``gain`` times."""
    zeros, poles = (
        tuple(Mode(mode.omega * time, mode.zeta) for mode in modes) for modes in (plant.zero_modes, plant.pole_modes)
    )
    return PlantModel(plant.gain * gain * time, zeros, poles, plant.delay_s / time)


@pytest.mark.parametrize("order", [1, 2, 3])
def test_units_change_nothing(order: int) -> None:
    """Bit for bit where they are powers of two, over 30 decades; otherwise to 1e-9."""
    rng = np.random.default_rng(order)
    fit = PlantModel(7.1, (Mode(40.4, 0.012),), (Mode(64.5, 0.02),), 8.1e-3)
    omega = np.sort(10 * 10 ** rng.uniform(0, 1.5, 40))
    test = measured(omega, 0.02 * np.abs(PLANT(1j * omega)) * rng.uniform(0, 1, 40), fit)
    usual = bound_residuals(PLANT, [test], [fit], order)
    around = np.geomspace(1.0, 4000.0, 200)
    for gain, time in ((2.0**100, 2.0**-100), (2.0**-99, 2.0**51), (1e30, 1e-30)):
        scaled = replace(test, omega=test.omega * time, response=test.response * gain)
        found = bound_residuals(in_units(PLANT, gain, time), [scaled], [in_units(fit, gain, time)], order)
        exact = np.log2(gain).is_integer()
        np.testing.assert_allclose(
            np.abs(found.bound(1j * around * time)) / gain,
            np.abs(usual.bound(1j * around)),
            rtol=0 if exact else 1e-9,
        )
        assert found.least_excess == pytest.approx(usual.least_excess, rel=0 if exact else 1e-9, abs=0)


@pytest.mark.parametrize("order", range(2, 9))
def test_slopes_of_what_keeps_modes_damped_and_roots_near(order: int) -> None:
    shape = Shape(order, 1.0, 10.0)
    theta = np.append(0.0, np.random.default_rng(order).uniform(*shape.bounds[1:].T))
    steps = 1e-6 * np.eye(theta.size)
    damping = [(shape.damping(theta + step)[0] - shape.damping(theta - step)[0]) / 2e-6 for step in steps]
    np.testing.assert_allclose(shape.damping(theta)[1], np.transpose(damping), rtol=1e-5, atol=1e-6)
    distance = [(shape.distance(theta + step)[0] - shape.distance(theta - step)[0]) / 2e-6 for step in steps]
    np.testing.assert_allclose(shape.distance(theta)[1], distance, rtol=1e-5, atol=1e-6)
    assert np.all(shape.damping(shape.damped(theta))[0] > -1e-12)
    np.testing.assert_array_equal(shape.damped(shape.damped(theta)), shape.damped(theta))
