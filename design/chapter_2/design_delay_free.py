"""The chapter 2 design: internal model, H-infinity stabiliser and anti-windup for the plant without its dead time."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from design.anti_windup.corrected_compensator import SETTLED
from design.anti_windup.judge import compensators
from design.blocks.block import Block, bound_block, plant_block, plant_denominator, plant_numerator
from design.chapter_2.internal_model import InternalModel, internal_model
from design.design_file import Design
from design.hinf.mixed_sensitivity import mixed_sensitivity
from design.hinf.pick import Problem
from design.parameters import DelayFreeParameters
from design.stability.delay_loop import DelayLoop
from design.stability.margins import robustness_of
from identification.model.additive_bound import AdditiveBound
from identification.model.model_file import IdentifiedModel
from identification.model.plant import PlantModel

TRACKING = 0.01  # W1 asks for |S| below gamma times this at the reference's frequencies


def stabiliser_problem(
    plant: PlantModel, bound: AdditiveBound, reference_omegas: Sequence[float], epsilon: float | None
) -> tuple[InternalModel, Problem]:
    """The internal model units, and what the stabiliser K has to minimise.

    Parameters
    ----------
    plant, bound, reference_omegas, epsilon
        As for :func:`design_delay_free`.

    Raises
    ------
    InputError
        As :func:`design_delay_free`.

    Notes
    -----
    The thesis prints neither W1 nor W2, so their principle is ours, after Remark 1:

    W2 = W_a/G, the multiplicative bound itself, so that ||W2 T|| < 1 is robust stability. Where deg Lambda
    exceeds deg B it gets as many zeros, an octave above the fastest root, as make W2 G_A biproper.

    W1 has the reference's poles, damped: moved left by twice the decay rate, which makes the stabiliser's
    zeros there cancel, and W1(0) = 1/TRACKING. The decay rate leaves SETTLED of a transient after the longest period,
    or is half that of the slowest mode of plant and bound where these decay more slowly.
    """
    plant, omegas = plant.without_delay(), tuple(map(float, reference_omegas))
    A, B, W_a = plant_denominator(plant), plant_numerator(plant), bound_block(bound)
    units = internal_model(plant, omegas, epsilon, roll_off=0 if W_a.relative_degree else 1)
    slowest = min(-root.real for root in A.zeros + B.zeros + W_a.poles if root != 0)
    decay_rate = min(math.log(1 / SETTLED) * min(omegas) / math.tau, slowest / 2)

    fastest = max(abs(root) for root in A.zeros + B.zeros + W_a.poles + units.Lambda.zeros)
    W2 = W_a * A * B.inverse()
    missing = (W2 * units.G_A).relative_degree
    W2 = W2 * Block((2 * fastest) ** -missing, (complex(-2 * fastest),) * missing)
    damped = tuple(root - 2 * decay_rate for root in units.reference.zeros)
    W1 = Block(float(np.prod(np.abs(damped))) / TRACKING, (), damped)
    return units, Problem(units.G_A, W1, W2, decay_rate)


def design_delay_free(
    model: IdentifiedModel,
    reference_omegas: Sequence[float],
    epsilon: float | None,
    recovery_s: float | None = None,
    sector: float | None = None,
    bandwidth: float | None = None,
    guarantee: str | None = None,
) -> Design:
    """Chapter 2: Lambda, F1, F2, G_A, the stabiliser K, theta1~, theta1 and theta2.

    Parameters
    ----------
    model
        P (its dead time is ignored, as the thesis does) and W_a.
    reference_omegas
        Angular frequencies of the reference in rad/s, above 0, each once.
    epsilon
        Of the factor s^2 + epsilon of Lambda, in rad^2/s^2. None for integral action, which is ours: Lambda has
        s^(integrators + 1) in place of that factor.
    recovery_s, sector, bandwidth, guarantee
        Of the corrected anti-windup, see :func:`design.anti_windup.judge.compensators`; unless given, the recovery
        takes half as long as the loop's own transients at most.

    Raises
    ------
    InputError
        A number is out of its range, or the plant has zeros at s = 0 or in the right half plane, or a pole there.
    SynthesisError
        The synthesis failed its own check.

    Notes
    -----
    With epsilon C = K A/Lambda has a zero at each of the plant's poles s = 0 (Lemma 1 assumes a stable A): the
    integrators are hidden from the loop and not stabilised, so that a constant disturbance at the plant's input makes y
    drift. With integral action Lambda holds these poles and one more, so that C has a pole at s = 0: a constant
    reference and a constant disturbance at the plant's input leave no error.
    """
    plant, bound = model.plant, model.additive_bound
    units, problem = stabiliser_problem(plant, bound, reference_omegas, epsilon)
    K, synthesis = mixed_sensitivity(problem.G, problem.W1, problem.W2, problem.decay_rate)
    own_s = math.log(1 / SETTLED) / (2 * problem.decay_rate)
    forward = K * plant_denominator(plant) * units.Lambda.inverse()
    robustness = robustness_of(DelayLoop(plant_block(plant.without_delay()), forward, Block(0.0), 0.0), bound)
    measured = model.fit.band[1] if model.fit else None
    thesis, corrected = compensators(
        plant, bound, own_s, recovery_s, sector, bandwidth, guarantee, robustness, measured
    )
    return Design(
        kind="delay-free",
        plant=plant,
        additive_bound=bound,
        reference_omegas=tuple(map(float, reference_omegas)),
        blocks={
            "Lambda": units.Lambda,
            "F1": units.F1,
            "F2": units.F2,
            "G_A": units.G_A,
            "K": K,
            "theta1_tilde": thesis.kind.theta1_tilde,
            "theta1": thesis.kind.theta1_tilde * units.one_plus_F,  # Eq. (2.17)
            "theta2": thesis.kind.theta2(plant.without_delay()),  # Eq. (2.18)
        },
        hinf=synthesis,
        parameters=DelayFreeParameters(math.tau / min(reference_omegas), epsilon),
        thesis=thesis,
        corrected=corrected,
        signals=model.signals,
    )
