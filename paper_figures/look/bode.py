"""Tests, model and the residuals under their bound, panel by panel and together."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator, MultipleLocator, NullFormatter

from identification.base.arrays import Complex, Real
from identification.base.errors import InputError
from identification.model.additive_bound import AdditiveBound
from identification.model.model_file import IdentifiedModel
from identification.model.plant import PlantModel
from identification.sweeps.as_fitted import as_fitted
from identification.sweeps.response import FrequencyResponse
from paper_figures.look.style import styled

MEASURED: dict[str, Any] = {
    "color": "0.55",
    "linestyle": "none",
    "marker": ".",
    "markersize": 2.5,
    "markeredgewidth": 0,
    "rasterized": True,
}
LEFT_OUT = MEASURED | {"color": "#E0A080"}
MODEL: dict[str, Any] = {"color": "#000000", "linewidth": 0.8}
BOUND: dict[str, Any] = {"color": "#CC79A7", "linestyle": (0, (7, 2, 1.5, 2)), "linewidth": 1.4}
TOUCH: dict[str, Any] = {
    "color": "#D55E00",
    "linestyle": "none",
    "marker": "o",
    "markersize": 5,
    "markerfacecolor": "none",
}
POINTS = 3000  # of a line
TURNS_DEG = (5, 10, 15, 30, 45, 90, 180, 360, 720, 1440)  # from one tick of a phase to the next
MOST_TICKS = 8
FEW = 100  # ratio of frequencies between which there are too few powers of ten
CHANCE = 0.3  # % of the distances, the least, that a panel may leave out: single ones come near zero by chance


@styled()
def plot_bode(model: IdentifiedModel, tests: Sequence[FrequencyResponse]) -> Figure:
    """Draw magnitude and phase of tests and model, and the residuals under W_a.

    Parameters
    ----------
    model
        The plant and its additive bound.
    tests
        One or more responses, see :func:`identification.sweeps.as_fitted.as_fitted`.

    Returns
    -------
    Figure
        Three panels, a to c, over omega in rad/s. The title says so if a test is synthetic.
    """
    if not tests:
        raise InputError("no test was given; expected one or more responses")
    plant, bound = model.plant, model.additive_bound
    clean = as_fitted(model, tests)
    figure = Figure(figsize=(5.2, 6.2), layout="constrained")
    magnitude, phase, distance = figure.subplots(3, 1, sharex=True)
    kinds = {"synthetic" if test.synthetic else "measured" for test in tests}
    name = " and ".join(sorted(kinds))
    draw_magnitude(magnitude, clean, plant, name)
    draw_phase(phase, clean, plant, name)
    draw_distance(distance, clean, plant, bound)
    for panel, letter in zip((magnitude, phase, distance), "abc", strict=True):
        panel.grid(which="both", linewidth=0.3, color="0.85")
        panel.legend(loc="lower left", markerscale=4)
        panel.text(0.985, 0.95, f"({letter})", transform=panel.transAxes, ha="right", va="top")
    if "synthetic" in kinds:
        figure.suptitle("synthetic data, never measured" if len(kinds) == 1 else "some data are synthetic")
    figure.align_ylabels()
    distance.set_xlabel(r"$\omega$ [rad/s]")
    return figure


def draw_magnitude(panel: Axes, tests: Sequence[FrequencyResponse], plant: PlantModel, name: str = "measured") -> None:
    """Draw the magnitude in dB of the tests, so named, and, upon them, of the model."""
    omega = _grid(panel, tests)
    _scatter(panel, tests, lambda _, response: decibel(np.abs(response)), name)
    panel.plot(omega, decibel(np.abs(plant(1j * omega))), **MODEL, label="model")
    panel.set_ylabel("Magnitude [dB]")


def draw_phase(panel: Axes, tests: Sequence[FrequencyResponse], plant: PlantModel, name: str = "measured") -> None:
    """Draw the phase in degrees of the model, unwrapped, and, behind it, of the tests on the turn next to it."""
    omega = _grid(panel, tests)
    rational_rad = np.unwrap(np.angle(plant.without_delay()(1j * omega)))
    phase_deg = np.degrees(rational_rad - plant.delay_s * omega)

    def beside_model(at: Real, response: Complex) -> Real:
        measured_deg = np.degrees(np.angle(response))
        return np.asarray(measured_deg + 360 * np.round((np.interp(at, omega, phase_deg) - measured_deg) / 360))

    _scatter(panel, tests, beside_model, name)
    panel.plot(omega, phase_deg, **MODEL, label="model")
    low, high = panel.get_ylim()
    enough = [step for step in TURNS_DEG if (high - low) / step <= MOST_TICKS]
    if enough:
        panel.yaxis.set_major_locator(MultipleLocator(enough[0]))
    panel.set_ylabel("Phase [deg]")


def draw_distance(
    panel: Axes,
    tests: Sequence[FrequencyResponse],
    plant: PlantModel,
    bound: AdditiveBound,
    touches_omega: Sequence[float] = (),
) -> None:
    """Draw |P - P_test| in dB of every test, |W_a| above them, and a ring where W_a touches them (rad/s)."""
    omega = _grid(panel, tests)
    distances = _scatter(
        panel, tests, lambda at, response: decibel(np.abs(plant(1j * at) - response)), r"$|P - P_\mathrm{test}|$"
    )
    panel.plot(omega, decibel(np.abs(bound(1j * omega))), **BOUND, label="$|W_a|$")
    if touches_omega:
        at = np.array(touches_omega)
        panel.plot(at, decibel(np.abs(bound(1j * at))), **TOUCH, label="touches")
    _leave_out_least(panel, distances)
    panel.set_ylabel("Distance [dB]")


def draw_relative_distance(
    panel: Axes, tests: Sequence[FrequencyResponse], plant: PlantModel, bound: AdditiveBound
) -> None:
    """Draw |P - P_test|/|P| in dB of every test and |W_a|/|P|; above 0 dB nothing is known of the plant."""
    omega = _grid(panel, tests)
    ratios = _scatter(
        panel,
        tests,
        lambda at, response: decibel(np.abs(1 - response / plant(1j * at))),
        r"$|P - P_\mathrm{test}|/|P|$",
    )
    panel.plot(omega, decibel(np.abs(bound(1j * omega) / plant(1j * omega))), **BOUND, label="$|W_a|/|P|$")
    _leave_out_least(panel, ratios)
    panel.set_ylabel("Relative distance [dB]")


def decibel(magnitude: Real) -> Real:
    """20 log10 of a magnitude; zero gives NaN, which is not drawn."""
    return 20 * np.log10(np.where(magnitude > 0, magnitude, np.nan))


def _grid(panel: Axes, tests: Sequence[FrequencyResponse]) -> Real:
    """Make the panel's axis logarithmic, over all lines of all tests, and return the points of its lines in rad/s.

    Below two decades, powers of ten would be too few ticks.
    """
    every = [omega for test in tests for omega in (test.omega, *(lines.omega for lines in test.left_out))]
    low, high = min(omega.min() for omega in every), max(omega.max() for omega in every)
    panel.set_xscale("log")
    panel.set_xlim(low, high)
    panel.xaxis.set_minor_formatter(NullFormatter())
    if high < FEW * low:
        panel.xaxis.set_major_locator(
            LogLocator(subs=(1, 2, 5)) if high > 5 * low else MaxNLocator(5, steps=[1, 2, 5, 10])
        )
        panel.xaxis.set_major_formatter(FuncFormatter(lambda omega, _: f"{omega:g}"))
    return np.geomspace(low, high, POINTS)


def _scatter(
    panel: Axes, tests: Sequence[FrequencyResponse], value: Callable[[Real, Complex], Real], label: str
) -> list[Real]:
    """Draw a value of each line of the tests, paler where it is left out, and return those that are not."""
    rest = [lines for test in tests for lines in test.left_out]
    for i, lines in enumerate(rest):
        panel.plot(lines.omega, value(lines.omega, lines.response), **LEFT_OUT, label=None if i else "left out")
    values = [value(test.omega, test.response) for test in tests]
    for i, (test, found) in enumerate(zip(tests, values, strict=True)):
        panel.plot(test.omega, found, **MEASURED, label=None if i else label)
    return values


def _leave_out_least(panel: Axes, values: Sequence[Real]) -> None:
    panel.set_ylim(bottom=float(np.nanpercentile(np.concatenate(values), CHANCE, method="higher")))
