"""Fig. A.7: the outcomes that the thesis prints, over the conditions that it does not print."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from identification.base.errors import InputError
from paper_figures.look import panels
from paper_figures.look.captions import at_least, number
from paper_figures.look.style import FULL_WIDTH, LINES, styled

TABLES: tuple[str, ...] = ("conditions", "conditions_summary")

NAMES = {"implied": "implied set", "table": "Table 2.1"}
PANELS = {
    "a": ("error", "error_after_1s", "Largest $|e|$ after 1 s [m]"),
    "b": ("desaturation", "desaturation_s", "Last saturation [s]"),
    "c": ("recovery", "recovery_saturation_s", "Last saturation [s]"),
    "d": ("recovery", "recovery_to_offset_s", "Settled to an offset [s]"),
}
CHAPTER_2 = ("delay_free_error", "peak_percent")
JOINT = ("error", "desaturation", "recovery")
VIEW = 0.8, 2.9  # of the limits of chapter 4, in multiples of the input that tracking needs
DOTS = {"color": LINES["second-order Pade"]["color"], "linestyle": "none", "marker": ".", "markersize": 2.0}
LIMIT = "Limit $L$ [unit of $u$]"
NONE, THESIS = "without anti-windup", "thesis anti-windup"


def caption(tables: Mapping[str, pd.DataFrame]) -> str:
    """Return the caption with the numbers of the tables."""
    summary = tables["conditions_summary"]
    return (
        "The outcomes that the thesis prints (grey) over the limits +-L, which it does not print. (a, b) Without, "
        "(c, d) with its anti-windup. (e) All three from one limit and one initial output: the nearest "
        f"{_joint(summary, 'together')}; where the error converges, {_joint(summary, 'together, converging')}. (f) "
        f"Chapter 2: {_chapter_2(summary)}"
    )


def _rows(summary: pd.DataFrame, **wanted: object) -> pd.DataFrame:
    """The rows of a summary with these values.

    Raises
    ------
    InputError
        There is none.
    """
    rows = summary
    for name, value in wanted.items():
        rows = rows[rows[name] == value]
    if rows.empty:
        raise InputError(f"the summary has no row with {', '.join(f'{k} {v}' for k, v in wanted.items())}")
    return rows


def _said(summary: pd.DataFrame, outcome: str) -> str:
    unit = {"error": "m", "delay_free_error": "%"}.get(outcome, "s")
    return f"{number(_rows(summary, outcome=outcome)['printed'].iloc[0])} {unit}"


def _nearest(summary: pd.DataFrame, search: str) -> pd.DataFrame:
    """The three rows of the condition that comes nearest in a joint search, by outcome."""
    rows = _rows(summary, search=search)
    best = rows.iloc[int(rows["worst_miss"].to_numpy().argmin())]
    nearest: pd.DataFrame = rows[(rows["set"] == best["set"]) & (rows["delay"] == best["delay"])]
    return nearest.set_index("outcome")


def _joint(summary: pd.DataFrame, search: str) -> str:
    if (summary["search"] != search).all():
        return "none was found"
    best = _nearest(summary, search)
    first = best.iloc[0]
    verdict = "gives them" if best["met"].all() else f"misses by {number(100 * first['worst_miss'], 2)} %"
    return f"(L = {number(first['limit'], 4)}, y(0) = {number(first['initial_output'])}) {verdict}"


def _chapter_2(summary: pd.DataFrame) -> str:
    least = _rows(summary, search="weights").nsmallest(1, "computed").iloc[0]
    bound = _rows(summary, search="any controller")["computed"].min()
    return (
        f"at the printed L = {number(least['limit'])} the least error found over the unprinted conditions is "
        f"{number(least['computed'])} % of the amplitude; no controller stays below {at_least(bound)} %."
    )


@styled()
def draw(tables: Mapping[str, pd.DataFrame]) -> Figure:
    """Return the figure."""
    axes = panels.lettered(FULL_WIDTH, 6.3, "ab;cd;ef")
    table, summary = tables["conditions"], tables["conditions_summary"]
    extended = table[table["case"] == "extended"]
    required = float(extended["required"].min())
    for letter, (outcome, reading, label) in PANELS.items():
        panel, kind = axes[letter], THESIS if outcome == "recovery" else NONE
        _printed(panel, summary, outcome)
        _lines(panel, extended, reading, kind)
        panel.axvline(required, **LINES["reference"])
        panel.set(xlabel=LIMIT, ylabel=label, xlim=(VIEW[0] * required, VIEW[1] * required))
        panel.set_ylim(bottom=0)
    for letter, kind, words in (("a", NONE, "none"), ("c", THESIS, "thesis")):
        _key(axes[letter], _look(kind, 0, "implied") | {"label": f"{words}, from rest"})
        _key(axes[letter], _look(kind, 1, "implied") | {"label": "from $y(0) = r(0)$"})
    _key(axes["b"], _look(NONE, 0, "table") | {"label": NAMES["table"]})
    _key(axes["b"], LINES["family 4"] | {"label": "printed"}, DOTS | {"markersize": 4.0, "label": "Pade"})
    _key(axes["d"], _look(THESIS, 0, "table") | {"label": NAMES["table"]})
    _key(axes["d"], LINES["reference"] | {"label": "needed to track"})
    axes["b"].set_ylim(top=12)
    axes["c"].set_ylim(top=8)
    _ratios(axes["e"], summary)
    _errors(axes["f"], table[table["case"] == "delay_free"], summary)
    figure = axes["a"].get_figure(root=True)
    assert figure is not None
    return figure


def _look(kind: str, start: int, name: str) -> dict[str, Any]:
    """The line of an anti-windup from rest (0) or from y(0) = r(0) (1) with a parameter set."""
    line = LINES[kind] | {"linewidth": (1.8, 0.8)[start]}
    if name != "implied":
        line = panels.band(line)
    return line | {"zorder": 3 - line["linewidth"] / 10}


def _key(panel: Axes, *looks: Mapping[str, Any]) -> None:
    """Add lines to the key of a panel."""
    for look in looks:
        panel.plot([], [], **look)
    panels.key(panel)


def _printed(panel: Axes, summary: pd.DataFrame, outcome: str) -> None:
    """The printed number as a band and a line."""
    row = _rows(summary, outcome=outcome).iloc[0]
    value, half_unit = row["printed"], row["tolerance"]
    grey = LINES["family 4"]
    panel.axhspan(value - half_unit, value + half_unit, color=panels.paler(grey["color"], 0.6), linewidth=0)
    panel.axhline(value, **grey)


def _lines(panel: Axes, rows: pd.DataFrame, reading: str, kind: str) -> None:
    """A reading over the limit: a line for each set and initial output, dots for the approximation."""
    for name in reversed(NAMES):
        for output, part in rows[rows["set"] == name].sort_values("limit").groupby("initial_output"):
            exact, pade = part[part["delay"] != "pade"], part[part["delay"] == "pade"]
            panel.plot(exact["limit"], exact[reading], **_look(kind, int(output != 0), name))
            panel.plot(pade["limit"], pade[reading], **DOTS, zorder=4)


def _ratios(panel: Axes, summary: pd.DataFrame) -> None:
    """Computed over printed of the nearest joint sets."""
    panel.axhline(1.0, **LINES["family 4"])
    looks = {
        "together": ("o", LINES["family 1"]["color"], "any error"),
        "together, converging": ("D", LINES[THESIS]["color"], "error to zero"),
    }
    for search, (marker, color, label) in looks.items():
        if (summary["search"] != search).all():
            continue
        for name in NAMES:
            rows = summary[
                (summary["search"] == search) & (summary["set"] == name) & (summary["delay"] == "exact")
            ].set_index("outcome")
            if rows.empty:
                continue
            ratios = [rows["computed"][outcome] / rows["printed"][outcome] for outcome in JOINT]
            face = color if name == "implied" else "#FFFFFF"
            panel.plot(
                np.arange(3) + (-0.08 if name == "implied" else 0.08),
                ratios,
                linestyle="none",
                marker=marker,
                markersize=4.5,
                color=color,
                markerfacecolor=face,
                label=label if name == "implied" else None,
            )
    panel.set_xticks(range(3), [_said(summary, outcome) for outcome in JOINT])
    panel.set(xlabel="Printed outcome", ylabel="Computed/printed [-]", xlim=(-0.5, 2.5))
    panel.set_ylim(0, 1.1 * panel.get_ylim()[1])
    hollow = {"linestyle": "none", "marker": "o", "markersize": 4.5, "color": color, "markerfacecolor": "#FFFFFF"}
    _key(panel, hollow | {"label": NAMES["table"]})


def _errors(panel: Axes, rows: pd.DataFrame, summary: pd.DataFrame) -> None:
    """Chapter 2's error over the limit, with the least over the weights and the bound of any controller."""
    outcome, reading = CHAPTER_2
    _printed(panel, summary, outcome)
    _lines(panel, rows[rows["weights"] == "usual"].drop_duplicates(["set", "initial_output", "limit"]), reading, THESIS)
    least, bound = (_rows(summary, search=search) for search in ("weights", "any controller"))
    look = {"color": LINES["family 1"]["color"], "linestyle": "none"}
    panel.plot(least["limit"], least["computed"], **look, marker="o", markersize=4, label="found")
    panel.plot(bound["limit"], bound["computed"], **look, marker="_", markersize=9, label="bound")
    panel.axvline(float(least["limit"].iloc[0]), **LINES["saturation limits"], label="printed $L$")
    panels.key(panel)
    panel.set(xlabel=LIMIT, ylabel="$|e|$, last period [%]", yscale="log", ylim=(1e-2, 200))
    panel.set_xlim(0.88 * float(least["limit"].iloc[0]), 1.2 * float(least["limit"].iloc[0]))
