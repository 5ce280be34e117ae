"""The extended design of chapters 3 and 4: Smith predictor based, for the plant with its dead time."""

from __future__ import annotations

from dataclasses import asdict

from design.anti_windup import compensators, printed_form
from design.block import Block, plant_block
from design.contract import Design
from design.smith_predictor import free_part, stabiliser
from design.stable_interpolation import by_poles, by_zeros, conditions, lagrange
from identification.files import InputError
from identification.model import IdentifiedModel

METHODS = ("zeros", "lagrange", "poles")


def design_extended(
    model: IdentifiedModel, reference_omega: float, a: float, e: float, f: float, method: str = "zeros"
) -> Design:
    """Chapters 3 and 4: Q, C_0, T_so, F1, F2, K_0, K_1, K, theta1~ and theta2.

    What holds 1 + F = 1 - T_so exp(-T_d s) is no block: C_aw, G_A and theta1 are functions of
    :mod:`design.smith_predictor`.

    Parameters
    ----------
    model
        Plant with its dead time, and W_a.
    reference_omega
        Angular frequency of the sinusoidal reference in rad/s.
    a
        Closed-loop pole of the free part in rad/s, Table 4.1.
    e, f
        Denominator of Q when ``method`` is "zeros".
    method
        How Q is designed, one of :data:`METHODS`; the results of all three are kept in ``parameters``.

    Raises
    ------
    InputError
        A number is out of its range, the method gives an unstable Q, or the plant has more pole modes than
        zero modes.
    """
    wanted = conditions(reference_omega, model.plant.delay_s, a)
    designs = {
        "zeros": lambda: by_zeros(wanted, e, f),
        "lagrange": lambda: lagrange(wanted),
        "poles": lambda: by_poles(wanted),
    }
    Q = designs[method]()
    tried: dict[str, object] = {}
    for name, design in designs.items():
        try:
            tried[name] = asdict(design())
        except InputError as error:
            tried[name] = {"refused": str(error)}

    free = free_part(Q, a)
    K_0, K_1, K = stabiliser(model.plant, free.T_so)
    F1 = plant_block(model.plant)
    F2 = (K_1 * Block(1.0, (0j,)) * free.T_so).scaled(-1.0)  # W_aw/(K R_0) with W_aw = -s T_so, Eq. (3.29)
    anti_windup = compensators(model, rate=a)
    thesis = printed_form(anti_windup["thesis"])
    return Design(
        kind="extended",
        plant=model.plant,
        additive_bound=model.additive_bound,
        reference_omega=reference_omega,
        blocks={
            "Q": Q.block(),
            "C0": free.C_0,
            "T_so": free.T_so,
            "F": Block(-free.T_so.gain, free.T_so.zeros, free.T_so.poles, model.plant.delay_s),
            "F1": F1,
            "F2": F2,
            "K0": K_0,
            "K1": K_1,
            "K": K,
            "theta1_tilde": thesis.theta1_tilde,
            "theta2": thesis.theta2(model.plant),
        },
        hinf=None,
        anti_windup=anti_windup,
        parameters={"a": a, "e": e, "f": f, "method": method, "Q": tried},
    )
