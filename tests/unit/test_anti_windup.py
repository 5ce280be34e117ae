"""theta1~ and theta2: identities, f against closed forms and brute force, Popov's line, the two designs' nature."""

from __future__ import annotations

import json

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from design.anti_windup.compensator import AntiWindup, anti_windup, from_one_plus, second_order, uncertainty_cost
from design.anti_windup.condition import Sector
from design.anti_windup.corrected_compensator import Corrected, corrected
from design.anti_windup.judge import Compensator, compensators, judge, lasting_offset, robust_sector
from design.anti_windup.popov import popov_sector, robust_popov_sector
from design.anti_windup.thesis_compensator import least_f, optimal_gamma, thesis_choice
from design.blocks.block import Block, bound_block, plant_block
from identification.base.errors import InputError
from identification.model.additive_bound import AdditiveBound
from identification.model.model_file import IdentifiedModel
from identification.model.modes import Mode
from identification.model.plant import PlantModel

S = 1j * np.geomspace(1e-2, 1e4, 300) + 0.05
positive = st.floats(1e-3, 1e3)


@settings(max_examples=50, deadline=None)
@given(positive, positive, st.floats(-5, 1e4))
def test_one_plus_theta1_is_exact_for_the_printed_form(alpha: float, beta: float, gamma: float) -> None:
    kind = second_order(alpha, beta, gamma)
    np.testing.assert_allclose(kind.one_plus(S), 1 + kind.theta1_tilde(S), rtol=1e-9, atol=1e-9)


@settings(max_examples=50, deadline=None)
@given(
    st.lists(st.floats(-100.0, -0.1), min_size=1, max_size=5),
    st.lists(st.floats(-50.0, 50.0), max_size=4),
    st.floats(-20.0, 20.0).filter(lambda gain: abs(gain) > 1e-3),
)
def test_one_plus_theta1_of_any_order(poles: list[float], zeros: list[float], gain: float) -> None:
    theta = Block(gain, tuple(map(complex, zeros[: len(poles) - 1])), tuple(map(complex, poles)))
    kind = anti_windup(theta)
    np.testing.assert_allclose(kind.one_plus(S), 1 + theta(S), rtol=1e-6, atol=1e-6)
    again = from_one_plus(kind.one_plus)
    np.testing.assert_allclose(again.theta1_tilde(S), theta(S), rtol=1e-4, atol=1e-6)


def test_the_general_form_agrees_with_the_printed_one_and_puts_its_zero_at_the_origin() -> None:
    for numbers in ((0.05, 0.025, 97.0), (0.2, 0.1, -1.0)):
        printed = second_order(*numbers)
        general = anti_windup(printed.theta1_tilde)
        np.testing.assert_allclose(np.sort_complex(general.one_plus.zeros), np.sort_complex(printed.one_plus.zeros))
    assert 0j in general.one_plus.zeros
    # two zeros at s = 0, for two integrators
    one_plus = Block(1.0, (0j, 0j), (-2 + 0j, -3 + 0j))
    assert anti_windup(from_one_plus(one_plus).theta1_tilde).one_plus.zeros == (0j, 0j)


@pytest.mark.parametrize(
    "theta",
    [Block(1.0), Block(1.0, (1 + 0j,), (-1 + 0j,)), Block(1.0, (), (1 + 0j,)), Block(1.0, (), (-1 + 0j,), 0.1)],
    ids=["constant", "biproper", "unstable", "delayed"],
)
def test_theta1_outside_its_class_is_refused(theta: Block) -> None:
    with pytest.raises(InputError, match="strictly proper and stable"):
        anti_windup(theta)


def test_a_file_with_another_one_plus_is_refused() -> None:
    content = second_order(0.1, 0.2, 3.0).to_dict()
    assert AntiWindup.from_dict(content) == second_order(0.1, 0.2, 3.0)
    content["one_plus"] = second_order(0.1, 0.2, 3.1).one_plus.to_dict()
    with pytest.raises(InputError, match="is not 1 \\+ theta1_tilde"):
        AntiWindup.from_dict(content)


