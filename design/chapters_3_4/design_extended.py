"""The extended design of chapters 3 and 4, for the plant with its dead time."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from design.anti_windup.corrected_compensator import SETTLED
from design.anti_windup.judge import compensators
from design.blocks.block import Block, plant_block
from design.blocks.inner_outer import inner_outer
from design.chapters_3_4.chosen_poles import chosen_pace, fixed_poles, pairs_of
from design.chapters_3_4.interpolate_Q import Conditions, StableFunction, by_poles, by_zeros, conditions, lagrange
from design.chapters_3_4.robust_roll_off import require_possible, robust_outer_part
from design.chapters_3_4.smith_predictor import free_part, free_part_of, stabiliser, thesis_factors
from design.chapters_3_4.tracking import TrackingConditions, tracking_conditions
from design.choices import ROBUST_LEVEL
from design.design_file import Design
from design.parameters import ExtendedParameters, Quotient, RollOff
from design.stability.delay_loop import DelayLoop
from design.stability.margins import robustness_of, tracking_floor
from identification.base.errors import InputError
from identification.model.additive_bound import AdditiveBound
from identification.model.model_file import IdentifiedModel
from identification.model.plant import PlantModel

Pairs = Sequence[tuple[float, float]] | None


def design_extended(
    model: IdentifiedModel,
    reference_omegas: Sequence[float],
    a: float | None = None,
    pairs: Sequence[tuple[float, float]] | None = None,
    method: str = "zeros",
    inverse_epsilon: float = 0.0,
    robust_level: float | None = None,
    recovery_s: float | None = None,
    sector: float | None = None,
    bandwidth: float | None = None,
    guarantee: str | None = None,
) -> Design:
    """Chapters 3 and 4 for every plant: T_so, T_si, F1, F2, K, theta1~ and theta2.

    What holds 1 + F = 1 - T_so T_si is no block: C_aw, G_A and theta1 are functions of
    :mod:`design.chapters_3_4.smith_predictor`. A plant of the thesis's class has Q, C_0, K_0 and K_1 too.

    Parameters
    ----------
    model
        P with its dead time, W_a, and the band of the fit, if there was one.
    reference_omegas
        Angular frequencies of the reference in rad/s; 0 is a constant.
    a
        Closed-loop pole of the free part in rad/s, Table 4.1; unless given, see
        :func:`design.chapters_3_4.chosen_poles.chosen_pace`.
    pairs
        e and f of the denominator of Q, a pair for each frequency above 0, when ``method`` is "zeros"; unless given,
        see :func:`design.chapters_3_4.chosen_poles.pairs_of`.
    method
        How Q is designed, one of :data:`design.choices.METHODS`; the results of all three are kept in ``parameters``.
        All but "zeros" are for plants of the thesis's class.
    inverse_epsilon
        epsilon of the approximate inverse of (3.2) in seconds; 0 is the exact one.
    robust_level
        T_so rolls off as late as ||W_a C S|| <= robust_level < 1 allows, see
        :func:`design.chapters_3_4.robust_roll_off.robust_outer_part`. Unless given it is
        :data:`design.choices.ROBUST_LEVEL`, and T_so of the thesis's class with a given a does not roll off.
    recovery_s, sector, bandwidth, guarantee
        Of the corrected anti-windup, see :func:`design.anti_windup.judge.compensators`; unless given, the recovery
        takes no longer than exp(-a t) takes to 1 %, or the roll-off where it is slower.

    Raises
    ------
    InputError
        A number is out of its range, the method gives an unstable Q, the level cannot be met, or the plant has zeros at
        s = 0 and the reference is a constant.
    """
    plant, bound = model.plant, model.additive_bound
    omegas = tuple(float(omega) for omega in reference_omegas)
    own_level = robust_level is None and a is not None
    as_printed = own_level and is_of_thesis_class(plant) and (plant.relative_degree == 1 or inverse_epsilon > 0)
    if not as_printed and (method != "zeros" or inverse_epsilon):
        raise InputError(
            f"the interpolation is '{method}' and epsilon {inverse_epsilon:g} s; expected 'zeros' and 0 for a design "
            "with a roll-off or with a chosen a"
        )
    if a is not None and as_printed:
        T_so, parameters = _as_printed(plant, omegas, a, pairs, method, inverse_epsilon)
    else:
        level = ROBUST_LEVEL if robust_level is None else robust_level
        T_so, parameters = _rolled_off(model, omegas, a, pairs, level)
    K = stabiliser(plant, T_so, inverse_epsilon)
    T_si, P_o = inner_outer(plant)
    own_s = float(np.log(1 / SETTLED)) / parameters.pace
    robustness = robustness_of(DelayLoop(plant_block(plant), K, (T_so * T_si).without_delay(), plant.delay_s), bound)
    measured = model.fit.band[1] if model.fit else None
    thesis, corrected = compensators(
        plant, bound, own_s, recovery_s, sector, bandwidth, guarantee, robustness, measured
    )
    blocks = {
        "T_so": T_so,
        "T_si": T_si,
        "F": (T_so * T_si).scaled(-1.0),
        "F1": plant_block(plant),
        # W_aw/(K R_0) with W_aw = -s T_so, Eq. (3.16), (3.17), (3.21), (3.29); it is -C_s S_s, (3.23)
        "F2": (T_so * P_o.inverse()).scaled(-1.0),
        "K": K,
        "theta1_tilde": thesis.kind.theta1_tilde,
        "theta2": thesis.kind.theta2(plant),
    }
    if is_of_thesis_class(plant):
        free = free_part_of(T_so, parameters.a)
        K_0, K_1 = thesis_factors(plant, T_so, inverse_epsilon)
        blocks = {"Q": free.Q, "C0": free.C_0, "K0": K_0, "K1": K_1} | blocks
    return Design(
        kind="extended",
        plant=plant,
        additive_bound=bound,
        reference_omegas=omegas,
        blocks=blocks,
        hinf=None,
        parameters=parameters,
        thesis=thesis,
        corrected=corrected,
        signals=model.signals,
    )


def is_of_thesis_class(plant: PlantModel) -> bool:
    """Whether a plant has one integrator and no other root in Re s >= 0, Thesis Eq. (2.20): then C_0 is for 1/s."""
    return plant.integrators == 1 and not plant.right_zeros and not plant.unstable_poles


def _as_printed(
    plant: PlantModel, omegas: tuple[float, ...], a: float, pairs: Pairs, method: str, inverse_epsilon: float
) -> tuple[Block, ExtendedParameters]:
    """T_so of Table 4.1 and (4.5)-(4.7), which does not roll off."""
    wanted = conditions(omegas, plant.delay_s, a)
    pairs = pairs_of(a, wanted.omegas) if pairs is None else pairs
    designs = _designs(wanted, pairs)
    if method not in designs:
        raise InputError(f"the method is '{method}'; expected one of {', '.join(designs)}")
    T_so = free_part(designs[method](), a).T_so
    return T_so, ExtendedParameters(a, tuple(pairs), method, inverse_epsilon, _tried(designs))


def _rolled_off(
    model: IdentifiedModel, omegas: tuple[float, ...], a: float | None, pairs: Pairs, level: float
) -> tuple[Block, ExtendedParameters]:
    """T_so of any plant, which rolls off as late as W_a allows."""
    plant, bound = model.plant, model.additive_bound
    wanted, reasons = _possible(plant, bound, omegas, level, model.fit.band if model.fit else (0.0, np.inf))
    order, most = None, np.inf
    if a is None:
        pace = chosen_pace(plant, bound, wanted, level, model.fit.band[1] if model.fit else None)
        a, order, most = pace.a, pace.order, pace.most
        reasons.append(f"a = {a:.4g} rad/s: {pace.reason}")
    if pairs is None:
        pairs = pairs_of(a, wanted.omegas)
        reasons += [
            f"e = {e:.4g} rad/s, f = {f:.4g} rad^2/s^2: poles of real part -a, no slower than the sinusoid"
            for e, f in pairs
        ]
    poles = fixed_poles(wanted, a, pairs)
    found = robust_outer_part(plant, bound, wanted, a, poles, level, order, most)
    if found.sensitivity > most:  # which the choice saw on a coarse grid alone
        most = np.inf
        reasons.append(f"||S|| is {found.sensitivity:.3g} nevertheless: no roll-off that was tried keeps it smaller")
    count = "one pole" if found.order == 1 else f"{found.order} poles"
    calm = f" and ||S|| <= {most:g}" if most < np.inf else ""
    reasons.append(
        f"T_so rolls off with {count} at {found.rate:.4g} rad/s: the latest found with |W_a C S| <= {level:g}{calm}"
        if found.order
        else f"T_so needs no roll-off: |W_a C S| is at most {found.peak:.3g} <= {level:g} as it is"
    )
    own = _designs(conditions(omegas, plant.delay_s, a), pairs) if is_of_thesis_class(plant) else {}
    roll_off = RollOff(level, found.order, found.rate)
    return found.T_so, ExtendedParameters(a, tuple(pairs), "zeros", 0.0, _tried(own), roll_off, tuple(reasons))


def _possible(
    plant: PlantModel, bound: AdditiveBound, omegas: tuple[float, ...], level: float, band: tuple[float, float]
) -> tuple[TrackingConditions, list[str]]:
    """The conditions that W_a lets a controller meet, without integral action where the model is not known at rest."""
    wanted = tracking_conditions(plant, omegas)
    at_rest = tracking_floor(plant, bound, [0.0]) if plant.integrators == 0 else 0.0
    if at_rest < level or 0 in omegas:
        require_possible(plant, bound, wanted, level, band)
        return wanted, []
    wanted = tracking_conditions(plant, omegas, integral_action=False)
    require_possible(plant, bound, wanted, level, band)
    return wanted, [f"no integral action: |W_a/P| is {at_rest:.3g} at s = 0, above the level {level:g}"]


def _designs(wanted: Conditions, pairs: Sequence[tuple[float, float]]) -> dict[str, Callable[[], StableFunction]]:
    return {
        "zeros": lambda: by_zeros(wanted, pairs),
        "lagrange": lambda: lagrange(wanted),
        "poles": lambda: by_poles(wanted),
    }


def _tried(designs: dict[str, Callable[[], StableFunction]]) -> dict[str, Quotient | str]:
    """What each method gives, or why it gives none."""
    found: dict[str, Quotient | str] = {}
    for name, design in designs.items():
        try:
            Q = design()
            found[name] = Quotient(Q.numerator, tuple(Q.denominator.tolist()))
        except InputError as error:
            found[name] = str(error)
    return found
