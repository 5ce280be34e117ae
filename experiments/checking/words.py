"""What a check found, in words: first what to do, then each answer, then the parameters in a table."""

from __future__ import annotations

from collections.abc import Sequence
from math import inf, pi

from experiments.checking.answers import Answer, Outcome, answers
from experiments.checking.check_model import ModelCheck, SweepCheck
from experiments.checking.parameter_moves import Move

HEAD = ("parameter", "model", "sweep", "moved", "standard errors", "found from")


def first_sentence(found: ModelCheck) -> str:
    """What to do and why, in one sentence without its full stop."""
    given = answers(found)
    moved = [each for each in given if each.outcome is Outcome.MOVED]
    several = len(found.sweeps) > 1
    if not moved:
        held = {each.question for each in given if each.outcome is Outcome.HOLDS}
        said = "every sweep lies within W_a" if several else "the sweep lies within W_a"
        parts = [said, *(["no parameter moved"] if "parameters" in held else [])]
        return f"Nothing to do: {', '.join([*parts, *_design_keeps(held)])}"
    first = {each.question: each for each in reversed(moved)}  # of each question that of the first sweep
    reasons = [f"{each.sentence}{f' ({each.sweep})' if several else ''}" for each in moved if each is first[each.question]]
    stable = not any("NOT stable" in each.sentence for each in moved)
    keeps = {each.question for each in given if each.question not in first and each.outcome is Outcome.HOLDS}
    reasons += _design_keeps(keeps)
    if not stable:
        todo = "Do not run this design"
    elif first.keys() & {"margins", "guarantee"}:
        todo = "Fit a new model and design again"
    else:
        todo = "Fit a new model" if found.promise else "Fit a new model, and see --against what it means for a design"
    return f"{todo}: {'; '.join(reasons)}"


def _design_keeps(held: set[str]) -> list[str]:
    kept = [f"its {question}" for question in ("margins", "guarantee") if question in held]
    return [f"the design keeps {' and '.join(kept)}"] if kept else []


def text(found: ModelCheck) -> str:
    """All that a check found, as a terminal shows it."""
    given = answers(found)
    lines = [first_sentence(found)]
    for sweep in found.sweeps:
        lines += ["", describe(sweep)]
        lines += [f"  {each.question:<12}{each.outcome.value:<10}{each.sentence}" for each in given if each.sweep == sweep.name]
        lines += _columns(rows(sweep.moves or (), found.share))
    return "\n".join(lines)


def describe(sweep: SweepCheck) -> str:
    """A sweep in a line: its name, and which lines of it were compared."""
    low, high = (f"{omega / (2 * pi):.4g}" for omega in sweep.band)
    return f"{sweep.name}: {sweep.lines} lines from {low} to {high} Hz"


def rows(moves: Sequence[Move], share: float) -> list[tuple[str, ...]]:
    """The table of the parameters, its head first; empty where none were compared."""
    if not moves:
        return []
    return [HEAD, *(_row(move, share) for move in moves)]


def _row(move: Move, share: float) -> tuple[str, ...]:
    value = move.parameter.value
    found_from = f"{1e3 * move.found_from:.2g} ms"
    if value:
        found_from = f"{100 * move.found_from:.2g} %" if move.found_from < 10 else "never"
    moved = f"{100 * move.share:+.2g} %" if value else f"{1e3 * move.value:+.2g} ms"
    errors = "other sign" if move.errors == inf else f"{move.errors:+.2f}"
    mark = " MOVED" if move.chance < share else ""
    return move.parameter.label, f"{value:.5g}", f"{move.value:.5g}", moved, errors + mark, found_from


def _columns(table: Sequence[Sequence[str]]) -> list[str]:
    if not table:
        return []
    widths = [max(map(len, column)) for column in zip(*table, strict=True)]
    return ["  " + "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip() for row in table]

