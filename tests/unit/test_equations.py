"""The thesis's numbered equations, both sides evaluated apart, on random plants and designs of its class."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from numpy.typing import NDArray

from data.thesis import model_named, printed_numbers
from design.anti_windup.compensator import AntiWindup, second_order, uncertainty_cost
from design.blocks.block import Block, plant_block, plant_denominator, plant_numerator
from design.blocks.frequency_peak import peak
from design.chapter_2.internal_model import internal_model, reference_polynomial
from design.chapters_3_4.design_extended import design_extended
from design.chapters_3_4.interpolate_Q import StableFunction, by_zeros, conditions
from design.chapters_3_4.smith_predictor import (
    FreePart,
    anti_windup_controller,
    anti_windup_theta1,
    augmented_plant,
    free_part,
    smith_controller,
    stabiliser,
    thesis_factors,
)
from design.design_file import Design
from design.hinf.closed_loop_norm import closed_loop_poles
from design.stability.characteristic_roots import rightmost_roots
from design.stability.coprime import controller, coprime_factors, evaluate
from design.stability.delay_loop import DelayLoop
from design.stability.margins import delay_loop, responses
from experiments.engine.saturated_loop import SaturatedLoop
from experiments.engine.simulate import simulate
from experiments.runs.design_loop import design_loop
from experiments.runs.references import Reference, sinusoid
from experiments.thesis.claims.checks.transfer_functions import bound_4_9, plant_4_8
from experiments.thesis.claims.inputs import rounded_inputs
from experiments.thesis.claims.ledger import read_ledger
from identification.model.additive_bound import AdditiveBound
from identification.model.model_file import IdentifiedModel
from identification.model.modes import Mode
from identification.model.plant import PlantModel

Complex = NDArray[np.complex128]

SEEDS = range(4)
each = pytest.mark.parametrize("seed", SEEDS)


def points(random: np.random.Generator, count: int = 40) -> Complex:
    """Complex frequencies of either sign of Re s, rad/s, away from the axis and from the real axis."""
    size, angle = np.exp(random.uniform(np.log(0.2), np.log(400), count)), random.uniform(0.3, 1.4, count)
    return np.asarray(size * np.exp(1j * angle))


def random_plant(random: np.random.Generator) -> PlantModel:
    """Of the thesis's class: K/s times as many zero pairs as pole pairs times a dead time."""
    pairs = int(random.integers(0, 3))

    def modes() -> tuple[Mode, ...]:
        return tuple(Mode(float(random.uniform(20, 600)), float(random.uniform(0.01, 0.5))) for _ in range(pairs))

    return PlantModel(float(random.uniform(0.5, 20)), modes(), modes(), float(random.uniform(1e-3, 0.03)))


def R_0(plant: PlantModel, s: Complex) -> Complex:
    """As printed below (3.1)."""
    value = np.ones_like(s)
    for mode in plant.zero_modes:
        value = value * (s**2 / mode.omega**2 + 2 * mode.zeta * (s / mode.omega) + 1)
    for mode in plant.pole_modes:
        value = value / (s**2 / mode.omega**2 + 2 * mode.zeta * (s / mode.omega) + 1)
    return np.asarray(value)


@dataclasses.dataclass
class Smith:
    """A random plant, the numbers of a design by the zeros of Q, and its free part."""

    plant: PlantModel
    a: float
    omega: float
    e: float
    f: float
    Q: StableFunction
    free: FreePart
    s: Complex

    @property
    def late(self) -> Complex:
        """exp(-T_d s)."""
        return np.asarray(np.exp(-self.plant.delay_s * self.s))

    @property
    def P(self) -> Complex:
        """As printed in (3.1)."""
        return np.asarray(self.plant.gain / self.s * R_0(self.plant, self.s) * self.late)


@pytest.fixture
def smith(seed: int) -> Smith:
    random = np.random.default_rng(seed)
    plant = random_plant(random)
    a, omega, e, f = (float(number) for number in random.uniform([1, 0.5, 1, 0.5], [8, 4, 4, 4]))
    Q = by_zeros(conditions([omega], plant.delay_s, a), [(e, f)])
    return Smith(plant, a, omega, e, f, Q, free_part(Q, a), points(random))


@pytest.fixture
def random_Q(seed: int) -> StableFunction:
    """Any stable Q of order two, without interpolation."""
    random = np.random.default_rng(seed)
    numerator = tuple(float(number) for number in random.uniform(-3, 3, 3))
    return StableFunction(numerator, (complex(-random.uniform(0.5, 3)), complex(-random.uniform(3, 9))))


def random_theta(random: np.random.Generator) -> tuple[float, float, float]:
    alpha, beta, gamma = random.uniform([0.02, 0.02, -0.9], [0.3, 0.3, 100])
    return float(alpha), float(beta), float(gamma)


@pytest.fixture(scope="module")
def designs(implied: IdentifiedModel, extended_design: Design) -> list[Design]:
    """Extended designs of the thesis's plant and of a random one with a longer dead time."""
    plant = dataclasses.replace(random_plant(np.random.default_rng(7)), delay_s=0.04)
    bound = AdditiveBound.printed_form(0.0015 * plant.gain, 20.0, 280.0, 0.01)
    return [extended_design, design_extended(IdentifiedModel(plant, bound), [2.5], 3.0, [(3.0, 2.0)])]


# section 2.1


@each
def test_definition_2_1_1_stable_is_bounded_in_the_right_half_plane(seed: int) -> None:
    random = np.random.default_rng(seed)
    real, imag = random.uniform(0.5, 5, 3), random.uniform(0.5, 5)
    zeros = (complex(random.uniform(-5, 5)),)
    stable = Block(2.0, zeros, (complex(-real[0]), complex(-real[1], imag), complex(-real[1], -imag)))
    x, y = np.meshgrid(np.append(0.0, np.geomspace(1e-3, 1e3, 200)), np.linspace(-40, 40, 801))
    on_the_axis, _ = peak(lambda omega: np.abs(stable(1j * omega)), stable.zeros + stable.poles)
    assert stable.is_stable
    assert np.abs(stable(x + 1j * y)).max() <= on_the_axis * (1 + 1e-5)
    for pole in (complex(real[2]), 0j):
        unstable = Block(2.0, zeros, (*stable.poles, pole))
        assert not unstable.is_stable
        assert abs(complex(unstable(pole + 1e-9))) > 1e6 * abs(complex(unstable(pole + 1.0)))


