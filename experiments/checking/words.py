"""What a check found, in words: first what to do, then each answer, then the parameters in a table."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import inf, isinf, pi

from design.stability.margins import Margins
from experiments.checking.answers import ROUNDING, Outcome, answers, answers_of_sweep, found_from, relative
from experiments.checking.check_model import ModelCheck, SweepCheck
from experiments.checking.parameter_moves import Move

HEAD = ("parameter", "model", "sweep", "moved", "standard errors", "found from")


def first_sentence(found: ModelCheck) -> str:
    """What to do and why, in one sentence without its full stop."""
    given = answers(found)
    failed: dict[str, str] = {}  # of each question that of the first sweep, rather one that moved
    for question in dict.fromkeys(each.question for each in given):
        failing = [each for each in given if each.question == question and each.outcome.fails]
        if failing:
            each = min(failing, key=lambda each: each.outcome is Outcome.OUTSIDE)
            failed[question] = each.sentence + (f" ({each.sweep})" if len(found.sweeps) > 1 else "")
    held = {each.question for each in given if each.outcome is Outcome.HOLDS} - failed.keys()
    if not failed:
        reasons = ["every sweep lies within W_a" if len(found.sweeps) > 1 else "the sweep lies within W_a"]
        reasons[0] += " except for noise" if any(map(_is_beyond, found.sweeps)) else ""
        reasons += ["no parameter moved by more than chance"] if "parameters" in held else []
        untold = dict.fromkeys(each.question for each in given if each.outcome is Outcome.OPEN)
        rest = f"; unknown: {', '.join(untold)}" if untold else ""
        return f"Nothing to do: {', '.join([*reasons, *_design_keeps(held)])}{rest}"
    outcomes = {each.outcome for each in given}
    todo = "Fit a new model"
    if Outcome.OUTSIDE in outcomes and Outcome.MOVED not in outcomes:
        todo += f" to the old tests and the new {'sweeps' if len(found.sweeps) > 1 else 'sweep'} together"
    todo += " and design again" if Outcome.LOST in outcomes else ""
    if any(sweep.design is not None and sweep.design.sector is None for sweep in found.sweeps):
        todo = "Do not run this design"
        failed.pop("guarantee", None)  # there is none without a stable loop
    after = _design_keeps(held)
    if Outcome.MOVED in outcomes and found.model.fit is not None and len(found.model.fit.tests) == 1:
        after += ["the model's single test does not say how much tests of one plant differ"]
    after += ["--against DESIGN shows whether a design can stay"] if found.promise is None else []
    return f"{todo}: {'; '.join([*failed.values(), *after])}"


def _is_beyond(sweep: SweepCheck) -> bool:
    reaches = (sweep.at_lines, sweep.between_lines)
    return any(reach is not None and reach.ratio > 1 + ROUNDING for reach in reaches)


def _design_keeps(held: set[str]) -> list[str]:
    kept = [f"its {question}" for question in ("margins", "guarantee") if question in held]
    return [f"the design keeps {' and '.join(kept)}"] if kept else []


def text(found: ModelCheck) -> str:
    """All that a check found, as a terminal shows it."""
    lines = [first_sentence(found)]
    for sweep in found.sweeps:
        lines += ["", describe(sweep)]
        lines += [
            f"  {each.question:<12}{each.outcome.value:<10}{each.sentence}" for each in answers_of_sweep(found, sweep)
        ]
        for table in tables(found, sweep):
            lines += ["", *_columns(table)]
    return "\n".join(lines)


def describe(sweep: SweepCheck) -> str:
    """A sweep in a line: its name, and which lines of it were compared."""
    low, high = (f"{omega / (2 * pi):.4g}" for omega in sweep.band)
    return f"{sweep.name}: {sweep.lines} lines from {low} to {high} Hz"


def tables(found: ModelCheck, sweep: SweepCheck) -> list[list[tuple[str, ...]]]:
    """The parameters and the margins beside those of the model, as far as they are known; heads first."""
    made = []
    if sweep.moves is not None:
        made.append([HEAD, *(_row(move, found.share) for move in sweep.moves)])
    if found.promise is not None and sweep.design is not None:
        before, after = found.promise.margins, sweep.design.margins
        if isinstance(before, Margins) and isinstance(after, Margins):
            made.append([("margin", "model", "sweep"), *_margins(before, after)])
    return made


def _margins(before: Margins, after: Margins) -> Iterator[tuple[str, ...]]:
    """Each margin of the loop with the model, and with the plant of the sweep."""

    def row(name: str, *values: float) -> tuple[str, ...]:
        return name, *("any" if isinf(value) else f"{value:.4g}" for value in values)

    yield row("modulus margin", before.modulus.value, after.modulus.value)
    yield row("least gain factor", before.gain_down.value, after.gain_down.value)
    yield row("greatest gain factor", before.gain_up.value, after.gain_up.value)
    yield row("phase margin [deg]", before.phase_deg.value, after.phase_deg.value)
    yield row("least true dead time [s]", before.delay_least_s.value, after.delay_least_s.value)
    yield row("greatest true dead time [s]", before.delay_greatest_s.value, after.delay_greatest_s.value)


def _row(move: Move, share: float) -> tuple[str, ...]:
    value = move.parameter.value
    moved = relative(move.share) if value else f"{1e3 * move.value:+.2g} ms"
    errors = "other sign" if move.errors == inf else f"{move.errors:+.2f}"
    mark = " MOVED" if move.chance < share else ""
    return move.parameter.label, f"{value:.5g}", f"{move.value:.5g}", moved, errors + mark, found_from(move)


def _columns(table: Sequence[Sequence[str]]) -> list[str]:
    widths = [max(map(len, column)) for column in zip(*table, strict=True)]
    return [
        "  " + "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip() for row in table
    ]
