"""The Nyquist curve of a design's loop with its exact dead time, and the discs that the bound W_a puts around it."""

from __future__ import annotations

from collections.abc import Sequence
from math import tau
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PatchCollection
from matplotlib.figure import Figure
from matplotlib.patches import Circle

from design.design_file import Design
from identification.base.arrays import Complex, Real
from identification.model.plant import PlantModel
from paper_figures.look.frequency_axis import number
from paper_figures.look.loop_curves import LoopCurves, traced
from paper_figures.look.panels import ABOVE
from paper_figures.look.style import styled

LOOP: dict[str, Any] = {"color": "#000000", "linewidth": 1.2}
TRUE: dict[str, Any] = {"color": "#D55E00", "linewidth": 1.0, "linestyle": (0, (5, 1.5))}
FILLED: dict[str, Any] = {"facecolor": "#E3F1FB", "edgecolor": "none", "zorder": 0.3}
RIMS: dict[str, Any] = {"facecolor": "none", "edgecolor": "#8CB8D9", "linewidth": 0.4, "zorder": 0.4}
DISC: dict[str, Any] = {
    "color": "#8CB8D9",
    "marker": "o",
    "markersize": 7,
    "markerfacecolor": "#E3F1FB",
    "markeredgewidth": 0.5,
    "linestyle": "none",
}
WORST: dict[str, Any] = {"color": "#0072B2", "linewidth": 1.1}
MARGIN: dict[str, Any] = {"color": "#CC79A7", "linewidth": 1.1, "linestyle": (0, (7, 2, 1.5, 2))}
UNIT: dict[str, Any] = {"color": "0.6", "linewidth": 0.5, "linestyle": (0, (1, 2))}
SHOWN = 2.6  # farthest from 0 that a loop is shown; towards the poles of L on the axis it leaves the panel
LEAST = (-1.9, 1.1, -1.4, 1.4)  # the view, at least
STEP = 0.05  # from one disc to the next, of the view: along the curve, and in radius
APART = 0.11  # two labels, of the view
SMALL = 0.12  # nearer to 0 there are no labels
OBLIQUE = 0.4  # component of a unit vector
SERIES = (1.0, 2.0, 5.0)


@styled()
def plot_nyquist(design: Design, plant: PlantModel | None = None) -> Figure:
    """Draw the Nyquist curve of a design.

    Parameters
    ----------
    design
        Of either kind.
    plant
        A true plant, whose own loop with the same controller is drawn too; none unless given.

    Returns
    -------
    Figure
        See :func:`draw_nyquist`.
    """
    figure = Figure(figsize=(4.6, 5.2), layout="constrained")
    draw_nyquist(figure.subplots(), design, plant)
    return figure


def draw_nyquist(panel: Axes, design: Design, plant: PlantModel | None = None) -> None:
    """Draw L(j omega) = P C for 0 < omega, dead times exact, on equal axes around the critical point -1.

    Parameters
    ----------
    panel
        Where to draw.
    design, plant
        As for :func:`plot_nyquist`.

    Notes
    -----
    At some frequencies, evenly apart in the panel, stands a disc of radius |W_a C| around L: the loop of every plant
    within W_a passes through each of them, and none of them holds -1 if |W_a C S| < 1. The one that comes nearest to
    that is drawn stronger. The circle around -1 has the radius min |1 + L| = 1/||S||. Both norms are those of the
    audit; a loop that is not stable has none, and neither circle. Dots on the curve say where it is at a frequency in
    Hz. Towards a pole of L on the imaginary axis the curve leaves the panel.
    """
    curves = LoopCurves.of(design)
    grid = curves.grid()
    omega, points = traced(curves.open, grid)
    margins = curves.margins
    modulus = margins.modulus.value if margins else 0.0
    view = _view(points, modulus)
    side = view[1] - view[0]
    at = omega[_spread(points, curves.radius(omega), view, STEP * side)]
    _discs(panel, curves.open(at), curves.radius(at))
    if margins:
        nearest = margins.W_a_C_S.omega or 0.0
        where = np.array([nearest])
        centre, radius = curves.open(where)[0], float(curves.radius(where)[0])
        if np.isfinite(centre) and np.isfinite(radius):
            said = rf"$\|W_a C S\|$ = {margins.W_a_C_S.value:.4g}, at {number(nearest / tau)} Hz"
            _circle(panel, centre, radius, WORST, said)
        _circle(panel, -1, modulus, MARGIN, rf"$1/\|S\|$ = {modulus:.4g}")
    _circle(panel, 0, 1, UNIT)
    panel.plot(points.real, points.imag, **LOOP, label=r"$L = P\,C$")
    if plant is not None:
        true = LoopCurves.of(design, plant)
        there = traced(true.open, true.grid())[1]
        panel.plot(there.real, there.imag, **TRUE, label="with the true plant")
    panel.plot([-1], [0], color="#D55E00", marker="+", markersize=9, markeredgewidth=1.5, linestyle="none", label="-1")
    panel.set_xlim(view[0], view[1])
    panel.set_ylim(view[2], view[3])
    _frequencies(panel, curves, omega, points, APART * side)
    panel.set_aspect("equal")
    panel.set_xlabel("Real part")
    panel.set_ylabel("Imaginary part")
    panel.legend(ncols=2, **ABOVE)


