"""The panels of tests, model and bound: what each line is, and axes that can be read."""

from __future__ import annotations

from dataclasses import replace
from math import tau

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from identification.fit_model import fit
from identification.model.additive_bound import AdditiveBound
from identification.model.model_file import IdentifiedModel
from identification.model.modes import Mode
from identification.model.plant import PlantModel
from identification.model.signals import Signals
from identification.sweeps.response import FrequencyResponse
from paper_figures.look.bode import decibel, draw_distance, draw_phase, draw_relative_distance, phase_deg, plot_bode

PLANT = PlantModel(-2.0, (Mode(50.0, 0.03),), (Mode(80.0, 0.02),), 0.05)
BOUND = AdditiveBound.printed_form(0.3, 40.0, 60.0, 0.2)
MODEL = IdentifiedModel(PLANT, BOUND)
OMEGA = np.linspace(10.0, 300.0, 200)
SWEEP = FrequencyResponse(OMEGA, 1.1 * PLANT(1j * OMEGA), None, "a.csv")


@pytest.fixture
def panel() -> Axes:
    return Figure().add_subplot()


def labels(panel: Axes) -> list[str]:
    """What stands at the ticks that are seen."""
    figure = panel.get_figure()
    assert isinstance(figure, Figure)
    FigureCanvasAgg(figure).draw()
    low, high = panel.get_xlim()
    ticks = [*panel.xaxis.get_major_ticks(), *panel.xaxis.get_minor_ticks()]
    return [tick.label1.get_text() for tick in ticks if low <= tick.get_loc() <= high and tick.label1.get_text()]


def test_fit_has_three_panels_with_tests_behind_the_model() -> None:
    figure = plot_bode(MODEL, [SWEEP, replace(SWEEP, synthetic=True)])
    assert [len(panel.lines) for panel in figure.axes] == [3, 3, 3]
    assert [panel.get_ylabel() for panel in figure.axes] == ["Magnitude [dB]", "Phase [deg]", "Distance [dB]"]
    assert figure.get_suptitle() == "some data are synthetic"
    for line in figure.axes[0].lines[:2]:
        assert line.get_ydata() == pytest.approx(decibel(np.abs(SWEEP.response)))
    keys = [[text.get_text() for text in panel.get_legend().get_texts()] for panel in figure.axes]
    assert keys[:2] == [["measured and synthetic", "model"]] * 2


def test_names_units_coherence_and_a_model_alone() -> None:
    named = replace(MODEL, signals=Signals("motor current", "A", "angle", "rad"))
    figure = plot_bode(named, [replace(SWEEP, coherence=np.linspace(0.5, 1.0, OMEGA.size))])
    magnitude, phase, distance, coherence = figure.axes
    labels = [panel.get_ylabel() for panel in (magnitude, phase, distance, coherence)]
    assert labels == ["Magnitude [dB re rad/A]", "Phase [deg]", "Distance [dB re rad/A]", "Coherence"]
    assert coherence.lines[0].get_ydata() == pytest.approx(np.linspace(0.5, 1.0, OMEGA.size))
    assert coherence.get_xlabel() == "Frequency [Hz]"
    assert figure.get_suptitle() == "angle over motor current"
    alone = plot_bode(MODEL)
    assert [len(panel.lines) for panel in alone.axes] == [1, 1, 1]
    low, high = alone.axes[0].get_xlim()
    assert low < 20.0 / tau < 80.0 / tau < high  # 1/dead time, and the pole


def test_the_band_has_the_half_widths_of_the_covariance() -> None:
    test = FrequencyResponse(OMEGA, SWEEP.response * (1 + 0.02 * np.random.default_rng(1).normal(size=200)), None, "a")
    model = fit(test, modes=1, real=0, integrators=1)
    assert model.fit is not None
    assert model.fit.covariance is not None
    magnitude, phase, _ = plot_bode(model, [test]).axes
    for panel, part, unit in ((magnitude, 0, 20 / np.log(10)), (phase, 1, 180 / np.pi)):
        (band,) = panel.collections
        edges = band.get_paths()[0].vertices
        line = next(line for line in panel.lines if line.get_label() == "model")
        for hertz, value in list(zip(line.get_xdata(), line.get_ydata(), strict=True))[::500]:
            ends = edges[np.isclose(edges[:, 0], hertz, rtol=1e-12), 1]
            half = unit * model.fit.covariance.of_response(model.plant, np.array([tau * hertz]))[part][0]
            assert ends.min() == pytest.approx(value - half)
            assert ends.max() == pytest.approx(value + half)


