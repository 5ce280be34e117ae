"""Runs over time: output and reference, error, control, and when it is saturated."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import isfinite
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter

from experiments.drive.sampled_loop import SampledRun
from experiments.engine.simulate import Run, limit_pair
from identification.base.arrays import Real
from identification.base.errors import InputError
from identification.model.signals import UNNAMED, Signals
from paper_figures.look.fast_swings import merged
from paper_figures.look.frequency_axis import plain
from paper_figures.look.panels import MOST_POINTS, band, envelope, key, paler, view
from paper_figures.look.stretches import saturated_stretches
from paper_figures.look.style import FAMILY, FULL_WIDTH, LINES, panel_letters, styled

AnyRun = Run | SampledRun

KINDS = {
    "none": "without anti-windup",
    "thesis": "thesis anti-windup",
    "corrected": "corrected anti-windup",
    "internal-model": "internal model",
    "weston-postlethwaite": "Weston and Postlethwaite",
    **{name: name for name in ("back-calculation", "conditioning", "observer", "static")},
}
"""The lines of the runs of each anti-windup by its name; others have the next one of the family's."""
SATURATED: dict[str, Any] = {"facecolor": "#E9DFC6", "edgecolor": "none", "zorder": 0.5}
IN_FRONT: dict[str, Any] = {"ha": "center", "va": "center", "bbox": {"facecolor": "white", "edgecolor": "none"}}
PALE = 0.6  # share of white
THIN = 0.9
FAR = 1.0  # times the view of the control, within which a limit that it does not reach is shown too
EDGE = 0.06
NARROWEST = 0.005  # of the time axis: a shaded stretch is drawn at least as wide, so that it is seen
SWINGS = 200  # from beyond one limit to beyond the other; more would fill the panel, so that they are counted and paler
BEYOND = 1.0  # of the range of the limits, up to which u is shown above and below them


@styled()
def plot_run(
    runs: AnyRun | Mapping[str, AnyRun],
    limits: float | Sequence[float] | None = None,
    signals: Signals = UNNAMED,
    title: str = "",
) -> Figure:
    """Draw a run, or several of one reference one upon the other.

    Parameters
    ----------
    runs
        One, or several by name: ``none``, ``corrected`` and the other anti-windups have lines of their own.
    limits
        Of the actuator, (lower, upper), or one number for +-limits: drawn as lines, and where the control is beyond
        them is shaded. Neither unless given.
    signals
        Names and units of the plant's input and output; those of a design are ``design.signals``.
    title
        What stands above all.

    Returns
    -------
    Figure
        Over the time in seconds: reference and outputs; errors; and for each run the control asked for upon what the
        actuator gives out. What is far beyond the limits leaves the panel.

    Raises
    ------
    InputError
        There is no run, or the limits are none, see :func:`experiments.engine.simulate.limit_pair`.
    """
    named = dict(runs) if isinstance(runs, Mapping) else {"": runs}
    if not named:
        raise InputError("no run was given; expected one or more")
    pair = None if limits is None else limit_pair(limits)
    figure = Figure(figsize=(FULL_WIDTH, 3.0 + 1.5 * len(named)), layout="constrained")
    panels = list(figure.subplots(2 + len(named), 1, sharex=True))
    output, error, controls = panels[0], panels[1], panels[2:]
    looks, first = _looks(named), next(iter(named.values()))
    reference = _signal(first, "reference")
    scale = float(np.max(np.abs(reference)))
    _line(output, first, reference, LINES["reference"], "reference $r$")
    for panel, name, symbol in ((output, "output", "$y$"), (error, "error", "$r - y$")):
        for run_name, run in named.items():
            _line(panel, run, _signal(run, name), looks[run_name], f"{symbol}{_beside(run_name)}")
        values = [_signal(run, name) for run in named.values()]
        panel.set_ylim(*view([*values, reference] if name == "output" else values, scale))
        key(panel)
    output.set_xlim(min(run.time_s[0] for run in named.values()), max(run.time_s[-1] for run in named.values()))
    output.set_ylabel(plain(signals.output))
    error.set_ylabel(plain(f"error [{signals.output_unit}]" if signals.output_unit else "error"))
    for panel, (name, run) in zip(controls, named.items(), strict=True):
        _control(panel, name, run, looks[name], pair)
        panel.set_ylabel(plain(signals.input))
    controls[-1].set_xlabel("Time [s]")
    for panel in panels:
        panel.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:.7g}"))
    panel_letters(panels)
    if title:
        figure.suptitle(title)
    figure.align_ylabels()
    return figure


