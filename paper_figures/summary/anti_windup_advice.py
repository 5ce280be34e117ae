"""Which anti-windup to use and which not to, in sentences."""

from __future__ import annotations

import math
from collections.abc import Iterator

import pandas as pd

from design.design_file import Design
from experiments.comparison import SMALLER
from experiments.runs.against_none import SAME
from identification.model.signals import Signals
from paper_figures.look.captions import a_second, is_rounding, number, of_run, only, with_unit
from paper_figures.summary.build_folder import Found
from paper_figures.summary.choice import best_anti_windup, enough, harm, is_guaranteed, recoveries, when


def use(design: Design, found: Found, signals: Signals) -> Iterator[str]:
    """With which anti-windup to use the controller, and what it does."""
    best = best_anti_windup(found)
    controller = "Use the controller of design.json"
    if best == "none":
        yield f"{controller} without anti-windup: none of those that were run improves the loop."
    elif best == "corrected":
        promise = _promise(design, found.made.get("tracking"), signals)
        yield f"{controller} with the anti-windup 'corrected': {promise}."
        start, pulse = recoveries(found).get(best, (0.0, 0.0))
        if start >= 0 and math.isnan(pulse):
            yield "From rest it recovers; after the disturbance of the comparison no anti-windup does."
    elif best is not None:
        first, then = map(when, recoveries(found)[best])
        promise = (
            "recovery is guaranteed however large the control is"
            if is_guaranteed(best, found)
            else "nothing is guaranteed of these runs"
        )
        yield (
            f"{controller} with the anti-windup '{best}' (--anti-windup {best}): from rest it recovers {first}, after "
            f"the disturbance of the comparison {then}; {promise}."
        )
    else:
        yield _nothing_follows(found)


def _nothing_follows(found: Found) -> str:
    said = "No anti-windup that was run makes the loop follow this reference from rest under these limits"
    table = found.made.get("compare")
    if table is None:
        return f"{said}."
    multiple, wide = enough(table), " and a rate limit" if only(table, "rate_limit") > 0 else ""
    if math.isnan(multiple):
        return f"{said}, nor with a reference {SMALLER[-1]:g} times smaller; look for a slower reference."
    return (
        f"{said}. With a reference {number(multiple)} times smaller, or limits{wide} {number(multiple)} times wider, "
        "one does; so may a slower reference."
    )


def use_not(found: Found, signals: Signals) -> Iterator[str]:
    """Which anti-windups do harm or do not make the loop follow, and what becomes of it without any."""
    best, said = best_anti_windup(found), list(harm(found))
    yield from said
    if best in (None, "none"):
        return
    times = recoveries(found)
    others = [run for run in times if run != "none" and not (run == "corrected" and said)]
    for place, upset in enumerate(("from rest", "after the disturbance of the comparison")):
        gone = [
            "'second order, Eq. (2.23)'" if run == "thesis" else f"'{run}'"
            for run in others
            if _fails_first(times[run]) == place
        ]
        if gone and not math.isnan(times[str(best)][place]):
            yield f"Do not use the anti-windup {_listed(gone)}: with it the loop does not recover {upset}."
    yield from _without(str(best), found, signals)


def _fails_first(times: tuple[float, float]) -> int:
    """Of which upset a run does not recover: 0 or 1, 2 if of each."""
    return next((place for place, time_s in enumerate(times) if math.isnan(time_s)), len(times))


def _listed(words: list[str]) -> str:
    return words[0] if len(words) == 1 else f"{', '.join(words[:-1])} or {words[-1]}"


def _without(best: str, found: Found, signals: Signals) -> Iterator[str]:
    """What becomes of the run without anti-windup, where it is worse."""
    tracking = found.made.get("tracking")
    if tracking is None:
        return
    none, own = (
        abs(of_run(tracking, run, "offset")) + of_run(tracking, run, "ripple") for run in ("none", "corrected")
    )
    with_it = f", with it {with_unit(own, signals.output_unit)}" if best == "corrected" else ""
    if math.isnan(none):
        yield "Do not leave the anti-windup out: without it the run under the reference diverges."
    elif of_run(tracking, "none", "last_saturation_s") == 0 or is_rounding(tracking, "none"):
        return
    elif none > (1 + SAME) * own or not with_it:
        yield (
            f"Do not leave the anti-windup out: without it an error of {with_unit(none, signals.output_unit)} is left "
            f"at the end of the run{with_it}."
        )


def _promise(design: Design, tracking: pd.DataFrame | None, signals: Signals) -> str:
    """What the corrected anti-windup is guaranteed to do."""
    if tracking is None or math.isnan(rate_limit := only(tracking, "rate_limit")):
        return _within_limits(design, tracking, signals)
    slope = a_second(rate_limit, signals.input_unit)
    if of_run(tracking, "corrected", "slews") == 1:
        return (
            f"in the run under the reference the loop recovers {when(of_run(tracking, 'corrected', 'recovery_s'))}; "
            f"nothing is guaranteed, since the rate limit of {slope} acts in this run and the guarantee covers "
            "saturation limits alone"
        )
    return (
        f"{_within_limits(design, tracking, signals)}. The rate limit of {slope} is never reached in the run under the "
        "reference; where it is, nothing is guaranteed"
    )


def _within_limits(design: Design, tracking: pd.DataFrame | None, signals: Signals) -> str:
    """That of an actuator with limits alone."""
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
        f"the {signals.input_name} asked for stays below {with_unit(covered, signals.input_unit)}; under this "
        f"reference it reached {with_unit(reached, signals.input_unit)}, {verdict}"
    )
