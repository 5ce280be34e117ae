"""The panels of tests, model and bound: what each line is, and axes that can be read."""

from __future__ import annotations

from dataclasses import replace
from math import tau

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from identification.model.additive_bound import AdditiveBound
from identification.model.model_file import IdentifiedModel
from identification.model.modes import Mode
from identification.model.plant import PlantModel
from identification.sweeps.response import FrequencyResponse
from paper_figures.look.bode import decibel, draw_distance, draw_phase, draw_relative_distance, plot_bode

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
