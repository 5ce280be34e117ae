"""The two designs against the identities of chapters 2 and 3, on the thesis's plant and on others."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from design.block import plant_block, plant_denominator, plant_numerator
from design.contract import Design, read_design
from design.delay_free import controller, design_delay_free
from design.extended import METHODS, design_extended
from design.internal_model import internal_model
from design.smith_predictor import (
    anti_windup_controller,
    anti_windup_theta1,
    augmented_plant,
    bezout,
    smith_controller,
)
from design.stable_interpolation import StableFunction, by_poles, by_zeros, conditions, lagrange
from identification.files import InputError
from identification.model import IdentifiedModel
from identification.plant import AdditiveBound, Mode, PlantModel

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
    units = internal_model(plant, omega, 1e-4)
    G = plant.without_delay()(S)
    F = units.F1(S) * units.F2(S)
    A, B = plant_denominator(plant), plant_numerator(plant)
    np.testing.assert_allclose(F, units.Lambda(S) / A(S) - 1, rtol=1e-7, atol=1e-9)  # (2.4)
    np.testing.assert_allclose(units.F2(S), (units.Lambda(S) - A(S)) / B(S), rtol=1e-7)  # (2.5)
    np.testing.assert_allclose(units.G_A(S), G / units.one_plus_F(S), rtol=1e-9)  # (2.6)
    np.testing.assert_allclose(np.abs(units.Lambda(1j * omega)), 0.0, atol=1e-9)


def test_the_controller_holds_the_reference_poles(delay_free_design: Design) -> None:
    C = controller(delay_free_design)
    omega = delay_free_design.reference_omega
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
    design = design_delay_free(other_model(name, implied), period, 1e-4)
    assert design.hinf is not None
    assert design.hinf["gamma_lower"] <= design.hinf["gamma"]
    assert design.hinf["gamma_line"] <= 1.021 * design.hinf["gamma_line_lower"]


@pytest.mark.parametrize(
    ("plant", "sentence"),
    [
        (PlantModel(1.0, (), (Mode(10.0, 0.1),), 0.01), "0 zeros and 2 poles; .* equally many"),
        (PlantModel(1.0, (), (), 0.01, real_poles=(3.0,)), "0 zeros and 1 poles; .* equally many"),
        (PlantModel(1.0, (), (), 0.01, integrators=0), "has 0 integrators"),
        (PlantModel(1.0, (), (), 0.01, integrators=2), "has 2 integrators"),
    ],
    ids=["two poles more", "one pole more", "no integrator", "two integrators"],
)
def test_plants_of_another_class_are_refused(implied: IdentifiedModel, plant: PlantModel, sentence: str) -> None:
    other = dataclasses.replace(implied, plant=plant)
    with pytest.raises(InputError, match=sentence):
        design_delay_free(other, 4.0, 1e-4)
    with pytest.raises(InputError, match=sentence):
        design_extended(other, 1.5, 4.0, 2.0, 1.0)


# chapters 3 and 4


@pytest.mark.parametrize("a", [0.5, 4.0, 30.0])
def test_bezout(a: float) -> None:
    N_p, D_p, X, Y = bezout(a)
    np.testing.assert_allclose(N_p(S) * X(S) + D_p(S) * Y(S), 1.0, rtol=1e-12)  # (3.7)
    np.testing.assert_allclose(N_p(S) / D_p(S), 1 / S, rtol=1e-12)


@pytest.mark.parametrize("omega", [0.2, 1.5, 6.0])
@pytest.mark.parametrize("delay", [1e-4, 8.1e-3, 0.05])
@pytest.mark.parametrize("method", ["zeros", "lagrange"])
def test_interpolation_conditions(implied: IdentifiedModel, omega: float, delay: float, method: str) -> None:
    plant = dataclasses.replace(implied.plant, delay_s=delay)
    design = design_extended(dataclasses.replace(implied, plant=plant), omega, 4.0, 2.0, 1.0, method)
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
    design = design_extended(model, 1.5, 4.0, 2.0, 1.0)
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
    wanted = conditions(3.0, 0.01, 5.0)
    assert lagrange(wanted) == by_zeros(wanted, 2.0, 1.0)


def test_pole_design_interpolates_where_it_is_stable() -> None:
    omega, delay, a = 300.0, 8.1e-3, 4.0
    wanted = conditions(omega, delay, a)
    found: StableFunction | None = None
    for factor in np.geomspace(0.01, 3, 200):
        try:
            wanted = conditions(omega * factor, delay, a)
            found = by_poles(wanted)
            break
        except InputError:
            continue
    assert found is not None
    Q = found.block()
    assert complex(Q(0j)) == pytest.approx(wanted.at_zero, rel=1e-9)
    assert complex(Q(1j * wanted.omega)) == pytest.approx(wanted.at_omega, rel=1e-9)
    assert Q.is_stable


def test_pole_design_refuses_where_it_is_unstable() -> None:
    with pytest.raises(InputError, match="unstable poles"):
        by_poles(conditions(1.5, 8.1e-3, 4.0))


@pytest.mark.parametrize(("e", "f"), [(0.0, 1.0), (2.0, -1.0), (float("nan"), 1.0)])
def test_unstable_denominators_are_refused(e: float, f: float) -> None:
    with pytest.raises(InputError, match="both positive"):
        by_zeros(conditions(1.5, 8.1e-3, 4.0), e, f)


def test_all_methods_are_recorded(extended_design: Design) -> None:
    assert set(extended_design.parameters["Q"]) == set(METHODS)


def test_design_json_round_trip(extended_design: Design, delay_free_design: Design, tmp_path) -> None:  # type: ignore[no-untyped-def]
    for design in (extended_design, delay_free_design):
        path = tmp_path / "design.json"
        path.write_text(design.to_json(), encoding="utf-8")
        assert read_design(path) == design