@pytest.mark.parametrize(("omega", "zeta"), [(3.0, 0.01), (280.0, 0.05), (50.0, 0.6)])
def test_2_1_the_norm_is_the_largest_modulus_of_the_right_half_plane(omega: float, zeta: float) -> None:
    """Of 1/(1 + 2 zeta s/omega + (s/omega)^2): 1/(2 zeta sqrt(1 - zeta^2)); and nowhere in Re s > 0 is it more."""
    mode = Mode(omega, zeta)
    value, at = peak(lambda w: 1 / np.abs(mode(1j * w)), mode.roots)
    assert value == pytest.approx(1 / (2 * zeta * np.sqrt(1 - zeta**2)), rel=1e-9)
    assert at == pytest.approx(omega * np.sqrt(1 - 2 * zeta**2), rel=1e-4)
    x, y = np.meshgrid(omega * np.geomspace(1e-6, 10, 100), omega * np.linspace(0, 3, 601))
    assert np.abs(1 / mode(x + 1j * y)).max() <= value


# section 2.3.1


@each
def test_2_2_lambda_takes_the_poles_off_the_reference(seed: int) -> None:
    """Lambda R = R_0 is a polynomial: the cubic through four of its values goes through all others."""
    random = np.random.default_rng(seed)
    omega, phase = random.uniform(0.5, 5), random.uniform(0, 6)
    z = sinusoid(50.0, omega, phase, 0.0).generator()
    s = points(random, 20) / 40
    R = np.array([z.row @ np.linalg.solve(at * np.eye(len(z.start)) - z.matrix, z.start) for at in s])
    # the Laplace transform of 50 sin(omega t + phase)
    np.testing.assert_allclose(R, 50 * (s * np.sin(phase) + omega * np.cos(phase)) / (s**2 + omega**2), rtol=1e-9)
    Lambda = reference_polynomial([omega], 1e-4)
    np.testing.assert_allclose(Lambda(s), (s**2 + 1e-4) * (s**2 + omega**2), rtol=1e-12)
    R_0_of_s = Lambda(s) * R
    cubic = np.linalg.solve(np.vander(s[:4], 4), R_0_of_s[:4])
    np.testing.assert_allclose(np.polyval(cubic, s), R_0_of_s, rtol=1e-6, atol=1e-6 * np.abs(R_0_of_s).max())


@each
def test_2_3_the_plant_is_B_over_A_and_so_is_F_1(seed: int) -> None:
    random = np.random.default_rng(seed)
    plant = random_plant(random).without_delay()
    s = points(random)
    B, A = plant_numerator(plant), plant_denominator(plant)
    assert not B.poles + A.poles  # polynomials
    np.testing.assert_allclose(plant_block(plant)(s), plant.gain / s * R_0(plant, s), rtol=1e-10)
    np.testing.assert_allclose(B(s) / A(s), plant.gain / s * R_0(plant, s), rtol=1e-10)
    np.testing.assert_allclose(internal_model(plant, [1.5], 1e-4).F1(s), B(s) / A(s), rtol=1e-10)


def test_lemma_1_the_error_of_the_linear_loop_dies_out(delay_free_design: Design) -> None:
    """E = (1 + F) A R_0 Lambda^-1/((1 + F) A + K B) of the proof is r - y of the loop; its poles are stable."""
    blocks, (omega,) = delay_free_design.blocks, delay_free_design.reference_omegas
    plant = delay_free_design.plant.without_delay()
    s = points(np.random.default_rng(0))
    A, B, Lambda = plant_denominator(plant), plant_numerator(plant), blocks["Lambda"]
    units = internal_model(plant, [omega], delay_free_design.parameters.epsilon)
    one_plus_F = 1 + units.F1(s) * units.F2(s)
    loop = design_loop(delay_free_design, sinusoid(50.0, omega, 0.7, 0.0), None)
    found = [signals(loop, complex(at), free=True) for at in s]
    R = np.array([signal["reference"] for signal in found])
    E = one_plus_F * A(s) * (R * Lambda(s)) / Lambda(s) / (one_plus_F * A(s) + blocks["K"](s) * B(s))
    np.testing.assert_allclose([signal["error"] for signal in found], E, rtol=1e-5)
    assert max(pole.real for pole in closed_loop_poles(blocks["G_A"], blocks["K"])) < 0
    error = simulate(loop, (-np.inf, np.inf), np.linspace(0, 40, 2001)).outputs["error"]
    assert np.abs(error[:100]).max() > 10
    assert np.abs(error[-100:]).max() < 1e-6


@each
def test_2_4_to_2_6_the_internal_model(seed: int) -> None:
    random = np.random.default_rng(seed)
    plant, omega = random_plant(random).without_delay(), float(random.uniform(0.5, 5))
    units, s = internal_model(plant, [omega], 1e-4), points(random)
    A, B = plant_denominator(plant)(s), plant_numerator(plant)(s)
    Lambda = (s**2 + 1e-4) * (s**2 + omega**2)
    np.testing.assert_allclose(1 + units.F1(s) * units.F2(s), Lambda / A, rtol=1e-6)  # (2.4)
    np.testing.assert_allclose(units.one_plus_F(s), Lambda / A, rtol=1e-9)
    np.testing.assert_allclose(units.F2(s), (Lambda - A) / B, rtol=1e-6)  # (2.5)
    np.testing.assert_allclose(units.G_A(s), B / A / (1 + units.F1(s) * units.F2(s)), rtol=1e-6)  # (2.6)