def _circle(panel: Axes, centre: complex, radius: float, line: dict[str, Any], label: str | None = None) -> None:
    around = centre + radius * np.exp(1j * np.linspace(0, tau, 361))
    panel.plot(around.real, around.imag, **line, label=label)


def _view(points: Complex, modulus: float) -> tuple[float, float, float, float]:
    """Left, right, bottom and top of a square: it holds the curve up to SHOWN, the circle around -1, and LEAST."""
    near = points[np.abs(points) <= SHOWN]
    x = [*near.real, -1.1 - modulus, LEAST[0], LEAST[1]]
    y = [*near.imag, 1.1 * modulus, -1.1 * modulus, LEAST[2], LEAST[3]]
    side = max(max(x) - min(x), max(y) - min(y)) / 2
    middle_x, middle_y = (min(x) + max(x)) / 2, (min(y) + max(y)) / 2
    return middle_x - side, middle_x + side, middle_y - side, middle_y + side


def _inside(points: Complex, view: Sequence[float]) -> np.ndarray:
    with np.errstate(invalid="ignore"):
        return (points.real > view[0]) & (points.real < view[1]) & (points.imag > view[2]) & (points.imag < view[3])


def _spread(points: Complex, radii: Real, view: Sequence[float], step: float) -> list[int]:
    """Which of the points, within the view, are a step from the last one, along the curve or in radius."""
    inside, chosen, gone = _inside(points, view), [], np.inf
    moved = np.abs(np.diff(points)) + np.abs(np.diff(radii))
    for i in np.flatnonzero(inside):
        gone += moved[i - 1] if i and inside[i - 1] else np.inf
        if gone >= step:
            chosen.append(int(i))
            gone = 0.0
    return chosen


def _discs(panel: Axes, centres: Complex, radii: Real) -> None:
    circles = [Circle((centre.real, centre.imag), radius) for centre, radius in zip(centres, radii, strict=True)]
    if circles:
        panel.add_collection(PatchCollection(circles, **FILLED))
        panel.add_collection(PatchCollection(circles, **RIMS))
        panel.plot([], [], **DISC, label="discs $|W_a C|$")


def _frequencies(panel: Axes, curves: LoopCurves, omega: Real, points: Complex, apart: float) -> None:
    """Dots on the curve with their frequencies, where there is room for them."""
    inside = _inside(points, (*panel.get_xlim(), *panel.get_ylim()))
    if not inside.any():
        return
    low, high = (np.log10(omega[inside][end] / tau) for end in (0, -1))
    decades = np.arange(np.floor(low), np.ceil(high) + 1)
    taken: list[complex] = [0j, -1 + 0j]
    for hertz in sorted(step * 10.0**decade for decade in decades for step in SERIES):
        here, there = curves.open(np.array([hertz, hertz * 1.001]) * tau)
        free = all(abs(here - other) > apart for other in taken)
        if not (free and abs(here) > SMALL and _inside(np.array([here]), (*panel.get_xlim(), *panel.get_ylim()))[0]):
            continue
        taken.append(here)
        across = 1j * (there - here) / abs(there - here)
        across *= 1 if (across * np.conj(here)).real > 0 else -1  # away from 0
        panel.plot([here.real], [here.imag], color="#000000", marker="o", markersize=2.8)
        panel.annotate(
            number(hertz) + ("" if len(taken) > 3 else " Hz"),
            (here.real, here.imag),
            (5 * across.real, 5 * across.imag),
            textcoords="offset points",
            ha="center" if abs(across.real) < OBLIQUE else ("left" if across.real > 0 else "right"),
            va="center" if abs(across.imag) < OBLIQUE else ("bottom" if across.imag > 0 else "top"),
            fontsize=7,
        )
