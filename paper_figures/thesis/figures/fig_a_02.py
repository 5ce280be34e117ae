"""Fig. A.2: where each of the three designs of Q works."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from paper_figures.look import panels
from paper_figures.look.captions import apart, duration, number, only
from paper_figures.look.style import FULL_WIDTH, LINES, styled

TABLES: tuple[str, ...] = ("interpolation", "interpolation_map", "interpolation_summary")

KINDS = {"zeros": ("family 4", "zeros of Q"), "lagrange": ("family 2", "Lagrange"), "poles": ("family 6", "poles of Q")}


def caption(tables: Mapping[str, pd.DataFrame]) -> str:
    """Return the caption with the numbers of the tables."""
    summary = tables["interpolation_summary"]
    said = []
    for method, (_, label) in KINDS.items():
        ranges = summary[summary["method"] == method][["lowest", "highest"]].dropna().to_numpy()
        where = " and ".join(_range(low, high) for low, high in ranges) or "nowhere"
        said.append(f"{'Lagrange interpolation' if method == 'lagrange' else f'designing the {label}'} {where}")
    a, delay_s = only(summary.head(1), "a"), only(summary.head(1), "delay_s")
    return (
        "The three designs of Q (thesis section 4.1; the thesis says in words that Lagrange interpolation fails at "
        "high "
        f"frequency and that designing the poles works only there), for a = {number(a)} rad/s and T_d = "
        f"{duration(delay_s)}. (a) ||S|| of the loop over the frequency of the reference, drawn where the "
        "design "
        "works: Q stable, no zero of C_0 in the closed right half plane, which (3.19) needs, and ||S|| <= 2 (our "
        f"criterion); thin elsewhere. In the range drawn they work: {'; '.join(said)}. Designing the zeros puts the "
        "poles of Q at -omega here. (b) Grey: designing the poles gives a stable Q, which depends on omega T_d and a "
        "T_d "
        "only; the line is the a T_d of (a)."
    )


def _range(low: float, high: float) -> str:
    return f"{'at' if low == high else 'from'} {apart(low, high)} rad/s"


@styled()
def draw(tables: Mapping[str, pd.DataFrame]) -> Figure:
    """Return the figure."""
    axes = panels.lettered(FULL_WIDTH, 2.7, "ab")
    table = tables["interpolation"]
    for method, (kind, label) in KINDS.items():
        part = table[table["method"] == method]
        line = LINES[kind]
        axes["a"].loglog(part["omega"], part["sensitivity"], **(line | {"linewidth": 0.5, "alpha": 0.7}))
        works = part["sensitivity"].where(part["works"] == 1)
        axes["a"].loglog(part["omega"], works, **(line | {"linewidth": line["linewidth"] + 0.8}), label=label)
    axes["a"].set(xlabel=r"$\omega$ [rad/s]", ylabel=r"$\|S\|_\infty$", ylim=(0.9, 30))
    axes["a"].set_xlim(table["omega"].min(), table["omega"].max())
    axes["a"].legend(**panels.ABOVE, ncols=3)
    grid = tables["interpolation_map"].pivot(index="a_delay", columns="omega_delay", values="stable")
    axes["b"].pcolormesh(
        grid.columns, grid.index, grid.to_numpy(), cmap="Greys", vmin=0, vmax=3, shading="nearest", rasterized=True
    )
    summary = tables["interpolation_summary"]
    own = float(summary["a"].iloc[0] * summary["delay_s"].iloc[0])
    if own > 0:
        axes["b"].axhline(np.clip(own, grid.index.min(), grid.index.max()), **LINES["reference"])
    axes["b"].set(xscale="log", yscale="log", xlabel=r"$\omega T_\mathrm{d}$", ylabel=r"$a T_\mathrm{d}$")
    return axes["a"].figure  # type: ignore[return-value]