def test_remark_1_the_weights_hold_the_reference_and_the_uncertainty(delay_free_design: Design) -> None:
    """W_1 has the roots of Lambda, moved left by twice the decay rate; |W_2| of stabiliser_problem is |W_a/G|."""
    design = delay_free_design
    assert design.hinf is not None
    W_1, W_2, rate = design.hinf.W1, design.hinf.W2, design.hinf.decay_rate
    Lambda = reference_polynomial(design.reference_omegas, design.parameters.epsilon)
    np.testing.assert_allclose(W_1.poles, np.array(Lambda.zeros) - 2 * rate, rtol=1e-12)
    s = 1j * np.geomspace(0.1, 1e3, 300)
    G = design.plant.without_delay()
    np.testing.assert_allclose(np.abs(W_2(s)), np.abs(design.additive_bound(s) / G(s)), rtol=1e-9)


# section 2.3.2: Lemma 2, step by step


def signals(loop: SaturatedLoop, s: complex, m: complex = 0.0, free: bool = False) -> dict[str, complex]:
    """Laplace transforms at s of a loop whose plant input u_m is anything: m, or u itself if ``free``."""
    W = np.exp(-s * loop.delays)[:, None] * loop.Z
    M = s * np.eye(len(loop.x0)) - loop.A - loop.D @ W
    u_row = loop.C + loop.E @ W
    if free:
        x = np.linalg.solve(M - np.outer(loop.B, u_row), loop.x0.astype(complex))
        m = u_row @ x
    else:
        x = np.linalg.solve(M, loop.B * m + loop.x0)
    outputs = {name: row @ x + late @ (W @ x) for name, (row, late) in loop.outputs.items()}
    return outputs | {"u": u_row @ x, "u_m": m}


@dataclasses.dataclass
class Case:
    """Fig. 2.6 with any u_m: its signals at the points s, and the blocks evaluated from their own formulas."""

    s: Complex
    G: Complex
    F: Complex
    theta1: Complex
    theta2: Complex
    y: Complex
    y_lin: Complex
    u: Complex
    u_m: Complex
    u_lin: Complex


@pytest.fixture(params=["delay_free_design", "extended_design"])
def chapter(request: pytest.FixtureRequest) -> Design:
    design = request.getfixturevalue(request.param)
    assert isinstance(design, Design)
    return design


def lemma_2(design: Design, seed: int, free: bool = False) -> Case:
    random = np.random.default_rng(seed)
    alpha, beta, gamma = random_theta(random)
    s = points(random)
    loop = design_loop(design, sinusoid(50.0, 1.5, 0.4, 3.0), second_order(alpha, beta, gamma))
    given = random.standard_normal((len(s), 2)) @ [100, 100j]
    found = [signals(loop, complex(at), complex(m), free) for at, m in zip(s, given, strict=True)]
    values = {name: np.array([signal[name] for signal in found]) for name in found[0]}
    G = design.loop_plant.gain / s * R_0(design.loop_plant, s) * np.exp(-design.loop_plant.delay_s * s)
    F = design.blocks["F1"](s) * design.blocks["F2"](s)
    theta1_tilde = gamma / ((1 + alpha * s) * (1 + beta * s))
    return Case(
        s=s,
        G=G,
        F=F,
        theta1=theta1_tilde * (1 + F),
        theta2=G * (1 + theta1_tilde),
        y=values["output"],
        y_lin=values["y_lin"],
        u=values["u"],
        u_m=values["u_m"],
        u_lin=design.blocks["K"](s) * (values["reference"] - values["y_lin"]),
    )


def close(left: Complex, right: Complex) -> None:
    np.testing.assert_allclose(left, right, rtol=1e-5, atol=1e-9 * float(np.abs(right).max()))


@each
def test_2_9_and_2_13_both_augmented_plants_are_one(seed: int) -> None:
    """G/(1 + F) = theta_2/(1 + F + theta_1), with the dead time exact, for random plants, F and theta1~."""
    random = np.random.default_rng(seed + 50)
    plant, s = random_plant(random), points(random)
    Q = by_zeros(conditions([2.0], plant.delay_s, 3.0), [(2.0, 1.5)])
    T_so, kind = free_part(Q, 3.0).T_so, second_order(*random_theta(random))
    F = -T_so(s) * np.exp(-plant.delay_s * s)
    G = plant.gain / s * R_0(plant, s) * np.exp(-plant.delay_s * s)
    theta1, theta2 = anti_windup_theta1(kind.theta1_tilde, plant, T_so, s), kind.theta2(plant)(s)
    G_A = augmented_plant(plant, T_so, s)
    np.testing.assert_allclose(G_A, G / (1 + F), rtol=1e-9)
    np.testing.assert_allclose(G_A, theta2 / (1 + F + theta1), rtol=1e-9)


@pytest.mark.parametrize("free", [True, False], ids=["linear", "any u_m"])
def test_2_13_y_lin_over_u_lin_is_the_augmented_plant(extended_design: Design, free: bool) -> None:
    case = lemma_2(extended_design, 1, free)
    close(case.y_lin / case.u_lin, augmented_plant(extended_design.plant, extended_design.blocks["T_so"], case.s))


@each
def test_2_10_y_lin_from_u_lin_and_u_m(chapter: Design, seed: int) -> None:
    """Both lines, and the u of the line above them, whatever u_m is."""
    case = lemma_2(chapter, seed)
    below = 1 + case.F + case.theta1
    u = case.u_lin / below + case.u_m * case.theta1 / below
    close(case.u, u)
    close(case.y_lin, case.u_m * case.G + (u - case.u_m) * case.theta2)
    second = case.u_lin * case.theta2 / below - case.u_m * (1 + case.F) / below * case.theta2 + case.u_m * case.G
    close(case.y_lin, second)


@each
def test_2_11_G_from_theta_2(seed: int) -> None:
    """theta_2 of the design, in G = (1 + F) theta_2/(1 + F + theta_1) with any F: theta_1 = theta1~ (1 + F)."""
    random = np.random.default_rng(seed)
    plant, s = random_plant(random), points(random)
    alpha, beta, gamma = random_theta(random)
    F = random.standard_normal((len(s), 2)) @ [3, 3j]
    theta1 = gamma / ((1 + alpha * s) * (1 + beta * s)) * (1 + F)
    theta2 = second_order(alpha, beta, gamma).theta2(plant)(s)
    G = plant.gain / s * R_0(plant, s) * np.exp(-plant.delay_s * s)
    np.testing.assert_allclose((1 + F) * theta2 / (1 + F + theta1), G, rtol=1e-8)


