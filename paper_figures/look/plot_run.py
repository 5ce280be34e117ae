"""One run over time: output and reference, error, control."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from experiments.engine.simulate import Run
from paper_figures.look.style import FULL_WIDTH, LINES, styled


@styled()
def plot_run(run: Run) -> Figure:
    """Draw a run.

    Parameters
    ----------
    run
        With the outputs ``reference``, ``output`` and ``error``.

    Returns
    -------
    Figure
        Three panels over the time in seconds: reference and output; their difference; the control asked for and what
        saturation leaves of it, between its extremes, which are the limits where the run saturates.
    """
    figure = Figure(figsize=(FULL_WIDTH, 4.6), layout="constrained")
    output, error, control = figure.subplots(3, 1, sharex=True)
    output.plot(run.time_s, run.outputs["reference"], label="reference r", **LINES["reference"])
    output.plot(run.time_s, run.outputs["output"], label="output y", **LINES["model"])
    error.plot(run.time_s, run.outputs["error"], label="error r - y", **LINES["model"])
    control.plot(run.time_s, run.control, label="control u", **LINES["without anti-windup"])
    control.plot(run.time_s, run.saturated_control, label="sat(u)", **LINES["model"])
    low, high = np.min(run.saturated_control), np.max(run.saturated_control)
    room = 0.5 * (high - low) or 1.0
    control.set_ylim(low - room, high + room)  # u may be many times the limits
    for panel, unit in ((output, "output unit"), (error, "output unit"), (control, "input unit")):
        panel.set_ylabel(unit)
        panel.legend(loc="lower right", bbox_to_anchor=(1.0, 0.97), ncols=2)
    control.set_xlabel("time [s]")
    return figure
