"""What bounds are made of: the envelope, the linear programs, and the numbers of W_a from roots."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from identification.bound.envelope import envelope_of
from identification.bound.least_excess import least_largest_excess
from identification.bound.level_certificate import excludes
from identification.bound.shape import Shape
from identification.bound.tightest_bound import resonances
from identification.model.additive_bound import AdditiveBound
from identification.model.modes import Mode

Real = NDArray[np.float64]

BAND = np.geomspace(1.0, 10.0, 80)


@pytest.mark.parametrize("slope", [-2.0, 1.0])
def test_one_pole_against_a_slope_it_cannot_follow(slope: float) -> None:
    """|W_a| falls like 1/omega at most and never rises: over omega^slope it gains a factor 10 on a decade."""
    level = BAND**slope
    assert least_largest_excess(BAND, level, level, 1).proved == pytest.approx(10.0, rel=3e-3)


@pytest.mark.parametrize(("slope", "order"), [(0.0, 1), (-1.0, 1), (-2.0, 2), (1.0, 2), (-3.0, 3), (2.0, 3)])
def test_slopes_that_an_order_can_follow(slope: float, order: int) -> None:
    level = BAND**slope
    assert least_largest_excess(BAND, level, level, order).proved == pytest.approx(1.0, abs=3e-3)


def test_one_pole_at_three_points() -> None:
    """|W_a|^2 = a/(1 + b x) over residuals 1 at x = 1, 4 and 9: straight in 1/|W_a|^2.

    Covering at 4, the excess at 1 and 9 is equal where 1/|W_a|^2 is constant; where only the first is covered and
    the others are free, the line through two of them is met.
    """
    omega = np.array([1.0, 2.0, 3.0])
    envelope = np.array([1.0, 0.4, 0.5])
    # 1/|W_a|^2 = p + q x is at most (1, 6.25, 4) and least below these: q = 3/8, p = 5/8 touches 1 and 9
    assert least_largest_excess(omega, envelope, envelope, 1).proved == pytest.approx(
        np.sqrt(6.25 / (5 / 8 + 4 * 3 / 8)), rel=3e-3
    )


@pytest.mark.parametrize("share", [1e-9, -1e-9])
def test_multipliers_prove_what_holds_and_no_more(share: float) -> None:
    """The three points above: T = 50/17 is the least square, by multipliers 5/17 and 12/17 of x = 1 and 9."""
    omega, level = np.array([1.0, 2.0, 3.0]), np.array([1.0, 0.4, 0.5])
    allowed = np.sqrt(50 / 17) * (1 - share) * level
    rng = np.random.default_rng(1)
    lower, upper = np.array([5 / 17, 0.0, 12 / 17]), np.array([0.0, 1 + 1e-11, 0.0])
    found = [excludes(omega, level, allowed, lower, upper, 1)]
    for _ in range(200):
        size = 10 ** rng.uniform(-13, 0)
        found.append(
            excludes(omega, level, allowed, *(np.abs(part + size * rng.normal(size=3)) for part in (lower, upper)), 1)
        )
    assert found[0] == (share > 0)
    assert any(found) == (share > 0)


def test_a_positive_sum_for_constants_alone_proves_nothing() -> None:
    """|W_a|^2 = 8/(5 + 3 x) is 1 at x = 1 and 1/4 at 9; the multipliers 1 and 2 exclude a constant D only."""
    omega, level = np.array([1.0, 3.0]), np.array([1.0, 0.5])
    assert not excludes(omega, level, level * [2.0, 1.0], np.array([1.0, 0.0]), np.array([0.0, 2.0]), 1)


def test_levels_that_an_order_keeps_without_touching_the_envelope() -> None:
    """A residual of half the envelope everywhere: a W_a of excess 1/2 exists, so 1 is no limit."""
    level = np.ones(BAND.size)
    assert least_largest_excess(BAND, level / 2, level, 2).proved <= 0.5


@pytest.mark.parametrize("seed", range(24))
def test_no_bound_that_exists_is_excluded(seed: int) -> None:
    """A random W_a that covers random residuals: what is proved is not above its own largest excess."""
    rng = np.random.default_rng(seed)
    order = 1 + seed % 8
    omega = np.sort(10.0 ** (rng.uniform(0, rng.uniform(0.5, 4), rng.integers(5, 80)) + rng.integers(-3, 4)))
    shape = Shape(order, float(omega[0]), float(omega[-1]))
    magnitude = np.exp(shape.log(np.append(rng.normal(), rng.uniform(*shape.bounds[1:].T)), omega))
    residual = magnitude * rng.uniform(rng.uniform(0, 1), 1, omega.size)
    envelope = envelope_of(omega, residual)(omega)
    assert least_largest_excess(omega, residual, envelope, order).proved <= np.max(magnitude / envelope) * (1 + 1e-12)


@pytest.mark.parametrize("seed", range(20))
def test_one_pole_by_a_search_over_its_corner(seed: int) -> None:
    rng = np.random.default_rng(seed)
    omega = np.sort(10.0 ** rng.uniform(0, rng.uniform(0.5, 3), rng.integers(4, 100)))
    residual = rng.uniform(0.01, 1, omega.size) * omega ** rng.uniform(-2, 1)
    envelope = envelope_of(omega, residual)(omega)
    corners = np.geomspace(omega[0] / 1e4, omega[-1] * 1e4, 20_001)
    log = -np.log1p((omega / corners[:, None]) ** 2) / 2
    least = np.exp(np.min(np.max(np.log(residual) - log, axis=1) + np.max(log - np.log(envelope), axis=1)))
    assert 0.99 * least < least_largest_excess(omega, residual, envelope, 1).proved < least * (1 + 1e-12)


@pytest.mark.parametrize("seed", range(5))
def test_the_envelope_is_not_rounded_where_it_is_given(seed: int) -> None:
    rng = np.random.default_rng(seed)
    omega, residual = np.sort(rng.uniform(1.0, 1e3, 300)), rng.uniform(0.0, 1.0, 300)
    envelope = envelope_of(omega, residual)
    np.testing.assert_array_equal(envelope(envelope.omega), envelope.level)
    np.testing.assert_allclose(
        envelope(omega), np.exp(np.interp(np.log(omega), np.log(envelope.omega), np.log(envelope.level))), rtol=1e-13
    )


def test_the_roots_are_those_of_the_bound_behind() -> None:
    behind = AdditiveBound(0.3, (Mode(2.0, 0.2),), (Mode(4.0, 0.05),), (), (30.0,))
    level = np.abs(behind(1j * BAND))
    found = least_largest_excess(BAND, level, level, 3)
    shape = Shape(3, 1.0, 10.0)
    theta = shape.parameters(found.zeros, found.poles)
    bound = shape.bound(theta)
    assert bound.zero_modes[0].omega == pytest.approx(2.0, rel=1e-2)
    assert bound.zero_modes[0].zeta == pytest.approx(0.2, rel=1e-2)
    assert bound.pole_modes[0].omega == pytest.approx(4.0, rel=1e-2)
    assert bound.pole_modes[0].zeta == pytest.approx(0.05, rel=1e-2)
    assert bound.real_poles[0] == pytest.approx(30.0, rel=5e-2)


@pytest.mark.parametrize("order", range(1, 9))
def test_logarithm_and_slope_are_those_of_the_bound(order: int) -> None:
    shape = Shape(order, 1.0, 10.0)
    rng = np.random.default_rng(order)
    theta = np.append(rng.normal(), rng.uniform(*shape.bounds[1:].T))
    bound = shape.bound(theta)
    assert bound.order == order
    assert 2 * len(bound.zero_modes) + len(bound.real_zeros) == order - 1
    np.testing.assert_allclose(shape.log(theta, BAND), np.log(np.abs(bound(1j * BAND))), rtol=0, atol=1e-10)
    for i, slope in enumerate(shape.slope(theta, BAND).T):
        step = np.eye(theta.size)[i] * 1e-6
        numeric = (shape.log(theta + step, BAND) - shape.log(theta - step, BAND)) / 2e-6
        np.testing.assert_allclose(slope, numeric, rtol=1e-5, atol=1e-6)


@pytest.mark.parametrize(
    ("poles", "mode"),
    [
        ([-4.0, -9.0], Mode(np.sqrt(6.0), 5 / (2 * np.sqrt(6.0)))),
        ([3.0 + 4.0j, 3.0 - 4.0j], Mode(np.sqrt(5.0), np.sqrt(0.2))),
        ([4.0, 4.41], Mode(np.sqrt(4.2), 1e-3)),
        ([1e30, -4.0], Mode(np.sqrt(200.0), 102 / (2 * np.sqrt(200.0)))),
    ],
    ids=["real", "pair", "on the axis", "at infinity"],
)
def test_roots_become_modes_of_the_left_half_plane(poles: list[complex], mode: Mode) -> None:
    shape = Shape(2, 1.0, 10.0)
    found = shape.bound(shape.parameters(np.array([-25.0 + 0j]), np.array(poles, dtype=complex)))
    assert found.real_zeros == pytest.approx((5.0,))
    assert (found.pole_modes[0].omega, found.pole_modes[0].zeta) == pytest.approx((mode.omega, mode.zeta))


def test_peaks_stay_and_narrow_notches_are_filled() -> None:
    omega = np.geomspace(1.0, 1000.0, 2000)
    level = omega**-0.5 * (1 + 5 / (1 + (np.log(omega / 30.0) / 0.01) ** 2))
    narrow, wide = np.abs(np.log(omega / 5.0)) < 0.04, np.abs(np.log(omega / 200.0)) < 0.3
    residual = level * np.where(narrow, 1e-3, 1.0) * np.where(wide, 1e-2, 1.0)
    envelope = envelope_of(omega, residual)
    assert np.all(envelope.level >= residual)
    outside = ~narrow & ~wide & (np.abs(np.log(omega / 30.0)) < 0.3)
    np.testing.assert_allclose(envelope.level[outside], residual[outside], rtol=0.02)
    np.testing.assert_allclose(envelope.level[narrow], level[narrow], rtol=0.05)
    assert envelope(np.array([200.0]))[0] == pytest.approx(1e-2 * 200.0**-0.5, rel=0.2)


def test_the_envelope_is_the_same_seen_from_the_other_end() -> None:
    rng = np.random.default_rng(3)
    omega, residual = np.sort(rng.uniform(1.0, 50.0, 60)), rng.uniform(0.0, 1.0, 60)
    forth, back = envelope_of(omega, residual), envelope_of(1 / omega, residual)
    np.testing.assert_allclose(forth.level, back.level[::-1])


def test_single_small_residuals_of_sparse_tests_are_filled() -> None:
    omega = np.geomspace(1.0, 100.0, 8)
    residual = np.array([3.0, 1e-4, 2.0, 2.5, 1e-5, 2.2, 2.1, 1e-3])
    np.testing.assert_allclose(envelope_of(omega, residual).level, [3.0, 2.5, 2.5, 2.5, 2.2, 2.2, 2.2, 2.2], rtol=1e-12)


def test_tests_on_different_lines_share_one_envelope() -> None:
    """Order and repetition do not matter, and a second test at the same lines can only raise it."""
    rng = np.random.default_rng(4)
    omega, residual = rng.uniform(1.0, 50.0, 200), rng.uniform(0.0, 1.0, 200)
    one = envelope_of(omega, residual)
    turned = envelope_of(omega[::-1], residual[::-1])
    np.testing.assert_array_equal(one.level, turned.level)
    both = envelope_of(np.tile(omega, 2), np.concatenate([residual, 3.0 + 0 * residual]))
    np.testing.assert_allclose(both.level, 3.0)


def test_the_envelope_says_nothing_outside_its_band() -> None:
    np.testing.assert_array_equal(
        envelope_of(BAND, np.ones(80))(np.array([0.9, 1.0, 5.0, 10.0, 11.0])), [0, 1, 1, 1, 0]
    )


@pytest.mark.parametrize("ratio", [1.0, 1.0005, 1.002, 1.01])
def test_no_peak_hides_between_the_frequencies_around_the_modes(ratio: float) -> None:
    """Two resonances of half-width 0.1 % that differ by the ratio."""
    mode, moved = Mode(65.0, 1e-3), Mode(65.0 * ratio, 1.1e-3)

    def apart(omega: Real) -> Real:
        return np.abs(1 / mode(1j * omega) - 1 / moved(1j * omega))

    omega = resonances(*(AdditiveBound(1.0, (), (each,)) for each in (mode, moved)))
    assert np.max(apart(np.linspace(64.0, 67.0, 400_001))) < (1 + 2e-4) * np.max(apart(omega))