@each
def test_2_12_y_lin_does_not_see_u_m(chapter: Design, seed: int) -> None:
    case = lemma_2(chapter, seed)
    close(case.y_lin, case.theta2 / (1 + case.F + case.theta1) * case.u_lin)
    assert np.abs(case.y - case.y_lin).max() > 1e-3  # y does


@each
def test_2_14_y_of_the_loop_without_saturation(chapter: Design, seed: int) -> None:
    case = lemma_2(chapter, seed, free=True)
    close(case.u, case.u_m)
    close(case.y, case.G / (1 + case.F) * case.u_lin)


@each
def test_2_15_both_sides(chapter: Design, seed: int) -> None:
    case = lemma_2(chapter, seed)
    below = 1 + case.F + case.theta1
    right = case.u_lin / below * case.theta2 - case.u_m * (1 + case.F) / below * case.theta2 + case.u_m * case.G
    close(case.y_lin, right)  # which is y_lin, by (2.10)
    close(case.G / (1 + case.F) * case.u_lin, right)


@pytest.mark.parametrize("limits", [(-1.0, 2.0), (0.3, 1.7), (-4.0, -1.0)])
def test_2_16_what_saturation_leaves_and_what_the_dead_zone_takes(limits: tuple[float, float]) -> None:
    """u = r open loop, m' = sat(u): the integral of what is left is the integrator's state."""
    low, high = limits
    reference = Reference((3.0,), (2.0,), (0.4,), 0.5)
    z = reference.generator()
    n = len(z.start)
    A, B, C = np.zeros((n + 1, n + 1)), np.zeros(n + 1), np.zeros(n + 1)
    A[:n, :n], B[n], C[:n] = z.matrix, 1.0, z.row
    state = (np.eye(n + 1)[n], np.zeros(1))
    D, E, Z = np.zeros((n + 1, 1)), np.zeros(1), np.zeros((1, n + 1))
    loop = SaturatedLoop(A, B, C, D, E, Z, np.zeros(1), np.append(z.start, 0.0), {"integral": state})
    run = simulate(loop, limits, np.linspace(0, 7, 40_001))
    u = reference(run.time_s)
    printed_dead_zone = np.where(u <= low, u - low, np.where(u >= high, u - high, 0.0))
    np.testing.assert_allclose(run.control - run.saturated_control, printed_dead_zone, atol=1e-10)
    rectangles = np.diff(run.time_s) * (u - printed_dead_zone)[1:]
    trapezoids = np.cumsum(rectangles - np.diff(u - printed_dead_zone) * np.diff(run.time_s) / 2)
    np.testing.assert_allclose(run.outputs["integral"][1:], trapezoids, atol=1e-6)


@each
def test_2_17_and_2_18_theta_1_and_theta_2(chapter: Design, seed: int) -> None:
    """Of design_delay_free and design_extended: theta_1 = theta1~ (1 + F), theta_2 = G (1 + theta1~)."""
    s = points(np.random.default_rng(seed))
    theta1_tilde, F = chapter.blocks["theta1_tilde"](s), chapter.blocks["F1"](s) * chapter.blocks["F2"](s)
    chosen = chapter.thesis
    formula = chosen.gamma / ((1 + chosen.alpha * s) * (1 + chosen.beta * s))
    np.testing.assert_allclose(theta1_tilde, formula, rtol=1e-9)
    if "theta1" in chapter.blocks:
        theta1 = chapter.blocks["theta1"](s)
    else:
        theta1 = anti_windup_theta1(chapter.blocks["theta1_tilde"], chapter.plant, chapter.blocks["T_so"], s)
    np.testing.assert_allclose(theta1, formula * (1 + F), rtol=1e-5)
    G = chapter.loop_plant(s)
    np.testing.assert_allclose(chapter.blocks["theta2"](s), G * (1 + theta1 / (1 + F)), rtol=1e-5)
    np.testing.assert_allclose(
        chapter.compensator("thesis").theta2(chapter.loop_plant)(s), G * (1 + formula), rtol=1e-9
    )


@each
def test_2_19_f_in_closed_form(seed: int) -> None:
    """theta1~ that cancels W_a's zero and poles: f is the largest |gain (1 + gamma)/(1 + beta s)|."""
    random = np.random.default_rng(seed)
    alpha, beta, gamma = (
        float(random.uniform(0.02, 0.2)),
        float(random.uniform(0.02, 0.2)),
        float(random.uniform(2, 50)),
    )
    omega = np.sqrt((1 + gamma) / (alpha * beta))
    bound = AdditiveBound.printed_form(0.3, 1 / alpha, omega, (1 / alpha + 1 / beta) / (2 * omega))
    f, _ = uncertainty_cost(bound, second_order(alpha, beta, gamma).one_plus)
    assert f == pytest.approx(0.3 * (1 + gamma), rel=1e-6)
    # and where nothing cancels, the largest value on a dense grid
    other = AdditiveBound.printed_form(0.3, 7.0, 60.0, 0.05)
    f, at = uncertainty_cost(other, second_order(alpha, beta, gamma).one_plus)
    s = 1j * np.append(np.geomspace(1e-3, 1e5, 20_001), at)
    theta1_tilde = gamma / ((1 + alpha * s) * (1 + beta * s))
    W_a = 0.3 * (1 + s / 7) / (1 + 2 * 0.05 * s / 60 + (s / 60) ** 2)
    assert f == pytest.approx(np.abs(W_a * (1 + theta1_tilde)).max(), rel=1e-9)


@each
def test_2_20_and_3_1_the_plant_as_printed(seed: int) -> None:
    """With two pairs of modes (2.20), and with any number K/s R_0 exp(-T_d s), (3.1)."""
    random = np.random.default_rng(seed)
    s = points(random)
    plant = random_plant(random)
    late = np.exp(-plant.delay_s * s)
    np.testing.assert_allclose(plant(s), plant.gain / s * R_0(plant, s) * late, rtol=1e-12)
    zeros, poles = ((Mode(170.0, 0.3), Mode(900.0, 0.02)), (Mode(300.0, 0.01), Mode(950.0, 0.4)))
    K, h = 3.0, 0.02
    n1, n2, d1, d2 = (1 + 2 * mode.zeta * s / mode.omega + (s / mode.omega) ** 2 for mode in zeros + poles)
    np.testing.assert_allclose(
        PlantModel(K, zeros, poles, h)(s), K * n1 * n2 / (s * d1 * d2) * np.exp(-h * s), rtol=1e-12
    )


