"""What to do with a plant and what not to, in plain words: each sentence follows from a design, a run or the fit."""

from __future__ import annotations

import math
from collections.abc import Iterator

import pandas as pd

from design.design_file import Design
from design.stability.characteristic_roots import roots_right_of
from design.stability.margins import delay_loop
from experiments.rates import lowest_rate
from experiments.runs.against_none import SAME
from identification.model.model_file import IdentifiedModel
from identification.model.signals import Signals
from paper_figures.look.captions import duration, hertz, limits_said, number, of_run, only, with_unit
from paper_figures.summary.build_folder import DESIGNS, TABLES, Found
from paper_figures.summary.of_fit import Paragraph, cautions

NONE = 1e-6  # of the amplitude: a smaller error is no more than rounding
METHODS = {"matched": "the method 'matched'", "tustin": "Tustin's rule", "exact": "held-input discretisation"}
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
    do, do_not = list(_do(found, model.signals)), list(_do_not(found, model.signals))
    parts = (
        ("Do", do),
        ("Avoid", do_not),
        ("Mind", cautions(model)),
        ("Assumed", list(_assumed(found.axis, model.signals))),
        ("To come", list(_to_come(found))),
    )
    return tuple((head, " ".join(sentences)) for head, sentences in parts if sentences)


def _do(found: Found, signals: Signals) -> Iterator[str]:
    design = found.design("design")
    if design is None:
        return
    tracking, rates = (found.made.get(name) for name in ("tracking", "rates"))
    best = best_anti_windup(design, found)
    if best == "corrected":
        promise = _promise(design, tracking, signals)
        yield f"Use the controller of design.json with the anti-windup 'corrected': {promise}."
    else:
        yield "Use the controller of design.json without anti-windup: no anti-windup that it carries does better here."
    if tracking is not None:
        yield _limits(tracking, found.made.get("limits_extended"), signals)
    if rates is not None:
        yield from _discretise(rates, best, signals)
    delay_free = found.design("design_delay_free")
    if delay_free is not None and not _unusable(delay_free):
        late = f"with the plant's dead time of {duration(delay_free.plant.delay_s)}" if delay_free.plant.delay_s else ""
        yield f"The controller of design_delay_free.json is stable {late or 'on this plant'} too."


def _do_not(found: Found, signals: Signals) -> Iterator[str]:
    design, delay_free = found.design("design"), found.design("design_delay_free")
    if design is not None:
        yield from _harm(design, found)
        yield from _without(design, found, signals)
    rates = found.made.get("rates")
    if design is not None and rates is not None:
        yield from _avoid(rates, best_anti_windup(design, found), signals)
    if delay_free is not None and (why := _unusable(delay_free)):
        yield f"Do not use the controller of design_delay_free.json: {why}."


def _unusable(delay_free: Design) -> str:
    """Why a design that ignores the dead time does not do for the plant; empty where it does."""
    if not delay_free.blocks["K"].is_stable:
        return "it is unstable by itself and diverges when the actuator saturates"
    late = delay_free.plant.delay_s
    count = roots_right_of(delay_loop(delay_free, delay_free.plant), 0.0) if late else 0
    if not count:
        return ""
    roots = f"{count} root{'s' if count > 1 else ''} in the right half plane"
    return f"with the plant's dead time of {duration(late)} its loop is unstable ({roots})"


def _without(design: Design, found: Found, signals: Signals) -> Iterator[str]:
    """What becomes of the run without anti-windup, where it is worse."""
    tracking = found.made.get("tracking")
    if tracking is None or best_anti_windup(design, found) == "none":
        return
    none, own = (
        abs(of_run(tracking, run, "offset")) + of_run(tracking, run, "ripple") for run in ("none", "corrected")
    )
    if math.isnan(none):
        yield "Do not leave the anti-windup out: without it the run under the reference diverges."
    elif none > (1 + SAME) * own and of_run(tracking, "none", "last_saturation_s") != 0:
        unit = signals.output_unit
        yield (
            f"Do not leave the anti-windup out: without it an error of {with_unit(none, unit)} is left in the last "
            f"period of the run, with it {with_unit(own, unit)}."
        )