def _control(panel: Axes, name: str, run: AnyRun, line: Mapping[str, Any], limits: tuple[float, float] | None) -> None:
    """Draw what is asked for upon what the actuator gives out, the limits, and when it is beyond them."""
    low, high = limits or (-np.inf, np.inf)
    _line(panel, run, run.saturated_control, band(line), "actuator")
    swings = _swings(run.control, (low, high))
    color = paler(line["color"], PALE) if swings > SWINGS else line["color"]
    _line(panel, run, run.control, {**line, "linewidth": THIN, "color": color}, f"control $u${_beside(name)}")
    if swings > SWINGS:
        panel.text(0.5, 0.5, f"from limit to limit {swings} times", transform=panel.transAxes, **IN_FRONT)
    ends = [end for end in (low, high) if isfinite(end)]
    least = low if isfinite(low) else float(run.saturated_control.min())
    most = high if isfinite(high) else float(run.saturated_control.max())
    room = BEYOND * (most - least) or 1.0
    bottom, top = view([run.control, run.saturated_control], 0.0)
    bottom, top = max(bottom, least - room), min(top, most + room)
    near = [end for end in ends if bottom - FAR * (top - bottom) < end < top + FAR * (top - bottom)]
    edge = EDGE * (top - bottom)
    panel.set_ylim(min([bottom, *(end - edge for end in near)]), max([top, *(end + edge for end in near)]))
    for i, end in enumerate(ends):
        panel.axhline(end, **LINES["saturation limits"], zorder=3, label=None if i else "limits")
    if limits is not None:
        first, last = float(run.time_s[0]), float(run.time_s[-1])
        bars = merged(saturated_stretches(run, limits), (last - first) / MOST_POINTS)
        if len(bars):
            least = NARROWEST * (last - first)
            widths = np.maximum(bars[:, 1] - bars[:, 0], least)
            spans = list(zip(np.minimum(bars[:, 0], last - widths), widths, strict=True))
            across = panel.get_xaxis_transform()
            narrow = np.any(bars[:, 1] - bars[:, 0] < least)
            said = f"beyond them, at least {100 * NARROWEST:g} % wide" if narrow else "beyond them"
            panel.broken_barh(spans, (0, 1), transform=across, label=said, **SATURATED)
    key(panel)


def _swings(control: Real, limits: tuple[float, float]) -> int:
    """How often a control goes from beyond one limit to beyond the other."""
    sides = np.where(control > limits[1], 1, np.where(control < limits[0], -1, 0))
    return int(np.count_nonzero(np.diff(sides[sides != 0])))


def _line(panel: Axes, run: AnyRun, values: Real, line: Mapping[str, Any], label: str) -> None:
    """A line, thinned to its envelope; where two meet, the thin one lies upon the broad one."""
    panel.plot(*envelope(run.time_s, values), **line, label=label, zorder=3 - line["linewidth"] / 10)


def _signal(run: AnyRun, name: str) -> Real:
    return np.asarray(run.outputs[name] if isinstance(run, Run) else getattr(run, name))


def _beside(name: str) -> str:
    """What a key adds to the symbol of a run's signal."""
    return f", {plain(KINDS.get(name, name))}" if name else ""


def _looks(named: Mapping[str, AnyRun]) -> dict[str, dict[str, Any]]:
    """The line of each run: that of its anti-windup, else the next of the family's."""
    looks, rest = {}, iter(FAMILY * len(named))
    for name in named:
        looks[name] = LINES[KINDS.get(name) or next(rest)] if name else LINES["model"]
    return looks
