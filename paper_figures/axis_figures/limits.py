"""The error that no control under the limits betters, beside what the loop reaches."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from design.design_file import Design
from paper_figures.axis_figures.labels import KINDS, look_of, united
from paper_figures.look import panels
from paper_figures.look.captions import actuator_said, duration, only
from paper_figures.look.style import FULL_WIDTH, LINES, figure, styled

TABLES: tuple[str, ...] = ("limits_extended", "limits_extended_summary")

RUNS = ("corrected", "none")  # the thin lines upon the broad ones
FLOOR = LINES["family 4"]
GREY = panels.paler(FLOOR["color"], 0.6)
DECADES = 3
ROOM = 1.25  # times the stretch in which a line is in the view that is shown
DIVERGENT = 100.0  # a run that exceeds all that is out of reach by more than this leaves the panel


def caption(design: Design, tables: Mapping[str, pd.DataFrame]) -> str:
    """Return the caption with the numbers of the tables."""
    row = tables["limits_extended"].iloc[0]
    best, corrected, none = (_after(float(row[f"settling_{name}_s"])) for name in ("upper", *RUNS))
    summary = tables["limits_extended_summary"]
    is_fast = math.isnan(only(summary, "rate_limit"))
    slopes = "" if is_fast else " Both ignore the rate limit, which the runs have."
    return (
        "The least error that is possible from rest under the limits "
        f"{actuator_said(summary, design.signals.input_unit)}: the greatest error from a time on, within three "
        "periods. No control within the limits reaches the grey area, even if it knows the reference in advance; some "
        f"control reaches the line on it, or above.{slopes} The error comes to stay within 1 % of the reference's "
        f"amplitude {best} under the best control that was found, {none} without anti-windup, {corrected} with the "
        "corrected one."
    )


def _after(time_s: float) -> str:
    return "never" if math.isnan(time_s) else f"after {duration(time_s)}"


@styled()
def draw(design: Design, tables: Mapping[str, pd.DataFrame]) -> Figure:
    """Return the figure."""
    panel = figure(FULL_WIDTH, 2.8).subplots()
    tails = {f"tail_{run}": LINES[look_of(run)] for run in RUNS}
    curves(panel, tables["limits_extended_summary"], "start_s", "rest", tails)
    panel.plot([], [], **FLOOR, label="best that was found")
    for run in RUNS:
        panel.plot([], [], **LINES[look_of(run)], label=KINDS[run])
    panel.set(xlabel="Time $t_0$ [s]")
    panel.set_ylabel(united("Greatest error from $t_0$ on", design.signals.output_unit))
    panel.legend(**panels.ABOVE, ncols=3)
    found = panel.get_figure(root=True)
    assert found is not None
    return found


def curves(
    panel: Axes,
    table: pd.DataFrame,
    along: str,
    floor: str,
    errors: Mapping[str, Mapping[str, Any]],
) -> None:
    """Draw a floor and errors of runs beside it, in as many decades as can be read.

    Parameters
    ----------
    panel
        Where to draw.
    table, along
        The columns, and the one over which they are drawn.
    floor
        The beginning of the two columns with the ends of what cannot be bettered.
    errors
        Column -> keywords of ``Axes.plot``.
    """
    x = table[along]
    greatest = float(np.nanmax([table[column].max() for column in errors]))
    top = 2 * min(greatest, DIVERGENT * float(table[f"{floor}_upper"].max()) or greatest)
    bottom, forced = top / 10**DECADES, float(table[f"{floor}_lower"].min())
    if 0 < forced < bottom:  # it belongs into the view
        bottom = max(forced / 2, top / 10 ** (2 * DECADES))
    lower, upper = (table[f"{floor}_{end}"].clip(lower=bottom / 10**DECADES) for end in ("lower", "upper"))
    panel.fill_between(x, bottom / 10**DECADES, lower, color=GREY, linewidth=0)
    panel.plot(x, upper, **FLOOR, zorder=3)
    for column, look in errors.items():
        panel.plot(x, table[column], **look, zorder=3 - look.get("linewidth", 0.0) / 10)
    panel.set(yscale="log", ylim=(bottom, top))
    if len(x) > 1:
        seen = x[np.any([upper > bottom, *(~(table[column] <= bottom) for column in errors)], axis=0)]
        panel.set_xlim(x.min(), min(x.max(), x.min() + ROOM * (seen.max() - x.min()) or x.max()))
