"""Chapter 2 on plants of every structure: the closed loop by routes that share nothing with the design."""

from __future__ import annotations

import dataclasses
import math
from functools import cache

import control
import numpy as np
import pytest
from flint import fmpq, fmpq_poly

from design.blocks.block import plant_block
from design.chapter_2.design_delay_free import design_delay_free
from design.chapter_2.internal_model import internal_model
from design.design_file import Design
from identification.base.errors import InputError
from identification.model.additive_bound import AdditiveBound
from identification.model.model_file import IdentifiedModel
from identification.model.modes import Mode
from identification.model.plant import PlantModel

EPSILON = 0.01  # of the square of the slowest reference
MODEL = IdentifiedModel(PlantModel(1.0, (), (), 0.0), AdditiveBound(1.0, (), (), (), (1.0,)))


def random_model(seed: int) -> tuple[IdentifiedModel, list[float]]:
    """Plant, W_a, rad/s: 0 to 2 integrators, real roots, up to 2 pairs of zeros, up to 5 poles more than zeros.

    Gains spread over six decades, units of time over six.
    """
    rng = np.random.default_rng(seed)
    time, gain, integrators = 10 ** rng.uniform(-3, 3), 10 ** rng.uniform(-3, 3), seed % 3

    def rates(count: int) -> tuple[float, ...]:
        return tuple(float(rate) for rate in 10 ** rng.uniform(1, 3, count) / time)

    def modes(count: int) -> tuple[Mode, ...]:
        return tuple(Mode(omega, float(10 ** rng.uniform(-2, -0.2))) for omega in rates(count))

    pairs, single = int(rng.integers(0, 3)), int(rng.integers(0, 2))
    poles = max(0, 2 * pairs + single + int(rng.integers(0, 6)) - integrators)
    plant = PlantModel(
        float(rng.choice([-1, 1]) * gain / time**integrators),
        modes(pairs),
        modes(poles // 3),
        0.0,
        integrators,
        rates(single),
        rates(poles - 2 * (poles // 3)),
    )
    bound = AdditiveBound(float(gain * 10 ** rng.uniform(-4, -2)), (), modes(1), rates(1))
    omegas = 10 ** rng.uniform(-0.5, 1, 1 + seed % 2) / time
    return dataclasses.replace(MODEL, plant=plant, additive_bound=bound), omegas.tolist()


@cache
def designed(seed: int, integral_action: bool) -> Design:
    model, omegas = random_model(seed)
    epsilon = None if integral_action else float(EPSILON * min(omegas) ** 2)
    return design_delay_free(model, omegas, epsilon, sector=0.5)


def characteristic_roots(design: Design) -> np.ndarray:
    """Roots of den P den C + num P num C, an exact polynomial, with those that cancel between P and C."""
    P, C = plant_block(design.loop_plant), design.controller_parts()[0]
    assert C.relative_degree >= 0
    total = _exact(P.poles + C.poles) + _rational(P.gain) * _rational(C.gain) * _exact(P.zeros + C.zeros)
    return np.array([complex(root) for root, count in total.numer().complex_roots() for _ in range(count)])


def _rational(value: float) -> fmpq:
    return fmpq(*value.as_integer_ratio())


def _exact(roots: tuple[complex, ...]) -> fmpq_poly:
    product = fmpq_poly([1])
    for root in roots:
        real, imag = _rational(root.real), _rational(root.imag)
        if imag == 0:
            product *= fmpq_poly([-real, 1])
        elif imag > 0:
            product *= fmpq_poly([real**2 + imag**2, -2 * real, 1])
    return product


@pytest.mark.parametrize("integral_action", [False, True], ids=["epsilon", "integral action"])
@pytest.mark.parametrize("seed", range(5))
def test_the_loop_around_a_random_plant(seed: int, integral_action: bool) -> None:
    design = designed(seed, integral_action)
    hinf, blocks = design.hinf, design.blocks
    assert hinf is not None
    roots = characteristic_roots(design)
    hidden = roots[roots == 0]
    assert len(hidden) == (0 if integral_action else design.plant.integrators)
    assert np.max(roots[roots != 0].real) < -0.999 * hinf.decay_rate
    # S = 0 at every reference: C has a pole exactly there, and P no zero
    C = design.controller_parts()[0]
    assert all(1j * omega in C.poles for omega in design.reference_omegas)
    assert (0 in C.poles) == integral_action
    # the norm (2.8) lies between its two bounds
    fastest = max(abs(root) for root in C.zeros + C.poles)
    s = 1j * np.geomspace(1e-3 * design.reference_omegas[0], 1e3 * fastest, 20_000)
    L = plant_block(design.loop_plant)(s) * C(s)
    norm = np.hypot(np.abs(hinf.W1(s) / (1 + L)), np.abs(hinf.W2(s) * L / (1 + L))).max()
    assert 0.98 * hinf.gamma_lower <= norm <= hinf.gamma * (1 + 1e-6)
    assert hinf.gamma_line_lower <= hinf.gamma_line <= 1.0101 * hinf.gamma_line_lower
    # (2.4) to (2.6), where they are neither 0 nor infinite
    at = fastest * np.array([0.013 + 0.02j, 0.7 + 0.3j])
    one_plus_F = 1 + blocks["F1"](at) * blocks["F2"](at)
    np.testing.assert_allclose(one_plus_F, blocks["Lambda"](at) * blocks["F1"](at) / plant_numerator_at(design, at))
    np.testing.assert_allclose(blocks["G_A"](at) * one_plus_F, blocks["F1"](at), rtol=1e-6)


def plant_numerator_at(design: Design, s: np.ndarray) -> np.ndarray:
    """B(s) of (2.3), from the plant's own parameters."""
    plant, value = design.plant, np.full(s.shape, design.plant.gain, dtype=complex)
    for mode in plant.zero_modes:
        value *= mode(s)
    for rate in plant.real_zeros:
        value *= 1 + s / rate
    return value


STRUCTURES = {
    "motor with friction": PlantModel(8.4, (), (Mode(480.0, 0.02),), 0.0, 0, (), (12.0,)),
    "one integrator": PlantModel(7.0, (Mode(175.0, 0.01),), (Mode(150.0, 0.01),), 0.0),
    "free inertia": PlantModel(3600.0, (), (Mode(340.0, 0.02),), 0.0, 2),
}


@pytest.mark.parametrize("name", STRUCTURES)
@pytest.mark.parametrize("integral_action", [False, True], ids=["epsilon", "integral action"])
def test_what_a_constant_disturbance_at_the_input_does(name: str, integral_action: bool) -> None:
    """python-control's step response from the plant's input to y: y drifts as t^integrators, or returns to 0."""
    plant = STRUCTURES[name]
    bound = AdditiveBound(1e-3 * abs(plant.gain), (), (Mode(300.0, 0.3),), (60.0,))
    model = dataclasses.replace(MODEL, plant=plant, additive_bound=bound)
    design = design_delay_free(model, [math.pi], None if integral_action else 0.01)
    assert design.hinf is not None
    P, C = plant_block(plant), design.controller_parts()[0]
    system = control.feedback(control.ss(P.to_control()), control.ss(C.to_control()))
    settled = 12 / design.hinf.decay_rate
    time = np.linspace(0.0, 2 * settled, 4001)
    y = control.forced_response(system, time, np.ones_like(time)).outputs
    late = y[time >= settled]
    if integral_action:
        assert np.abs(late).max() < 1e-4 * np.abs(y).max()
        return
    # S(0) P: of an integrator the residue, of two the second
    Lambda, K, B = (
        complex(value).real
        for value in (
            design.blocks["Lambda"](0j),
            design.blocks["K"](0j),
            plant_numerator_at(design, np.array([0j]))[0],
        )
    )
    share = plant.gain * Lambda / (Lambda + K * B)
    degree = plant.integrators
    drift = np.polyfit(time[time >= settled], late, degree)[0] * max(1, degree)
    assert drift == pytest.approx(share, rel=1e-3)


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"integrators": -2}, "has 2 zeros at s = 0, so that no bounded input holds a constant output"),
        ({"integrators": -1}, "has a zero at s = 0, so that"),
        ({"real_zeros": (-3.5,)}, "a zero in the right half plane, at 3.5 rad/s"),
        ({"zero_modes": (Mode(5.0, -0.6),)}, r"a zero in the right half plane, at 3 \+- 4j rad/s"),
        ({"real_poles": (-3.5,)}, "a pole in the right half plane, at 3.5 rad/s, which C = K A/Lambda cancels"),
        ({"pole_modes": (Mode(5.0, -0.6),)}, r"a pole in the right half plane, at 3 \+- 4j rad/s"),
    ],
)
def test_plants_that_chapter_2_cannot_take(changes: dict[str, object], sentence: str) -> None:
    plant = dataclasses.replace(PlantModel(2.0, (), (Mode(9.0, 0.2),), 0.0, 0, (), (3.0,)), **changes)  # type: ignore[arg-type]
    for epsilon in (1e-3, None):
        with pytest.raises(InputError, match=sentence):
            design_delay_free(dataclasses.replace(MODEL, plant=plant), [math.tau], epsilon)


