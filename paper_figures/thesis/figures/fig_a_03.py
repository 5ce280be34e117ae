"""Fig. A.3: |W_a C S| of the extended design, of its robust redesign, and what tracking forbids."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from paper_figures.look import panels
from paper_figures.look.captions import number, of_run
from paper_figures.look.style import FULL_WIDTH, LINES, styled

TABLES: tuple[str, ...] = ("robustness", "robustness_summary")

KINDS = {
    "design_extended": (LINES["thesis anti-windup"], "thesis"),
    "design_robust": (panels.band(LINES["corrected anti-windup"]), "redesign"),
}
"""The designs and their lines; the redesign is a broad band, on which the thesis's line stays visible."""


def caption(tables: Mapping[str, pd.DataFrame]) -> str:
    """Return the caption with the numbers of the tables."""
    summary = tables["robustness_summary"]
    peak, modulus, greatest = (
        [number(of_run(summary, run, column)) for run in KINDS] for column in ("peak", "modulus", "delay_greatest_s")
    )
    at = number(of_run(summary, "design_extended", "peak_omega"))
    verdict = "holds" if of_run(summary, "design_extended", "peak") < 1 else "does NOT hold"
    return (
        "(a) Robust stability: where |W_a C S| stays below 1 (dotted), the loop is stable for every plant within W_a. "
        f"The design of chapters 3 and 4 reaches {peak[0]} at {at} rad/s, so the condition {verdict}; our redesign "
        f"reaches {peak[1]}. Dashed: |W_a/P|, which |W_a C S| equals at the reference's frequencies in every loop that "
        f"tracks; there it is at most {number(of_run(summary, 'design_extended', 'tracking_floor'))}. (b) Sensitivity "
        f"|S|: the modulus margin is {modulus[0]} (thesis) and {modulus[1]} (redesign). The loop stays stable for dead "
        f"times below {greatest[0]} s and {greatest[1]} s."
    )


@styled()
def draw(tables: Mapping[str, pd.DataFrame]) -> Figure:
    """Return the figure."""
    axes = panels.lettered(FULL_WIDTH, 2.7, "ab")
    table = tables["robustness"]
    omega = table["omega"]
    for run, (line, label) in KINDS.items():
        on_top = 3 - line["linewidth"] / 10
        axes["a"].loglog(omega, table[f"robustness_{run}"], **line, label=label, zorder=on_top)
        axes["b"].loglog(omega, table[f"sensitivity_{run}"], **line, zorder=on_top)
    axes["a"].loglog(omega, table["floor"], **LINES["reference"], label="$|W_a/P|$", zorder=4)
    axes["a"].axhline(1.0, **LINES["saturation limits"])
    shown = omega[(table["robustness_design_extended"] > 1e-5) & (omega > 0)]
    view = float(shown.min()), float(10 * omega[np.argmax(table["robustness_design_extended"])])
    axes["a"].set(xlabel=r"$\omega$ [rad/s]", ylabel="$|W_a C S|$ [-]", xlim=view, ylim=(1e-5, 30))
    axes["b"].set(xlabel=r"$\omega$ [rad/s]", ylabel="$|S|$ [-]", xlim=view, ylim=(1e-4, 3))
    axes["a"].legend(**panels.ABOVE, ncols=3)
    return axes["a"].figure  # type: ignore[return-value]
