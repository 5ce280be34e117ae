"""Where each of the three designs of Q works (Fig. A.2), which section 4.2 says in words."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pandas as pd

from design.blocks.frequency_peak import peak
from design.chapters_3_4.interpolate_Q import (
    Conditions,
    StableFunction,
    by_poles,
    by_zeros,
    conditions,
    lagrange,
    wanted_at,
)
from design.chapters_3_4.smith_predictor import free_part
from design.design_file import Design
from identification.base.errors import InputError

FREQUENCIES = 161
SENSITIVITY = 2.0  # ||S|| above it, a modulus margin below 1/2, counts as a failure
METHODS: dict[str, Callable[[Conditions], StableFunction]] = {
    "zeros": lambda wanted: by_zeros(wanted, [(2 * omega, omega**2) for omega in wanted.omegas]),
    "lagrange": lagrange,
    "poles": by_poles,
}
"""Each method at one frequency; the zeros design with both poles of Q at -omega, so that it scales with omega."""


def interpolation_tables(design: Design) -> dict[str, pd.DataFrame]:
    """The three designs of Q over the frequency of the reference, and where the poles design is stable at all.

    Parameters
    ----------
    design
        Of kind "extended"; its a and its plant's dead time count.

    Returns
    -------
    dict
        ``interpolation``: omega (rad/s), method, stable, outer (C_0 has no zero in the closed right half plane, the
        proviso of (3.19)), sensitivity (||S||, empty where Q is not stable), works (all three, ||S|| <= 2).
        ``interpolation_summary``: method, lowest and highest omega of each range in which it works (empty: nowhere),
        a, delay_s. ``interpolation_map``: omega_delay, a_delay, margin: the poles design gives a stable Q where
        it is positive, which depends on omega T_d and a T_d only.
    """
    a, delay_s = design.free.a, design.plant.delay_s
    top = max(100 * a, 3 * math.pi / delay_s if delay_s else 0.0)
    rows = [
        {"omega": omega, "method": name} | _judge(method, float(omega), delay_s, a)
        for omega in np.geomspace(a / 40, top, FREQUENCIES)
        for name, method in METHODS.items()
    ]
    table = pd.DataFrame(rows)
    summary = []
    for name in METHODS:
        part = table[table["method"] == name]
        works = part["works"].to_numpy() == 1
        edges = np.flatnonzero(np.diff(np.concatenate([[0], works, [0]])))
        ends = [(part["omega"].iloc[first], part["omega"].iloc[last - 1]) for first, last in edges.reshape(-1, 2)]
        for lowest, highest in ends or [(np.nan, np.nan)]:
            summary.append({"method": name, "lowest": lowest, "highest": highest, "a": a, "delay_s": delay_s})
    omega_delay, a_delay = (each.ravel() for each in np.meshgrid(np.linspace(0.1, 20, 151), np.geomspace(1e-3, 10, 61)))
    return {
        "interpolation": table,
        "interpolation_summary": pd.DataFrame(summary),
        "interpolation_map": pd.DataFrame(
            {"omega_delay": omega_delay, "a_delay": a_delay, "margin": _poles_margin(omega_delay, a_delay)}
        ),
    }


def _judge(method: Callable[[Conditions], StableFunction], omega: float, delay_s: float, a: float) -> dict[str, float]:
    try:
        free = free_part(method(conditions([omega], delay_s, a)), a)
    except InputError:
        return {"stable": 0, "outer": 0, "sensitivity": np.nan, "works": 0}
    T = free.T_so
    # the dead time turns T_so exp(-T_d s) once each 2 pi/T_d: roots there make the grid fine enough
    turns = tuple(-k / delay_s + 1j * k * math.pi / delay_s for k in (0.5, 1, 2, 4, 8)) if delay_s else ()
    sensitivity, _ = peak(lambda at: np.abs(1 - T(1j * at) * np.exp(-1j * at * delay_s)), (*T.zeros, *T.poles, *turns))
    outer = all(zero.real < 0 for zero in free.C_0.zeros)
    works = outer and sensitivity <= SENSITIVITY
    return {"stable": 1, "outer": int(outer), "sensitivity": sensitivity, "works": int(works)}


def _poles_margin(omega: np.ndarray, a: np.ndarray) -> np.ndarray:
    """Positive where 1/Q = c_2 s^2 + c_1 s + c_0 through the conditions, with T_d = 1, has all coefficients positive.

    It is the lesser of c_1 and c_2 over |1/Q|, and so smooth across the boundary, which a contour then finds.
    """
    inverse, c_0 = 1 / wanted_at(omega, 1.0, a), 1 / (a * (1 + a))
    return np.asarray(np.minimum(inverse.imag, c_0 - inverse.real) / (np.abs(inverse) + c_0))