def test_table_2_1_as_printed() -> None:
    plant = model_named("table").plant
    assert (plant.gain, plant.delay_s, plant.integrators) == (7.1, 8.1e-3, 1)
    assert plant.zero_modes == (Mode(175.0, 0.08), Mode(930.0, 0.04))
    assert plant.pole_modes == (Mode(285.0, 0.02), Mode(960.0, 0.1))


@each
def test_2_23_theta1_tilde_as_printed(seed: int) -> None:
    random = np.random.default_rng(seed)
    alpha, beta, gamma = random_theta(random)
    s = points(random)
    theta1_tilde = gamma / ((1 + alpha * s) * (1 + beta * s))
    kind = second_order(alpha, beta, gamma)
    np.testing.assert_allclose(kind.theta1_tilde(s), theta1_tilde, rtol=1e-10)
    np.testing.assert_allclose(kind.one_plus(s), 1 + theta1_tilde, rtol=1e-9)


# section 3.1


@each
def test_3_2_the_smith_predictor_based_controller(smith: Smith) -> None:
    s, plant, C_0 = smith.s, smith.plant, smith.free.C_0(smith.s)
    inner = C_0 / (1 + C_0 * (1 - smith.late) / s)
    exact = 1 / (plant.gain * R_0(plant, s)) * inner
    np.testing.assert_allclose(smith_controller(plant, smith.free.C_0, s), exact, rtol=1e-7)
    # with the approximate inverse, in the form that is realised: K/(1 - T_so exp(-T_d s))
    K = stabiliser(plant, smith.free.T_so, inverse_epsilon=1e-3)
    approximate = 1 / (plant.gain * R_0(plant, s) * (1 + 1e-3 * s) ** 2) * inner
    np.testing.assert_allclose(anti_windup_controller(plant, K, smith.free.T_so, s), approximate, rtol=1e-6)


@each
def test_3_3_3_4_and_4_3_the_free_part_at_the_reference(smith: Smith) -> None:
    """C_0(0) = -1/T_d, C_0(j omega) = -j omega/(1 - exp(-j omega T_d)): C_1 has poles there."""
    C_0, T_d, s = smith.free.C_0, smith.plant.delay_s, 1j * smith.omega
    assert complex(C_0(0j)) == pytest.approx(-1 / T_d, rel=1e-6)
    assert complex(C_0(s)) == pytest.approx(-s / (1 - np.exp(-T_d * s)), rel=1e-6)
    for at in (0j, s):
        near, nearer = (abs(complex(smith_controller(smith.plant, C_0, at + d))) for d in (1e-4, 1e-5))
        assert nearer > 5 * near


@each
def test_3_5_the_characteristic_equation_is_1_plus_C_0_over_s(smith: Smith) -> None:
    """Times the denominator of C_0/s it is the characteristic function of the loop, whose dead time is gone."""
    plant, free, s = smith.plant, smith.free, smith.s
    loop = DelayLoop(plant_block(plant), stabiliser(plant, free.T_so), free.T_so, plant.delay_s)
    exact = evaluate(loop.characteristic, s)[0]
    denominator = s * np.prod([s - pole for pole in free.C_0.poles], axis=0)
    visible = np.prod([s - root for root in loop.denominator.zeros], axis=0)
    ours = (1 + free.C_0(s) / s) * denominator  # (s + a)^2 q
    np.testing.assert_allclose(
        exact, ours * visible / np.prod([s - pole for pole in free.T_so.poles], axis=0), rtol=1e-6
    )
    expected = (s + smith.a) ** 2 * (s**2 + smith.e * s + smith.f)
    np.testing.assert_allclose(ours, expected, rtol=1e-6)


@each
def test_3_6_and_4_1_the_parametrisation(seed: int, random_Q: StableFunction) -> None:
    random = np.random.default_rng(seed)
    a, s = float(random.uniform(1, 8)), points(random)
    Q, N_p, D_p, X, Y = random_Q.block()(s), 1 / (s + a), s / (s + a), a, 1.0
    C_0 = controller(coprime_factors(Block(1.0, (), (0j,)), (complex(-a),)), random_Q.block())
    np.testing.assert_allclose(C_0(s), (X + D_p * Q) / (Y - N_p * Q), rtol=1e-8)


@each
def test_3_7_and_3_8_the_bezout_equation_and_Y(seed: int) -> None:
    """For 1/s: X = a = 1/N_p(0), not 1/s, and Y = 1; and for plants of two poles."""
    random = np.random.default_rng(seed)
    a, s = float(random.uniform(1, 8)), points(random)
    of_integrator = coprime_factors(Block(1.0, (), (0j,)), (complex(-a),))
    assert Block(a) == of_integrator.X
    assert Block(1.0) == of_integrator.Y
    assert complex(of_integrator.X(0j)) == pytest.approx(1 / complex(of_integrator.N_p(0j)))
    poles = (complex(random.uniform(-3, 3)), 0j)
    roots = (complex(-a), complex(-2 * a))
    factors = coprime_factors(Block(2.0, (-5 + 0j,), poles), roots, (complex(-3 * a),))
    for found in (of_integrator, factors):
        N_p, D_p, X, Y = (block(s) for block in (found.N_p, found.D_p, found.X, found.Y))
        np.testing.assert_allclose(N_p * X + D_p * Y, 1.0, rtol=1e-9)  # (3.7)
        np.testing.assert_allclose(Y, (1 - N_p * X) / D_p, rtol=1e-7)  # (3.8)


@each
def test_3_9_and_4_2_the_free_part(seed: int, random_Q: StableFunction) -> None:
    random = np.random.default_rng(seed)
    a, s = float(random.uniform(1, 8)), points(random)
    Q = random_Q.block()(s)
    C_0 = (a + s / (s + a) * Q) / (1 - 1 / (s + a) * Q)
    np.testing.assert_allclose(free_part(random_Q, a).C_0(s), C_0, rtol=1e-8)


