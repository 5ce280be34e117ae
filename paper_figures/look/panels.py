"""What the figures of data share: panels over time, thinned lines, views that survive divergence, keys."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import isfinite
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.colors import to_hex, to_rgb
from matplotlib.figure import Figure
from matplotlib.transforms import IdentityTransform, Transform

from paper_figures.look import style
from paper_figures.look.control_axis import beyond_logarithmic
from paper_figures.look.fast_swings import fast_stretches, swing_range

MOST_POINTS = 3000
"""A line of more points than this is thinned to its envelope."""

ABOVE: dict[str, Any] = {
    "loc": "lower right",
    "bbox_to_anchor": (1.0, 1.0),
    "borderpad": 0,
    "borderaxespad": 0.25,
    "columnspacing": 1.1,
    "handlelength": 2.0,
    "handletextpad": 0.5,
}
"""Where a legend stands: above the panel, at its right end, where no data can lie."""

Panels = dict[str, Axes]
"""The panels of a figure by their letter."""

_DIVERGENT = 100.0  # a signal that exceeds its scale by more than this is not shown whole
_SHOWN = 10.0  # but up to this many times its scale
_MARGIN = 0.06
_LINEAR = IdentityTransform()
_THIN = 0.9  # width of the controller output upon the saturated input [pt]
_EDGE = 0.5  # of the range of a line that swings too fast to be drawn


@dataclass(frozen=True)
class Run:
    """One simulated loop of a table and how it is shown.

    Parameters
    ----------
    name
        The end of its columns, such as ``none`` in ``output_none``.
    kind
        Its entry in ``style.LINES``.
    label
        What the key adds to the symbol of its signals.
    """

    name: str
    kind: str
    label: str

    def symbol(self, symbol: str) -> str:
        """Return the entry of the key for one of the run's signals."""
        return f"{symbol}, {self.label}"


NONE = Run("none", "without anti-windup", "without anti-windup")
THESIS = Run("thesis", "thesis anti-windup", "thesis")
CORRECTED = Run("corrected", "corrected anti-windup", "corrected")


@dataclass(frozen=True)
class Trace:
    """A line over time: its values, keywords of ``Axes.plot`` and its entry in the key, if any."""

    values: pd.Series
    line: Mapping[str, Any]
    label: str | None = None


def lettered(width: float, height: float, layout: str, *, ratios: Sequence[float] | None = None) -> Panels:
    """Return panels on a page of their own, with their letters.

    Parameters
    ----------
    width, height
        Size of the figure on the page [in].
    layout, ratios
        Which letter stands where, the rows divided by ``;``: in ``ac;bd;ee`` the last panel is as wide as two; and
        the relative heights of the rows, equal if not given.
    """
    panels = style.figure(width, height).subplot_mosaic(layout, height_ratios=ratios)
    style.panel_letters(panels[letter] for letter in sorted(panels))
    return panels


def finished(panels: Panels, *common: str) -> Figure:
    """Return the figure of panels over time, once all is drawn in them.

    Parameters
    ----------
    panels
        By letter.
    common
        Letters of panels that get the same vertical view, such as ``ac``. A panel needs no labels where its left
        neighbour has the same view and name, or the one below it the same time axis.
    """
    for letters in common:
        ends = [panels[letter].get_ylim() for letter in letters]
        for letter in letters:
            panels[letter].set_ylim(min(low for low, _ in ends), max(high for _, high in ends))
    places = {}
    for panel in panels.values():
        place = panel.get_subplotspec()
        assert place is not None
        places[panel] = place.rowspan, place.colspan
    for panel, (rows, columns) in places.items():
        panel.set_xlabel("Time $t$ [s]")
        for other, (other_rows, other_columns) in places.items():
            below = other_columns == columns and other_rows.start == rows.stop
            if below and other.get_xlim() == panel.get_xlim():
                panel.set_xlabel("")
                panel.tick_params(labelbottom=False)
    labels = {panel: panel.get_ylabel() for panel in places}
    for panel, (rows, columns) in places.items():
        for other, (other_rows, other_columns) in places.items():
            left = other_rows == rows and other_columns.stop == columns.start
            if left and other.get_ylim() == panel.get_ylim() and labels[other] == labels[panel]:
                panel.set_ylabel("")
                panel.tick_params(labelleft=False)
    figure = next(iter(places)).get_figure(root=True)
    assert figure is not None
    return figure


def outputs(panel: Axes, table: pd.DataFrame, *runs: Run) -> None:
    """Draw the reference and the outputs of the runs, with their key."""
    reference = Trace(table["reference"], style.LINES["reference"], "$r$")
    traces = [Trace(table[f"output_{run.name}"], style.LINES[run.kind], run.symbol("$y$")) for run in runs]
    draw(panel, table["time_s"], [reference, *traces], scale(table["reference"]))
    panel.set_ylabel("Output [unit of $y$]")
    key(panel)


def errors(panel: Axes, table: pd.DataFrame, *runs: Run) -> None:
    """Draw the tracking errors of the runs, with their key."""
    traces = [Trace(table[f"error_{run.name}"], style.LINES[run.kind], run.symbol("$e$")) for run in runs]
    draw(panel, table["time_s"], traces, scale(table["reference"]))
    panel.set_ylabel("Error [unit of $y$]")
    key(panel)


