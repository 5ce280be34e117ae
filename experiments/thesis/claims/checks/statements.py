"""What the thesis states of its designs in words, for its own numbers: 1 where it holds, 0 where it does not."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping

import numpy as np

from data.thesis import printed_numbers
from design.anti_windup.compensator import second_order
from design.blocks.block import Block, plant_block, plant_denominator, plant_numerator
from design.chapter_2.internal_model import reference_polynomial
from design.chapters_3_4.smith_predictor import anti_windup_controller, smith_controller
from design.stability.characteristic_roots import rightmost_roots
from design.stability.margins import delay_loop, margins_of
from experiments.thesis.claims.inputs import Inputs, plant_of
from experiments.thesis.printed_choices import chapter_2, chapter_4
from identification.model.plant import PlantModel

Statements = Mapping[str, float]

NOTHING = 1e-9  # what counts as 0, or as equal, of numbers of order 1
SECTORS = (0.1, 0.5, 1.0, 10.0, 1e4)  # k of Theorem 2.3.1, for which (2.23) is tried
GRID = 1j * np.geomspace(1e-3, 1e5, 2001)  # s = j omega, rad/s


def unanimous(answers: Iterable[bool]) -> float:
    """1 where all say that a statement holds, 0 where none does; NaN where it depends on what is not printed."""
    distinct = set(answers)
    return float(distinct.pop()) if len(distinct) == 1 else math.nan


def plant_class(inputs: Inputs) -> Statements:
    """Sections 2.3.1 and 3.1 of the plant: a stable A, resonances above anti-resonances, a minimum phase R_0.

    ``R0.damping`` is the damping farthest from 1/2.
    """
    plant = plant_of(inputs)
    pairs = zip(plant.zero_modes, plant.pole_modes, strict=True)
    damping = [mode.zeta for mode in (*plant.zero_modes, *plant.pole_modes)]
    roots = (*plant_block(plant).zeros, *(pole for pole in plant_block(plant).poles if pole != 0))
    return {
        "statement.A_stable": float(all(root.real < 0 for root in plant_denominator(plant).zeros)),
        "statement.resonances": float(all(0 < zero.omega < pole.omega for zero, pole in pairs)),
        "statement.R0_minimum_phase": float(all(root.real < 0 for root in roots)),
        "R0.damping": max(damping, key=lambda zeta: abs(zeta - 0.5)),
    }


def example(inputs: Inputs) -> Statements:
    """The example of section 2.1, P = 1/(s - a): its controller stabilises for several a > 0 and constants Q."""
    roots = []
    for a in (0.1, 1.0, 10.0):
        for Q in (-5.0, 0.0, 3.0):
            C = np.array([2 * a + Q, 2 * a**2 - a * Q]), np.array([1.0, a - Q])  # numerator, denominator
            roots.append(np.roots(np.polyadd(np.polymul([1.0, -a], C[1]), C[0])))
    return {"statement.example": float(all(np.all(found.real < 0) for found in roots))}


def internal_model_principle(inputs: Inputs) -> Statements:
    """Lemma 1 for the design of chapter 2, why Lambda needs s^2 + epsilon, the proof's final value step, and R(s).

    The final value theorem, taken for a sinusoid as the proof takes it, says of 1/s under unit feedback, which has no
    internal model, that the error vanishes; its amplitude is |S(j omega)|.
    """
    design = chapter_2()
    blocks, (omega,) = design.blocks, design.reference_omegas
    found = rightmost_roots(delay_loop(design, design.loop_plant), 1)
    Lambda = blocks["Lambda"](1j * omega)
    S = Lambda / (Lambda + blocks["K"](1j * omega) * plant_numerator(design.plant)(1j * omega))  # G_A = B/Lambda
    proper = {
        factors: Block(1.0, blocks["G_A"].zeros, polynomial.zeros).relative_degree >= 0
        for factors, polynomial in {
            "with": reference_polynomial([omega], printed_numbers()["delay_free"]["epsilon"]),
            "without": Block(1.0, (1j * omega, -1j * omega)),
        }.items()
    }
    s = 1e-9 * omega
    limit = abs(s * s / (s + 1) * s / (s**2 + omega**2))  # s E(s) with S = s/(s + 1) and R = s/(s^2 + omega^2)
    amplitude = abs(1j * omega / (1j * omega + 1))
    return {
        "statement.lemma_1": float(bool(np.all(found.roots[~found.hidden].real < 0)) and abs(S) < NOTHING),
        "statement.epsilon_makes_proper": float(proper["with"] and not proper["without"]),
        "statement.final_value": float((limit < NOTHING) == (amplitude < NOTHING)),
        "statement.R": float(_is_the_reference(1.5 * omega, 2.5 * omega)),
    }


def popov(inputs: Inputs) -> Statements:
    """Theorem 2.3.1: condition ii for (2.23) if gamma > -1/k, the dead zone's sector, what is stable of the proof.

    Condition ii is tried for the printed alpha and beta, several k, and gamma from just above -1/k upwards, with the
    multiplier alpha.
    """
    chosen = printed_numbers()["delay_free"]
    alpha, beta = chosen["alpha"], chosen["beta"]
    margins = []
    for k in SECTORS:
        for gamma in (*(-np.array([0.999, 0.5, 0.1]) / k), 0.5 / k, 1 / k, chosen["gamma"]):
            theta = gamma / ((1 + alpha * GRID) * (1 + beta * GRID))
            margins.append(np.min(((1 + alpha * GRID) * theta).real + 1 / k))
    theta2 = second_order(alpha, beta, chosen["gamma"]).theta2(plant_of(inputs).without_delay())
    inverse = plant_denominator(chapter_2().plant) * chapter_2().blocks["Lambda"].inverse()  # 1/(1 + F), Eq. (2.4)
    return {
        "statement.popov": float(min(margins) > 0),
        "statement.theta2_stable": float(theta2.is_stable),
        "statement.inverse_stable": float(inverse.is_stable),
        "statement.dead_zone": float(_dead_zone(chosen["limit"] / 2, chosen["limit"]) > 0),
    }


def _dead_zone(u: float, limit: float) -> float:
    """dz(u) = u - sat(u), Thesis Eq. (2.16)."""
    return u - min(max(u, -limit), limit)


def _is_the_reference(*points: float) -> bool:
    """Whether the transform of chapter 2's reference is s/(s^2 + omega_1^2) times one number, at some s in rad/s."""
    chosen = printed_numbers()["delay_free"]["reference"]
    A, phase, omega = chosen["amplitude"], chosen["phase_rad"], 2 * np.pi / chosen["period_s"]
    s = np.array(points)
    waves = A * (s * np.sin(phase) + omega * np.cos(phase)) / (s**2 + omega**2)
    ratio = (waves + chosen["offset"] / s) / (s / (s**2 + omega**2))
    return bool(np.ptp(ratio) < NOTHING * abs(A))