# section 3.2


@each
def test_3_10_the_controller_of_fig_2_5(chapter: Design, seed: int) -> None:
    s = points(np.random.default_rng(seed))
    forward, feedback = chapter.controller_parts()
    C = forward(s) / (1 - feedback(s) * np.exp(-chapter.loop_plant.delay_s * s))
    one_plus_F = 1 + chapter.blocks["F1"](s) * chapter.blocks["F2"](s)
    np.testing.assert_allclose(C, chapter.blocks["K"](s) / one_plus_F, rtol=1e-5)
    np.testing.assert_allclose(one_plus_F, 1 + chapter.loop_plant(s) * chapter.blocks["F2"](s), rtol=1e-9)


@each
def test_3_11_the_plant_with_its_dead_time_as_a_block(seed: int) -> None:
    random = np.random.default_rng(seed)
    plant, s = random_plant(random), points(random)
    expected = plant.gain / s * R_0(plant, s) * np.exp(-plant.delay_s * s)
    np.testing.assert_allclose(plant_block(plant)(s), expected, rtol=1e-10)


def extended_loop(smith: Smith) -> tuple[DelayLoop, Block]:
    K = stabiliser(smith.plant, smith.free.T_so)
    return DelayLoop(plant_block(smith.plant), K, smith.free.T_so, smith.plant.delay_s), K


@each
def test_3_12_and_3_13_the_characteristic_function(smith: Smith) -> None:
    """1 + G C_aw = 1 + G/(1 + G F_2) K: the characteristic terms over 1 + F, for any dead time of the true plant."""
    s = smith.s
    loop, K = extended_loop(smith)
    F_2 = -s * smith.free.T_so(s) / (smith.plant.gain * R_0(smith.plant, s))
    one_plus_F = 1 + smith.P * F_2
    one_plus_G_C = 1 + smith.P * K(s) / one_plus_F  # (3.12) with (3.10)
    denominator = loop.denominator(s)
    np.testing.assert_allclose(evaluate(loop.characteristic, s)[0], denominator * one_plus_F * one_plus_G_C, rtol=1e-6)
    G_A = augmented_plant(smith.plant, smith.free.T_so, s)
    np.testing.assert_allclose(1 + G_A * K(s), one_plus_G_C, rtol=1e-6)  # (3.13)
    # with another true dead time
    other = dataclasses.replace(loop, plant=plant_block(dataclasses.replace(smith.plant, delay_s=0.05)))
    G = smith.P / smith.late * np.exp(-0.05 * s)
    function = evaluate(other.characteristic, s)[0]
    np.testing.assert_allclose(function, denominator * (one_plus_F + G * K(s)), rtol=1e-6)


def test_3_14_the_roots_of_the_loop_but_one_are_stable(designs: list[Design]) -> None:
    """Those that K moves are; s = 0 is hidden between K and G/(1 + G F_2), from whose input to y the loop is P."""
    for design in designs:
        found = rightmost_roots(delay_loop(design, design.plant), 6)
        moved, poles = (sorted(roots, key=abs) for roots in (found.roots[~found.hidden], design.blocks["T_so"].poles))
        np.testing.assert_allclose(np.abs(moved), np.abs(poles), rtol=1e-5)
        assert np.all(np.array(moved).real < -0.1)
        outside = found.roots[found.hidden & (found.roots.real >= 0)]
        assert list(outside) == [0]
        s = points(np.random.default_rng(0))
        G_A = augmented_plant(design.plant, design.blocks["T_so"], s)
        np.testing.assert_allclose(G_A / (1 + G_A * design.blocks["K"](s)), design.plant(s), rtol=1e-7)


@each
def test_3_15_C_0_stabilises_an_integrator(seed: int, random_Q: StableFunction) -> None:
    """For every stable Q: the closed loop of C_0 and 1/s has its poles at -a, -a and those of Q."""
    a = float(np.random.default_rng(seed).uniform(1, 8))
    C_0 = free_part(random_Q, a).C_0
    poles = np.sort_complex(np.array(closed_loop_poles(Block(1.0, (), (0j,)), C_0)))
    expected = np.sort_complex(np.array([-a, -a, *random_Q.poles], dtype=complex))
    np.testing.assert_allclose(poles, expected, rtol=1e-5)
    assert not Block(1.0, (), (0j,)).is_stable


def test_3_16_to_3_18_Z_aw_and_W_aw(designs: list[Design]) -> None:
    """Z_aw from (3.16) is Lambda (W_aw exp(-T_d s) + s), with W_aw from (3.17), and its zeros are (3.18)."""
    for design in designs:
        s = points(np.random.default_rng(0))
        plant, (omega,) = design.plant, design.reference_omegas
        Lambda, late = s**2 + omega**2, np.exp(-plant.delay_s * s)
        Z_aw = (1 + plant(s) * design.blocks["F2"](s)) * Lambda * s  # (3.16)
        W_aw = design.blocks["F2"](s) * plant.gain * R_0(plant, s)  # (3.17)
        np.testing.assert_allclose(Z_aw, Lambda * (W_aw * late + s), rtol=1e-7)
        np.testing.assert_allclose(W_aw, -s * design.blocks["T_so"](s), rtol=1e-7)
        at = 1j * omega
        W_at = complex(design.blocks["F2"](at)) * plant.gain * complex(R_0(plant, np.array([at]))[0])
        assert W_at == pytest.approx(-at / np.exp(-plant.delay_s * at), rel=1e-9)  # (3.18)


@each
def test_3_18_W_aw_at_the_reference(smith: Smith) -> None:
    s = 1j * smith.omega
    assert -s * complex(smith.free.T_so(s)) == pytest.approx(-s / np.exp(-smith.plant.delay_s * s), rel=1e-9)
    assert smith.free.T_so.is_stable


