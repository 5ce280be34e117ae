"""Tests, model and the residuals under their bound, panel by panel and together."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MultipleLocator

from identification.base.arrays import Complex, Real
from identification.model.model_file import IdentifiedModel
from identification.model.modes import roots_of
from identification.model.plant import PlantModel
from identification.sweeps.as_fitted import as_fitted
from identification.sweeps.response import FrequencyResponse
from paper_figures.look.frequency_axis import HERTZ, decibel_of, hertz, over_hertz, plain
from paper_figures.look.panels import ABOVE, envelope
from paper_figures.look.style import panel_letters, styled

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
BAND: dict[str, Any] = {"color": "#0072B2", "alpha": 0.35, "linewidth": 0}
BOUND: dict[str, Any] = {"color": "#CC79A7", "linestyle": (0, (7, 2, 1.5, 2)), "linewidth": 1.4}
TOUCH: dict[str, Any] = {
    "color": "#D55E00",
    "linestyle": "none",
    "marker": "o",
    "markersize": 5,
    "markerfacecolor": "none",
}
POINTS = 3000  # of a line
MOST_DOTS = 20_000  # of a test; of more lines as many are drawn, and the extremes among them
SPARSE = 60  # lines of a test up to which they are drawn as dots of a size that is seen
BEYOND = 10.0  # times the slowest and the fastest root of a plant without tests is drawn
TURNS_DEG = (5, 10, 15, 30, 45, 90, 180, 360, 720, 1440)  # from one tick of a phase to the next
MOST_TICKS = 8
CHANCE = 0.3  # % of the distances, the least, that a panel may leave out: single ones come near zero by chance


@styled()
def plot_bode(model: IdentifiedModel, tests: Sequence[FrequencyResponse] = ()) -> Figure:
    """Draw magnitude and phase of a model and its tests, and how far the tests are from it.

    Parameters
    ----------
    model
        The plant and its additive bound, with the signals whose units the axes have.
    tests
        The responses that it was fitted to, or others; none unless given.

    Returns
    -------
    Figure
        Panels over the frequency in Hz: magnitude; phase, unwrapped, dead time and all; the distances of the tests
        under W_a, or W_a alone; the coherence, where a test has one. The title says so if a test is synthetic.

    Notes
    -----
    The band around the model is the 95 % confidence interval of |P| and of the phase of P at each frequency by itself,
    to first order in the parameters, from their covariance: see
    :class:`identification.model.covariance.Covariance`. A model that was not fitted, or that an older version wrote,
    has none. It says how sure the nominal plant is; how far plants may be from it, W_a says.
    """
    clean = as_fitted(model, tests)
    coherent = [test for test in clean if test.coherence is not None]
    count = 4 if coherent else 3
    figure = Figure(figsize=(5.2, 1.0 + 1.75 * count), layout="constrained")
    panels = list(figure.subplots(count, 1, sharex=True))
    kinds = {"synthetic" if test.synthetic else "measured" for test in clean}
    name = " and ".join(sorted(kinds))
    draw_magnitude(panels[0], model, clean, name)
    draw_phase(panels[1], model, clean, name)
    draw_distance(panels[2], model, clean)
    if coherent:
        _draw_coherence(panels[3], coherent)
    for panel in panels:
        panel.grid(which="both", linewidth=0.3, color="0.85")
        panel.legend(ncols=4, markerscale=3, **ABOVE)
    panel_letters(panels)
    signals, said = model.signals, []
    if (signals.output_name, signals.input_name) != ("output", "input"):
        said.append(f"{plain(signals.output_name)} over {plain(signals.input_name)}")
    if "synthetic" in kinds:
        said.append("synthetic data, never measured" if len(kinds) == 1 else "some data are synthetic")
    if said:
        figure.suptitle("; ".join(said))
    figure.align_ylabels()
    panels[-1].set_xlabel(HERTZ)
    return figure


def draw_magnitude(
    panel: Axes, model: IdentifiedModel, tests: Sequence[FrequencyResponse], name: str = "measured"
) -> None:
    """Draw the magnitude in dB of the tests, so named, and, upon them, of the model with its confidence band."""
    omega = _grid(panel, model, tests)
    _scatter(panel, tests, lambda _, response: decibel(np.abs(response)), name)
    magnitude = decibel(np.abs(model.plant(1j * omega)))
    _line_with_band(panel, model, omega, magnitude, 20 / np.log(10), 0)
    panel.set_ylabel(decibel_of("Magnitude", model.signals.gain_unit))


def draw_phase(panel: Axes, model: IdentifiedModel, tests: Sequence[FrequencyResponse], name: str = "measured") -> None:
    """Draw the phase in degrees of the model, and, behind it, of the tests on the turn next to it."""
    omega = _grid(panel, model, tests)

    def beside_model(at: Real, response: Complex) -> Real:
        measured_deg = np.degrees(np.angle(response))
        return np.asarray(measured_deg + 360 * np.round((phase_deg(model.plant, at) - measured_deg) / 360))

    _scatter(panel, tests, beside_model, name)
    _line_with_band(panel, model, omega, phase_deg(model.plant, omega), 180 / np.pi, 1)
    low, high = panel.get_ylim()
    enough = [step for step in TURNS_DEG if (high - low) / step <= MOST_TICKS]
    if enough:
        panel.yaxis.set_major_locator(MultipleLocator(enough[0]))
    panel.set_ylabel("Phase [deg]")


def draw_distance(
    panel: Axes, model: IdentifiedModel, tests: Sequence[FrequencyResponse], touches_omega: Sequence[float] = ()
) -> None:
    """Draw |P - P_test| in dB of every test, |W_a| above them, and a ring where W_a touches them (rad/s)."""
    omega = _grid(panel, model, tests)
    distances = _scatter(
        panel, tests, lambda at, response: decibel(np.abs(model.plant(1j * at) - response)), r"$|P - P_\mathrm{test}|$"
    )
    bound = model.additive_bound
    panel.plot(hertz(omega), decibel(np.abs(bound(1j * omega))), **BOUND, label="$|W_a|$")
    if touches_omega:
        at = np.array(touches_omega)
        panel.plot(hertz(at), decibel(np.abs(bound(1j * at))), **TOUCH, label="touches")
    leave_out_least(panel, distances)
    panel.set_ylabel(decibel_of("Distance", model.signals.gain_unit))


def draw_relative_distance(panel: Axes, model: IdentifiedModel, tests: Sequence[FrequencyResponse]) -> None:
    """Draw |P - P_test|/|P| in dB of every test and |W_a|/|P|; above 0 dB nothing is known of the plant."""
    omega, plant = _grid(panel, model, tests), model.plant
    ratios = _scatter(
        panel,
        tests,
        lambda at, response: decibel(np.abs(1 - response / plant(1j * at))),
        r"$|P - P_\mathrm{test}|/|P|$",
    )
    relative = np.abs(model.additive_bound(1j * omega) / plant(1j * omega))
    panel.plot(hertz(omega), decibel(relative), **BOUND, label="$|W_a|/|P|$")
    leave_out_least(panel, ratios)
    panel.set_ylabel("Relative distance [dB]")


def decibel(magnitude: Real) -> Real:
    """20 log10 of a magnitude; zero gives NaN, which is not drawn."""
    return np.asarray(20 * np.log10(np.where(magnitude > 0, magnitude, np.nan)))


def phase_deg(plant: PlantModel, omega: Real) -> Real:
    """The phase in degrees of a plant at omega (n,) in rad/s, continuous since it is the sum of its factors' phases.

    Towards s = 0 it is that of K/s^integrators, within half a turn of 0.
    """
    s = 1j * omega
    turn = 180 * (plant.gain < 0) * (1 if plant.integrators >= 0 else -1)
    phase_rad = np.radians(turn - 90 * plant.integrators) - plant.delay_s * omega
    for modes, rates, side in (
        (plant.zero_modes, plant.real_zeros, 1),
        (plant.pole_modes, plant.real_poles, -1),
    ):
        phase_rad = phase_rad + side * sum((np.angle(mode(s)) for mode in modes), np.zeros(omega.size))
        phase_rad = phase_rad + side * sum((np.arctan(omega / rate) for rate in rates), np.zeros(omega.size))
    return np.asarray(np.degrees(phase_rad))


def _draw_coherence(panel: Axes, tests: Sequence[FrequencyResponse]) -> None:
    for i, test in enumerate(tests):
        assert test.coherence is not None
        panel.plot(*_thinned(test.omega, test.coherence), **_dots(test), label=None if i else "coherence")
    panel.set_ylim(-0.03, 1.03)
    panel.set_ylabel("Coherence")


def _line_with_band(panel: Axes, model: IdentifiedModel, omega: Real, values: Real, unit: float, part: int) -> None:
    """The model's line, and its band: of log |P| (``part`` 0) or of the phase in rad (1), of which ``unit`` is one."""
    covariance = None if model.fit is None else model.fit.covariance
    panel.plot(hertz(omega), values, **MODEL, label="model")
    if covariance is not None:
        view = panel.get_ylim()  # an open parameter may leave the band without end
        half = unit * covariance.of_response(model.plant, omega)[part]
        panel.fill_between(hertz(omega), values - half, values + half, **BAND, label="its 95 % band")
        panel.set_ylim(view)