def smith_predictor(inputs: Inputs) -> Statements:
    """Chapter 3: what is stable, what equals what, and what W_a guarantees, with the exact dead time."""
    design = chapter_4()
    plant, C_0, T_so, K = design.loop_plant, *(design.blocks[name] for name in ("C0", "T_so", "K"))
    (omega,), W_aw = design.reference_omegas, T_so.scaled(-1.0) * Block(1.0, (0j,))
    loop = delay_loop(design, plant)
    found = rightmost_roots(loop, len(T_so.poles) + 1)
    roots = found.roots[~found.hidden]
    e = np.exp(-plant.delay_s * GRID)
    C_aw = anti_windup_controller(plant, K, T_so, GRID)
    C_s = smith_controller(plant, C_0, GRID)
    K_0 = design.blocks["K0"](GRID)
    margins = margins_of(loop, design.additive_bound)
    one_plus_PC = 1 + plant(GRID) * C_aw
    printed_3_27 = 1 - T_so(GRID) * e / (1 + K_0 * e / GRID)
    a = printed_numbers()["extended"]["a"]
    Y = (1 - a / (GRID + a)) / (GRID / (GRID + a))
    return {
        "statement.delay_outside": float(_same_roots(roots, np.array(T_so.poles))),
        "statement.K_stabilises": float(_stabilises_augmented_plant(plant, K, T_so)),
        "statement.C0_stabilises": float(T_so.is_stable),
        "statement.C0_zeros": float(all(zero.real < 0 for zero in C_0.zeros)),
        "statement.W_aw_stable": float(W_aw.is_stable and W_aw.relative_degree >= 0),
        "statement.Z_aw_root": float(not _any_Z_aw_vanishes(omega, plant.delay_s)),
        "statement.choice_3_28": float(
            T_so.is_stable and np.allclose(1 / one_plus_PC, 1 - T_so(GRID) * e, atol=NOTHING)
        ),
        "statement.T_aw_3_27": float(np.allclose(one_plus_PC, printed_3_27, rtol=1e-3)),
        "statement.C_aw_is_C_s": float(np.allclose(C_aw / C_s, 1, atol=NOTHING)),
        "statement.N_p_at_zero": float(_is_one_over_s(a)),
        "statement.pole_at_zero": float(_tracking_needs_pole_at_zero(plant, a)),
        "statement.robust": float(margins.W_a_C_S.value < 1),
        "statement.delay_destabilises": float(np.isfinite(margins.delay_greatest_s.value)),
        "statement.T_si": float(bool(np.allclose(e, 1 / e, rtol=1e-3))),
        "statement.T_so_3_21": float(_W_follows_at_all_s(W_aw, omega)),
        "statement.Z_aw_polynomial": float(_grows_as_a_polynomial(T_so, plant.delay_s)),
        "bezout.Y": float(np.max(np.abs(Y))),
    }