@each
def test_3_19_the_outer_factor(smith: Smith) -> None:
    C_0, s = smith.free.C_0(smith.s), smith.s
    T_so = (C_0 / s) / (1 + C_0 / s)
    np.testing.assert_allclose(smith.free.T_so(s), T_so, rtol=1e-7)
    C_s = smith_controller(smith.plant, smith.free.C_0, s)
    np.testing.assert_allclose(smith.P * C_s / (1 + smith.P * C_s), T_so * smith.late, rtol=1e-5)
    axis = dataclasses.replace(smith, s=1j * np.geomspace(10, 1e3, 50))
    L = axis.P * smith_controller(smith.plant, smith.free.C_0, axis.s)
    T_si = L / (1 + L) / smith.free.T_so(axis.s)
    np.testing.assert_allclose(np.abs(T_si), 1.0, rtol=1e-5)  # all-pass


@each
def test_3_20_the_outer_factor_at_the_reference(smith: Smith) -> None:
    """The three forms of T_so(j omega_d), whose last is printed for T_si too; T_si(j omega_d) is its inverse."""
    s = 1j * smith.omega
    late = np.exp(-smith.plant.delay_s * s)
    C_0, T_so = complex(smith.free.C_0(s)), complex(smith.free.T_so(s))
    assert T_so == pytest.approx((C_0 / s) / (1 + C_0 / s), rel=1e-6)
    assert T_so == pytest.approx((late - 1) ** -1 / (1 + (late - 1) ** -1), rel=1e-8)
    assert T_so == pytest.approx(1 / late, rel=1e-8)
    beside = dataclasses.replace(smith, s=np.array([s * (1 + 1e-6)]))  # C_s has a pole at j omega_d
    L = beside.P * smith_controller(smith.plant, smith.free.C_0, beside.s)
    T_si = complex((L / (1 + L) / smith.free.T_so(beside.s))[0])
    assert T_si == pytest.approx(late, rel=1e-5)
    assert abs(T_si * late - 1) > 1e-3  # 1/late is what is printed


def test_3_21_W_aw_is_minus_s_T_so(designs: list[Design]) -> None:
    s = points(np.random.default_rng(1))
    for design in designs:
        W_aw = design.blocks["F2"](s) * design.plant.gain * R_0(design.plant, s)
        C_0 = design.blocks["C0"](s)
        np.testing.assert_allclose((C_0 / s) / (1 + C_0 / s), -W_aw / s, rtol=1e-7)
        np.testing.assert_allclose(design.blocks["T_so"](s), -W_aw / s, rtol=1e-8)


@each
def test_3_22_T_so_from_plant_controller_and_sensitivity(smith: Smith) -> None:
    C_s = smith_controller(smith.plant, smith.free.C_0, smith.s)
    S_s = 1 / (1 + smith.P * C_s)
    np.testing.assert_allclose(smith.free.T_so(smith.s), smith.P * C_s * S_s / smith.late, rtol=1e-5)


def test_3_23_F_2_is_minus_C_s_S_s(designs: list[Design]) -> None:
    s = points(np.random.default_rng(2))
    for design in designs:
        C_s = smith_controller(design.plant, design.blocks["C0"], s)
        np.testing.assert_allclose(design.blocks["F2"](s), -C_s / (1 + design.plant(s) * C_s), rtol=1e-5)


@each
def test_3_24_and_3_31_the_new_controller(smith: Smith) -> None:
    """With T_so written out by C_0; and it is the Smith predictor's, since K is (3.29)."""
    K, s = stabiliser(smith.plant, smith.free.T_so), smith.s
    C_0 = smith.free.C_0(s)
    T_so = (C_0 / s) / (1 + C_0 / s)
    C_aw = anti_windup_controller(smith.plant, K, smith.free.T_so, s)
    np.testing.assert_allclose(C_aw, K(s) / (1 - T_so * smith.late), rtol=1e-6)
    np.testing.assert_allclose(C_aw, smith_controller(smith.plant, smith.free.C_0, s), rtol=1e-6)
    # K is any stabiliser in (3.24)
    other = Block(3.0, (-7 + 0j,), (-1 + 0j, -2 + 0j))
    found = anti_windup_controller(smith.plant, other, smith.free.T_so, s)
    np.testing.assert_allclose(found, other(s) / (1 - T_so * smith.late), rtol=1e-6)


@each
def test_3_25_the_sensitivity(smith: Smith) -> None:
    loop, K = extended_loop(smith)
    omega = np.geomspace(0.3, 300, 60)
    at = dataclasses.replace(smith, s=1j * omega)
    C_0 = smith.free.C_0(at.s)
    S_aw = 1 / (1 + at.P * K(at.s) / (1 - (C_0 / at.s) / (1 + C_0 / at.s) * at.late))
    S, C_S = responses(loop, omega)
    np.testing.assert_allclose(S, S_aw, rtol=1e-5, atol=1e-8)
    C_aw = anti_windup_controller(smith.plant, K, smith.free.T_so, at.s)
    np.testing.assert_allclose(C_S, C_aw * S_aw, rtol=1e-5, atol=1e-8 * np.abs(C_S).max())


@each
def test_3_26_to_3_29_the_stabiliser(smith: Smith) -> None:
    blocks = (*thesis_factors(smith.plant, smith.free.T_so), stabiliser(smith.plant, smith.free.T_so))
    K_0, K_1, K = (block(smith.s) for block in blocks)
    C_0 = smith.free.C_0(smith.s)
    np.testing.assert_allclose(K, K_0 * K_1, rtol=1e-9)  # (3.26)
    np.testing.assert_allclose(K_1, 1 / (smith.plant.gain * R_0(smith.plant, smith.s)), rtol=1e-9)
    np.testing.assert_allclose(K_0, C_0 / (1 + C_0 / smith.s), rtol=1e-7)  # (3.28)
    np.testing.assert_allclose(K, C_0 / (1 + C_0 / smith.s) / (smith.plant.gain * R_0(smith.plant, smith.s)), rtol=1e-7)


