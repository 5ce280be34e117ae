"""Fig. A.7: the outcomes that the thesis prints, over the conditions that it does not print."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
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
STARTS = "from rest", "from $y(0) = r(0)$"
PANELS = {
    "a": ("error", "error_after_1s", "Largest $|e|$ after 1 s"),
    "b": ("desaturation", "desaturation_s", "Last saturation [s]"),
    "c": ("recovery", "recovery_saturation_s", "Last saturation [s]"),
    "d": ("recovery", "recovery_to_offset_s", "Settled to an offset [s]"),
}
WORDS = {
    "error_after_1s": "after the first second",
    "desaturation_s": "as the last saturation",
    "recovery_saturation_s": "as the last saturation",
    "recovery_1_s": "as settling to 1 % of the amplitude",
    "recovery_to_offset_s": "as settling to an offset",
    "peak_percent": "in the last period",
}
CHAPTER_2 = ("delay_free_error", "peak_percent")
JOINT = ("error", "desaturation", "recovery")
VIEW = 0.8, 2.9  # of the limits of chapter 4, in multiples of the input that tracking needs
DOTS = {"color": LINES["second-order Pade"]["color"], "linestyle": "none", "marker": ".", "markersize": 2.0}
NONE, THESIS = "without anti-windup", "thesis anti-windup"


def caption(tables: Mapping[str, pd.DataFrame]) -> str:
    """Return the caption with the numbers of the tables."""
    summary = tables["conditions_summary"]
    none, thesis = ("error_after_1s", "desaturation_s"), tuple(name for name in WORDS if name.startswith("recovery"))
    starts = summary[(summary["search"] == "alone") & (summary["outcome"] == "error")]["initial_output"]
    return " ".join(
        [
            "The outcomes that the thesis prints (grey, half a unit of the last digit to both sides), over the limits "
            "+-L that chapter 4 does not print; how its words are read is our choice. Strong lines: the implied set; "
            "pale ones: Table 2.1; broad: from rest; thin: from y(0) = r(0); dots: second-order Pade approximation; "
            "dashed: the limit that tracking needs.",
            "(a, b) Without and (c, d) with the thesis's anti-windup. From rest,",
            f"{_each(summary, (*none, *thesis), 0.0)}.",
            f"From y(0) = r(0) = {number(starts.max())}, {_each(summary, (*none, *thesis), float(starts.max()))}.",
            f"The Pade approximation moves no limit that gives an outcome by more than {_moved(summary)} %.",
            "(e) All three from one limit and one initial output, filled: the implied set, hollow: Table 2.1.",
            _joint(summary, "together"),
            _joint(summary, "together, converging"),
            "(f) Chapter 2: its limit is printed (dotted), its weights and initial state are not; thin: from r's mean.",
            _chapter_2(summary),
        ]
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


def _each(summary: pd.DataFrame, readings: Iterable[str], output: float) -> str:
    """Which limits give the outcomes in these readings, set by set, with the exact dead time."""
    parts = []
    for reading in readings:
        rows = _rows(summary, search="alone", reading=reading, initial_output=output)
        sets = [f"{_limits(part)}{NAMES[str(name)]})" for name, part in rows[rows["delay"] != "pade"].groupby("set")]
        parts.append(f"{_said(summary, rows['outcome'].iloc[0])} {WORDS[reading]} comes at {' and '.join(sets)}")
    return "; ".join(parts)


def _limits(rows: pd.DataFrame) -> str:
    """The limits at which an outcome is met, or what comes nearest, and an open bracket."""
    met = rows[rows["met"] == 1]
    spans = [
        f"L = {number(at, 4)}" if high - low < 0.01 * at else f"L from {number(low)} to {number(high)}"
        for low, high, at in met[["limit_low", "limit_high", "limit"]].to_numpy(float)
    ]
    computed, limit = rows["computed"].iloc[0], rows["limit"].iloc[0]
    if spans:
        return f"{', '.join(spans)} ("
    return "no L (" if math.isnan(computed) else f"no L ({number(computed)} at {number(limit, 4)} is nearest, "


def _moved(summary: pd.DataFrame) -> str:
    """The largest relative change of a limit by the Pade approximation, in percent, to one digit."""
    met = summary[(summary["search"] == "alone") & (summary["met"] == 1)]
    keys = ["outcome", "reading", "set", "initial_output"]
    exact, pade = (met[met["delay"] == delay].groupby(keys)["limit"].first() for delay in ("exact", "pade"))
    both = pd.concat([exact, pade], axis=1, keys=["exact", "pade"]).dropna()
    return number(100 * float((both["pade"] / both["exact"] - 1).abs().max()), 1)


def _nearest(summary: pd.DataFrame, search: str) -> pd.DataFrame:
    """The three rows of the condition that comes nearest in a joint search, by outcome."""
    rows = _rows(summary, search=search)
    best = rows.iloc[int(rows["worst_miss"].to_numpy().argmin())]
    nearest: pd.DataFrame = rows[(rows["set"] == best["set"]) & (rows["delay"] == best["delay"])]
    return nearest.set_index("outcome")


def _joint(summary: pd.DataFrame, search: str) -> str:
    said = {"together": "Whatever the error comes to", "together, converging": "Where the error converges to zero"}
    if (summary["search"] != search).all():
        return f"{said[search]}, no point of the search has all three outcomes."
    best = _nearest(summary, search)
    first = best.iloc[0]
    values = ", ".join(f"{number(best['computed'][name])} for {_said(summary, name)}" for name in JOINT)
    verdict = "gives them all" if best["met"].all() else f"misses by {number(100 * first['worst_miss'], 2)} %"
    return (
        f"{said[search]}, the nearest, L = {number(first['limit'], 4)} and y(0) = {number(first['initial_output'])} "
        f"({NAMES[first['set']]}), {verdict}: {values}; the error of the last period is "
        f"{number(first['final_error_percent'], 2)} % of the amplitude."
    )


def _chapter_2(summary: pd.DataFrame) -> str:
    least = _rows(summary, search="weights").nsmallest(1, "computed").iloc[0]
    bound = _rows(summary, search="any controller")["computed"].min()
    return (
        f"Over the weights and initial outputs tried, the least error at L = {number(least['limit'])} is "
        f"{number(least['computed'])} % of the amplitude (dot); no controller stays below {at_least(bound)} % (bar). "
        f"From y(0) = r(0), {_each(summary, CHAPTER_2[1:], 0.0)}."
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
        panel.set(xlabel="Limit $L$", ylabel=label, xlim=(VIEW[0] * required, VIEW[1] * required))
        panel.set_ylim(bottom=0)
    _key(axes["a"], NONE, "none")
    _key(axes["c"], THESIS, "thesis")
    axes["b"].set_ylim(top=12)
    axes["c"].set_ylim(top=8)
    _ratios(axes["e"], summary)
    _errors(axes["f"], table[table["case"] == "delay_free"], summary)
    figure = axes["a"].get_figure(root=True)
    assert figure is not None
    return figure


def _look(kind: str, start: int, name: str) -> dict[str, Any]:
    """The line of an anti-windup from one of STARTS with a parameter set."""
    line = LINES[kind] | {"linewidth": (1.8, 0.8)[start]}
    return line if name == "implied" else line | {"color": panels.paler(line["color"], 0.5)}


def _key(panel: Axes, kind: str, label: str) -> None:
    for start, words in enumerate(STARTS):
        panel.plot([], [], **_look(kind, start, "implied"), label=words if start else f"{label}, {words}")
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
    panel.set(ylabel="Computed/printed", xlim=(-0.5, 2.5))
    panel.set_ylim(0, 1.1 * panel.get_ylim()[1])
    panels.key(panel)


def _errors(panel: Axes, rows: pd.DataFrame, summary: pd.DataFrame) -> None:
    """Chapter 2's error over the limit, with the least over the weights and the bound of any controller."""
    outcome, reading = CHAPTER_2
    _printed(panel, summary, outcome)
    _lines(panel, rows[rows["weights"] == "usual"].drop_duplicates(["set", "initial_output", "limit"]), reading, THESIS)
    least, bound = (_rows(summary, search=search) for search in ("weights", "any controller"))
    panel.plot(least["limit"], least["computed"], **LINES["family 1"] | {"linestyle": "none"}, marker="o", markersize=4)
    panel.plot(bound["limit"], bound["computed"], **LINES["family 1"] | {"linestyle": "none"}, marker="_", markersize=9)
    panel.axvline(float(least["limit"].iloc[0]), **LINES["saturation limits"])
    panel.set(xlabel="Limit $L$", ylabel="$|e|$, last period [%]", yscale="log", ylim=(1e-2, 200))
    panel.set_xlim(0.9 * float(least["limit"].iloc[0]), 1.2 * float(least["limit"].iloc[0]))