def best_anti_windup(design: Design, found: Found) -> str:
    """``corrected``, or ``none`` where a run with it is worse than the same one without anti-windup."""
    return "none" if any(_harm(design, found)) else "corrected"


def _harm(design: Design, found: Found) -> Iterator[str]:
    """Where the corrected anti-windup does harm."""
    for sentence in design.compared:
        if sentence.startswith("corrected is WORSE"):
            yield f"Do not use the anti-windup 'corrected': {sentence.removeprefix('corrected ')}."
    table = found.made.get("compare")
    if table is None:
        return
    for upset, said in (("start", "from rest"), ("pulse", "after a disturbance")):
        rows = table[table["upset"] == upset].set_index("run")
        own, none = (float(rows["recovery_s"].get(run, math.nan)) for run in ("corrected", "none"))
        if not math.isnan(none) and not own <= none * (1 + SAME):
            yield (
                f"Do not use the anti-windup 'corrected': {said} it recovers {_when(own)}, without anti-windup the "
                f"loop recovers {_when(none)}."
            )


def _when(time_s: float) -> str:
    return "never" if math.isnan(time_s) else "at once" if time_s == 0 else f"after {duration(time_s)}"


def _promise(design: Design, tracking: pd.DataFrame | None, signals: Signals) -> str:
    """What the corrected anti-windup is guaranteed to do."""
    chosen = design.corrected
    if chosen.guarantee != "sector":
        whom = "for every plant within the bound W_a" if chosen.guarantee == "robust" else "for the fitted plant"
        return (
            "however large the control was, the output returns to that of the loop without limits once the control of "
            f"that loop stays within them (guaranteed {whom})"
        )
    if tracking is None:
        return "the output returns to that of the loop without limits as long as the control stays within a bound"
    covered, reached = (of_run(tracking, "corrected", column) for column in ("covered_control", "largest_control"))
    if math.isnan(covered):
        return "nothing is guaranteed under this reference, since it takes as much as the limits give"
    verdict = "no more" if of_run(tracking, "corrected", "covered") else "MORE, so nothing is guaranteed of this run"
    return (
        "the output is guaranteed to return to that of the loop without limits as long as "
        f"{signals.input_name} asked for stays below {with_unit(covered, signals.input_unit)}; under this reference it "
        f"reached {with_unit(reached, signals.input_unit)}, {verdict}"
    )


def _limits(tracking: pd.DataFrame, best: pd.DataFrame | None, signals: Signals) -> str:
    """Whether the limits suffice for the reference, and by how much."""
    unit, within = signals.input_unit, limits_said(tracking, signals.input_unit)
    ends, steady = ("lower_limit", "limit"), ("steady_least", "steady_greatest")
    (low, high), (least, greatest) = ([only(tracking, each) for each in pair] for pair in (ends, steady))
    takes = f"following the reference takes {number(least)} to {with_unit(greatest, unit)}"
    share = max(greatest / high, least / low) if low < 0 < high else math.nan
    if low < least and greatest < high:
        used = "" if math.isnan(share) else f", {number(100 * share, 2)} % of the way to the nearer one"
        unsaturated = only(tracking, "linear_control")
        reached = (
            "the control never reaches them"
            if of_run(tracking, "none", "last_saturation_s") == 0
            else f"on the way there the loop asks for up to {with_unit(unsaturated, unit)}, and they act"
        )
        return f"The limits {within} suffice for this reference: {takes}{used}; {reached}."
    forced = 0.0 if best is None else float(best["periodic_lower"].iloc[0])
    leaves = f": each leaves an error of {with_unit(forced, signals.output_unit)} or more" if forced > 0 else ""
    remedy = f" to {number(100 / share, 2)} % of its size, or widen the limits {number(share)} times"
    return (
        f"Make the reference smaller{'' if math.isnan(share) else remedy}: the limits {within} do NOT suffice, "
        f"{takes}, so that no controller follows it{leaves}."
    )


