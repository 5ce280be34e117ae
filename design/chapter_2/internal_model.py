"""The internal model of chapter 2: Lambda, F1, F2 and the augmented plant G_A (2.2)-(2.6)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from flint import arb

from design.blocks.ball import decided, line, polynomial_roots
from design.blocks.block import Block, plant_block, plant_denominator, plant_numerator
from identification.base.errors import InputError
from identification.model.plant import PlantModel


@dataclass(frozen=True)
class InternalModel:
    """What the reference asks of the controller.

    Parameters
    ----------
    Lambda
        Polynomial block; the reference's poles are among its roots.
    F1, F2
        Internal model units, F1 = G and F1 F2 = F with 1 + F = Lambda/A. F2 is improper, so it is never
        realised by itself.
    G_A
        G/(1 + F) = B/Lambda.
    one_plus_F
        Lambda/A; strictly proper for the thesis's plant.
    """

    Lambda: Block
    F1: Block
    F2: Block
    G_A: Block
    one_plus_F: Block


def reference_polynomial(omega: float, epsilon: float) -> Block:
    """Lambda = (s^2 + epsilon)(s^2 + omega^2) of Thesis Eq. (2.2), with the factor that section 2.4 adds.

    That factor, s^2 + epsilon, holds constants nearly; the other is the sinusoid's.
    """
    slow = np.sqrt(epsilon)
    return Block(1.0, (1j * slow, -1j * slow, 1j * omega, -1j * omega))


def internal_model(plant: PlantModel, omega: float, epsilon: float) -> InternalModel:
    """The internal model units for a sinusoidal reference, Thesis Eq. (2.2)-(2.6).

    Parameters
    ----------
    plant
        Its dead time is ignored, as chapter 2 does.
    omega
        Angular frequency of the reference in rad/s, positive.
    epsilon
        Of the factor s^2 + epsilon that the thesis adds to make G_A proper, in rad^2/s^2; smaller than omega^2.

    Raises
    ------
    InputError
        omega or epsilon is out of its range.

    Notes
    -----
    G_A = B/Lambda is proper when deg Lambda >= deg B. The thesis's plant has deg B = 4 = deg Lambda. With more
    zero modes we fill Lambda up with stable factors s + omega_max, omega_max being the plant's fastest mode:
    Lemma 1 asks only that (1 + F) A contain the reference's poles.
    """
    if not (np.isfinite([omega, epsilon]).all() and omega > 0 and 0 < epsilon < omega**2):
        raise InputError(
            f"omega = {omega:g} rad/s and epsilon = {epsilon:g}; expected omega > 0 and 0 < epsilon < omega^2"
        )
    A, B = plant_denominator(plant), plant_numerator(plant)
    fill = max(0, len(B.zeros) - 4)
    fastest = max((abs(root) for root in A.zeros + B.zeros if root != 0), default=omega)
    Lambda = reference_polynomial(omega, epsilon) * Block(1.0, (complex(-fastest),) * fill)
    return InternalModel(
        Lambda=Lambda,
        F1=plant_block(plant.without_delay()),
        F2=_difference(Lambda, A) * B.inverse(),  # Eq. (2.5)
        G_A=B * Lambda.inverse(),  # Eq. (2.6)
        one_plus_F=Lambda * A.inverse(),  # Eq. (2.4)
    )


def _difference(first: Block, second: Block) -> Block:
    """The difference of two polynomial blocks, whose coefficients spread over too many decades for doubles."""

    def compute() -> Block:
        x = line(0.0, first, second)
        polynomial = x.gain(first) * x.polynomial(first.zeros) - x.gain(second) * x.polynomial(second.zeros)
        roots = tuple(x.back(root) for root in polynomial_roots(polynomial))
        return Block(float(polynomial[len(roots)] / arb(x.unit) ** len(roots)), roots)

    found = decided(compute)
    if found is None:
        raise InputError("the zeros of F2, roots of Lambda - A, are not told apart; expected another reference")
    return found
