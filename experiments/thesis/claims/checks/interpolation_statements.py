"""What chapter 4 says of Q, of its three designs, and of the Pade approximation."""

from __future__ import annotations

from collections.abc import Mapping

import control
import numpy as np

from data.thesis import printed_numbers
from design.chapters_3_4.interpolate_Q import Conditions, by_poles, by_zeros, conditions, lagrange
from experiments.thesis.claims.checks.statements import NOTHING
from experiments.thesis.claims.inputs import Inputs, plant_of
from experiments.thesis.printed_choices import chapter_4
from experiments.thesis.studies.chapter_4 import PADE_ORDER
from experiments.thesis.studies.interpolation import interpolation_tables
from identification.base.errors import InputError

ORDERS = range(1, 7)  # of the Pade approximations that are compared
LARGE_ORDERS = (20, 40, 80, 160)


def interpolation(inputs: Inputs) -> Mapping[str, float]:
    """Section 4.1: the degree of Q, the printed Q(j omega), and where the three designs work.

    ``Q.conditions`` counts real conditions, ``Q.conditions_4_3`` those of (4.3), of which one is complex. ``Q.degree``
    is the number of poles of the three designs, the poles design at 2/T_d. ``Q.minimum_degree`` is the least degree of
    any stable Q that meets (4.4) at the thesis's frequency. The statement that this is always the number of conditions
    less one is tried there and at 2/T_d.
    """
    chosen = printed_numbers()["extended"]
    plant, omega = plant_of(inputs), chosen["reference"]["omega"]
    wanted = conditions([omega], plant.delay_s, chosen["a"])
    Q = by_zeros(wanted, [(chosen["e"], chosen["f"])])
    s = 1j * omega
    b, c, d = Q.numerator
    # as printed, with the d of the numerator in the denominator
    as_printed = (-b * omega**2 + c * s + d) / (-d * omega**2 + chosen["e"] * s + chosen["f"])
    conditions_met = 1 + 2 * len(wanted.omegas)
    degrees = [_least_degree(conditions([at], plant.delay_s, chosen["a"])) for at in (omega, 2 / plant.delay_s)]
    high = conditions([2 / plant.delay_s], plant.delay_s, chosen["a"])
    degree_of_designs = [len(found.poles) for found in (Q, lagrange(wanted), by_poles(high))]
    table = interpolation_tables(chapter_4())
    regions = table["interpolation_summary"].groupby("method")
    top = table["interpolation"]["omega"].max()
    return {
        "Q.conditions": conditions_met,
        "Q.conditions_4_3": 1 + len(wanted.omegas),
        "Q.degree": max(degree_of_designs, key=lambda degree: abs(degree - 2)),
        "Q.minimum_degree": degrees[0],
        "statement.minimum_degree": float(all(degree == conditions_met - 1 for degree in degrees)),
        "statement.Q_at_omega": float(abs(as_printed - wanted.at_omegas[0]) < NOTHING * abs(wanted.at_omegas[0])),
        "statement.lagrange_fails": float(regions.get_group("lagrange")["highest"].max() < top),
        "statement.poles_only_high": float(regions.get_group("poles")["lowest"].min() > omega),
        "statement.e_negative": float(_e_of_poles_design(wanted) < 0),
    }


def _least_degree(wanted: Conditions) -> int:
    """The least degree of a stable Q that meets the conditions of one frequency.

    Of degree 0 is a constant, which Q(0) and Q(j omega) would have to equal. Of degree 1 is (b s + c)/(s + f), whose
    three coefficients the three conditions determine: b j omega + f Q(0) = (j omega + f) Q(j omega), in the real part
    f (Re Q(j omega) - Q(0)) = omega Im Q(j omega). Of degree 2 the denominator is free.
    """
    (omega,), (at_omega,) = wanted.omegas, wanted.at_omegas
    if abs(at_omega - wanted.at_zero) < NOTHING * wanted.at_zero:
        return 0
    return 1 if omega * at_omega.imag / (at_omega.real - wanted.at_zero) > 0 else 2


def _e_of_poles_design(wanted: Conditions) -> float:
    """e of Q = b/(d s^2 + e s + f) as section 4.1 prints it for b = 1, where Q is unstable: Im(1/Q(j omega))/omega."""
    (omega,), (at_omega,) = wanted.omegas, wanted.at_omegas
    try:
        by_poles(wanted)
    except InputError:
        return float((1 / at_omega).imag / omega)
    return np.inf


def pade(inputs: Inputs) -> Mapping[str, float]:
    """Section 4.2: the coefficients of the second order approximation, and what becomes of larger orders.

    ``pade.s`` and ``pade.s2`` are T_d/k_1 and T_d^2/k_2 of python-control's approximation. More accurate: the largest
    error up to omega = 2/T_d falls with the order. Numerical problems: at some order of :data:`LARGE_ORDERS` that error
    is no longer below 1e-6.
    """
    delay_s = plant_of(inputs).delay_s
    _, down = control.pade(delay_s, PADE_ORDER)
    k2, k1, k0 = np.array(down)
    errors = [_pade_error(delay_s, order) for order in ORDERS]
    return {
        "pade.order": PADE_ORDER,
        "pade.s": delay_s * k0 / k1,
        "pade.s2": delay_s**2 * k0 / k2,
        "statement.pade_accuracy": float(bool(np.all(np.diff(errors) < 0))),
        "statement.pade_coefficients": float(any(not _pade_error(delay_s, order) < 1e-6 for order in LARGE_ORDERS)),
    }


def _pade_error(delay_s: float, order: int) -> float:
    """The largest error up to omega = 2/T_d; not finite where the coefficients are not."""
    s = 1j * np.linspace(0, 2, 201) / delay_s
    with np.errstate(all="ignore"):
        try:
            up, down = control.pade(delay_s, order)
        except (ArithmeticError, ValueError):  # as they may answer too
            return np.inf
        return float(np.max(np.abs(np.polyval(up, s) / np.polyval(down, s) - np.exp(-delay_s * s))))