def _grid(panel: Axes, model: IdentifiedModel, tests: Sequence[FrequencyResponse]) -> Real:
    """Set the panel's axis over all lines of all tests, and return the points of its lines in rad/s.

    Without tests it is the band of the fit, or else that of the plant's roots and of its dead time.
    """
    every = [omega for test in tests for omega in (test.omega, *(lines.omega for lines in test.left_out))]
    if every:
        low, high = min(float(omega.min()) for omega in every), max(float(omega.max()) for omega in every)
    elif model.fit is not None:
        low, high = model.fit.band
    else:
        plant = model.plant
        zeros, poles = roots_of(plant.zero_modes, plant.real_zeros), roots_of(plant.pole_modes, plant.real_poles)
        corners = [*map(abs, (*zeros, *poles)), *([1 / plant.delay_s] if plant.delay_s else [])] or [1.0]
        low, high = min(corners) / BEYOND, max(corners) * BEYOND
    over_hertz(panel, low, high)
    roots = [mode.omega for modes in (model.plant.zero_modes, model.plant.pole_modes) for mode in modes]
    return np.unique([*np.geomspace(low, high, POINTS), *(root for root in roots if low < root < high)])


def _scatter(
    panel: Axes, tests: Sequence[FrequencyResponse], value: Callable[[Real, Complex], Real], label: str
) -> list[Real]:
    """Draw a value of each line of the tests, paler where it is left out, and return those that are not."""
    rest = [lines for test in tests for lines in test.left_out]
    for i, lines in enumerate(rest):
        found = value(lines.omega, lines.response)
        panel.plot(*_thinned(lines.omega, found), **LEFT_OUT, label=None if i else "left out")
    values = [value(test.omega, test.response) for test in tests]
    for i, (test, found) in enumerate(zip(tests, values, strict=True)):
        panel.plot(*_thinned(test.omega, found), **_dots(test), label=None if i else label)
    return values


def _dots(test: FrequencyResponse) -> dict[str, Any]:
    return MEASURED | ({"markersize": 4.5} if test.omega.size <= SPARSE else {})


def _thinned(omega: Real, values: Real) -> tuple[Real, Real]:
    """Frequencies in Hz and values of a test's lines; of very many some, and the extremes."""
    seen = np.isfinite(values)
    omega, values = omega[seen], values[seen]
    if omega.size <= MOST_DOTS:
        return hertz(omega), values
    step = -(-2 * omega.size // MOST_DOTS)
    extremes, most = envelope(omega, values, MOST_DOTS // 2, along=np.log(omega))
    return hertz(np.append(omega[::step], extremes)), np.append(values[::step], most)


def leave_out_least(panel: Axes, values: Sequence[Real]) -> None:
    """End a panel above the least of the values in dB of its tests, single ones of which come near zero by chance."""
    found = np.concatenate([*values, np.zeros(0)])
    found = found[np.isfinite(found)]
    if found.size:
        panel.set_ylim(bottom=float(np.percentile(found, CHANCE, method="higher")))