def controls(panel: Axes, table: pd.DataFrame, run: Run, limit: float, *signals: str) -> None:
    """Draw the controller output of a run, the saturated input, or one upon the other, with the limits.

    Parameters
    ----------
    panel
        Where to draw.
    table
        With columns time_s, control_NAME and saturated_NAME.
    run
        Which NAME.
    limit
        The limits are +-limit.
    signals
        ``control``, ``saturated`` or both. The saturated input is a broad pale band, on which the line of the
        controller output lies wherever the two are the same.

    Notes
    -----
    The axis is linear between the limits and logarithmic beyond them, so that they are seen however large u is.
    """
    line = style.LINES[run.kind]
    if len(signals) > 1:
        line = line | {"linewidth": _THIN}
    looks = {
        "control": (line, run.symbol("$u$")),
        "saturated": (band(line) if len(signals) > 1 else line, run.symbol(r"$\mathrm{sat}(u)$")),
    }
    traces = [Trace(table[f"{signal}_{run.name}"], *looks[signal]) for signal in signals]
    if isfinite(limit):
        beyond_logarithmic(panel, limit, _DIVERGENT * limit)
    draw(panel, table["time_s"], traces, limit)
    for end in (-limit, limit):
        panel.axhline(end, **style.LINES["saturation limits"], zorder=3)
    panel.set_ylabel("Control [unit of $u$]")
    key(panel)


def draw(panel: Axes, time_s: pd.Series, traces: Sequence[Trace], scale: float) -> None:
    """Draw lines over time, thinned to what the page can show, and choose the view.

    Parameters
    ----------
    panel
        Where to draw.
    time_s
        Time [s]; all of it is shown, so give only the part to show.
    traces
        The lines; where they meet, a thin one lies upon a broad one. Where one swings faster than the page can show,
        the range in which it swings is drawn in its place.
    scale
        What the signals are compared with, see :func:`view`.
    """
    signals = [trace.values.to_numpy(float) for trace in traces]
    at = time_s.to_numpy(float)
    panel.set_ylim(*view(signals, scale, panel.yaxis.get_transform()))
    panel.set_xlim(at[0], at[-1])
    low, high = panel.get_ylim()
    for trace, signal in zip(traces, signals, strict=True):
        layer = 3 - trace.line["linewidth"] / 10
        slow = signal.copy()
        for first, last in fast_stretches(panel, at, signal):
            inside = (at >= first) & (at <= last)
            slow[(at > first) & (at < last)] = np.nan
            places, *ends = swing_range(at[inside], signal[inside])
            color = trace.line["color"]
            look = {"facecolor": paler(color, 0.6), "edgecolor": color, "linewidth": _EDGE, "zorder": layer}
            panel.fill_between(places, *np.clip(ends, 2 * low - high, 2 * high - low), **look)
        panel.plot(*envelope(at, slow), **trace.line, label=trace.label, zorder=layer)


def view(signals: Sequence[np.ndarray], scale: float, axis: Transform = _LINEAR) -> tuple[float, float]:
    """Return the limits of a panel in which the signals can be read.

    Parameters
    ----------
    signals
        Their values; those that are not finite do not count.
    scale
        What the signals are compared with, such as the largest reference. They are shown whole unless they
        exceed it a hundredfold; then the panel shows up to ten times the scale, and the line leaves it.
    axis
        Of the scale of the axis, if it is not linear: the margin is one on the page.
    """
    values = np.concatenate([signal[np.isfinite(signal)] for signal in signals])
    if not len(values):
        return -1.0, 1.0
    low, high = float(values.min()), float(values.max())
    if max(-low, high) > _DIVERGENT * scale > 0:
        low, high = max(low, -_SHOWN * scale), min(high, _SHOWN * scale)
    low, high = axis.transform(np.array([low, high]))
    margin = _MARGIN * (high - low) or max(abs(high), 1.0)
    low, high = axis.inverted().transform(np.array([low - margin, high + margin]))
    return float(low), float(high)


def scale(reference: pd.Series) -> float:
    """Return the largest magnitude of a reference."""
    return float(reference.abs().max())


def band(line: Mapping[str, Any]) -> dict[str, Any]:
    """Return a line style as a broad, pale, unbroken line of the same hue."""
    return {"color": paler(line["color"], 0.6), "linestyle": "-", "linewidth": line["linewidth"] + 2.6}


def paler(color: str, share: float) -> str:
    """Return a colour mixed with white, of which it then has that share."""
    red, green, blue = ((1 - share) * channel + share for channel in to_rgb(color))
    return to_hex((red, green, blue))


def envelope(
    x: np.ndarray, y: np.ndarray, most: int = MOST_POINTS, *, along: np.ndarray | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Thin a line so that its peaks survive.

    Parameters
    ----------
    x, y
        The points, x ascending, only those that are shown: what is left outside of the view is missing within it.
    most
        How many points to leave; fewer points than that stay as they are.
    along
        x as it is drawn, log(x) on a logarithmic axis; x if not given.

    Returns
    -------
    x, y
        The lowest and the highest point of each of equal pieces of the axis, and both ends.
    """
    if len(x) <= most:
        return x, y
    position = x if along is None else along
    pieces = (most - 2) // 2
    piece = np.floor((position - position[0]) / (position[-1] - position[0]) * pieces)
    kept = {0, len(x) - 1}
    for indices in np.split(np.arange(len(x)), np.flatnonzero(np.diff(piece)) + 1):
        kept |= {int(indices[np.argmin(y[indices])]), int(indices[np.argmax(y[indices])])}
    chosen = sorted(kept)
    return x[chosen], y[chosen]


def key(panel: Axes) -> None:
    """Explain the labelled lines above the panel, at its right end, where no data can lie."""
    panel.legend(ncols=len(panel.get_legend_handles_labels()[1]), **ABOVE)
