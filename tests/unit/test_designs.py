"""The two designs against the identities of chapters 2 and 3, on the thesis's plant and on others."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np
import pytest

from design.blocks.block import Block, plant_block, plant_denominator, plant_numerator
from design.chapter_2.design_delay_free import design_delay_free
from design.chapter_2.internal_model import internal_model
from design.chapters_3_4.design_extended import design_extended
from design.chapters_3_4.interpolate_Q import StableFunction, by_poles, by_zeros, conditions, lagrange, poles_of
from design.chapters_3_4.smith_predictor import (
    anti_windup_controller,
    anti_windup_theta1,
    augmented_plant,
    free_part_of,
    smith_controller,
    stabiliser,
)
from design.chapters_3_4.tracking import outer_part, tracking_conditions
from design.choices import METHODS
from design.design_file import Design, read_design
from design.stability.coprime import controller, coprime_factors
from identification.base.errors import InputError
from identification.model.additive_bound import AdditiveBound
from identification.model.model_file import IdentifiedModel
from identification.model.modes import Mode
from identification.model.plant import PlantModel

S = 1j * np.geomspace(1e-2, 3e3, 300) + 0.01

OTHERS = {
    "no modes": PlantModel(20.0, (), (), 0.02),
    "one mode, negative gain": PlantModel(-3.0, (Mode(50, 0.05),), (Mode(80, 0.03),), 0.004),
    "three modes, no delay": PlantModel(
        0.7,
        (Mode(50, 0.05), Mode(150, 0.05), Mode(400, 0.05)),
        (Mode(80, 0.03), Mode(190, 0.05), Mode(600, 0.05)),
        0.0,
    ),
}


def other_model(name: str, implied: IdentifiedModel) -> IdentifiedModel:
    plant = OTHERS[name]
    bound = AdditiveBound.printed_form(0.0015 * abs(plant.gain), 20.0, 280.0, 0.01)
    return dataclasses.replace(implied, plant=plant, additive_bound=bound)


# chapter 2


@pytest.mark.parametrize("omega", [0.3, 1.5707963267948966, 9.0])
def test_internal_model_identities(implied: IdentifiedModel, omega: float) -> None:
    plant = implied.plant
    units = internal_model(plant, [omega], 1e-4)
    G = plant.without_delay()(S)
    F = units.F1(S) * units.F2(S)
    A, B = plant_denominator(plant), plant_numerator(plant)
    np.testing.assert_allclose(F, units.Lambda(S) / A(S) - 1, rtol=1e-7, atol=1e-9)  # (2.4)
    np.testing.assert_allclose(units.F2(S), (units.Lambda(S) - A(S)) / B(S), rtol=1e-7)  # (2.5)
    np.testing.assert_allclose(units.G_A(S), G / units.one_plus_F(S), rtol=1e-9)  # (2.6)
    np.testing.assert_allclose(np.abs(units.Lambda(1j * omega)), 0.0, atol=1e-9)


def test_the_controller_holds_the_reference_poles(delay_free_design: Design) -> None:
    C, _ = delay_free_design.controller_parts()
    (omega,) = delay_free_design.reference_omegas
    assert any(abs(pole - 1j * omega) < 1e-12 for pole in C.poles)
    L = C * plant_block(delay_free_design.plant.without_delay())
    S_, T = 1 / (1 + L(S)), L(S) / (1 + L(S))
    np.testing.assert_allclose(S_ + T, 1.0, rtol=1e-12)
    near = 1j * omega * (1 + 1e-7)
    assert abs(1 / (1 + complex(L(near)))) < 1e-4


def test_delay_free_blocks_follow_from_each_other(delay_free_design: Design) -> None:
    blocks = delay_free_design.blocks
    G = delay_free_design.plant.without_delay()(S)
    np.testing.assert_allclose(blocks["F1"](S), G, rtol=1e-9)
    one_plus_F = 1 + blocks["F1"](S) * blocks["F2"](S)
    np.testing.assert_allclose(blocks["theta1"](S), blocks["theta1_tilde"](S) * one_plus_F, rtol=1e-6)  # (2.17)
    np.testing.assert_allclose(blocks["theta2"](S), G * (1 + blocks["theta1_tilde"](S)), rtol=1e-9)  # (2.18)
    # Lemma 2, (2.9)
    np.testing.assert_allclose(blocks["G_A"](S), blocks["theta2"](S) / (one_plus_F + blocks["theta1"](S)), rtol=1e-6)


@pytest.mark.parametrize("period", [0.2, 1.0, 4.0])
@pytest.mark.parametrize("name", OTHERS)
def test_delay_free_design_of_other_plants(implied: IdentifiedModel, name: str, period: float) -> None:
    other = other_model(name, implied)
    design = design_delay_free(other, [math.tau / period], 1e-4)
    assert design.hinf is not None
    assert design.hinf.gamma_lower <= design.hinf.gamma
    assert design.hinf.gamma_line <= 1.021 * design.hinf.gamma_line_lower


# chapters 3 and 4


def test_the_free_part_is_theorem_2_1_1_for_an_integrator(extended_design: Design) -> None:
    """(4.2) is the general parametrisation with N_p = 1/(s + a), D_p = s/(s + a), X = a, Y = 1."""
    C_0 = controller(coprime_factors(Block(1.0, (), (0j,)), (-4.0 + 0j,)), extended_design.blocks["Q"])
    np.testing.assert_allclose(C_0(S), extended_design.blocks["C0"](S), rtol=1e-8)


@pytest.mark.parametrize("omega", [0.2, 1.5, 6.0])
@pytest.mark.parametrize("delay", [1e-4, 8.1e-3, 0.05])
@pytest.mark.parametrize("method", ["zeros", "lagrange"])
def test_interpolation_conditions(implied: IdentifiedModel, omega: float, delay: float, method: str) -> None:
    plant = dataclasses.replace(implied.plant, delay_s=delay)
    design = design_extended(dataclasses.replace(implied, plant=plant), [omega], 4.0, [(2.0, 1.0)], method)
    C_0, T_so, Q = (design.blocks[name] for name in ("C0", "T_so", "Q"))
    jw = 1j * omega
    assert complex(C_0(0j)) == pytest.approx(-1 / delay, rel=1e-7)  # (4.3)
    assert complex(C_0(jw)) == pytest.approx(-jw / (1 - np.exp(-delay * jw)), rel=1e-7)
    assert complex(Q(0j)) == pytest.approx(4.0 * (1 + 4.0 * delay), rel=1e-12)  # (4.4)
    assert complex(T_so(jw)) == pytest.approx(np.exp(delay * jw), rel=1e-9)  # so that S_s(j omega) = 0
    assert complex(T_so(0j)) == pytest.approx(1.0, rel=1e-12)


def test_parametrisation_is_the_printed_formula(extended_design: Design) -> None:
    Q, a = extended_design.blocks["Q"](S), 4.0
    C_0 = (a + S / (S + a) * Q) / (1 - Q / (S + a))  # (4.2)
    np.testing.assert_allclose(extended_design.blocks["C0"](S), C_0, rtol=1e-8)
    np.testing.assert_allclose(extended_design.blocks["T_so"](S), (C_0 / S) / (1 + C_0 / S), rtol=1e-8)  # (3.19)
    np.testing.assert_allclose(extended_design.blocks["K0"](S), C_0 / (1 + C_0 / S), rtol=1e-8)  # (3.28)


@pytest.mark.parametrize("name", [*OTHERS, "implied"])
def test_anti_windup_controller_is_the_smith_controller(implied: IdentifiedModel, name: str) -> None:
    model = implied if name == "implied" else other_model(name, implied)
    design = design_extended(model, [1.5], 4.0, [(2.0, 1.0)])
    C_aw = anti_windup_controller(model.plant, design.blocks["K"], design.blocks["T_so"], S)
    C_s = smith_controller(model.plant, design.blocks["C0"], S)
    np.testing.assert_allclose(C_aw, C_s, rtol=1e-6)
    # S_s = 1 - T_so exp(-T_d s), and S + T = 1
    P = model.plant(S)
    np.testing.assert_allclose(
        1 / (1 + P * C_s), 1 - design.blocks["T_so"](S) * np.exp(-model.plant.delay_s * S), rtol=1e-6, atol=1e-9
    )


def test_extended_blocks_follow_from_each_other(extended_design: Design) -> None:
    blocks, plant = extended_design.blocks, extended_design.plant
    np.testing.assert_allclose(blocks["F"](S), blocks["F1"](S) * blocks["F2"](S), rtol=1e-9)
    np.testing.assert_allclose(blocks["K"](S), blocks["K0"](S) * blocks["K1"](S), rtol=1e-9)
    np.testing.assert_allclose(blocks["theta2"](S), plant(S) * (1 + blocks["theta1_tilde"](S)), rtol=1e-9)
    C_s = smith_controller(plant, blocks["C0"], S)
    np.testing.assert_allclose(blocks["F2"](S), -C_s / (1 + plant(S) * C_s), rtol=1e-6)  # (3.23)
    theta1 = anti_windup_theta1(blocks["theta1_tilde"], plant, blocks["T_so"], S)
    np.testing.assert_allclose(theta1, blocks["theta1_tilde"](S) * (1 + blocks["F"](S)), rtol=1e-9)  # (3.30)
    G_A = augmented_plant(plant, blocks["T_so"], S)
    np.testing.assert_allclose(G_A, blocks["theta2"](S) / (1 + blocks["F"](S) + theta1), rtol=1e-9)  # (2.9)
    np.testing.assert_allclose(G_A, plant(S) / (1 + blocks["F"](S)), rtol=1e-9)


def test_lagrange_is_the_zeros_design_with_its_denominator() -> None:
    for omegas in ([3.0], [1.0, 4.0], [0.0]):
        wanted = conditions(omegas, 0.01, 5.0)
        assert lagrange(wanted) == by_zeros(wanted, [(2.0, 1.0)] * len(wanted.omegas))


def test_pole_design_interpolates_where_it_is_stable() -> None:
    omega, delay, a = 300.0, 8.1e-3, 4.0
    wanted = conditions([omega], delay, a)
    found: StableFunction | None = None
    for factor in np.geomspace(0.01, 3, 200):
        try:
            wanted = conditions([omega * factor], delay, a)
            found = by_poles(wanted)
            break
        except InputError:
            continue
    assert found is not None
    Q = found.block()
    assert complex(Q(0j)) == pytest.approx(wanted.at_zero, rel=1e-9)
    assert complex(Q(1j * wanted.omegas[0])) == pytest.approx(wanted.at_omegas[0], rel=1e-9)
    assert Q.is_stable


def test_pole_design_refuses_where_it_is_unstable() -> None:
    with pytest.raises(InputError, match="unstable poles"):
        by_poles(conditions([1.5], 8.1e-3, 4.0))


@pytest.mark.parametrize(("e", "f"), [(0.0, 1.0), (2.0, -1.0), (float("nan"), 1.0)])
def test_unstable_denominators_are_refused(e: float, f: float) -> None:
    with pytest.raises(InputError, match="both positive"):
        by_zeros(conditions([1.5], 8.1e-3, 4.0), [(e, f)])


def test_all_methods_are_recorded(extended_design: Design) -> None:
    assert set(extended_design.free.Q) == set(METHODS)


def test_design_json_round_trip(extended_design: Design, delay_free_design: Design, tmp_path) -> None:  # type: ignore[no-untyped-def]
    for design in (extended_design, delay_free_design):
        path = tmp_path / "design.json"
        path.write_text(design.to_json(), encoding="utf-8")
        assert read_design(path) == design


# several frequencies, a constant, and what the thesis does not have


@pytest.mark.parametrize("omegas", [[0.0], [1.5], [0.0, 1.5], [0.7, 2.0], [3.0, 1.0, 2.0], [0.5, 1.0, 5.0, 20.0]])
@pytest.mark.parametrize("method", ["zeros", "lagrange"])
def test_one_condition_for_each_frequency(implied: IdentifiedModel, omegas: list[float], method: str) -> None:
    positive = [omega for omega in omegas if omega]
    pairs = [(2.0 * omega, omega**2) for omega in positive]
    design = design_extended(implied, omegas, 4.0, pairs, method)
    Q, T_so, delay = design.blocks["Q"], design.blocks["T_so"], implied.plant.delay_s
    assert len(Q.poles) == 2 * len(positive)  # the number of conditions less one
    assert Q.is_stable
    wanted = conditions(omegas, delay, 4.0)
    for omega, value in zip((0.0, *wanted.omegas), (wanted.at_zero, *wanted.at_omegas), strict=True):
        assert complex(Q(1j * omega)) == pytest.approx(value, rel=1e-6)
        assert complex(T_so(1j * omega)) == pytest.approx(np.exp(1j * omega * delay), rel=1e-6)
    # T_so'(0) = T_d, so that a constant disturbance at the plant's input is rejected too
    step = 1e-4
    assert (complex(T_so(step)) - complex(T_so(-step))) / (2 * step) == pytest.approx(delay, rel=1e-2)


def test_a_pair_for_each_frequency() -> None:
    wanted = conditions([1.0, 2.0], 0.01, 4.0)
    with pytest.raises(InputError, match="2 frequencies above 0 and there are 1 pairs"):
        by_zeros(wanted, [(2.0, 1.0)])
    with pytest.raises(InputError, match="expected each once"):
        conditions([1.0, 1.0], 0.01, 4.0)


@pytest.mark.parametrize(("rate", "order"), [(30.0, 1), (55.0, 2), (200.0, 3), (1.0, 0)])
@pytest.mark.parametrize("omegas", [[0.0], [1.5], [1.0, 3.0]])
def test_a_roll_off_keeps_the_conditions(rate: float, order: int, omegas: list[float]) -> None:
    wanted = conditions(omegas, 0.03, 4.0)
    pairs = [(2.0, 1.0)] * len(wanted.omegas)
    poles = (-4.0 + 0j, -4.0 + 0j, *poles_of(wanted.omegas, pairs), *(complex(-rate),) * order)
    free = free_part_of(outer_part(tracking_conditions(PlantModel(1.0, (), (), 0.03), tuple(omegas)), poles), 4.0)
    assert free.T_so.relative_degree == order + 1
    for omega, value in zip((0.0, *wanted.omegas), (wanted.at_zero, *wanted.at_omegas), strict=True):
        assert complex(free.Q(1j * omega)) == pytest.approx(value, rel=1e-7)
    assert complex(free.C_0(0j)) == pytest.approx(-1 / 0.03, rel=1e-7)  # (4.3)
    C_0 = (4.0 + S / (S + 4.0) * free.Q(S)) / (1 - free.Q(S) / (S + 4.0))  # (4.2)
    np.testing.assert_allclose(free.C_0(S), C_0, rtol=1e-6)
    np.testing.assert_allclose(free.T_so(S), (C_0 / S) / (1 + C_0 / S), rtol=1e-6)
    if order == 0:
        thesis = by_zeros(wanted, pairs).block()
        np.testing.assert_allclose(free.Q(S), thesis(S), rtol=1e-9)


@pytest.mark.parametrize("level", [0.5, 0.9])
def test_the_redesign_is_robust_and_tracks(implied: IdentifiedModel, level: float) -> None:
    design = design_extended(implied, [1.5], 4.0, [(2.0, 1.0)], robust_level=level)
    K, T_so = design.blocks["K"], design.blocks["T_so"]
    omega = np.concatenate([np.geomspace(1e-3, 1e5, 5000), *(w + np.linspace(-5, 5, 2001) for w in (175, 280, 930))])
    C_S = anti_windup_controller(implied.plant, K, T_so, 1j * omega) * (
        1 - T_so(1j * omega) * np.exp(-1j * omega * implied.plant.delay_s)
    )
    robustness = np.abs(implied.additive_bound(1j * omega) * C_S)
    assert 0.95 * level < robustness.max() <= level * (1 + 1e-6)
    assert complex(T_so(1.5j)) == pytest.approx(np.exp(1.5j * implied.plant.delay_s), rel=1e-9)


def test_a_design_that_meets_the_level_stays_as_it_is(table: IdentifiedModel) -> None:
    """With Table 2.1 as printed (zeta = 0.08 at 175 rad/s) |W_a C S| is 0.896."""
    design = design_extended(table, [1.5], 4.0, [(2.0, 1.0)], robust_level=0.9)
    assert design.free.roll_off.order == 0
    plain = design_extended(table, [1.5], 4.0, [(2.0, 1.0)]).blocks["T_so"]
    np.testing.assert_allclose(design.blocks["T_so"](S), plain(S), rtol=1e-9)


def test_a_bound_that_forbids_tracking_is_refused(implied: IdentifiedModel) -> None:
    """|W_a C S| = |W_a/P| where the loop follows: no controller can help."""
    large = AdditiveBound.printed_form(5.0, 20.0, 280.0, 0.01)
    floor = abs(complex(large(1.5j) / implied.plant(1.5j)))
    assert floor > 1
    with pytest.raises(InputError, match=rf"{floor:.6g} at 1.5 rad/s with every controller"):
        design_extended(IdentifiedModel(implied.plant, large), [1.5], 4.0, [(2.0, 1.0)], robust_level=0.9)


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        ({"robust_level": 1.5}, "expected between 0 and 1"),
        ({"robust_level": 0.9, "method": "lagrange"}, "expected 'zeros' and 0 for a design"),
        ({"inverse_epsilon": -1.0}, "expected 0 or more"),
    ],
)
def test_options_out_of_range_are_refused(implied: IdentifiedModel, options: dict[str, Any], sentence: str) -> None:
    with pytest.raises(InputError, match=sentence):
        design_extended(implied, [1.5], 4.0, [(2.0, 1.0)], **options)


def test_the_approximate_inverse_takes_plants_with_more_poles(implied: IdentifiedModel) -> None:
    """(3.2): R_eps^-1 = R_0^-1/(1 + eps s)^2 makes K proper for up to two poles more than zeros."""
    plant = PlantModel(3.0, (Mode(50.0, 0.05),), (Mode(80.0, 0.03), Mode(400.0, 0.2)), 0.01)
    design = design_extended(dataclasses.replace(implied, plant=plant), [1.5], 4.0, [(2.0, 1.0)], inverse_epsilon=1e-3)
    forward, feedback = design.controller_parts()
    assert forward.relative_degree == 0
    exact = smith_controller(plant, design.blocks["C0"], S) / (1 + 1e-3 * S) ** 2
    np.testing.assert_allclose(anti_windup_controller(plant, forward, feedback, S), exact, rtol=1e-6)
    # so does the roll-off of the robust redesign, with the exact inverse
    rolled = design_extended(dataclasses.replace(implied, plant=plant), [1.5], 4.0, [(2.0, 1.0)], robust_level=0.9)
    assert rolled.blocks["K"].relative_degree >= 0


def test_the_exact_inverse_is_the_limit_of_the_approximate_one(implied: IdentifiedModel) -> None:
    T_so = design_extended(implied, [1.5], 4.0, [(2.0, 1.0)]).blocks["T_so"]
    exact = stabiliser(implied.plant, T_so)(S)
    errors = [np.abs(stabiliser(implied.plant, T_so, epsilon)(S) / exact - 1).max() for epsilon in (1e-6, 1e-7)]
    assert errors[0] < 2e-2
    assert errors[1] == pytest.approx(errors[0] / 10, rel=0.02)
