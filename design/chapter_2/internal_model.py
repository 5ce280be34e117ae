"""The internal model of chapter 2: Lambda, F1, F2 and the augmented plant G_A (2.2)-(2.6)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from flint import arb

from design.blocks.ball import decided, line, polynomial_roots, shared
from design.blocks.block import Block, plant_block, plant_denominator, plant_numerator
from identification.base.errors import InputError
from identification.model.plant import PlantModel


@dataclass(frozen=True)
class InternalModel:
    """What the reference asks of the controller.

    Parameters
    ----------
    reference
        Polynomial block of :func:`reference_polynomial`.
    Lambda
        The same, with stable factors where the degrees need them.
    F1, F2
        Internal model units, F1 = G and F1 F2 = F with 1 + F = Lambda/A. F2 is improper, so it is never
        realised by itself.
    G_A
        G/(1 + F) = B/Lambda.
    one_plus_F
        Lambda/A; strictly proper for the thesis's plant.
    """

    reference: Block
    Lambda: Block
    F1: Block
    F2: Block
    G_A: Block
    one_plus_F: Block


def reference_polynomial(omegas: Sequence[float], epsilon: float | None, integrators: int = 0) -> Block:
    """The polynomial of Thesis Eq. (2.2): a factor s^2 + omega^2 for each sinusoid, and one for constants.

    Parameters
    ----------
    omegas
        Angular frequencies of the reference in rad/s.
    epsilon
        Of the factor s^2 + epsilon that section 2.4 adds, in rad^2/s^2, which holds constants nearly. None:
        s^(integrators + 1) in its place, which is ours and integral action.
    integrators
        Of the plant.
    """
    constant = (0j,) * (integrators + 1) if epsilon is None else _pair(float(np.sqrt(epsilon)))
    return Block(1.0, (*constant, *(root for omega in omegas for root in _pair(omega))))


def _pair(omega: float) -> tuple[complex, complex]:
    return 1j * omega, -1j * omega


def internal_model(
    plant: PlantModel, omegas: Sequence[float], epsilon: float | None, roll_off: int = 0
) -> InternalModel:
    """The internal model units for a periodic reference, Thesis Eq. (2.2)-(2.6).

    Parameters
    ----------
    plant
        Its dead time is ignored, as chapter 2 does.
    omegas
        Angular frequencies of the reference in rad/s, positive, each once.
    epsilon
        Of the factor s^2 + epsilon, smaller than the square of every omega, or None for integral action, see
        :func:`reference_polynomial`.
    roll_off
        Relative degree that C = K A/Lambda is to have at least, with a K of relative degree 1.

    Raises
    ------
    InputError
        An omega or epsilon is out of its range, or the plant is none that chapter 2 can take.

    Notes
    -----
    Lambda gets as many stable factors as make G_A = B/Lambda and C = K A/Lambda proper: Lemma 1 asks only that
    (1 + F) A contain the reference's poles. Their rate is the plant's fastest root. A slower one would delay the loop
    within the plant's band; a faster one would only raise the gain of C where the plant no longer answers.

    The plant's poles at s = 0 that Lambda does not hold are zeros of C: they are hidden from the loop. With integral
    action Lambda holds all of them and one more.
    """
    _require_reference(omegas, epsilon)
    _require_class(plant)
    A, B = plant_denominator(plant), plant_numerator(plant)
    reference = reference_polynomial(omegas, epsilon, plant.integrators)
    fill = max(0, max(len(A.zeros) - 1 + roll_off, len(B.zeros)) - len(reference.zeros))
    fastest = max((abs(root) for root in A.zeros + B.zeros if root != 0), default=max(omegas))
    Lambda = reference * Block(1.0, (complex(-fastest),) * fill)
    return InternalModel(
        reference=reference,
        Lambda=Lambda,
        F1=plant_block(plant.without_delay()),
        F2=_difference(Lambda, A) * B.inverse(),  # Eq. (2.5)
        G_A=B * Lambda.inverse(),  # Eq. (2.6)
        one_plus_F=Lambda * A.inverse(),  # Eq. (2.4)
    )


def _require_reference(omegas: Sequence[float], epsilon: float | None) -> None:
    shown = ", ".join(f"{omega:.12g}" for omega in omegas)
    if len(set(omegas)) < len(omegas):
        raise InputError(f"the reference has omega = {shown} rad/s; expected each frequency once")
    if len(omegas) and min(omegas) == 0:
        hertz = ", ".join(f"{omega / math.tau:g}" for omega in omegas)
        raise InputError(
            f"the reference has the frequencies {hertz} Hz; expected positive ones for a delay-free design, which "
            "follows a constant by --integral-action"
        )
    if not (len(omegas) and all(np.isfinite(omega) and omega > 0 for omega in omegas)):
        raise InputError(f"the reference has omega = {shown} rad/s; expected one or more positive numbers")
    if epsilon is not None and not 0 < epsilon < min(omegas) ** 2:
        raise InputError(f"omega = {shown} rad/s and epsilon = {epsilon:.12g}; expected 0 < epsilon < omega^2")


def _require_class(plant: PlantModel) -> None:
    """Refuse a plant whose zeros or poles the construction would have to cancel although they do not decay."""
    if plant.integrators < 0:
        zeros = "a zero" if plant.integrators == -1 else f"{-plant.integrators} zeros"
        raise InputError(
            f"the plant has {zeros} at s = 0, so that no bounded input holds a constant output; expected every zero in "
            "the left half plane"
        )
    for root in plant.right_zeros:
        raise InputError(
            f"the plant has a zero in the right half plane, at {_shown(root)} rad/s, which is an unstable pole of "
            "F2 = (Lambda - A)/B; expected every zero in the left half plane"
        )
    for root in plant_denominator(plant).zeros:
        if root.real > 0:
            raise InputError(
                f"the plant has a pole in the right half plane, at {_shown(root)} rad/s, which C = K A/Lambda cancels, "
                "so that y grows without bound after a disturbance; expected stable poles and at most two integrators"
            )


def _shown(root: complex) -> str:
    return f"{root.real:.4g}" + (f" +- {abs(root.imag):.4g}j" if root.imag else "")


def _difference(first: Block, second: Block) -> Block:
    """The difference of two polynomial blocks, whose coefficients spread over too many decades for doubles."""
    common, left, right = shared(first.zeros, second.zeros)

    def compute() -> Block:
        x = line(0.0, first, second)
        one, other = Block(first.gain, tuple(left)), Block(second.gain, tuple(right))
        polynomial = x.gain(one) * x.polynomial(left) - x.gain(other) * x.polynomial(right)
        roots = tuple(x.back(root) for root in polynomial_roots(polynomial))
        return Block(float(polynomial[len(roots)] / arb(x.unit) ** len(roots)), (*common, *roots))

    found = decided(compute)
    if found is None:
        raise InputError("the zeros of F2, roots of Lambda - A, are too close to separate; expected another reference")
    return found