@each
def test_3_27_as_corrected(smith: Smith) -> None:
    """1 + P C_aw = (1 - T_so e + K_0 e/s)/(1 - T_so e), for any K_0; the print is 1 - T_so e/(1 + K_0 e/s)."""
    s, late, T_so = smith.s, smith.late, smith.free.T_so(smith.s)
    K_1, K = thesis_factors(smith.plant, smith.free.T_so)[1], stabiliser(smith.plant, smith.free.T_so)
    for K_0 in (Block(1.0, (0j,)) * smith.free.T_so, Block(2.0, (-9 + 0j,), (-3 + 0j,))):
        loop = DelayLoop(plant_block(smith.plant), K_0 * K_1, smith.free.T_so, smith.plant.delay_s)
        function = evaluate(loop.characteristic, s)[0] / loop.denominator(s) / (1 - T_so * late)
        mended = (1 - T_so * late + K_0(s) * late / s) / (1 - T_so * late)
        np.testing.assert_allclose(function, mended, rtol=1e-6)
        as_printed = 1 - T_so * late / (1 + K_0(s) * late / s)
        assert np.max(np.abs(as_printed / mended - 1)) > 0.1
    # and with (3.28) its inverse is 1 - T_so e, stable
    mended = 1 + smith.P * anti_windup_controller(smith.plant, K, smith.free.T_so, s)
    np.testing.assert_allclose(1 / mended, 1 - T_so * late, rtol=1e-5, atol=1e-8)


@each
def test_3_30_theta_1_with_the_dead_time(smith: Smith) -> None:
    alpha, beta, gamma = random_theta(np.random.default_rng(3))
    kind: AntiWindup = second_order(alpha, beta, gamma)
    theta1_tilde = gamma / ((1 + alpha * smith.s) * (1 + beta * smith.s))
    C_0 = smith.free.C_0(smith.s)
    F = -(C_0 / smith.s) / (1 + C_0 / smith.s) * smith.late  # F_1 F_2 with F_2 = -s T_so/(K R_0)
    theta1 = anti_windup_theta1(kind.theta1_tilde, smith.plant, smith.free.T_so, smith.s)
    np.testing.assert_allclose(theta1, theta1_tilde * (1 + F), rtol=1e-6)
    np.testing.assert_allclose(kind.theta2(smith.plant)(smith.s), smith.P * (1 + theta1 / (1 + F)), rtol=1e-6)


# chapter 4


@each
def test_4_3_and_4_4_are_one_condition(smith: Smith) -> None:
    """(4.4) solved by hand from (4.2): Q = (C_0 - a)(s + a)/(s + C_0) with the values of (4.3)."""
    wanted, a, T_d, s = (
        conditions([smith.omega], smith.plant.delay_s, smith.a),
        smith.a,
        smith.plant.delay_s,
        1j * smith.omega,
    )
    C_0 = -s / (1 - np.exp(-T_d * s))
    assert wanted.at_omegas[0] == pytest.approx((C_0 - a) * (s + a) / (s + C_0), rel=1e-6)
    assert wanted.at_zero == pytest.approx((-1 / T_d - a) * a / (-1 / T_d), rel=1e-9)
    late = np.exp(-s * T_d)
    assert wanted.at_omegas[0] == pytest.approx((s + a - a * late) * (s + a) / (s * late), rel=1e-12)  # as printed
    assert wanted.at_zero == pytest.approx(a * (1 + a * T_d), rel=1e-12)


@each
def test_4_5_to_4_7_the_coefficients_as_printed(smith: Smith) -> None:
    a, T_d, omega, e, f, jw = smith.a, smith.plant.delay_s, smith.omega, smith.e, smith.f, 1j * smith.omega
    inside = (-(omega**2) + e * jw + f) * (jw + a - a * np.exp(-jw * T_d)) * (jw + a) / (jw * np.exp(-jw * T_d))
    d = f * a * (1 + a * T_d)  # (4.6)
    b, c = (inside.real - d) / -(omega**2), inside.imag / omega  # (4.7)
    np.testing.assert_allclose(smith.Q.numerator, (b, c, d), rtol=1e-9)
    s = smith.s
    np.testing.assert_allclose(smith.Q.block()(s), (b * s**2 + c * s + d) / (s**2 + e * s + f), rtol=1e-9)  # (4.5)


def test_4_8_the_plant_printed_again() -> None:
    """All agree with the set ``implied`` to half a unit of the last digit, but 285, which is 282."""
    found = plant_4_8({name: number.value for name, number in rounded_inputs(read_ledger()).items()})
    as_printed = {"P.gain": (7.1, 0.05), "P.delay_s": (8.1e-3, 5e-5), "P.delay_ms": (8.1, 0.05)}
    for side, two_zetas in {"zero": (0.016, 0.08), "pole": (0.04, 0.21)}.items():
        as_printed |= {f"P.{side}_mode_{k}.two_zeta": (value, 0.005) for k, value in enumerate(two_zetas, start=1)}
    omegas = {"P.zero_mode_1": 175, "P.zero_mode_2": 930, "P.pole_mode_1": 285, "P.pole_mode_2": 960}
    as_printed |= {f"{name}.omega": (omega, 0.5) for name, omega in omegas.items()}
    assert found.keys() == as_printed.keys()
    different = {name for name, (value, half) in as_printed.items() if abs(found[name] - value) > half * (1 + 1e-9)}
    assert different == {"P.pole_mode_1.omega"}
    assert found["P.pole_mode_1.omega"] == 282


def test_4_9_the_bound_printed_again() -> None:
    assert bound_4_9({}) == pytest.approx({"W_a.gain": 0.011, "W_a.corner": 20, "W_a.two_zeta": 0.02, "W_a.omega": 280})
    s = points(np.random.default_rng(0))
    W_a = 0.011 * (1 + s / 20) / (1 + 0.02 * (s / 280) + (s / 280) ** 2)
    np.testing.assert_allclose(model_named("implied").additive_bound(s), W_a, rtol=1e-12)


def test_tables_4_1_and_4_2_as_printed() -> None:
    chosen = printed_numbers()["extended"]
    assert (chosen["a"], chosen["e"], chosen["f"]) == (4, 2, 1)
    Q = by_zeros(conditions([chosen["reference"]["omega"]], 8.1e-3, chosen["a"]), [(chosen["e"], chosen["f"])])
    for found, as_printed, half in zip(Q.numerator, (6.2496, 6.89, 4.1296), (5e-5, 5e-3, 5e-5), strict=True):
        assert abs(found - as_printed) <= half