def test_theta2_is_the_plant_times_one_plus_theta1(implied: IdentifiedModel, best: Corrected) -> None:
    for kind in (second_order(0.05, 0.025, 97.0), best.anti_windup):
        expected = implied.plant(S) * (1 + kind.theta1_tilde(S))
        np.testing.assert_allclose(kind.theta2(implied.plant)(S), expected, rtol=1e-9)


def test_the_printed_form_keeps_the_integrator_and_the_corrected_one_does_not(
    implied: IdentifiedModel, best: Corrected
) -> None:
    printed = second_order(0.05, 0.025, 97.0)
    assert 0j in printed.theta2(implied.plant).poles
    assert 0j not in best.anti_windup.theta2(implied.plant).poles
    assert not judge(implied.plant, implied.additive_bound, printed).theta2_stable
    assert judge(implied.plant, implied.additive_bound, best.anti_windup).theta2_stable
    # gamma = -1 is the printed form's only way out
    assert judge(implied.plant, implied.additive_bound, second_order(0.2, 0.2, -1.0)).theta2_stable


def test_the_lasting_offset_is_the_final_value(implied: IdentifiedModel, best: Corrected) -> None:
    assert lasting_offset(implied.plant, second_order(0.05, 0.025, 97.0)) == pytest.approx(98 * 7.105, rel=1e-9)
    assert lasting_offset(implied.plant, best.anti_windup) == 0.0
    double = PlantModel(3.0, (), (), 0.0, integrators=2)
    assert lasting_offset(double, second_order(0.05, 0.025, 97.0)) is None
    # one zero at s = 0 leaves one integrator: 3 lim (1 + theta1~)/s = 3 (alpha + beta)
    assert lasting_offset(double, second_order(0.2, 0.1, -1.0)) == pytest.approx(0.9, rel=1e-12)


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
    for other in np.linspace(0.2 * gamma, 2 * gamma, 21):
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


def test_the_least_f_of_the_printed_form_is_a_matter_of_bandwidth(implied: IdentifiedModel) -> None:
    """Its infimum is 0: theta1~ -> -1 wherever W_a is not small. Below a bandwidth there is an optimum, not 1/40."""
    bound = implied.additive_bound
    alpha, beta, gamma, f = least_f(bound, 960.0)
    assert f == pytest.approx(1.36804, abs=1e-5)
    assert alpha == pytest.approx(beta, rel=1e-3)
    assert f < 0.85 * uncertainty_cost(bound, second_order(*thesis_choice(bound)).one_plus)[0]
    rng = np.random.default_rng(1)
    for _ in range(60):  # no neighbour and no random set within the bandwidth is better
        near = np.array([alpha, beta, gamma]) * np.exp(0.1 * rng.standard_normal(3))
        far = (*np.exp(rng.uniform(np.log(1 / 960), 1.0, 2)), np.exp(rng.uniform(-3, 6)) - 1)
        for numbers in (near, far):
            if min(numbers[:2]) >= 1 / 960:
                assert uncertainty_cost(bound, second_order(*map(float, numbers)).one_plus)[0] >= f * (1 - 1e-7)
    for fast in (1e-4, 1e-5, 1e-6):
        assert uncertainty_cost(bound, second_order(fast, fast, -1.0).one_plus)[0] < 5e3 * fast


# the corrected class


@pytest.fixture(scope="module")
def best(implied: IdentifiedModel) -> Corrected:
    return corrected((0j,), implied.additive_bound, 1.0, Sector(0.95), 960.0)


def test_the_corrected_one_keeps_what_it_states(implied: IdentifiedModel, best: Corrected) -> None:
    kind = best.anti_windup
    assert kind.one_plus.zeros.count(0j) == 1
    assert complex(kind.theta1_tilde(0j)) == pytest.approx(-1.0, abs=1e-9)
    assert kind.theta1_tilde.relative_degree >= 1
    np.testing.assert_allclose(kind.one_plus(S), 1 + kind.theta1_tilde(S), rtol=1e-9, atol=1e-9)
    assert popov_sector(kind.theta1_tilde)[0] >= 0.95
    assert all(-960.0 * (1 + 1e-12) <= pole.real <= -np.log(100) * (1 - 1e-12) for pole in kind.one_plus.poles)
    assert all(zero.real < 0 for zero in kind.one_plus.zeros if zero != 0)
    assert 0.9 < judge(implied.plant, implied.additive_bound, kind).recovery_s <= 1.0
    assert best.f_lower <= best.f <= 1.001 * best.f_lower


