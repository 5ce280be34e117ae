"""Nyquist curve, discs and sensitivities of a design, against python-control and values by hand."""

from __future__ import annotations

import re
from dataclasses import replace
from math import tau

import control
import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.collections import PatchCollection
from matplotlib.lines import Line2D

from design.chapters_3_4.design_extended import design_extended
from design.design_file import Design
from design.stability.margins import delay_loop, margins_of
from identification.model.additive_bound import AdditiveBound
from identification.model.model_file import IdentifiedModel
from identification.model.modes import Mode
from identification.model.plant import PlantModel
from paper_figures.look.audit_sheet import plot_audit
from paper_figures.look.frequency_axis import number
from paper_figures.look.nyquist import plot_nyquist
from paper_figures.look.sensitivity import plot_sensitivity

UNSTABLE = IdentifiedModel(
    PlantModel(1.5, (), (Mode(20.0, 0.05),), 0.02, 0, (), (-3.0, 50.0)), AdditiveBound(0.02, (), (), (), (50.0,))
)
WITHOUT_DELAY = IdentifiedModel(
    PlantModel(2e-9, (), (Mode(60.0, 0.02),), 0.0, 1, (-200.0,)), AdditiveBound(1e-10, (), (), (), (50.0,))
)


@pytest.fixture(scope="module", params=["extended", "delay-free", "unstable", "without delay"])
def design(request: pytest.FixtureRequest, extended_design: Design, delay_free_design: Design) -> Design:
    made = {"extended": extended_design, "delay-free": delay_free_design}
    if request.param in made:
        return made[request.param]
    if request.param == "unstable":
        return design_extended(UNSTABLE, [0.0])
    return design_extended(WITHOUT_DELAY, [3.0])


@pytest.fixture(scope="module")
def nyquist(design: Design) -> Axes:
    """The panel of its curve, for tests that only look at it."""
    return plot_nyquist(design).axes[0]


def controller(design: Design, omega: np.ndarray) -> np.ndarray:
    """C(j omega) of (3.31), or of chapter 2 G_A's, from python-control's polynomials."""
    forward, feedback = (block.to_control() for block in design.controller_parts())
    late = np.exp(-1j * omega * design.loop_plant.delay_s)
    return forward(1j * omega) / (1 - feedback(1j * omega) * late)


def line_of(panel: Axes, start: str) -> Line2D:
    return next(line for line in panel.lines if str(line.get_label()).startswith(start))


def around(design: Design) -> np.ndarray:
    """Frequencies in rad/s off those of the reference, where C has poles."""
    fastest = 30 * max(abs(design.loop_plant.parameters[1].value), 50.0)
    return np.geomspace(0.05, fastest, 4000) * (1 + 1e-5)


def test_the_curve_is_the_loop_and_the_circle_its_modulus_margin(design: Design, nyquist: Axes) -> None:
    omega = around(design)
    L = design.loop_plant(1j * omega) * controller(design, omega)
    drawn = line_of(nyquist, "$L").get_xydata() @ [1, 1j]
    assert nyquist.get_aspect() == 1.0
    seen = L[(np.abs(L) < 2.0) & (np.abs(L) > 0.06)]
    assert len(seen) > 100
    assert max(np.nanmin(np.abs(drawn - point)) for point in seen[::20]) < 0.05
    circle = line_of(nyquist, "$1/").get_xydata() @ [1, 1j]
    margins = control.stability_margins(control.frd(L, omega), returnall=True)
    assert np.abs(circle + 1) == pytest.approx(np.full(circle.size, np.min(margins[2])), rel=2e-3)


def test_discs_are_as_large_as_the_bound_times_the_controller(design: Design, nyquist: Axes) -> None:
    discs = next(each for each in nyquist.collections if isinstance(each, PatchCollection))
    assert len(discs.get_paths()) > 8
    for box in (disc.get_extents() for disc in discs.get_paths()[::4]):
        centre, size = (box.x0 + box.x1 + 1j * (box.y0 + box.y1)) / 2, box.width / 2
        omega = np.geomspace(0.01, 1e5, 20_000) * (1 + 1e-7)
        for _ in range(3):
            C = controller(design, omega)
            L, radius = design.loop_plant(1j * omega) * C, np.abs(design.additive_bound(1j * omega) * C)
            apart = np.abs(L - centre) + np.abs(radius - size)
            at = int(np.argmin(apart))
            omega = np.linspace(omega[max(at - 1, 0)], omega[at + 1], 1001)
        assert apart.min() < 1e-3 * (1 + size), "no frequency has both this centre and this radius"


def test_frequencies_stand_where_the_curve_is_then(design: Design, nyquist: Axes) -> None:
    said = [(text.get_text(), text.xy) for text in nyquist.texts]
    assert said
    assert said[0][0].endswith(" Hz")
    for text, at in said:
        omega = np.array([tau * float(text.removesuffix(" Hz"))])
        assert np.array([1, 1j]) @ at == pytest.approx((design.loop_plant(1j * omega) * controller(design, omega))[0])


