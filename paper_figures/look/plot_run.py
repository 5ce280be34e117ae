"""Runs over time: output and reference, error, control, and when it is saturated."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import isfinite
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter

from experiments.drive.sampled_loop import SampledRun
from experiments.engine.simulate import Run, limit_pair
from identification.base.arrays import Real
from identification.base.errors import InputError
from identification.model.signals import UNNAMED, Signals
from paper_figures.look.frequency_axis import plain
from paper_figures.look.panels import MOST_POINTS, Trace, band, draw, key
from paper_figures.look.stretches import saturated_stretches
from paper_figures.look.style import FAMILY, FULL_WIDTH, LINES, panel_letters, styled

AnyRun = Run | SampledRun

KINDS = {
    "none": "without anti-windup",
    "thesis": "thesis anti-windup",
    "corrected": "corrected anti-windup",
    "internal-model": "internal model",
    "weston-postlethwaite": "Weston and Postlethwaite",
}
"""What an anti-windup's runs are called, where that is not its own name."""
SATURATED: dict[str, Any] = {"facecolor": "#E9DFC6", "edgecolor": "none", "zorder": 0.5}
THIN = 0.9
FAR = 1.0  # times the view of the control, within which a limit that it does not reach is shown too
EDGE = 0.06
BEYOND = 1.0  # of the range of the limits, up to which u is shown above and below them


@styled()
def plot_run(
    runs: AnyRun | Mapping[str, AnyRun],
    limits: float | Sequence[float] | None = None,
    signals: Signals = UNNAMED,
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
    looks = _looks(named)
    reference = _signal(next(iter(named.values())), "reference")
    scale = float(np.max(np.abs(reference[np.isfinite(reference)]), initial=0.0))
    time_s = pd.Series(next(iter(named.values())).time_s)
    for panel, name, symbol in ((output, "output", "output $y$"), (error, "error", "error $r - y$")):
        traces = [Trace(pd.Series(reference), LINES["reference"], "reference $r$")] if name == "output" else []
        for run_name, run in named.items():
            called = f"$y$, {plain(_said(run_name))}" if name == "output" else f"$r - y$, {plain(_said(run_name))}"
            traces.append(Trace(pd.Series(_signal(run, name)), looks[run_name], called if run_name else symbol))
        draw(panel, time_s, traces, scale)
        key(panel)
    output.set_ylabel(plain(signals.output))
    error.set_ylabel(plain(f"error [{signals.output_unit}]" if signals.output_unit else "error"))
    for panel, (name, run) in zip(controls, named.items(), strict=True):
        _control(panel, name, run, looks[name], pair)
        panel.set_ylabel(plain(signals.input))
    controls[-1].set_xlabel("Time [s]")
    for panel in panels:
        panel.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:.7g}"))
    panel_letters(panels)
    figure.align_ylabels()
    return figure


def _control(panel: Axes, name: str, run: AnyRun, line: Mapping[str, Any], limits: tuple[float, float] | None) -> None:
    """Draw what is asked for upon what the actuator gives out, the limits, and when it is beyond them."""
    beside = f", {plain(_said(name))}" if name else ""
    low, high = limits or (-np.inf, np.inf)
    given = run.saturated_control[np.isfinite(run.saturated_control)]
    least, most = (float(extreme(given, initial=0.0)) for extreme in (np.min, np.max))
    least, most = low if isfinite(low) else least, high if isfinite(high) else most
    traces = [
        Trace(pd.Series(run.saturated_control), band(line), "actuator"),
        Trace(pd.Series(run.control), {**line, "linewidth": THIN}, f"control $u${beside}"),
    ]
    draw(panel, pd.Series(run.time_s), traces, max(-least, most))
    room = BEYOND * (most - least) or 1.0
    bottom, top = panel.get_ylim()
    bottom, top = max(bottom, least - room), min(top, most + room)
    ends = [end for end in (low, high) if isfinite(end)]
    near = [end for end in ends if bottom - FAR * (top - bottom) < end < top + FAR * (top - bottom)]
    edge = EDGE * (top - bottom)
    panel.set_ylim(min([bottom, *(end - edge for end in near)]), max([top, *(end + edge for end in near)]))
    for i, end in enumerate(ends):
        panel.axhline(end, **LINES["saturation limits"], zorder=3, label=None if i else "limits")
    if limits is not None:
        bars = _merged(saturated_stretches(run, limits), float(run.time_s[-1] - run.time_s[0]) / MOST_POINTS)
        if len(bars):
            spans = [(start, end - start) for start, end in bars]
            across = panel.get_xaxis_transform()
            panel.broken_barh(spans, (0, 1), transform=across, label="beyond them", **SATURATED)
    key(panel)


def _merged(stretches: Real, gap_s: float) -> Real:
    """The stretches (n, 2) as they are seen: those less than a gap apart are one."""
    if not len(stretches):
        return stretches
    new = np.append(True, stretches[1:, 0] - stretches[:-1, 1] > gap_s)
    last = np.append(new[1:], True)
    return np.column_stack([stretches[new, 0], stretches[last, 1]])


def _signal(run: AnyRun, name: str) -> Real:
    return np.asarray(run.outputs[name] if isinstance(run, Run) else getattr(run, name))


def _said(name: str) -> str:
    """What a run of this name is called in a key."""
    return KINDS.get(name, name)


def _looks(named: Mapping[str, AnyRun]) -> dict[str, dict[str, Any]]:
    """The line of each run: that of its anti-windup, else the next of the family's."""
    looks, rest = {}, iter(FAMILY * len(named))
    for name in named:
        known = LINES.get(_said(name)) if name else LINES["model"]
        looks[name] = known or LINES[next(rest)]
    return looks