@pytest.mark.parametrize(
    "plant", [PLANT, PlantModel(3.0, (Mode(9.0, -0.2),), (Mode(5.0, 0.1),), 0.3, 0, (-4.0,), (8.0,))]
)
def test_the_phase_is_continuous_and_that_of_the_response(plant: PlantModel) -> None:
    omega = np.geomspace(1e-4, 1e3, 20_000)
    phase = phase_deg(plant, omega)
    assert np.exp(1j * np.radians(phase)) == pytest.approx(np.exp(1j * np.angle(plant(1j * omega))))
    assert np.abs(np.diff(phase + np.degrees(plant.delay_s * omega))).max() < 5
    assert -180 <= phase[0] <= 180


def test_of_very_many_lines_the_extremes_are_drawn() -> None:
    omega = np.linspace(1.0, 1000.0, 200_000)
    response = PLANT(1j * omega) * 1.1
    response[[5, 123_456]] *= 20
    magnitude = plot_bode(MODEL, [FrequencyResponse(omega, response, None, "a")]).axes[0]
    drawn = magnitude.lines[0]
    assert len(drawn.get_xdata()) < 30_000
    for k in (5, 123_456):
        at = np.flatnonzero(np.isclose(drawn.get_xdata(), omega[k] / tau, rtol=1e-12))
        assert decibel(np.abs(response[k : k + 1]))[0] in drawn.get_ydata()[at]


def test_distance_has_the_bound_above_and_rings_where_it_touches(panel: Axes) -> None:
    draw_distance(panel, MODEL, [SWEEP], [60.0])
    measured, bound, ring = panel.lines
    assert measured.get_ydata() == pytest.approx(decibel(0.1 * np.abs(PLANT(1j * OMEGA))))
    assert ring.get_ydata() == pytest.approx(decibel(np.abs(BOUND([60.0j]))))
    assert max(bound.get_ydata()) < panel.get_ylim()[1]


def test_relative_distance_is_over_the_model(panel: Axes) -> None:
    draw_relative_distance(panel, MODEL, [SWEEP])
    measured, bound = panel.lines
    assert measured.get_ydata() == pytest.approx(np.full(OMEGA.size, -20.0))
    assert bound.get_ydata()[0] == pytest.approx(20 * np.log10(abs(BOUND(10j) / PLANT(10j))))


def test_a_distance_of_nothing_does_not_stretch_the_panel(panel: Axes) -> None:
    response = SWEEP.response.copy()
    response[100] = PLANT(1j * OMEGA[100]) * (1 + 1e-15)
    draw_distance(panel, MODEL, [replace(SWEEP, response=response)])
    assert panel.get_ylim()[0] > -80


def test_phase_of_the_tests_is_on_the_models_turn(panel: Axes) -> None:
    turned = replace(SWEEP, response=SWEEP.response * np.exp(0.1j))
    draw_phase(panel, MODEL, [turned])
    measured, model = panel.lines
    near = np.interp(OMEGA / tau, model.get_xdata(), model.get_ydata())
    assert measured.get_ydata() - near == pytest.approx(np.full(OMEGA.size, np.degrees(0.1)), abs=0.5)
    assert measured.get_ydata()[-1] < -360
    steps = np.diff(panel.get_yticks())
    assert steps == pytest.approx(np.full(steps.size, 180.0))


@pytest.mark.parametrize(
    ("low", "high", "wanted"),
    [
        (100.0, 160.0, ["100", "120", "140", "160"]),
        (15.0, 900.0, ["20", "50", "100", "200", "500"]),
        (0.5, 900.0, ["$\\mathdefault{10^{0}}$", "$\\mathdefault{10^{1}}$", "$\\mathdefault{10^{2}}$"]),
    ],
)
def test_frequencies_can_be_read_however_narrow_the_band(low: float, high: float, wanted: list[str]) -> None:
    omega = tau * np.geomspace(low, high, 50)
    figure = plot_bode(MODEL, [FrequencyResponse(omega, 1.1 * PLANT(1j * omega), None, "a.csv")])
    assert labels(figure.axes[-1]) == wanted