def test_the_corrected_one_is_far_better_on_the_thesis_own_cost(implied: IdentifiedModel, best: Corrected) -> None:
    """Ten times better than the washout with a notch p = 5, z1 = 0.05, z2 = 1, which has f = 0.386."""
    bound = implied.additive_bound
    notch = np.roots([1, 2 * 0.05 * 280, 280**2])
    example = Block(1.0, (0j, *map(complex, notch)), (-5 + 0j, complex(-280), complex(-280)))
    f = uncertainty_cost(bound, example)[0]
    assert f == pytest.approx(0.386, abs=5e-4)
    assert best.f < 0.1 * f
    assert best.f < uncertainty_cost(bound, second_order(*thesis_choice(bound)).one_plus)[0] / 40


def test_no_neighbour_of_the_corrected_one_that_meets_the_sector_is_better(
    implied: IdentifiedModel, best: Corrected
) -> None:
    """Convexity makes a local test a global one: n moved at random, the poles kept."""
    rng = np.random.default_rng(2)
    one_plus = best.anti_windup.one_plus
    n = np.real(np.poly([zero for zero in one_plus.zeros if zero != 0]))
    tried = 0
    for _ in range(40):
        moved = n * np.append(1.0, np.exp(10 ** rng.uniform(-4, -1) * rng.standard_normal(2)))
        other = Block(1.0, (0j, *(complex(root) for root in np.roots(moved))), one_plus.poles)
        if popov_sector(from_one_plus(other).theta1_tilde)[0] >= 0.95:
            tried += 1
            assert uncertainty_cost(implied.additive_bound, other)[0] >= best.f_lower * (1 - 1e-4)
    assert tried > 10


def test_the_trade_off_is_monotonic(implied: IdentifiedModel) -> None:
    bound = implied.additive_bound
    sectors = [corrected((0j,), bound, 1.0, Sector(k), 960.0).f for k in (0.8, 0.95, 0.999)]
    assert all(np.diff(sectors) > -1e-4 * np.array(sectors[1:]))
    assert sectors[-1] > 2 * sectors[0]
    widths = [corrected((0j,), bound, 1.0, Sector(0.95), B).f for B in (100.0, 300.0)]
    assert all(np.diff(widths) < 0)


def test_without_a_bandwidth_the_corrected_class_has_no_optimum(implied: IdentifiedModel) -> None:
    """s/(s + b) meets every sector below 1 and its f vanishes as b grows."""
    for b in (1e4, 1e6):
        kind = from_one_plus(Block(1.0, (0j,), (complex(-b),)))
        assert popov_sector(kind.theta1_tilde)[0] == pytest.approx(1.0, rel=1e-6)
        assert uncertainty_cost(implied.additive_bound, kind.one_plus)[0] < 7.75 * 300 / b