def test_nothing_is_drawn_across_the_panel_where_the_curve_is_infinite(extended_design: Design) -> None:
    drawn = line_of(plot_nyquist(extended_design).axes[0], "$L").get_xydata() @ [1, 1j]
    steps, size = np.abs(np.diff(drawn)), np.abs(drawn)
    assert np.isnan(drawn).any()
    assert np.nanmax(steps / (1 + np.fmin(size[1:], size[:-1]))) < 0.05


def test_a_true_plant_has_a_curve_of_its_own(extended_design: Design) -> None:
    plant = replace(extended_design.plant, gain=1.5 * extended_design.plant.gain)
    panel = plot_nyquist(extended_design, plant).axes[0]
    own, true = (line_of(panel, start).get_xydata() @ [1, 1j] for start in ("$L", "with the true"))
    point = own[np.nanargmin(np.abs(own + 0.25 + 0.75j))]
    assert np.nanmin(np.abs(true - 1.5 * point)) < 0.03


def test_sensitivities_are_those_of_the_loop_with_the_audits_peaks(design: Design) -> None:
    panel = plot_sensitivity(design).axes[0]
    C_s = {"S": lambda L, C: 1 / (1 + L), "T": lambda L, C: L / (1 + L), "W_a C S": lambda L, C: C / (1 + L)}
    margins = margins_of(delay_loop(design, design.loop_plant), design.additive_bound)
    peaks = {"S": 1 / margins.modulus.value, "T": margins.T_peak.value, "W_a C S": margins.W_a_C_S.value}
    for name, formula in C_s.items():
        line = line_of(panel, f"$|{name}|$")
        hertz, values = np.asarray(line.get_xdata(), float), np.asarray(line.get_ydata(), float)
        omega = tau * hertz
        off = np.min(np.abs(np.subtract.outer(omega, [*design.reference_omegas, 0.0])), axis=1) > 1e-3 * omega
        C = controller(design, omega)
        expected = np.abs(formula(design.loop_plant(1j * omega) * C, C))
        expected = expected * np.abs(design.additive_bound(1j * omega)) if "W_a" in name else expected
        shown = off & (values > 1.1e-4)
        np.testing.assert_allclose(values[shown], expected[shown], rtol=1e-5)
        peak = re.search(r"peak (\S+)", str(line.get_label()))
        assert peak is not None
        assert float(peak[1]) == pytest.approx(peaks[name], rel=6e-4)


def test_a_peak_far_beyond_the_bandwidth_is_found_and_shown(extended_design: Design) -> None:
    design = replace(extended_design, additive_bound=AdditiveBound.printed_form(1e-4, 100.0, 9e3, 0.02))
    omega = np.geomspace(1.0, 1e5, 100_001)
    C = controller(design, omega)
    L = design.loop_plant(1j * omega) * C
    size = np.abs(design.additive_bound(1j * omega) * C / (1 + L))
    at = int(np.argmax(size))
    assert abs(L[at]) < 1e-2  # far below what is looked at for L
    line = line_of(plot_sensitivity(design).axes[0], "$|W_a")
    assert str(line.get_label()).endswith(f"peak {size[at]:.4g}")
    assert np.max(line.get_ydata()) == pytest.approx(size[at], rel=1e-4)
    assert line_of(plot_nyquist(design).axes[0], r"$\|W_a").get_label().endswith(f"{number(omega[at] / tau)} Hz")


def test_levels_and_frequencies_of_the_reference_are_marked() -> None:
    design = design_extended(WITHOUT_DELAY, [3.0], robust_level=0.7)
    figure = plot_audit(design)
    curve, panel = figure.axes
    assert panel.get_xlabel() == "Frequency [Hz]"
    level = [line.get_ydata()[0] for line in panel.lines if len(line.get_ydata()) == 2 and line.get_xdata()[0] == 0]
    assert level == [2.0, 1.0, 0.7]
    assert list(line_of(panel, "reference").get_xdata()) == pytest.approx([3.0 / tau] * 2)
    assert figure.get_suptitle() == "extended design"
    assert [text.get_text() for text in curve.texts][-1] == "(a)"


def test_an_unstable_loop_is_called_so(extended_design: Design) -> None:
    plant = extended_design.plant
    worse = replace(extended_design, plant=replace(plant, gain=-plant.gain))
    figure = plot_audit(worse)
    assert "UNSTABLE" in figure.get_suptitle()
    said = [text.get_text() for panel in figure.axes for text in panel.get_legend().get_texts()]
    assert not any("peak" in each or r"\|" in each for each in said), "an unstable loop has no norms"
