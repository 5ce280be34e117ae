"""theta1~ and theta2: identities, f against closed forms and brute force, Popov's line, the two designs' nature."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from design.anti_windup import (
    describe,
    optimal_gamma,
    popov_sector,
    second_order,
    thesis_choice,
    uncertainty_cost,
    washout,
)
from design.block import Block, bound_block, plant_block
from identification.files import InputError
from identification.model import IdentifiedModel
from identification.plant import AdditiveBound

S = 1j * np.geomspace(1e-2, 1e4, 300) + 0.05
positive = st.floats(1e-3, 1e3)


@settings(max_examples=50, deadline=None)
@given(positive, positive, st.floats(-5, 1e4))
def test_one_plus_theta1_is_exact_for_the_printed_form(alpha: float, beta: float, gamma: float) -> None:
    kind = second_order(alpha, beta, gamma)
    np.testing.assert_allclose(kind.one_plus(S), 1 + kind.theta1_tilde(S), rtol=1e-9, atol=1e-9)


@settings(max_examples=50, deadline=None)
@given(positive, positive, st.floats(1e-3, 4.0), positive)
def test_one_plus_theta1_is_exact_for_the_corrected_form(omega: float, corner: float, zeta: float, rate: float) -> None:
    kind = washout(AdditiveBound.printed_form(1.0, corner, omega, zeta), rate)
    np.testing.assert_allclose(kind.one_plus(S), 1 + kind.theta1_tilde(S), rtol=1e-9, atol=1e-9)
    assert complex(kind.theta1_tilde(0j)) == pytest.approx(-1.0, abs=1e-12)
    assert kind.theta1_tilde.relative_degree >= 1
    assert kind.theta1_tilde.is_stable


def test_theta2_is_the_plant_times_one_plus_theta1(implied: IdentifiedModel) -> None:
    for kind in (second_order(0.05, 0.025, 97.0), washout(implied.additive_bound, 4.0)):
        expected = implied.plant(S) * (1 + kind.theta1_tilde(S))
        np.testing.assert_allclose(kind.theta2(implied.plant)(S), expected, rtol=1e-9)


def test_the_printed_form_keeps_the_integrator_and_the_corrected_one_does_not(implied: IdentifiedModel) -> None:
    printed, corrected = second_order(0.05, 0.025, 97.0), washout(implied.additive_bound, 4.0)
    assert 0j in printed.theta2(implied.plant).poles
    assert 0j not in corrected.theta2(implied.plant).poles
    assert not describe(implied, printed).theta2_stable
    assert describe(implied, corrected).theta2_stable
    # gamma = -1 is the printed form's only way out
    assert describe(implied, second_order(0.2, 0.2, -1.0)).theta2_stable


def test_f_of_no_compensation_is_the_peak_of_a_second_order_bound() -> None:
    # |W_a| with its zero far away: gain/(2 zeta sqrt(1 - zeta^2)) at omega sqrt(1 - 2 zeta^2)
    bound = AdditiveBound.printed_form(0.3, 1e9, 50.0, 0.02)
    value, omega = uncertainty_cost(bound, Block(1.0))
    assert value == pytest.approx(0.3 / (2 * 0.02 * np.sqrt(1 - 0.02**2)), rel=1e-6)
    assert omega == pytest.approx(50.0 * np.sqrt(1 - 2 * 0.02**2), rel=1e-4)


@pytest.mark.parametrize("beta", [0.1, 0.05, 0.025, 0.0125])
def test_optimal_gamma_beats_brute_force(implied: IdentifiedModel, beta: float) -> None:
    bound = implied.additive_bound
    gamma, cost = optimal_gamma(bound, 0.05, beta)
    omega = np.concatenate([np.geomspace(1, 1e5, 4000), np.linspace(270, 290, 8001)])
    W_a = bound_block(bound)(1j * omega)
    for other in np.linspace(0.2 * gamma, 2 * gamma, 41):
        theta = second_order(0.05, beta, other).theta1_tilde(1j * omega)
        assert np.abs(W_a * (1 + theta)).max() >= cost * (1 - 1e-6)


def test_thesis_choice_scales_with_the_bound(implied: IdentifiedModel) -> None:
    # time in other units: alpha and beta scale, gamma and f do not
    bound = implied.additive_bound
    slow = AdditiveBound.printed_form(bound.gain, bound.corner / 7, bound.resonance.omega / 7, bound.resonance.zeta)
    alpha, beta, gamma = thesis_choice(bound)
    np.testing.assert_allclose(thesis_choice(slow), (7 * alpha, 7 * beta, gamma), rtol=1e-5)


def test_popov_sector_of_known_functions() -> None:
    # Re(1/(1 + alpha s)(1 + beta s)) with the multiplier alpha leaves 1/(1 + beta s), positive: every sector
    assert popov_sector(second_order(0.05, 0.025, 97.0).theta1_tilde)[0] == float("inf")
    # negative gamma: the line passes through gamma at omega = 0, so that k = 1/|gamma|
    assert popov_sector(second_order(0.2, 0.2, -0.5).theta1_tilde)[0] == pytest.approx(2.0, rel=1e-6)
    assert popov_sector(second_order(0.2, 0.2, -1.0).theta1_tilde)[0] == pytest.approx(1.0, rel=1e-6)


def test_the_corrected_one_is_far_better_on_the_thesis_own_cost(implied: IdentifiedModel) -> None:
    bound = implied.additive_bound
    printed = uncertainty_cost(bound, second_order(*thesis_choice(bound)).one_plus)[0]
    corrected = uncertainty_cost(bound, washout(bound, 4.0).one_plus)[0]
    assert corrected < printed / 10


@pytest.mark.parametrize("numbers", [(0.0, 1.0, 1.0), (1.0, -1.0, 1.0), (1.0, 1.0, float("nan"))])
def test_bad_parameters_are_refused(numbers: tuple[float, float, float]) -> None:
    with pytest.raises(InputError, match="expected alpha > 0"):
        second_order(*numbers)


def test_bad_rate_is_refused(implied: IdentifiedModel) -> None:
    with pytest.raises(InputError, match="recovery rate"):
        washout(implied.additive_bound, 0.0)


def test_plant_block_keeps_the_dead_time(implied: IdentifiedModel) -> None:
    assert plant_block(implied.plant).delay_s == implied.plant.delay_s
    assert second_order(1.0, 1.0, 1.0).theta2(implied.plant).delay_s == implied.plant.delay_s
