"""Why the statements that do not hold, or cannot be judged, are so: each reason, shown."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from scipy.integrate import quad

from data.thesis import THESIS, model_named, printed_numbers
from design.blocks.block import Block, plant_block, plant_denominator
from design.chapters_3_4.design_extended import design_extended
from design.chapters_3_4.interpolate_Q import by_zeros, conditions
from design.design_file import Design
from design.stability.characteristic_roots import rightmost_roots, roots_right_of
from design.stability.delay_loop import DelayLoop
from design.stability.margins import delay_loop, margins_of
from experiments.engine.simulate import simulate
from experiments.runs.design_loop import design_loop
from experiments.runs.metrics import over_last
from experiments.thesis.claims.checks import saturated_runs
from experiments.thesis.claims.checks.chapter_2_weights import DESIGNS, long_run, over_weights
from experiments.thesis.claims.checks.interpolation_statements import pade
from experiments.thesis.claims.checks.statements import internal_model_principle, plant_class, popov, smith_predictor
from experiments.thesis.claims.inputs import Inputs, rounded_inputs
from experiments.thesis.printed_choices import thesis_reference
from experiments.thesis.studies.chapter_4 import extended_tables
from experiments.thesis.studies.pid import STEP, PidBenchmark, pid_loop, pid_tables
from identification.model.model_file import IdentifiedModel
from identification.sweeps.read_sweeps import read_sweeps

S = 1j * np.geomspace(1e-3, 1e4, 300)


@pytest.fixture(scope="module")
def pid_runs() -> pd.DataFrame:
    return pid_tables()["pid"]


# Section 2.2


def test_the_wound_up_control_settles_inside_the_range(pid_runs: pd.DataFrame):
    """In a steady state u = y/gain; |y| <= gain limit, so that |u| <= limit whatever the step that y can reach."""
    values = printed_numbers()["pid"]
    time_s = pid_runs["time_s"].to_numpy()
    middle, half = over_last(time_s, pid_runs["control_swapped_none"].to_numpy(), 5.0)
    assert middle == pytest.approx(STEP / values["gain"], rel=0.05)
    assert abs(middle) + half < values["limit"]
    _, half = over_last(time_s, pid_runs["control_printed_none"].to_numpy(), 20.0)
    assert half > 10 * values["limit"]


def test_the_printed_pid_gains_do_not_stabilise_and_the_swapped_ones_do():
    """By the exact characteristic roots, and by the argument principle."""
    values = printed_numbers()["pid"]
    lag = 1 / values["time_constant_s"]
    plant = Block(values["gain"] * lag, (), (complex(-lag),), values["delay_s"])
    gains = values["printed_proportional"], values["printed_integral"]
    for (proportional, integral), real, right in ((gains, 0.108, 2), (gains[::-1], -0.117, 0)):
        loop = DelayLoop(plant, Block(proportional, (complex(-integral / proportional),), (0j,)), Block(0.0), 0.0)
        assert rightmost_roots(loop, 1).roots[0].real == pytest.approx(real, abs=0.0005)
        assert roots_right_of(loop, 0.0) == right


@pytest.mark.parametrize(("gain", "met_s"), [(1.0, 35.2), (10.0, 22.4), (100.0, 0.06)])
def test_when_u_and_sat_u_coincide_is_a_matter_of_the_back_calculation_gain(gain: float, met_s: float):
    """To 1 % of the limit, for a step of 10; with a gain of 1 they are equal from 37 s on."""
    values = printed_numbers()["pid"]
    plant = {name: values[name] for name in ("gain", "time_constant_s", "delay_s", "limit")}
    swapped = {"proportional": values["printed_integral"], "integral": values["printed_proportional"]}
    time_s, limit = np.linspace(0.0, 60.0, 30001), values["limit"]
    run = simulate(pid_loop(PidBenchmark(**plant, **swapped, step=STEP), gain), (-limit, limit), time_s)
    assert run.control[0] == 4.5 * STEP
    apart = np.abs(run.control - run.saturated_control)
    assert time_s[apart > 0.01 * limit].max() == pytest.approx(met_s, abs=0.1 if met_s > 1 else 0.02)
    if gain == 1.0:
        assert time_s[apart > 0].max() == pytest.approx(37, abs=0.5)


# Chapter 2


def test_the_controller_of_chapter_2_hides_the_integrator(delay_free_design: Design):
    """C = K A/Lambda has a zero where P has its pole s = 0, so that a constant at u makes y drift."""
    plant = delay_free_design.plant.without_delay()
    A, Lambda = plant_denominator(plant), delay_free_design.blocks["Lambda"]
    assert 0j in A.zeros
    assert 0j not in Lambda.zeros

    def from_input_disturbance(s: complex) -> float:
        C = delay_free_design.blocks["K"](s) * A(s) / Lambda(s)
        return abs(complex(plant(s) / (1 + plant(s) * C)))

    slope = from_input_disturbance(1e-7) / from_input_disturbance(1e-6)
    assert slope == pytest.approx(10, rel=1e-3)


def test_one_over_one_plus_F_has_the_poles_of_the_reference(delay_free_design: Design):
    """A/Lambda is improper too: deg A = 5, deg Lambda = 4."""
    plant, Lambda = delay_free_design.plant.without_delay(), delay_free_design.blocks["Lambda"]
    inverse = plant_denominator(plant) * Lambda.inverse()
    assert delay_free_design.reference_omegas[0] * 1j in inverse.poles
    assert inverse.relative_degree == -1
    assert not inverse.is_stable
    assert 0j in delay_free_design.blocks["theta1"].poles


@pytest.mark.parametrize(("weights", "greatest_s"), [("ours", 0.0248), ("others", 0.1032)])
def test_the_loop_of_chapter_2_tolerates_the_dead_time(weights: str, greatest_s: float):
    """Up to what the delay margin of the loop without a dead time says, the hidden integrator apart."""
    design = DESIGNS[weights]()
    found = margins_of(delay_loop(design, design.loop_plant), design.additive_bound).delay_greatest_s.value
    assert found == pytest.approx(greatest_s, abs=0.0001)
    assert found > 3 * design.plant.delay_s
    for delay_s, right in ((design.plant.delay_s, 0), (0.99 * found, 0), (1.01 * found, 2)):
        loop = delay_loop(design, replace(design.plant, delay_s=delay_s))
        assert loop.hidden.count(0j) == 1
        assert roots_right_of(loop, 1e-6) == right


def test_the_final_value_step_says_of_a_loop_without_internal_model_that_it_tracks():
    """P = 1/s, C = 1, r = sin(w t): e'(t) = r'(t) - e(t), so that e swings with w/sqrt(1 + w^2), and s E(s) -> 0."""
    omega, s = 1.5, 1e-9
    assert s * (s / (s + 1)) * omega / (s**2 + omega**2) < 1e-15
    t = 40.0
    phases = [
        quad(lambda x, at=at: np.exp(x - at) * omega * np.cos(omega * x), 0, at, limit=200)[0]
        for at in (t, t + np.pi / 2 / omega)
    ]
    assert np.hypot(*phases) == pytest.approx(omega / np.hypot(1, omega), rel=1e-6)


@pytest.mark.parametrize("limit", [0.5, 10.0])
def test_the_dead_zone_is_zero_between_the_limits(limit: float):
    """u dz(u)/u^2 = 1 - limit/|u| beyond them: from 0 to below 1."""
    u = limit * np.array([-0.9, -0.1, 0.5, 1.0])
    assert np.all(u - np.clip(u, -limit, limit) == 0)
    beyond = limit * np.array([-1e6, -2.0, 3.0, 1e3])
    sector = (beyond - np.clip(beyond, -limit, limit)) / beyond
    assert sector == pytest.approx(1 - limit / np.abs(beyond), rel=1e-12)
    assert np.all((sector > 0) & (sector < 1))


def test_s2_plus_epsilon_holds_the_offset_that_R_leaves_out(delay_free_design: Design):
    """The error to a constant of 50 is 50/(1 + K(0) B(0)/(epsilon omega_1^2)), not 0."""
    chosen = printed_numbers()["delay_free"]["reference"]
    G_A, K = (complex(delay_free_design.blocks[name](0)) for name in ("G_A", "K"))
    left = abs(chosen["offset"] / (1 + G_A * K))
    assert 1e-7 < left < 2e-6
    time_s = np.linspace(0.0, 400.0, 4001)
    reference = thesis_reference("delay-free", delay_free_design.reference_omegas)
    run = simulate(design_loop(delay_free_design, reference, None), (-1e9, 1e9), time_s)
    assert run.outputs["error"][-1] == pytest.approx(chosen["offset"] / (1 + G_A * K).real, rel=0.01)


def test_the_shipped_sweeps_say_that_they_are_synthetic():
    tests = read_sweeps(sorted((THESIS.parent / "elevation").glob("*_frf.csv")))
    assert len(tests) == 6
    assert all(test.synthetic for test in tests)


def test_without_anti_windup_the_weights_decide():
    """With ours u grows for all of 50 periods though K is stable; with a W_1 that asks for less the loop settles."""
    limit = printed_numbers()["delay_free"]["limit"]
    ours, others = (long_run(weights, None) for weights in ("ours", "others"))
    assert DESIGNS["ours"]().blocks["K"].is_stable
    assert np.max(np.abs(ours.outputs["error"])) == pytest.approx(177, abs=1)
    assert np.max(np.abs(ours.outputs["error"][-500:])) == pytest.approx(53, abs=0.5)
    sizes = [np.max(np.abs(part)) for part in np.array_split(ours.control, 4)]
    assert np.all(np.diff(sizes) > 0.2 * sizes[0])
    assert sizes[0] > 1e4 * limit
    assert np.max(np.abs(others.outputs["error"][-500:])) == pytest.approx(3.19, abs=0.01)
    assert np.max(np.abs(others.control[-500:])) == pytest.approx(14.3, abs=0.05)
    assert np.max(np.abs(long_run("others", "thesis").outputs["error"][-500:])) == pytest.approx(6.04, abs=0.01)


@pytest.mark.parametrize("weights", DESIGNS)
def test_both_choices_of_weights_are_what_remark_1_asks_for(weights: str):
    """W_2 is W_a/P, the bound of the multiplicative uncertainty, and ||W_a C S|| < 1: all of W_a is stabilised."""
    design = DESIGNS[weights]()
    assert design.hinf is not None
    plant, W_a = design.loop_plant, design.additive_bound
    assert design.hinf.W2(S) * plant(S) == pytest.approx(W_a(S), rel=1e-9)
    assert margins_of(delay_loop(design, plant), W_a).W_a_C_S.value < 0.1


@pytest.mark.parametrize("weights", DESIGNS)
def test_the_controller_output_exceeds_the_limits_by_little(weights: str):
    control, limit = np.abs(long_run(weights, "thesis").control), printed_numbers()["delay_free"]["limit"]
    assert 0.2 < np.mean(control > limit) < 0.5
    assert limit < control.max() < 1.005 * limit


# Chapter 3


@pytest.mark.parametrize(("name", "peak", "at"), [("implied", 8.84, 175), ("table", 0.90, None)])
def test_the_printed_bound_guarantees_nothing(name: str, peak: float, at: float | None):
    """For the set behind the printed transfer functions; for Table 2.1 as printed it does, with zeta_n1 = 0.08."""
    model = model_named(name)
    design = design_extended(model, [1.5], 4.0, [(2.0, 1.0)])
    found = margins_of(delay_loop(design, design.loop_plant), model.additive_bound).W_a_C_S
    assert found.value == pytest.approx(peak, abs=0.005)
    assert at is None or found.omega == pytest.approx(at, rel=1e-3)


def test_a_constant_is_followed_without_a_controller_pole_at_zero(extended_design: Design):
    """S_s = (s + C_0 (1 - exp(-T_d s)))/(s + C_0): 0 at s = 0 for any C_0; but P S_s is 0 there only with (3.3)."""
    delay_s = extended_design.plant.delay_s
    s = np.array([1e-5, 1e-6])

    def S(C_0: np.ndarray) -> np.ndarray:
        return (s - C_0 * np.expm1(-delay_s * s)) / (s + C_0)

    free, interpolated = np.full(2, 4.0), extended_design.blocks["C0"](s).real
    assert interpolated == pytest.approx(-1 / delay_s, rel=1e-3)
    assert S(free) == pytest.approx((1 + 4 * delay_s) * s / 4, rel=1e-4)  # tends to 0: a constant is followed
    disturbed = {name: np.abs(S(C_0) / s) for name, C_0 in {"free": free, "interpolated": interpolated}.items()}
    assert disturbed["free"] == pytest.approx((1 + 4 * delay_s) / 4, rel=1e-4)  # of a constant at u something stays
    assert disturbed["interpolated"][1] == pytest.approx(disturbed["interpolated"][0] / 10, rel=0.01)


def test_N_p_at_zero_is_one_over_a(extended_design: Design):
    """N_p = 1/(s + a), and X = a = 1/N_p(0), with which N_p X + D_p Y = 1 for Y = 1."""
    a = extended_design.free.a
    assert 1 / (0 + a) == 1 / a
    assert 1 / (S + a) * a + S / (S + a) * 1 == pytest.approx(np.ones(len(S)), rel=1e-14)


def test_K_leaves_the_integrator_between_u_lin_and_y(extended_design: Design):
    """1 + F + P K = 1 - T_so e + T_so e = 1: G_A/(1 + G_A K) = P/(1 + F + P K) = P, which integrates."""
    plant, T_so, K = extended_design.loop_plant, extended_design.blocks["T_so"], extended_design.blocks["K"]
    F = -T_so(S) * np.exp(-plant.delay_s * S)
    G_A = plant(S) / (1 + F)
    assert G_A / (1 + G_A * K(S)) == pytest.approx(plant(S), rel=1e-9)
    assert 0j in plant_block(plant).poles


def test_the_printed_3_27_is_not_one_plus_P_C_aw(extended_design: Design):
    plant, T_so = extended_design.loop_plant, extended_design.blocks["T_so"]
    e, K_0 = np.exp(-plant.delay_s * S), extended_design.blocks["K0"](S)
    exact = 1 + plant(S) * extended_design.blocks["K"](S) / (1 - T_so(S) * e)
    mended = (1 - T_so(S) * e + K_0 * e / S) / (1 - T_so(S) * e)
    assert exact == pytest.approx(mended, rel=1e-9)
    assert 1 / exact == pytest.approx(1 - T_so(S) * e, rel=1e-9, abs=1e-12)  # (3.28) and its conclusion stand
    as_printed = 1 - T_so(S) * e / (1 + K_0 * e / S)
    assert np.max(np.abs(as_printed / exact - 1)) > 0.5


@pytest.mark.parametrize("W_aw", [0.0, 1.0, -7.0 + 3.0j])
def test_Z_aw_has_the_root_whatever_W_aw_is(W_aw: complex, extended_design: Design):
    """Lambda = s^2 + omega_d^2 by (2.2). With Lambda and not its inverse in (3.16) the condition (3.18) is needed."""
    (omega,), delay_s = extended_design.reference_omegas, extended_design.plant.delay_s
    s = 1j * omega
    needed = W_aw * np.exp(-delay_s * s) + s  # (3.18) makes this 0
    assert abs(needed) > 0.1
    assert abs((s**2 + omega**2) * needed) < 1e-12
    met = -s * complex(extended_design.blocks["T_so"](s)) * np.exp(-delay_s * s) + s
    assert abs(met) < 1e-12


def test_Z_aw_grows_as_an_exponential(extended_design: Design):
    """Z_aw/Lambda = s - s T_so exp(-T_d s): its logarithm grows by T_d for each rad/s to the left."""
    delay_s, T_so = extended_design.plant.delay_s, extended_design.blocks["T_so"]
    s = np.array([-1e4, -2e4])
    grown = np.log(np.abs(s - s * T_so(s) * np.exp(-delay_s * s)))
    assert np.diff(grown)[0] / 1e4 == pytest.approx(delay_s, rel=1e-3)


def test_at_the_reference_T_so_is_the_inverse_of_T_si(extended_design: Design):
    s = 1j * extended_design.reference_omegas[0]
    T_si = np.exp(-extended_design.plant.delay_s * s)
    assert complex(extended_design.blocks["T_so"](s)) == pytest.approx(1 / T_si, rel=1e-12)
    assert abs(T_si - 1 / T_si) > 0.02


def test_3_21_is_a_choice(extended_design: Design):
    """Another stable W_aw meets (3.18), makes 1 + P F_2 vanish at 0 and j omega_d too, and is not -s T_so."""
    (omega,), T_so = extended_design.reference_omegas, extended_design.blocks["T_so"]
    delay_s = extended_design.plant.delay_s

    def W(s: complex, share: float) -> complex:
        return -s * complex(T_so(s)) + share * s * (s**2 + omega**2) / (s + 1) ** 3

    for share in (0.0, 3.0):
        s = 1j * omega
        assert W(s, share) == pytest.approx(-s * np.exp(delay_s * s), rel=1e-12)  # (3.18)
    assert abs(W(3j, 3.0) - W(3j, 0.0)) > 0.5


# Chapter 4


def test_a_first_order_Q_meets_the_conditions_at_high_frequencies():
    """(b s + c)/(s + f) with c = f Q(0): three real conditions, three coefficients."""
    delay_s, a = printed_numbers()["plants"]["implied"]["delay_s"], printed_numbers()["extended"]["a"]
    stable = {}
    for omega in (1.5, 198.0, 200.0, 2 / delay_s, 392.0, 394.0):
        wanted = conditions([omega], delay_s, a)
        Q_0, Q_omega = wanted.at_zero, wanted.at_omegas[0]
        b, f = np.linalg.solve(
            [[0.0, Q_0 - Q_omega.real], [omega, -Q_omega.imag]], [-omega * Q_omega.imag, omega * Q_omega.real]
        )
        s = 1j * omega
        assert (b * s + f * Q_0) / (s + f) == pytest.approx(Q_omega, rel=1e-9)
        stable[omega] = f > 0
    assert list(stable.values()) == [False, False, True, True, True, False]


def test_the_printed_Q_at_omega_misses_the_condition():
    chosen, delay_s = printed_numbers()["extended"], printed_numbers()["plants"]["implied"]["delay_s"]
    wanted = conditions([1.5], delay_s, chosen["a"])
    b, c, d = by_zeros(wanted, [(chosen["e"], chosen["f"])]).numerator
    s = 1j * wanted.omegas[0]
    numerator = b * s**2 + c * s + d
    assert numerator / (s**2 + chosen["e"] * s + chosen["f"]) == pytest.approx(wanted.at_omegas[0], rel=1e-12)
    assert abs(numerator / (d * s**2 + chosen["e"] * s + chosen["f"]) / wanted.at_omegas[0] - 1) > 0.5


def test_without_anti_windup_the_error_vanishes_and_with_it_an_offset_stays(extended_design: Design):
    summary = extended_tables(extended_design)["extended_summary"].set_index("run")
    assert abs(summary["offset"]["none"]) + summary["ripple"]["none"] < 0.003
    assert summary["offset"]["thesis"] == pytest.approx(-36, abs=0.5)
    assert abs(summary["offset"]["corrected"]) + summary["ripple"]["corrected"] < 1e-5


# The statements themselves can fail


@pytest.fixture
def inputs(ledger: pd.DataFrame) -> Inputs:
    return {name: number.value for name, number in rounded_inputs(ledger).items()}


def test_statements_are_true_or_false(inputs: Inputs, judged: pd.DataFrame):
    rows = judged[judged["printed"] == "true"]
    assert set(rows["computed"].dropna()) == {0.0, 1.0}
    assert (rows["verdict"][rows["computed"] == 0] == "differs").all()


def test_a_plant_of_another_kind_turns_its_statements(inputs: Inputs):
    """Resonance below anti-resonance, a zero in the right half plane, a damping beyond 1."""
    assert plant_class(inputs)["statement.resonances"] == 1
    swapped = {**inputs, "implied.pole_modes.0.omega": 100.0}
    assert plant_class(swapped)["statement.resonances"] == 0
    assert plant_class({**inputs, "implied.pole_modes.1.zeta": 1.5})["R0.damping"] == 1.5


def test_other_printed_numbers_turn_their_statements(inputs: Inputs, monkeypatch: pytest.MonkeyPatch):
    """gamma = -1 makes theta2 stable; with T_d ten times as long the Pade coefficients are still 2 and 12."""
    forgetting = {**printed_numbers(), "delay_free": printed_numbers()["delay_free"] | {"gamma": -1.0}}
    monkeypatch.setattr("experiments.thesis.claims.checks.statements.printed_numbers", lambda: forgetting)
    assert popov(inputs)["statement.theta2_stable"] == 1
    longer = pade({**inputs, "implied.delay_s": 0.081})
    assert (longer["pade.s"], longer["pade.s2"]) == (pytest.approx(2), pytest.approx(12))


def test_another_design_turns_its_statements(inputs: Inputs, implied: IdentifiedModel, monkeypatch: pytest.MonkeyPatch):
    """A robust redesign keeps what is stable and equal, and is robust."""
    redesigned = design_extended(implied, [1.5], 4.0, [(2.0, 1.0)], robust_level=0.9)
    before = smith_predictor(inputs)
    monkeypatch.setattr("experiments.thesis.claims.checks.statements.chapter_4", lambda: redesigned)
    after = smith_predictor(inputs)
    assert {name for name in before if abs(before[name] - after[name]) > 0.5} == {"statement.robust"}


@pytest.mark.parametrize("factor", [-5.0, 1e-3])
def test_a_stabiliser_that_does_not_stabilise_breaks_lemma_1(
    factor: float, inputs: Inputs, delay_free_design: Design, monkeypatch: pytest.MonkeyPatch
):
    K = delay_free_design.blocks["K"].scaled(factor)
    other = replace(delay_free_design, blocks={**delay_free_design.blocks, "K": K})
    monkeypatch.setattr("experiments.thesis.claims.checks.statements.chapter_2", lambda: other)
    assert internal_model_principle(inputs)["statement.lemma_1"] == 0


def test_a_lambda_without_the_sinusoid_breaks_lemma_1(
    inputs: Inputs, delay_free_design: Design, monkeypatch: pytest.MonkeyPatch
):
    assert internal_model_principle(inputs)["statement.lemma_1"] == 1
    other = replace(delay_free_design, blocks=delay_free_design.blocks | {"Lambda": Block(1.0, (-1 + 0j,) * 4)})
    monkeypatch.setattr("experiments.thesis.claims.checks.statements.chapter_2", lambda: other)
    assert internal_model_principle(inputs)["statement.lemma_1"] == 0


def test_the_corrected_anti_windup_turns_the_statements_of_the_runs(
    inputs: Inputs, extended_design: Design, monkeypatch: pytest.MonkeyPatch
):
    """With the corrected compensator in the thesis's place the error converges, and faster than without."""
    renamed = replace(extended_design, thesis=replace(extended_design.thesis, kind=extended_design.corrected.kind))
    monkeypatch.setattr(saturated_runs, "chapter_4", lambda: renamed)
    found = saturated_runs.extended(inputs)
    assert found["statement.error_converges"] == found["statement.minimises_error"] == 1


def test_what_depends_on_the_weights_is_neither_true_nor_false():
    assert over_weights(lambda weights: True) == 1
    assert over_weights(lambda weights: False) == 0
    assert np.isnan(over_weights(lambda weights: weights == "ours"))
