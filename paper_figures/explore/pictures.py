"""The page's pictures: figures of Bokeh whose data are exchanged, in the line styles of all figures."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from bokeh.models import ColumnDataSource, CustomJS, Range1d, Span
from bokeh.plotting import figure as bokeh_figure

from experiments.engine.simulate import Run
from identification.model.signals import Signals
from paper_figures.explore.compute import Linear, saturated
from paper_figures.explore.words import without_tex
from paper_figures.look.panels import band
from paper_figures.look.style import LINES

POINT = 4 / 3  # pixels
HOLDS: dict[str, Any] = {"line_color": "#D55E00", "line_width": 2.0, "line_dash": [4, 3]}  # a disc that holds -1
SHADE: dict[str, Any] = {"fill_color": "#E69F00", "fill_alpha": 0.22, "line_color": None}
MIDDLE, VIEW = -0.5, 2.0  # of the Nyquist plot: its middle on the real axis, and half its height
ROOM = 1.6  # of the limits, above and below them
LEFT = 72  # pixels for the labels of an axis, so that panels one above the other have one time axis
SQUARE = """
const half = VIEW * cb_obj.inner_width / cb_obj.inner_height
x_range.setv({start: MIDDLE - half, end: MIDDLE + half, reset_start: MIDDLE - half, reset_end: MIDDLE + half})
"""


def line(name: str) -> dict[str, Any]:
    """A line style of :data:`paper_figures.look.style.LINES` as Bokeh takes it."""
    own = LINES[name]
    width = own["linewidth"] * POINT
    dash = "solid" if own["linestyle"] == "-" else [max(1, round(each * width)) for each in own["linestyle"][1]]
    return {"line_color": own["color"], "line_width": width, "line_dash": dash}


def sources() -> dict[str, ColumnDataSource]:
    """The data of every picture by their names, empty."""
    columns = {
        "run": ("time_s", "reference", "output", "y_lin", "control", "saturated_control"),
        "saturated": ("start", "end"),
        "model": ("real", "imag"),
        "true": ("real", "imag"),
        "discs": ("real", "imag", "radius"),
        "holding": ("real", "imag", "radius"),
        "step": ("time_s", "model", "true"),
    }
    return {name: ColumnDataSource({each: [] for each in own}, name=name) for name, own in columns.items()}


class Pictures:
    """The figures ``output``, ``control``, ``nyquist`` and ``step``, empty until something is shown.

    Parameters
    ----------
    signals
        Names and units for the axes.
    """

    def __init__(self, signals: Signals) -> None:
        self.data = sources()
        self.limits = [Span(dimension="width", **line("saturation limits")) for _ in range(2)]
        self._shown: Linear | None = None
        self.output = self._over_time("output", "Saturated run: output", signals.output)
        self.control = self._over_time("control", "Saturated run: control", signals.input)
        self.control.x_range = self.output.x_range
        self.output.xaxis.axis_label = None  # that of the panel below
        self.step = self._over_time("step", "Step of the reference, no limits", signals.output)
        self.nyquist = self._nyquist()
        self._draw_over_time()

    @property
    def all(self) -> tuple[bokeh_figure, ...]:
        """Every figure."""
        return self.output, self.control, self.nyquist, self.step

    def show_run(self, run: Run, limits: tuple[float, float]) -> None:
        """Show a run and its limits."""
        outputs = run.outputs
        lines = {name: outputs[name] for name in ("reference", "output", "y_lin")}
        shown = _view([outputs["reference"], outputs["output"]])
        _see(self.output.y_range, shown)
        around = _view([_around(limits)])
        _see(self.control.y_range, around)
        _see(self.output.x_range, (0.0, float(run.time_s[-1])))
        self.data["run"].data = {
            "time_s": run.time_s,
            **{name: _cut(values, shown) for name, values in lines.items()},
            "control": _cut(run.control, around),
            "saturated_control": run.saturated_control,
        }
        times = saturated(run)
        self.data["saturated"].data = {"start": times[:, 0], "end": times[:, 1]}
        for span, limit in zip(self.limits, limits, strict=True):
            span.location = limit

    def show_linear(self, linear: Linear) -> None:
        """Show the loop without limits, unless it is shown already."""
        if linear is self._shown:
            return
        self._shown, nyquist = linear, linear.nyquist
        for name, curve in (("model", nyquist.model), ("true", nyquist.true)):
            self.data[name].data = {"real": curve.real, "imag": curve.imag}
        holds = np.abs(nyquist.centres + 1) <= nyquist.radii
        self.nyquist.legend[0].items[1].visible = bool(holds.any())
        for name, chosen in (("discs", ~holds), ("holding", holds)):
            centres = nyquist.centres[chosen]
            self.data[name].data = {"real": centres.real, "imag": centres.imag, "radius": nyquist.radii[chosen]}
        shown = _view([linear.model, linear.true, np.array([0.0, 1.0])])
        _see(self.step.y_range, shown)
        _see(self.step.x_range, (0.0, float(linear.time_s[-1])))
        self.data["step"].data = {
            "time_s": linear.time_s,
            "model": _cut(linear.model, shown),
            "true": _cut(linear.true, shown),
        }

    def _over_time(self, name: str, title: str, label: str) -> bokeh_figure:
        return _figure(name, title, "time [s]", label, Range1d(0, 1), Range1d(-1, 1))

    def _draw_over_time(self) -> None:
        own = line("corrected anti-windup")
        broad = band(LINES["corrected anti-windup"])
        pale = own | {"line_color": broad["color"], "line_width": broad["linewidth"] * POINT}
        for panel in (self.output, self.control):
            panel.vstrip(x0="start", x1="end", source=self.data["saturated"], legend_label="saturated", **SHADE)
        for panel, source, name, look, said in (
            (self.output, "run", "output", own, "output"),
            (self.output, "run", "y_lin", line("family 5"), "no limits"),
            (self.output, "run", "reference", line("reference"), "reference"),
            (self.control, "run", "saturated_control", pale, "sat(u)"),
            (self.control, "run", "control", own, "u"),
            (self.step, "step", "true", own, "true plant"),
            (self.step, "step", "model", line("model"), "model"),
        ):
            panel.line("time_s", name, source=self.data[source], legend_label=said, **look)
        for span in self.limits:
            self.control.add_layout(span)
        self.step.add_layout(Span(dimension="width", location=1.0, **line("reference")))
        for panel in (self.output, self.control, self.step):
            _key(panel)

    def _nyquist(self) -> bokeh_figure:
        ranges = Range1d(MIDDLE - VIEW, MIDDLE + VIEW), Range1d(-VIEW, VIEW)
        panel = _figure("nyquist", "Nyquist plot of L = P C", "real part", "imaginary part", *ranges)
        square = SQUARE.replace("VIEW", str(VIEW)).replace("MIDDLE", str(MIDDLE))
        for side in ("inner_width", "inner_height"):
            panel.js_on_change(side, CustomJS(args={"x_range": panel.x_range}, code=square))
        bound = line("bound") | {"line_width": 1.0}
        for name, look, said in (("discs", bound, "W_a"), ("holding", HOLDS, "W_a around -1")):
            panel.circle(
                "real",
                "imag",
                radius="radius",
                source=self.data[name],
                legend_label=said,
                fill_color=look["line_color"],
                fill_alpha=0.07,
                **look,
            )
        for name, style, said in (("true", "corrected anti-windup", "true plant"), ("model", "model", "model")):
            panel.line("real", "imag", source=self.data[name], legend_label=said, **line(style))
        panel.scatter([-1], [0], marker="cross", size=14, line_color="#000000", line_width=2.5)
        _key(panel)
        return panel


def _figure(name: str, title: str, x: str, y: str, x_range: Range1d, y_range: Range1d) -> bokeh_figure:
    panel = bokeh_figure(
        name=name,
        title=title,
        x_axis_label=x,
        y_axis_label=without_tex(y),
        x_range=x_range,
        y_range=y_range,
        sizing_mode="stretch_both",
        min_height=60,
        tools="box_zoom,reset",
        active_drag=None,
        min_border_left=LEFT,
    )
    panel.toolbar.autohide = True
    panel.toolbar.logo = None
    panel.title.text_font_size = "14px"
    panel.title.text_color = "#000000"
    panel.outline_line_color = "#808080"
    panel.grid.grid_line_color = "#E0E0E0"
    for axis in panel.axis:
        axis.axis_label_text_font_size = "13px"
        axis.axis_label_text_font_style = "normal"
        axis.axis_label_text_color = axis.major_label_text_color = "#000000"
        axis.major_label_text_font_size = "12px"
    return panel


def _key(panel: bokeh_figure) -> None:
    """Put the key above the panel, where no data can lie."""
    legend = panel.legend[0]
    panel.center.remove(legend)
    panel.add_layout(legend, "above")
    legend.orientation = "horizontal"
    legend.border_line_color = None
    legend.padding, legend.margin, legend.spacing, legend.label_standoff = 0, 2, 8, 3
    legend.label_text_font_size = "12px"
    legend.label_text_color = "#000000"
    legend.glyph_height = legend.label_height = 14
    legend.glyph_width = 18


def _around(limits: tuple[float, float]) -> np.ndarray:
    """What is shown of a control: its limits, 0, and as much room on both sides as ROOM says of the range they span."""
    low, high = min(*limits, 0.0), max(*limits, 0.0)
    room = (ROOM - 1) * (high - low) / 2
    return np.array([low - room, high + room])


def _view(signals: Sequence[np.ndarray]) -> tuple[float, float]:
    """Round ends of an axis, which stay where they are while what is shown moves a little."""
    values = np.concatenate([signal[np.isfinite(signal)] for signal in signals])
    largest = float(np.abs(signals[0][np.isfinite(signals[0])]).max(initial=0.0)) * 10 or 1.0
    low, high = max(float(values.min()), -largest), min(float(values.max()), largest)
    unit = 10.0 ** math.floor(math.log10(max(high - low, 1e-300))) / 5
    return (math.floor(low / unit) - 0.5) * unit, (math.ceil(high / unit) + 0.5) * unit


def _see(view: Any, ends: tuple[float, float]) -> None:
    view.update(start=ends[0], end=ends[1], reset_start=ends[0], reset_end=ends[1])


def _cut(values: np.ndarray, view: tuple[float, float]) -> np.ndarray:
    """Values that a browser draws quickly, though a loop diverges: what is out of view lies just outside."""
    room = 0.1 * (view[1] - view[0])
    return np.asarray(np.clip(values, view[0] - room, view[1] + room))
