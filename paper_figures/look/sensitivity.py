"""|S|, |T| and |W_a C S| of a design over the frequency, beside what bounds them."""

from __future__ import annotations

from math import tau
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter

from design.design_file import Design
from design.parameters import ExtendedParameters
from identification.model.plant import PlantModel
from paper_figures.look.frequency_axis import HERTZ, hertz, over_hertz
from paper_figures.look.loop_curves import LoopCurves
from paper_figures.look.panels import ABOVE
from paper_figures.look.style import FULL_WIDTH, styled

LINES: tuple[tuple[str, dict[str, Any]], ...] = (
    ("S", {"color": "#000000", "linewidth": 1.2}),
    ("T", {"color": "#0072B2", "linewidth": 1.2, "linestyle": (0, (5, 1.5))}),
    ("W_a C S", {"color": "#CC79A7", "linewidth": 1.6, "linestyle": (0, (7, 2, 1.5, 2))}),
)
LEVEL: dict[str, Any] = {"color": "0.35", "linewidth": 0.7}
REFERENCE: dict[str, Any] = {"color": "#E69F00", "linewidth": 0.9, "linestyle": (0, (3, 1.5))}
USUAL = 2.0  # ||S|| up to which a loop counts as robust: gain margin 2, phase margin 29 degrees
BELOW = 30.0  # times the slowest frequency of the reference that is drawn
DEPTH = 1e-3  # least that is shown
POINTS = 2000
BESIDE = np.geomspace(1e-6, 1e-1, 41)  # a frequency of the reference, relative


@styled()
def plot_sensitivity(design: Design, plant: PlantModel | None = None) -> Figure:
    """Draw how a design's loop answers the reference, disturbances, and the uncertainty of its plant.

    Parameters
    ----------
    design
        Of either kind.
    plant
        The true plant; the design's own model unless given.

    Returns
    -------
    Figure
        See :func:`draw_sensitivity`.
    """
    figure = Figure(figsize=(FULL_WIDTH, 3.3), layout="constrained")
    draw_sensitivity(figure.subplots(), design, plant)
    return figure


def draw_sensitivity(panel: Axes, design: Design, plant: PlantModel | None = None) -> None:
    """Draw |S|, |T| and |W_a C S| over the frequency in Hz, dead times exact.

    Parameters
    ----------
    panel
        Where to draw.
    design, plant
        As for :func:`plot_sensitivity`.

    Notes
    -----
    |S| above 2 is a gain margin below 2. |W_a C S| below 1 at every frequency stabilises every plant within W_a with as
    many poles in the right half plane, and the level that a robust design was asked for is drawn too. At the
    frequencies of the reference, which are marked, S = 0 and T = 1. The peaks are the norms of the audit; an unstable
    loop has none.
    """
    curves = LoopCurves.of(design, plant)
    grid = curves.grid()
    shown = [omega for omega in design.reference_omegas if omega > 0]
    low, high = curves.corners()
    low = min([min(shown) / BELOW, *curves.peaks_at]) if shown else low
    beside = np.multiply.outer(shown, 1 + np.outer([-1, 1], BESIDE)).ravel()  # the controller has poles at them
    inside = grid[(grid >= low) & (grid <= high)]
    omega = np.unique([*inside, *np.geomspace(low, high, POINTS), *beside, *curves.peaks_at])
    magnitudes = curves.magnitudes(omega)
    said = [f", peak {peak.value:.4g}" for peak in curves.peaks] or [""] * len(LINES)
    for (name, line), values, peak in zip(LINES, magnitudes, said, strict=True):
        panel.plot(hertz(omega), np.maximum(values, DEPTH / 10), **line, label=f"$|{name}|${peak}")
    top = max(USUAL, *(float(np.nanmax(values)) for values in magnitudes))
    levels = {USUAL: f"{USUAL:g}", 1.0: "1"}
    roll_off = design.parameters.roll_off if isinstance(design.parameters, ExtendedParameters) else None
    if roll_off is not None:
        levels[roll_off.level] = f"{roll_off.level:g} asked"
    for level in levels:
        panel.axhline(level, **LEVEL, linestyle="-" if level == 1 else (0, (1, 2)), zorder=1)
        panel.annotate(
            levels[level],
            (1, level),
            (3, 0),
            xycoords=("axes fraction", "data"),
            textcoords="offset points",
            va="center" if level == USUAL else ("bottom" if level == 1 else "top"),
            fontsize=7,
        )
    for i, at in enumerate(shown):
        panel.axvline(at / tau, **REFERENCE, zorder=1, label=None if i else "reference")
    panel.set_yscale("log")
    panel.set_ylim(max(DEPTH, min(float(np.nanmin(values)) for values in magnitudes) / 2), 1.5 * top)
    panel.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    over_hertz(panel, low, high)
    panel.set_xlabel(HERTZ)
    panel.set_ylabel("Magnitude")
    panel.legend(ncols=4, **ABOVE)
