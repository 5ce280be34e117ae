"""The coefficients of the printed transfer functions, computed from the parameter set ``implied``."""

from __future__ import annotations

import numpy as np
from scipy.optimize import newton

from data.thesis import printed_numbers
from design.anti_windup.compensator import second_order
from design.blocks.block import Block, plant_block
from design.chapter_2.internal_model import InternalModel, internal_model
from design.chapters_3_4.interpolate_Q import by_zeros, conditions
from design.chapters_3_4.smith_predictor import (
    FreePart,
    anti_windup_controller,
    augmented_plant,
    free_part,
    stabiliser,
    thesis_factors,
)
from experiments.thesis.claims.inputs import Inputs, plant_of
from identification.model.plant import PlantModel
from identification.model.plant_json import bound_from_dict

LOW = 0.1j  # s = j omega, rad/s: where the gain of a form that leaves factors out is read off


def coefficients(name: str, block: Block) -> dict[str, float]:
    """The coefficients with which Matlab prints a block.

    Returns
    -------
    dict
        ``NAME.gain`` (leading coefficient); for SIDE ``zero`` and ``pole``: ``NAME.SIDE_origin.power``, the
        multiplicity of s; ``NAME.SIDE_1`` ... and ``.power`` of each factor (s + c)^power, c in rad/s; and
        ``NAME.SIDE_pair_1.s1`` and ``.s0`` of each factor s^2 + s1 s + s0, in rad/s and rad^2/s^2. The factors are
        numbered from the slowest.
    """
    values = {f"{name}.gain": block.gain}
    for side, roots in (("zero", block.zeros), ("pole", block.poles)):
        values[f"{name}.{side}_origin.power"] = float(roots.count(0j))
        real = sorted({-root.real for root in roots if root.imag == 0 and root != 0}, key=abs)
        for k, constant in enumerate(real, start=1):
            values[f"{name}.{side}_{k}"] = constant
            values[f"{name}.{side}_{k}.power"] = float(roots.count(complex(-constant)))
        pairs = sorted((abs(root) ** 2, 0.0 - 2 * root.real) for root in roots if root.imag > 0)
        for k, (s0, s1) in enumerate(pairs, start=1):
            values |= {f"{name}.{side}_pair_{k}.s1": s1, f"{name}.{side}_pair_{k}.s0": s0}
    return values


def plant_4_8(inputs: Inputs) -> dict[str, float]:
    """P of Thesis Eq. (4.8), whose modes are printed as 1 + (2 zeta) s/omega + (s/omega)^2; omega in rad/s.

    ``P.delay_ms`` is T_d as the sentence after it says it.
    """
    plant = plant_of(inputs)
    values = {"P.gain": plant.gain, "P.delay_s": plant.delay_s, "P.delay_ms": 1e3 * plant.delay_s}
    for side, modes in (("zero", plant.zero_modes), ("pole", plant.pole_modes)):
        for k, mode in enumerate(modes, start=1):
            values |= {f"P.{side}_mode_{k}.two_zeta": 2 * mode.zeta, f"P.{side}_mode_{k}.omega": mode.omega}
    return values


def bound_4_9(inputs: Inputs) -> dict[str, float]:
    """W_a of Thesis Eq. (4.9), printed as 1 + (2 zeta) s/omega + (s/omega)^2; omega in rad/s."""
    bound = bound_from_dict(printed_numbers()["additive_bound"])
    return {
        "W_a.gain": bound.gain,
        "W_a.corner": bound.corner,
        "W_a.two_zeta": 2 * bound.resonance.zeta,
        "W_a.omega": bound.resonance.omega,
    }


def G_A_delay_free(inputs: Inputs) -> dict[str, float]:
    """G_A of section 2.4, Thesis Eq. (2.6)."""
    return coefficients("G_A_2", _internal_model(inputs).G_A)


def theta1(inputs: Inputs) -> dict[str, float]:
    """theta1 = theta1~ (1 + F) of section 2.4, Thesis Eq. (2.17)."""
    return coefficients("theta1", second_order(*_anti_windup()).theta1_tilde * _internal_model(inputs).one_plus_F)


def theta2(inputs: Inputs) -> dict[str, float]:
    """theta2 = G (1 + theta1~) of section 2.4, Thesis Eq. (2.18)."""
    return coefficients("theta2", second_order(*_anti_windup()).theta2(plant_of(inputs).without_delay()))


def C0(inputs: Inputs) -> dict[str, float]:
    """C_0 of section 4.2, Thesis Eq. (4.2)."""
    return coefficients("C0", _free_part(plant_of(inputs)).C_0)


