"""Draw the tests, the model and the residuals under their bound."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from identification.frequency_response import FrequencyResponse
from identification.plant import AdditiveBound, PlantModel

Real = NDArray[np.float64]

MODEL, MEASURED, BOUND = "#0072B2", "0.55", "#D55E00"  # Okabe-Ito blue, grey, Okabe-Ito vermilion
MARKER = {"linestyle": "none", "marker": ".", "markersize": 1.5, "color": MEASURED, "rasterized": True}
POINTS = 3000  # of the model's line


def draw_fit(tests: Sequence[FrequencyResponse], plant: PlantModel, bound: AdditiveBound) -> Figure:
    """Bode magnitude and phase of the tests (markers) and the model (line); residuals under W_a.

    Parameters
    ----------
    tests
        The responses that were fitted.
    plant, bound
        The model and its additive bound.

    Returns
    -------
    Figure
        Three panels, a to c, over omega in rad/s.
    """
    omega = np.geomspace(min(t.omega[0] for t in tests), max(t.omega[-1] for t in tests), POINTS)
    model = plant(1j * omega)
    phase_deg = np.degrees(np.unwrap(np.angle(model * np.exp(1j * plant.delay_s * omega))) - plant.delay_s * omega)
    figure = Figure(figsize=(5.2, 6.2), layout="constrained")
    magnitude, phase, residual = figure.subplots(3, 1, sharex=True)
    for i, test in enumerate(tests):
        label = "measured" if i == 0 else None
        near = np.interp(test.omega, omega, phase_deg)
        angle = np.degrees(np.angle(test.response))
        distance = np.abs(plant(1j * test.omega) - test.response)
        magnitude.plot(test.omega, decibel(np.abs(test.response)), label=label, **MARKER)
        phase.plot(test.omega, angle + 360 * np.round((near - angle) / 360), label=label, **MARKER)
        residual.plot(test.omega, decibel(distance), label=r"$|P - P_{\mathrm{test}}|$" if i == 0 else None, **MARKER)
    magnitude.plot(omega, decibel(np.abs(model)), color=MODEL, linewidth=1, label="model")
    phase.plot(omega, phase_deg, color=MODEL, linewidth=1, label="model")
    residual.plot(omega, decibel(np.abs(bound(1j * omega))), color=BOUND, linewidth=1, label="$|W_a|$")
    for panel, letter, label in zip(
        (magnitude, phase, residual), "abc", ("Magnitude [dB]", "Phase [deg]", "Distance [dB]"), strict=True
    ):
        panel.set_xscale("log")
        panel.set_ylabel(label)
        panel.grid(which="both", linewidth=0.3, color="0.85")
        panel.legend(loc="lower left", frameon=False, fontsize=8, markerscale=4)
        panel.text(0.985, 0.95, f"({letter})", transform=panel.transAxes, ha="right", va="top")
    phase.yaxis.set_major_locator(MaxNLocator(steps=[1.8, 3.6, 4.5, 9, 10]))
    figure.align_ylabels()
    residual.set_xlabel(r"$\omega$ [rad/s]")
    residual.set_xlim(omega[0], omega[-1])
    return figure


def decibel(magnitude: Real) -> Real:
    """20 log10 of a magnitude; zero gives NaN, which is not drawn."""
    return 20 * np.log10(np.where(magnitude > 0, magnitude, np.nan))
