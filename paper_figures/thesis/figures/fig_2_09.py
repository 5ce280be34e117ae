"""Thesis Fig. 2.9: the additive error between the nominal model and the tests, with its bound W_a(s)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from matplotlib.legend_handler import HandlerTuple

from paper_figures.look import panels, style
from paper_figures.look.captions import number, only
from paper_figures.look.style import FULL_WIDTH, LINES, styled

TABLES: tuple[str, ...] = ("additive_error", "additive_error_summary")

MARKERS = "osD^v<>"
MOST_MARKERS = 500


def caption(tables: Mapping[str, pd.DataFrame]) -> str:
    """Return the caption with the numbers of the tables."""
    table, summary = tables["additive_error"], tables["additive_error_summary"]
    above = int((table["error"] > table["bound"]).sum())
    verdict = "at every line" if not above else f"but for {above} lines"
    synthetic = int(only(summary, "synthetic_tests"))
    origin = (
        f" {synthetic} of the tests are SYNTHETIC, made by a program: they show that the method works and are no "
        "evidence about any hardware. (The thesis's own records are not published.)"
    )
    return (
        f"Additive error |P - P_test| of {only(summary, 'tests'):.0f} tests at {only(summary, 'lines'):.0f} spectral "
        "lines, the bound |W_a| of Eq. (2.21) and, for scale, |P| (thesis Fig. 2.9). The error stays below the bound "
        f"{verdict}; the largest ratio of the two is {number(only(summary, 'largest_ratio'))}, at omega = "
        f"{number(only(summary, 'largest_ratio_omega'))} rad/s. Where lines stand closer than markers, the smallest "
        f"and the largest error of each test are drawn.{origin if synthetic else ''}"
    )


@styled()
def draw(tables: Mapping[str, pd.DataFrame]) -> Figure:
    """Return the figure, on logarithmic axes."""
    table = tables["additive_error"]
    figure = style.figure(FULL_WIDTH, 3.4)
    panel = figure.subplots()
    tests = sorted(table["test"].unique())
    markers = []
    for order, test in enumerate(tests):
        rows = table[table["test"] == test].sort_values("omega")
        markers += panel.plot(*_thinned(rows, "error", MOST_MARKERS), **_marker(order, len(tests)))
    common = table.sort_values("omega").drop_duplicates("omega")
    (model,) = panel.plot(*_thinned(common, "plant"), **LINES["model"] | {"linewidth": 0.6})
    (bound,) = panel.plot(*_thinned(common, "bound"), **LINES["bound"])
    panel.set(xscale="log", yscale="log", xlabel=r"$\omega$ [rad/s]", ylabel="Magnitude")
    panel.set_xlim(table["omega"].min(), table["omega"].max())
    shown = tuple(markers[:3])
    span = f"test {tests[0]}" if len(tests) == 1 else f"tests {tests[0]} to {tests[-1]}"
    panel.legend(
        [shown, bound, model],
        [rf"$|P - P_\mathrm{{test}}|$, {span}", r"$|W_a|$", "$|P|$"],
        handler_map={tuple: HandlerTuple(ndivide=None, pad=0.3)},
        **panels.ABOVE,
        ncols=3,
    )
    return figure


def _thinned(rows: pd.DataFrame, column: str, most: int = panels.MOST_POINTS) -> tuple[np.ndarray, np.ndarray]:
    omega, values = (rows[name].to_numpy(float) for name in ("omega", column))
    return panels.envelope(omega, values, most, along=np.log(omega))


def _marker(order: int, tests: int) -> dict[str, Any]:
    """Return the style of a test: a shape of its own, and paler from the first to the last."""
    color = panels.paler(LINES["measured"]["color"], 0.6 * order / max(tests - 1, 1))
    return LINES["measured"] | {"color": color, "marker": MARKERS[order % len(MARKERS)], "markeredgewidth": 0}