def F(inputs: Inputs) -> dict[str, float]:
    """F = -T_so exp(-T_d s) of section 4.2, with its dead time ``F.delay_s`` in seconds."""
    plant = plant_of(inputs)
    return coefficients("F", _free_part(plant).T_so.scaled(-1.0)) | {"F.delay_s": plant.delay_s}


def K0(inputs: Inputs) -> dict[str, float]:
    """K_0 of section 4.2, Thesis Eq. (3.28)."""
    plant = plant_of(inputs)
    return coefficients("K0", thesis_factors(plant, _free_part(plant).T_so)[0])


def K1(inputs: Inputs) -> dict[str, float]:
    """K_1 = 1/(K R_0) of section 4.2, Thesis Eq. (3.29)."""
    plant = plant_of(inputs)
    return coefficients("K1", thesis_factors(plant, _free_part(plant).T_so)[1])


def G_A_extended(inputs: Inputs) -> dict[str, float]:
    """G_A = P/(1 + F) of section 4.2, with its dead time, see :func:`_over_one_plus_F`.

    ``G_A_4.form_gain`` is the gain that the printed form, without the fastest pair, needs to be G_A at low
    frequencies.
    """
    plant = plant_of(inputs)
    T_so = _free_part(plant).T_so
    block = _over_one_plus_F(plant_block(plant), T_so, plant.delay_s)
    exact = complex(augmented_plant(plant, T_so, LOW))
    form = complex(_without_fast_pair(block)(LOW))
    return coefficients("G_A_4", block) | {
        "G_A_4.delay_s": block.delay_s,
        "G_A_4.form_gain": block.gain * (exact / form).real,
    }


def C_aw(inputs: Inputs) -> dict[str, float]:
    """C_aw = K/(1 + F) of section 4.2, Thesis Eq. (3.31), see :func:`_over_one_plus_F`.

    ``C_aw.form_gain`` is as in :func:`G_A_extended`.
    """
    plant = plant_of(inputs)
    T_so = _free_part(plant).T_so
    K = stabiliser(plant, T_so)
    block = _over_one_plus_F(K, T_so, plant.delay_s)
    exact = complex(anti_windup_controller(plant, K, T_so, LOW))
    form = complex(_without_fast_pair(block)(LOW))
    return coefficients("C_aw", block) | {"C_aw.form_gain": block.gain * (exact / form).real}


def _anti_windup() -> tuple[float, float, float]:
    chosen = printed_numbers()["delay_free"]
    return chosen["alpha"], chosen["beta"], chosen["gamma"]


def _internal_model(inputs: Inputs) -> InternalModel:
    chosen = printed_numbers()["delay_free"]
    return internal_model(plant_of(inputs), [2 * np.pi / chosen["reference"]["period_s"]], chosen["epsilon"])


def _free_part(plant: PlantModel) -> FreePart:
    chosen = printed_numbers()["extended"]
    wanted = conditions([chosen["reference"]["omega"]], plant.delay_s, chosen["a"])
    return free_part(by_zeros(wanted, [(chosen["e"], chosen["f"])]), chosen["a"])


def _over_one_plus_F(block: Block, T_so: Block, delay_s: float) -> Block:
    """block/(1 + F), 1 + F being replaced by its zeros at s = 0 and near j omega over the poles of T_so.

    1 + F = 1 - T_so exp(-T_d s) has infinitely many zeros. These are the ones that the interpolation conditions
    (4.3) put there, found on the function itself: by the argument principle around s = 0 and by Newton's method
    from a point beside j omega. The thesis prints no others.
    """
    omega = printed_numbers()["extended"]["reference"]["omega"]

    def one_plus_F(s: complex) -> complex:
        return complex(1 - T_so(s) * np.exp(-delay_s * s))

    circle = omega / 2 * np.exp(2j * np.pi * np.arange(513) / 512)
    turns = np.unwrap(np.angle(1 - T_so(circle) * np.exp(-delay_s * circle)))
    at_zero = round((turns[-1] - turns[0]) / (2 * np.pi))
    near = newton(one_plus_F, 1.01j * omega, tol=1e-14 * omega)  # type: ignore[arg-type] # complex functions too
    zeros = Block(1.0, (0j,) * at_zero + (near, near.conjugate()))
    return block * Block(1.0, T_so.poles) * zeros.inverse()


def _without_fast_pair(block: Block) -> Block:
    """Leave out the fastest pair of zeros and of poles, which chapter 4 does not print."""
    return Block(block.gain, block.zeros[:-2], block.poles[:-2], block.delay_s)