@pytest.mark.parametrize(
    ("omegas", "epsilon", "sentence"),
    [
        ([1.0, 2.0, 1.0], 1e-3, "expected each frequency once"),
        ([], 1e-3, "expected one or more positive numbers"),
        ([2.0, np.inf], 1e-3, "expected one or more positive numbers"),
        ([2.0, 1.0], 1.0, "expected 0 < epsilon < omega"),
        ([2.0], 0.0, "expected 0 < epsilon < omega"),
    ],
)
def test_references_that_are_refused(omegas: list[float], epsilon: float, sentence: str) -> None:
    with pytest.raises(InputError, match=sentence):
        internal_model(PlantModel(1.0, (), (), 0.0), omegas, epsilon)


def test_a_bound_that_does_not_fall_makes_the_controller_fall() -> None:
    """|W_a C S| at infinite frequency is that of |W_a C|."""
    plant = PlantModel(2.0, (), (Mode(9.0, 0.2), Mode(20.0, 0.1)), 0.0, 1, (), (3.0,))
    flat = AdditiveBound(0.01, (), (), (2.0,), (30.0,))
    design = design_delay_free(dataclasses.replace(MODEL, plant=plant, additive_bound=flat), [math.pi], 1e-3)
    assert design.controller_parts()[0].relative_degree == 1
    assert np.max(characteristic_roots(design).real) == 0