def _discretise(rates: pd.DataFrame, run: str, signals: Signals) -> Iterator[str]:
    """Which method, from which rate on; and what the computer's own rate gives."""
    lowest = {method: lowest_rate(rates, run, method) for method in METHODS}
    usable = {method: rate for method, rate in lowest.items() if not math.isnan(rate)}
    asked = only(rates, "asked_hz")
    if not usable:
        yield (
            "Look for a faster computer or a slower reference: by no method does the controller come within 1 % of the "
            f"reference's amplitude of what it does in continuous time, up to {hertz(float(rates['rate_hz'].max()))}."
        )
        return
    method = min(usable, key=usable.__getitem__)
    yield (
        f"Run it on a computer by {METHODS[method]} at {hertz(usable[method])} or more: the steady error is then no "
        "more than 1 % of the reference's amplitude above that in continuous time, at every rate that was tried."
    )
    if not math.isnan(asked):
        said = ", ".join(
            f"{_left(error, only(rates, 'amplitude'), signals)} by {METHODS[each]}"
            for each, error in ((each, _error(rates, run, each, asked)) for each in METHODS)
        )
        yield f"At your rate of {hertz(asked)} the steady error is {said}."


def _avoid(rates: pd.DataFrame, run: str, signals: Signals) -> Iterator[str]:
    """Below which rates which method does not do."""
    for method, words in METHODS.items():
        rows = rates[(rates["run"] == run) & (rates["method"] == method)].sort_values("rate_hz")
        lowest = lowest_rate(rates, run, method)
        below = rows if math.isnan(lowest) else rows[rows["rate_hz"] < lowest]
        if len(below):
            last = below.iloc[-1]
            left = _left(float(last["steady_error"]), float(last["amplitude"]), signals)
            left = f"the steady error is {left}" if last["stable"] else "the loop is unstable"
            tried = hertz(last["rate_hz"])
            until = f"at any rate up to {tried}" if math.isnan(lowest) else f"below {hertz(lowest)}"
            yield f"Do not use {words} {until}: at {tried} {left}."


def _error(rates: pd.DataFrame, run: str, method: str, rate_hz: float) -> float:
    rows = rates[(rates["run"] == run) & (rates["method"] == method)]
    return float(rows["steady_error"].iloc[int((rows["rate_hz"] - rate_hz).abs().to_numpy().argmin())])


def _left(error: float, amplitude: float, signals: Signals) -> str:
    if error < NONE * amplitude:
        return "less than a millionth of the amplitude"
    return "unbounded" if math.isnan(error) else with_unit(error, signals.output_unit)


def _assumed(axis: pd.DataFrame | str | None, signals: Signals) -> Iterator[str]:
    """What the program chose because nobody said it."""
    if not isinstance(axis, pd.DataFrame):
        return
    units = {"limit": signals.input_unit, "amplitude": signals.output_unit, "reference-hz": "Hz", "phase": "rad"}
    for row in axis[axis["source"] == "chosen"].to_dict("records"):
        values = " to ".join(number(float(value)) for value in str(row["value"]).split())
        yield f"{row['key']} = {values} {units.get(str(row['key']), '')}".rstrip() + f": {row['why']}."


def _to_come(found: Found) -> Iterator[str]:
    """What a refit has not yet come to."""
    if isinstance(found.axis, str):
        return
    if "design" not in found.designs:
        yield f"{'This is the fit alone; designs' if found.axis is None else 'Designs'} and runs follow."
        return
    rest = [said for name, said in DESIGNS.items() if name not in found.designs]
    if found.design("design") is not None:
        rest += [FOLLOWS[name] for name in TABLES if name not in found.tables]
    if rest:
        yield f"{'; '.join(rest)}."
