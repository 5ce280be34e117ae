"""The extended design of chapters 3 and 4: Smith predictor based, for the plant with its dead time."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from design.anti_windup.corrected_compensator import SETTLED
from design.anti_windup.judge import compensators
from design.blocks.block import Block, plant_block, plant_denominator, plant_numerator
from design.chapters_3_4.interpolate_Q import StableFunction, by_poles, by_zeros, conditions, lagrange
from design.chapters_3_4.robust_roll_off import robust_free_part
from design.chapters_3_4.smith_predictor import free_part, stabiliser
from design.design_file import Design
from design.parameters import ExtendedParameters, Quotient, RollOff
from design.stability.delay_loop import DelayLoop
from design.stability.margins import robustness_of
from identification.base.errors import InputError
from identification.model.model_file import IdentifiedModel


def design_extended(
    model: IdentifiedModel,
    reference_omegas: Sequence[float],
    a: float,
    pairs: Sequence[tuple[float, float]],
    method: str = "zeros",
    inverse_epsilon: float = 0.0,
    robust_level: float | None = None,
    recovery_s: float | None = None,
    sector: float | None = None,
    bandwidth: float | None = None,
    guarantee: str | None = None,
) -> Design:
    """Chapters 3 and 4: Q, C_0, T_so, F1, F2, K_0, K_1, K, theta1~ and theta2.

    What holds 1 + F = 1 - T_so exp(-T_d s) is no block: C_aw, G_A and theta1 are functions of
    :mod:`design.chapters_3_4.smith_predictor`.

    Parameters
    ----------
    model
        P with its dead time, and W_a.
    reference_omegas
        Angular frequencies of the reference in rad/s; 0 is a constant.
    a
        Closed-loop pole of the free part in rad/s, Table 4.1.
    pairs
        e and f of the denominator of Q, a pair for each frequency above 0, when ``method`` is "zeros".
    method
        How Q is designed, one of :data:`design.choices.METHODS`; the results of all three are kept in ``parameters``.
    inverse_epsilon
        epsilon of the approximate inverse of (3.2) in seconds; 0 is the exact one.
    robust_level
        Unless None, T_so rolls off as late as ||W_a C S|| <= robust_level < 1 allows, see
        :func:`design.chapters_3_4.robust_roll_off.robust_free_part`.
    recovery_s, sector, bandwidth, guarantee
        Of the corrected anti-windup, see :func:`design.anti_windup.judge.compensators`; unless given, the recovery
        takes no longer than exp(-a t) takes to 1 %.

    Raises
    ------
    InputError
        A number is out of its range, the method gives an unstable Q, the level cannot be met, or the plant is not of
        the class.
    """
    plant, bound = model.plant, model.additive_bound
    wanted = conditions(reference_omegas, plant.delay_s, a)
    designs = {
        "zeros": lambda: by_zeros(wanted, pairs),
        "lagrange": lambda: lagrange(wanted),
        "poles": lambda: by_poles(wanted),
    }
    if method not in designs:
        raise InputError(f"the method is '{method}'; expected one of {', '.join(designs)}")
    roll_off = None
    if robust_level is None:
        free = free_part(designs[method](), a)
    elif method != "zeros" or inverse_epsilon:
        raise InputError(
            "the robust redesign is by the zeros of Q with the exact inverse; found another method or epsilon"
        )
    else:
        redesign = robust_free_part(plant, bound, wanted, pairs, robust_level)
        free, roll_off = redesign.free, RollOff(robust_level, redesign.order, redesign.rate)

    K_0, K_1, K = stabiliser(plant, free.T_so, inverse_epsilon)
    F1 = plant_block(plant)
    # W_aw/(K R_0) with W_aw = -s T_so, Eq. (3.16), (3.17), (3.21), (3.29); it is -C_s S_s, (3.23)
    F2 = (free.T_so * plant_denominator(plant) * plant_numerator(plant).inverse()).scaled(-1.0)
    robustness = robustness_of(DelayLoop(F1, K, free.T_so, plant.delay_s), bound)
    own_s = float(np.log(1 / SETTLED)) / a
    thesis, corrected = compensators(plant, bound, own_s, recovery_s, sector, bandwidth, guarantee, robustness)
    return Design(
        kind="extended",
        plant=plant,
        additive_bound=bound,
        reference_omegas=tuple(float(omega) for omega in reference_omegas),
        blocks={
            "Q": free.Q,
            "C0": free.C_0,
            "T_so": free.T_so,
            "F": Block(-free.T_so.gain, free.T_so.zeros, free.T_so.poles, plant.delay_s),
            "F1": F1,
            "F2": F2,
            "K0": K_0,
            "K1": K_1,
            "K": K,
            "theta1_tilde": thesis.kind.theta1_tilde,
            "theta2": thesis.kind.theta2(plant),
        },
        hinf=None,
        parameters=ExtendedParameters(
            a=a,
            pairs=tuple((e, f) for e, f in pairs),
            method=method,
            inverse_epsilon=inverse_epsilon,
            Q={name: _attempt(design) for name, design in designs.items()},
            roll_off=roll_off,
        ),
        thesis=thesis,
        corrected=corrected,
    )


def _attempt(design: Callable[[], StableFunction]) -> Quotient | str:
    try:
        found = design()
    except InputError as error:
        return str(error)
    return Quotient(found.numerator, tuple(found.denominator.tolist()))
