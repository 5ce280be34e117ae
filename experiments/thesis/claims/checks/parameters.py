"""The printed parameters that follow from others: Table 2.1 from the later print, Table 4.2, f(gamma), gamma_opt."""

from __future__ import annotations

import math

from data.thesis import printed_numbers
from design.chapters_3_4.interpolate_Q import by_zeros, conditions
from experiments.thesis.claims.inputs import Inputs, plant_of
from experiments.thesis.studies.f_gamma import f_gamma_tables
from identification.model.plant_json import bound_from_dict


def table_2_1(inputs: Inputs) -> dict[str, float]:
    """The plant that the printed theta2 implies: omega in rad/s, K in output units per second and input unit.

    theta2 is the only transfer function that prints every factor of the plant: s^2 + 2 zeta omega s + omega^2 for
    each mode, and K (omega_d1 omega_d2)^2/(omega_n1 omega_n2)^2 in front.
    """
    values: dict[str, float] = {}
    gain = inputs["printed.theta2.gain"]
    for mode, factor in {"n1": "zero_pair_1", "n2": "zero_pair_3", "d1": "pole_pair_1", "d2": "pole_pair_2"}.items():
        s1, s0 = inputs[f"printed.theta2.{factor}.s1"], inputs[f"printed.theta2.{factor}.s0"]
        values |= {f"table_2_1.omega_{mode}": math.sqrt(s0), f"table_2_1.zeta_{mode}": s1 / (2 * math.sqrt(s0))}
        gain = gain * s0 if mode.startswith("n") else gain / s0
    return values | {"table_2_1.K": gain}


def table_4_2(inputs: Inputs) -> dict[str, float]:
    """b, c and d of Q, Thesis Eq. (4.6) and (4.7)."""
    chosen = printed_numbers()["extended"]
    wanted = conditions([chosen["reference"]["omega"]], plant_of(inputs).delay_s, chosen["a"])
    Q = by_zeros(wanted, [(chosen["e"], chosen["f"])])
    return {f"table_4_2.{name}": value for name, value in zip("bcd", Q.numerator, strict=True)}


def anti_windup(inputs: Inputs) -> dict[str, float]:
    """alpha, beta (s) and gamma of Thesis Eq. (2.23) by the procedure of section 2.4.

    ``anti_windup.beta`` is the best of the four values that our Fig. 2.10 compares, ``anti_windup.beta_continuous`` the
    best of all.
    """
    found = f_gamma_tables(bound_from_dict(printed_numbers()["additive_bound"]))["f_gamma_summary"].iloc[0]
    return {
        "anti_windup.alpha": float(found["alpha"]),
        "anti_windup.beta": float(found["beta"]),
        "anti_windup.gamma": float(found["gamma"]),
        "anti_windup.beta_continuous": float(found["beta_best"]),
    }


def measured(inputs: Inputs) -> dict[str, float]:
    """NaN: what is said of the measured frequency responses, which are not published."""
    return {"statement.bound_covers": math.nan}


def gamma_opt(inputs: Inputs) -> dict[str, float]:
    """NaN: the least norm of Thesis Eq. (2.8) scales with W_1 and W_2, which the thesis does not print."""
    return {"delay_free.gamma_opt": math.nan}
