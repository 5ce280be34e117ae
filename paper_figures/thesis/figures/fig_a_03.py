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
    "design_extended": ("thesis anti-windup", "thesis"),
    "design_robust": ("corrected anti-windup", "redesign"),
}


def caption(tables: Mapping[str, pd.DataFrame]) -> str:
    """Return the caption with the numbers of the tables."""
    summary = tables["robustness_summary"]
    peak, modulus, greatest = (
        [number(of_run(summary, run, column)) for run in KINDS] for column in ("peak", "modulus", "delay_greatest_s")
    )
    at = number(of_run(summary, "design_extended", "peak_omega"))
    if of_run(summary, "design_extended", "peak") < 1:
        verdict = "so that the loop around every plant within W_a is stable already"
    else:
        verdict = "so that W_a guarantees nothing"
    return (
        "(a) |W_a C S| with the exact dead time: where it is below 1 at every frequency, the loop around every plant "
        "within W_a is stable. The design "
        f"of chapters 3 and 4 reaches {peak[0]} at {at} rad/s, {verdict}; the redesign, whose T_so rolls off as far as "
        f"that takes and meets the same tracking conditions, {peak[1]}. Dashed: |W_a/P|, which no controller gets "
        "below "
        "where it follows; at the frequencies of the reference it is at most "
        f"{number(of_run(summary, 'design_extended', 'tracking_floor'))}. (b) |S|; the modulus margin is {modulus[0]} "
        "with "
        f"the one and {modulus[1]} with the other. The true dead time may grow to {greatest[0]} s and {greatest[1]} s, "
        "all "
        "else as modelled, before the loop is unstable."
    )


@styled()
def draw(tables: Mapping[str, pd.DataFrame]) -> Figure:
    """Return the figure."""
    axes = panels.lettered(FULL_WIDTH, 2.7, "ab")
    table = tables["robustness"]
    omega = table["omega"]
    for run, (kind, label) in KINDS.items():
        axes["a"].loglog(omega, table[f"robustness_{run}"], **LINES[kind], label=label)
        axes["b"].loglog(omega, table[f"sensitivity_{run}"], **LINES[kind])
    axes["a"].loglog(omega, table["floor"], **LINES["reference"], label="$|W_a/P|$")
    axes["a"].axhline(1.0, **LINES["saturation limits"])
    shown = omega[(table["robustness_design_extended"] > 1e-5) & (omega > 0)]
    view = float(shown.min()), float(10 * omega[np.argmax(table["robustness_design_extended"])])
    axes["a"].set(xlabel=r"$\omega$ [rad/s]", ylabel="$|W_a C S|$", xlim=view, ylim=(1e-5, 30))
    axes["b"].set(xlabel=r"$\omega$ [rad/s]", ylabel="$|S|$", xlim=view, ylim=(1e-4, 3))
    axes["a"].legend(**panels.ABOVE, ncols=3)
    return axes["a"].figure  # type: ignore[return-value]
