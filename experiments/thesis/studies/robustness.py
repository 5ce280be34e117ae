"""|W_a C S| of extended designs, with the exact dead time, and their margins (Fig. A.3)."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pandas as pd

from design.blocks.block import plant_block
from design.blocks.frequency_peak import frequency_grid
from design.design_file import Design
from design.stability.margins import delay_loop, margins_of, responses, tracking_floor
from identification.base.errors import InputError


def robustness_tables(designs: Mapping[str, Design]) -> dict[str, pd.DataFrame]:
    """Robustness of several designs for one plant and W_a.

    Parameters
    ----------
    designs
        Name -> design; plant, W_a and reference are those of all.

    Returns
    -------
    dict
        ``robustness``: omega (rad/s), floor (|W_a/P|, which |W_a C S| is wherever T = 1) and, for every design NAME,
        robustness_NAME (|W_a C S|) and sensitivity_NAME (|S|). ``robustness_summary``: a row a design: peak and
        peak_omega of |W_a C S|, modulus, phase_deg, gain_down, gain_up, delay_least_s, delay_greatest_s (empty: no
        limit), tracking_floor.

    Raises
    ------
    InputError
        The designs are for different plants or bounds, or one of their loops is not stable.
    """
    first = next(iter(designs.values()))
    for name, design in designs.items():
        if (design.loop_plant, design.additive_bound) != (first.loop_plant, first.additive_bound):
            raise InputError(f"the design {name} is for another plant or W_a than {next(iter(designs))}")
    P = plant_block(first.loop_plant)
    W_a = first.additive_bound
    parts = [P, *(part for design in designs.values() for part in design.controller_parts())]
    omega = frequency_grid((root for part in parts for root in part.zeros + part.poles), per_decade=40)
    s = 1j * omega
    columns = {"omega": omega, "floor": np.abs(W_a(s) / P(s))}
    rows = []
    for name, design in designs.items():
        loop = delay_loop(design, first.loop_plant)
        S, C_S = responses(loop, omega)
        columns[f"robustness_{name}"], columns[f"sensitivity_{name}"] = np.abs(W_a(s) * C_S), np.abs(S)
        margins = margins_of(loop, W_a)
        rows.append(
            {
                "run": name,
                "peak": margins.W_a_C_S.value,
                "peak_omega": margins.W_a_C_S.omega,
                "modulus": margins.modulus.value,
                "phase_deg": margins.phase_deg.value,
                "gain_down": margins.gain_down.value,
                "gain_up": margins.gain_up.value,
                "delay_least_s": margins.delay_least_s.value,
                "delay_greatest_s": margins.delay_greatest_s.value,
                "tracking_floor": tracking_floor(first.loop_plant, W_a, design.reference_omegas),
            }
        )
    summary = pd.DataFrame(rows).replace(np.inf, np.nan)
    return {"robustness": pd.DataFrame(columns), "robustness_summary": summary}
