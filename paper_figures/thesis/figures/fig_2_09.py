"""Thesis Fig. 2.9: the additive error between the nominal model and the tests, with its bound W_a(s)."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from scipy.interpolate import CubicSpline

from identification.base.arrays import Real
from paper_figures.look import panels, style
from paper_figures.look.bode import BOUND, MEASURED, MODEL, TOUCH, decibel, leave_out_least
from paper_figures.look.captions import number, only
from paper_figures.look.frequency_axis import over_decades
from paper_figures.look.style import FULL_WIDTH, styled

TABLES: tuple[str, ...] = ("additive_error", "additive_error_summary")


def caption(tables: Mapping[str, pd.DataFrame]) -> str:
    """Return the caption with the numbers of the tables."""
    table, summary = tables["additive_error"], tables["additive_error_summary"]
    above = int((table["error"] > table["bound"]).sum())
    verdict = "at every line" if not above else f"except at {above} lines"
    synthetic = int(only(summary, "synthetic_tests"))
    origin = (
        f" {synthetic} of the tests are SYNTHETIC: a program made them. They show that the method works, and say "
        "nothing about hardware. The thesis does not publish its own records."
    )
    return (
        f"Additive error |P - P_test| of {only(summary, 'tests'):.0f} tests at {only(summary, 'lines'):.0f} spectral "
        "lines, the bound |W_a| of Eq. (2.21), and |P| for scale (thesis Fig. 2.9). The error stays below the bound "
        f"{verdict}. The largest ratio of the two is {number(only(summary, 'largest_ratio'))}, at omega = "
        f"{number(only(summary, 'largest_ratio_omega'))} rad/s (ring).{origin if synthetic else ''}"
    )


@styled()
def draw(tables: Mapping[str, pd.DataFrame]) -> Figure:
    """Return the figure, in dB over the frequency in rad/s."""
    table = tables["additive_error"]
    figure = style.figure(FULL_WIDTH, 3.4)
    panel = figure.subplots()
    errors = []
    for order, (_, rows) in enumerate(table.sort_values("omega").groupby("test")):
        omega, error = (rows[name].to_numpy(float) for name in ("omega", "error"))
        omega, error = panels.envelope(omega, error, along=np.log(omega))
        errors.append(decibel(error))
        panel.plot(omega, errors[-1], **MEASURED, label=None if order else r"$|P - P_\mathrm{test}|$")
    common = table.sort_values("omega").drop_duplicates("omega")
    omega, bound, plant = (common[name].to_numpy(float) for name in ("omega", "bound", "plant"))
    panel.plot(omega, decibel(bound), **BOUND, label="$|W_a|$")
    nearest = table.iloc[int((table["error"] / table["bound"]).to_numpy().argmax())]
    panel.plot(nearest["omega"], decibel(nearest["error"]), **TOUCH, label="nearest to the bound")
    panel.plot(*_smooth(omega, plant), **MODEL, label="$|P|$")
    leave_out_least(panel, errors)
    over_decades(panel, float(omega[0]), float(omega[-1]))
    panel.set(xlabel=r"$\omega$ [rad/s]", ylabel="Magnitude [dB]")
    panel.legend(ncols=4, markerscale=1.5, **panels.ABOVE)
    return figure


def _smooth(omega: Real, plant: Real) -> tuple[Real, Real]:
    """|P| in dB, with points between the spectral lines: |P|^2 is a smooth function, through a notch too."""
    if omega.size < 2:
        return omega, decibel(plant)
    grid = np.unique([*omega, *np.geomspace(omega[0], omega[-1], panels.MOST_POINTS)])
    return grid, decibel(np.maximum(CubicSpline(omega, plant**2)(grid), 0.0)) / 2
