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
STABLE = panels.paler(LINES["family 4"]["color"], 0.6)


def caption(tables: Mapping[str, pd.DataFrame]) -> str:
    """Return the caption with the numbers of the tables."""
    summary = tables["interpolation_summary"]
    said = []
    for method, (_, label) in KINDS.items():
        ranges = summary[summary["method"] == method][["lowest", "highest"]].dropna().to_numpy()
        said.append(f"{label}, {' and '.join(apart(low, high) for low, high in ranges) or 'nowhere'}")
    a, delay_s = only(summary.head(1), "a"), only(summary.head(1), "delay_s")
    return (
        f"Three ways to design Q (section 4.1): a = {number(a)} rad/s, T_d = {duration(delay_s)}. (a) ||S|| over the "
        "reference's frequency. A line is thick where the way works: Q is stable, C_0 has no zero in the closed right "
        f"half plane, and ||S|| <= 2 (our criterion). In rad/s: {'; '.join(said)}. (b) Grey: designing the poles gives "
        "a stable Q."
    )


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
    axes["a"].set(xlabel=r"$\omega$ [rad/s]", ylabel=r"$\|S\|_\infty$ [-]", ylim=(0.9, 20))
    axes["a"].set_xlim(table["omega"].min(), table["omega"].max())
    axes["a"].legend(**panels.ABOVE, ncols=3)
    grid = tables["interpolation_map"].pivot(index="a_delay", columns="omega_delay", values="margin")
    axes["b"].contourf(grid.columns, grid.index, grid.to_numpy(), levels=[0.0, np.inf], colors=[STABLE])
    axes["b"].plot([], [], color=STABLE, linewidth=5.0, label="Q stable")
    summary = tables["interpolation_summary"]
    own = float(summary["a"].iloc[0] * summary["delay_s"].iloc[0])
    if own > 0:
        axes["b"].axhline(
            np.clip(own, grid.index.min(), grid.index.max()), **LINES["reference"], label=r"$a T_\mathrm{d}$ of (a)"
        )
    axes["b"].set(yscale="log", xlabel=r"$\omega T_\mathrm{d}$ [-]", ylabel=r"$a T_\mathrm{d}$ [-]")
    axes["b"].legend(**panels.ABOVE, ncols=2)
    return axes["a"].figure  # type: ignore[return-value]
