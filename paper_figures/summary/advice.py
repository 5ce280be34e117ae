"""What to do with a plant and what not to, in plain words: each sentence follows from a design, a run or the fit."""

from __future__ import annotations

import math
from collections.abc import Iterator

import pandas as pd

from design.design_file import Design
from design.stability.characteristic_roots import roots_right_of, unstable_roots
from design.stability.margins import delay_loop
from identification.model.model_file import IdentifiedModel
from identification.model.signals import Signals
from paper_figures.look.captions import duration, limits_said, number, of_run, only, with_unit
from paper_figures.summary.anti_windup_advice import use, use_not
from paper_figures.summary.build_folder import DESIGNS, TABLES, Found
from paper_figures.summary.choice import best_anti_windup
from paper_figures.summary.of_fit import Paragraph, cautions
from paper_figures.summary.rates_advice import avoid, discretise

FOLLOWS = {
    "tracking": "the run under the reference",
    "compare": "the comparison of anti-windups",
    "rates": "the runs on a computer",
    "limits_extended": "what no controller can better",
    "campaign": "the plants within W_a",
}
"""What each table shows, while it is not there yet."""


def advice(model: IdentifiedModel, found: Found) -> tuple[Paragraph, ...]:
    """What to do, what not to do, what to mind, what was assumed, and what is not there yet, as far as there is any.

    Parameters
    ----------
    model
        The plant as it was fitted, with the names and units of its signals.
    found
        What was made for it so far.
    """
    delay_free = found.design("design_delay_free")
    unusable = "" if delay_free is None else _unusable(delay_free)
    do, do_not = list(_do(found, unusable, model.signals)), list(_do_not(found, unusable, model.signals))
    parts = (
        ("Do", do),
        ("Avoid", do_not),
        ("Mind", cautions(model)),
        ("Assumed", list(_assumed(found.axis, model.signals))),
        ("Not yet on this page", list(_to_come(found))),
    )
    return tuple((head, " ".join(sentences)) for head, sentences in parts if sentences)


def _do(found: Found, unusable: str, signals: Signals) -> Iterator[str]:
    design = found.design("design")
    if design is None:
        return
    tracking, rates = (found.made.get(name) for name in ("tracking", "rates"))
    best = best_anti_windup(found)
    yield from use(design, found, signals)
    if tracking is not None:
        yield _limits(tracking, found.made.get("limits_extended"), signals, best is not None)
    if rates is not None:
        yield from discretise(rates, best, signals)
    delay_free = found.design("design_delay_free")
    if delay_free is not None and not unusable:
        late = f"with the plant's dead time of {duration(delay_free.plant.delay_s)}" if delay_free.plant.delay_s else ""
        yield f"The loop with the controller of design_delay_free.json is stable {late or 'around this plant'} too."


def _do_not(found: Found, unusable: str, signals: Signals) -> Iterator[str]:
    rates = found.made.get("rates")
    if found.design("design") is not None:
        yield from use_not(found, signals)
        if rates is not None:
            yield from avoid(rates, best_anti_windup(found), signals)
    if unusable:
        yield f"Do not use the controller of design_delay_free.json: {unusable}."


def _unusable(delay_free: Design) -> str:
    """Why a design that ignores the dead time does not do for the plant; empty where it does."""
    if not delay_free.blocks["K"].is_stable:
        return "it is unstable by itself and diverges when the actuator saturates"
    late = delay_free.plant.delay_s
    count = roots_right_of(delay_loop(delay_free, delay_free.plant), 0.0) if late else 0
    if not count:
        return ""
    return f"with the plant's dead time of {duration(late)} its loop is unstable ({unstable_roots(count)})"


def _limits(tracking: pd.DataFrame, best: pd.DataFrame | None, signals: Signals, follows: bool) -> str:
    """Whether the limits suffice for the reference, and by how much."""
    unit, within = signals.input_unit, limits_said(tracking, signals.input_unit)
    ends, steady = ("lower_limit", "limit"), ("steady_least", "steady_greatest")
    (low, high), (least, greatest) = ([only(tracking, each) for each in pair] for pair in (ends, steady))
    takes = f"{number(least)} to {with_unit(greatest, unit)}" if least < greatest else with_unit(greatest, unit)
    takes = f"in steady state the reference needs a control of {takes}"
    share = max(greatest / high, least / low) if low < 0 < high else math.nan
    if low < least and greatest < high:
        used = f", {number(100 * share, 2)} % of the way to the nearer one" if share > 0 else ""
        unsaturated = only(tracking, "linear_control")
        acts = of_run(tracking, "none", "last_saturation_s") != 0
        reached = f"in the run the loop without limits asks for up to {with_unit(unsaturated, unit)}, so the "
        reached += "actuator saturates" if acts else "actuator never saturates"
        if follows:
            return f"The limits {within} suffice for this reference: {takes}{used}; {reached}."
        asked = f"but from rest the loop asks for up to {with_unit(unsaturated, unit)}"
        return f"The limits {within} would suffice: {takes}{used}; {asked}, and its output does not follow."
    forced = 0.0 if best is None else float(best["periodic_lower"].iloc[0])
    leaves = f": each leaves an error of {with_unit(forced, signals.output_unit)} or more" if forced > 0 else ""
    remedy = f" to {number(100 / share, 2)} % of its size, or widen the limits {number(share)} times"
    return (
        f"Make the reference smaller{'' if math.isnan(share) else remedy}: the limits {within} do NOT suffice: "
        f"{takes}, so no controller follows it{leaves}."
    )


def _assumed(axis: pd.DataFrame | str | None, signals: Signals) -> Iterator[str]:
    """What the program chose because nobody said it."""
    if not isinstance(axis, pd.DataFrame):
        return
    units = {"limit": signals.input_unit, "amplitude": signals.output_unit, "reference-hz": "Hz", "phase": "rad"}
    cells = axis.set_index("key")["value"]
    swings = any(
        float(hertz) > 0 and float(size) != 0
        for hertz, size in zip(
            *(str(cells.get(key, "")).split() for key in ("reference-hz", "amplitude")), strict=False
        )
    )
    for row in axis[axis["source"] == "chosen"].to_dict("records"):
        if row["key"] == "phase" and not swings:  # a constant has no crest
            continue
        between = " to " if row["key"] == "limit" else ", "
        values = between.join(number(float(value)) for value in str(row["value"]).split())
        yield f"{row['key']} = {values} {units.get(str(row['key']), '')}".rstrip() + f": {row['why']}."


def _to_come(found: Found) -> Iterator[str]:
    """What a refit has not yet come to."""
    if isinstance(found.axis, str):
        return
    if "design" not in found.designs:
        yield f"{'This page holds the fit alone; designs' if found.axis is None else 'Designs'} and runs follow."
        return
    rest = [said for name, said in DESIGNS.items() if name not in found.designs]
    if found.design("design") is not None:
        rest += [FOLLOWS[name] for name in TABLES if name not in found.tables]
    if rest:
        yield f"{'; '.join(rest)}."