@pytest.mark.parametrize("integrators", [0, 1, 2])
@pytest.mark.parametrize("order", [1, 2, 4])
def test_other_plants_and_bounds(integrators: int, order: int) -> None:
    poles = [Mode(30.0, 0.05), Mode(4.0, 0.3)][: order // 2]
    bound = AdditiveBound(0.02, (), tuple(poles), (3.0,) * (order > 1), (9.0,) * (order % 2))
    found = corrected((0j,) * integrators, bound, 2.0, Sector(0.9), 60.0)
    kind = found.anti_windup
    assert kind.one_plus.zeros.count(0j) == integrators
    assert found.f_lower <= found.f <= 1.001 * found.f_lower
    assert popov_sector(kind.theta1_tilde)[0] >= 0.9
    assert kind.theta2(PlantModel(1.0, (), (), 0.1, integrators=integrators)).is_stable
    assert all(zero.real < 0 for zero in kind.one_plus.zeros if zero != 0)


def test_an_unstable_plant_pole_is_a_zero_of_one_plus_theta1() -> None:
    bound = AdditiveBound.printed_form(0.01, 5.0, 20.0, 0.05)
    kind = corrected((0.5 + 0j,), bound, 1.0, Sector(0.6), 50.0).anti_windup
    assert abs(complex(kind.one_plus(0.5))) < 1e-12


@pytest.mark.parametrize(
    ("numbers", "sentence"),
    [
        ((0.0, 0.9, 100.0), "the recovery time is 0 s; expected a positive number"),
        ((1.0, 1.0, 100.0), "the sector is 1; expected 0 < sector < 1"),
        ((1.0, float("nan"), 100.0), "the sector is nan; expected 0 < sector < 1"),
        ((1.0, 0.9, float("inf")), "bandwidth of the anti-windup is inf rad/s; expected a finite one"),
        (
            (1.0, 0.9, 2.0),
            "bandwidth of the anti-windup is 2 rad/s; expected a finite one of at least 4.60517019 rad/s",
        ),
    ],
)
def test_a_corrected_one_out_of_range_is_refused(
    implied: IdentifiedModel, numbers: tuple[float, float, float], sentence: str
) -> None:
    with pytest.raises(InputError, match=sentence):
        corrected((0j,), implied.additive_bound, numbers[0], Sector(numbers[1]), numbers[2])


def test_a_sector_that_nothing_meets_is_refused() -> None:
    bound = AdditiveBound.printed_form(0.01, 5.0, 20.0, 0.05)
    with pytest.raises(InputError, match=r"meets the sector 0\.999"):
        corrected((5.0 + 0j,), bound, 1.0, Sector(0.999), 50.0)


def test_the_robust_sector_shrinks_with_the_uncertainty(best: Corrected) -> None:
    kind = best.anti_windup

    def level(x: float) -> float:
        return robust_sector(kind, lambda omega: np.full(len(omega), x), ())

    assert level(0.0) == pytest.approx(popov_sector(kind.theta1_tilde)[0], rel=1e-4)
    assert 0.95 > level(0.1) > level(0.3) > level(0.6) > 0
    assert level(1.0) == 0.0


def test_the_robust_sector_holds_for_drawn_uncertainties(best: Corrected) -> None:
    """For |x| < 0.4 the function that meets the dead zone is theta1~ - x/(1 + x) (1 + theta1~)."""
    kind, rng = best.anti_windup, np.random.default_rng(3)
    k = robust_sector(kind, lambda omega: np.full(len(omega), 0.4), ())
    omega = np.geomspace(1e-2, 1e5, 2000)
    theta, one_plus = kind.theta1_tilde(1j * omega), kind.one_plus(1j * omega)
    least = min(
        np.min((theta - x / (1 + x) * one_plus).real) for x in 0.4 * np.exp(2j * np.pi * rng.uniform(size=(200, 1)))
    )
    assert least + 1 / k >= -1e-9


def test_compensators_of_a_design(implied: IdentifiedModel) -> None:
    thesis, own = compensators(implied.plant, implied.additive_bound, 1.0)
    assert own.bandwidth == pytest.approx(960.0)
    assert own.judgement.lasting_offset == 0.0
    assert thesis.judgement.lasting_offset == pytest.approx(7.105 * (1 + thesis.gamma), rel=1e-9)


@pytest.mark.parametrize("numbers", [(0.0, 1.0, 1.0), (1.0, -1.0, 1.0), (1.0, 1.0, float("nan"))])
def test_bad_parameters_are_refused(numbers: tuple[float, float, float]) -> None:
    with pytest.raises(InputError, match="expected alpha > 0"):
        second_order(*numbers)


def test_plant_block_keeps_the_dead_time(implied: IdentifiedModel) -> None:
    assert plant_block(implied.plant).delay_s == implied.plant.delay_s
    assert second_order(1.0, 1.0, 1.0).theta2(implied.plant).delay_s == implied.plant.delay_s


# cases that once went wrong


def test_never_worse_than_the_plain_washout(implied: IdentifiedModel) -> None:
    """s/(s + bandwidth) meets every sector below 1: with a narrow bandwidth it beats any notch."""
    bound = implied.additive_bound
    for bandwidth in (10.0, 20.0, 50.0, 300.0):
        plain = from_one_plus(Block(1.0, (0j,), (complex(-bandwidth),)))
        f = uncertainty_cost(bound, plain.one_plus)[0]
        assert corrected((0j,), bound, 1.15, Sector(0.95), bandwidth).f <= f * (1 + 1e-9)


@pytest.mark.parametrize("sector", [0.9999, 0.999999])
def test_a_sector_close_to_one(implied: IdentifiedModel, sector: float) -> None:
    found = corrected((0j,), implied.additive_bound, 1.15, Sector(sector), 960.0)
    assert popov_sector(found.anti_windup.theta1_tilde)[0] >= sector
    assert found.f < 2.2


@pytest.mark.parametrize("scale", [1e-9, 1e9])
def test_the_size_of_the_bound_does_not_matter(implied: IdentifiedModel, scale: float) -> None:
    bound = implied.additive_bound
    scaled = AdditiveBound.printed_form(bound.gain * scale, bound.corner, bound.resonance.omega, bound.resonance.zeta)
    here, there = (corrected((0j,), each, 1.15, Sector(0.95), 960.0) for each in (bound, scaled))
    assert there.f == pytest.approx(scale * here.f, rel=1e-6)


@pytest.mark.parametrize("recovery_s", [0.01, 1.0])
@pytest.mark.parametrize(
    "bound",
    [
        AdditiveBound(0.1, (), (Mode(1.0, 0.02), Mode(3.0, 0.02)), (1.0,), ()),
        AdditiveBound(1e-4, (), (), (), (50.0, 100.0, 200.0, 300.0)),
        AdditiveBound(0.05, (), (Mode(280.0, 0.1), Mode(600.0, 0.1), Mode(900.0, 0.1)), (20.0, 40.0), ()),
    ],
    ids=["slow resonances", "four real poles", "three resonances"],
)
def test_there_is_always_one_for_an_integrator(bound: AdditiveBound, recovery_s: float) -> None:
    found = corrected((0j,), bound, recovery_s, Sector(0.95), 9600.0)
    assert popov_sector(found.anti_windup.theta1_tilde)[0] >= 0.95
    assert found.f <= 1.01 * found.f_lower


def test_optimal_gamma_where_w_a_has_several_resonances() -> None:
    modes = (Mode(280.0, 0.1), Mode(600.0, 0.1), Mode(900.0, 0.1))
    bound = AdditiveBound(0.05, (), modes, (20.0, 40.0, 60.0, 80.0, 100.0), ())
    for beta in (0.1, 0.0125):
        gamma, f = optimal_gamma(bound, 0.05, beta)
        tried = [
            uncertainty_cost(bound, second_order(0.05, beta, g).one_plus)[0]
            for g in np.geomspace(0.01, 100, 41) * gamma
        ]
        assert f <= min(tried) * (1 + 1e-6)


def test_no_multiplier_where_the_uncertainty_does_not_roll_off() -> None:
    """|1 + j m omega| times it then grows without end for every m > 0."""
    kind = second_order(0.05, 0.025, 5.0)
    constant, _ = robust_popov_sector(kind.theta1_tilde, lambda omega: np.full(len(omega), 0.2))
    rolling, _ = robust_popov_sector(kind.theta1_tilde, lambda omega: 0.2 / (1 + omega))
    omega = np.geomspace(1e-3, 1e6, 20000)
    circle = -1 / np.min(kind.theta1_tilde(1j * omega).real - 0.2)
    assert constant == pytest.approx(circle, rel=1e-3)
    assert rolling > 5 * constant


def test_a_cost_that_is_reached_as_omega_grows_is_kept_in_a_file() -> None:
    """W_a = 0.02 (1 + s/100)/(1 + s/50) tends to 0.01 as 1 + 3750/omega^2, s/(s + 1000) to 1 as 1 - 500000/omega^2."""
    kind = from_one_plus(Block(1.0, (0j,), (-1000 + 0j,)))
    judged = judge(PlantModel(1.0, (), (), 0.1), AdditiveBound(0.02, (), (), (100.0,), (50.0,)), kind)
    assert judged.f == pytest.approx(0.01, rel=1e-9)
    assert judged.f_omega is None
    content = json.loads(json.dumps(Compensator(kind, judged).to_dict(), allow_nan=False))
    assert Compensator.from_dict(content).judgement == judged