def _grows_as_a_polynomial(T_so: Block, delay_s: float) -> bool:
    """Whether Z_aw/Lambda = s (1 - T_so exp(-T_d s)) grows no faster than s^100 towards s = -infinity."""
    near, far = (abs(s * (1 - T_so(s) * np.exp(-delay_s * s))) for s in (-100 / delay_s, -200 / delay_s))
    return bool(far < 2.0**100 * near)


def _W_follows_at_all_s(W_aw: Block, omega: float) -> bool:
    """Whether every stable W_aw that meets (3.18) is -s T_so.

    Tried is that plus s (s^2 + omega^2)/(s + omega)^3, which keeps what (3.18) and the zero at s = 0 ask for.
    """

    def other(s: complex) -> complex:
        return complex(W_aw(s)) + s * (s**2 + omega**2) / (s + omega) ** 3

    kept, apart = (abs(other(s) - complex(W_aw(s))) for s in (1j * omega, 2j * omega))
    return not (kept < NOTHING < apart)


def _any_Z_aw_vanishes(omega: float, delay_s: float) -> bool:
    """Whether Z_aw = Lambda (W_aw exp(-T_d s) + s) vanishes at j omega for W_aw = 1, which does not meet (3.18)."""
    s = 1j * omega
    rest = np.exp(-delay_s * s) + s
    return bool(abs((s**2 + omega**2) * rest) < NOTHING < abs(rest))


def _same_roots(first: np.ndarray, second: np.ndarray) -> bool:
    """Whether two sets of roots are the same, double ones to half the digits."""
    return len(first) == len(second) and np.allclose(np.sort_complex(first), np.sort_complex(second), rtol=1e-5)


def _stabilises_augmented_plant(plant: PlantModel, K: Block, T_so: Block) -> bool:
    """Whether G_A/(1 + G_A K), from the input of G_A to its output, is bounded at s -> 0; G_A = P/(1 + F)."""
    sizes = []
    for s in (1e-3 + 0j, 1e-6 + 0j):
        F = -T_so(s) * np.exp(-plant.delay_s * s)
        sizes.append(abs(plant(s) / (1 + F + plant(s) * K(s))))
    return bool(sizes[1] < 2 * sizes[0])


def _is_one_over_s(a: float) -> bool:
    """Whether N_p = 1/(s + a) grows without limit at s = 0, as 1/s does."""
    s = NOTHING * a
    return bool(np.isclose(1 / (s + a), 1 / s, rtol=0.1))


def _tracking_needs_pole_at_zero(plant: PlantModel, a: float) -> bool:
    """Whether a constant is followed only if C_1 has a pole at s = 0.

    Tried with C_0 = a, which stabilises 1/s and violates (3.3):
    S_s = (1 + C_0 (1 - e)/s)/(1 + C_0/s) = (s + a (1 - e))/(s + a), e = exp(-T_d s).
    """
    s = NOTHING * a
    S = (s - a * np.expm1(-plant.delay_s * s)) / (s + a)
    return not abs(S) < 10 * NOTHING
