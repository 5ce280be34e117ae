"""What a check found -> an answer to each question about each sweep: whether it holds, and a sentence."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from enum import Enum
from math import inf, pi

from design.stability.margins import Margins
from experiments.checking.check_model import ModelCheck, SweepCheck
from experiments.checking.design_on_plant import OnPlant, Promise
from experiments.checking.parameter_moves import Move
from experiments.checking.within_bound import Reach
from experiments.runs.guarantee import sector_text
from identification.base.digits import told_apart
from identification.model.parameter import Parameter

LOST = 1e-6  # relative, by which a margin or a sector may be less for rounding
NAMED = 3  # parameters that a sentence names


class Outcome(Enum):
    """Of a question; its value is the word for it."""

    HOLDS = "holds"
    MOVED = "MOVED"
    OPEN = "not told"


@dataclass(frozen=True)
class Answer:
    """To one question about one sweep.

    Parameters
    ----------
    sweep
        Its name.
    question
        ``within W_a``, ``parameters``, ``margins`` or ``guarantee``.
    outcome
        Whether it holds.
    sentence
        What was found, without a full stop.
    """

    sweep: str
    question: str
    outcome: Outcome
    sentence: str


def answers(found: ModelCheck) -> tuple[Answer, ...]:
    """The answers, sweep by sweep."""
    return tuple(each for sweep in found.sweeps for each in answers_of_sweep(found, sweep))


def has_moved(given: Sequence[Answer]) -> bool:
    """Whether anything did."""
    return any(each.outcome is Outcome.MOVED for each in given)


def answers_of_sweep(found: ModelCheck, sweep: SweepCheck) -> Iterator[Answer]:
    """The answers about one sweep."""

    def answer(question: str, outcome: Outcome, sentence: str) -> Answer:
        return Answer(sweep.name, question, outcome, sentence)

    if sweep.at_lines is None or sweep.between_lines is None:
        nowhere = f"no plant of the model's structure is near the sweep ({sweep.sweep})"
        yield answer("within W_a", Outcome.MOVED, nowhere)
        rest = ("parameters", "margins", "guarantee") if found.promise else ("parameters",)
        yield from (answer(question, Outcome.OPEN, "no plant was fitted to the sweep") for question in rest)
        return
    bound = _bound(found, (sweep.at_lines, sweep.between_lines))
    yield answer("within W_a", *bound)
    yield answer("parameters", *_parameters(sweep, found.share))
    if found.promise is not None and sweep.design is not None:
        yield answer("margins", *_margins(found.promise, sweep.design, bound[0] is Outcome.HOLDS))
        yield answer("guarantee", *_guarantee(found.promise, sweep.design))


def _bound(found: ModelCheck, looked: Sequence[Reach]) -> tuple[Outcome, str]:
    worst = min(looked, key=lambda reach: (reach.chance, -reach.ratio))
    unit = f" {found.model.signals.gain_unit}".rstrip()
    distance, bound = told_apart(worst.distance, worst.bound, 3, lambda value, digits: f"{value:.{digits}g}{unit}")
    where = f"at {worst.omega / (2 * pi):.4g} Hz"
    if worst.chance < found.share / len(looked):
        return Outcome.MOVED, f"the sweep leaves W_a {where}: it is {distance} from the model, where W_a is {bound}"
    if worst.distance > worst.bound:
        said = f"it is {distance} from the model {where}, where W_a is {bound}, and its noise explains the difference"
        return Outcome.HOLDS, f"the sweep lies within W_a: {said}"
    return (
        Outcome.HOLDS,
        f"the sweep lies within W_a: its distance from the model is at most {worst.ratio:.2g} of W_a, {where}",
    )


def _parameters(sweep: SweepCheck, share: float) -> tuple[Outcome, str]:
    if sweep.moves is None:
        return Outcome.OPEN, "the model does not say how sure its parameters are, so that only W_a was compared"
    largest = sorted(sweep.moves, key=lambda move: move.chance)
    moved = [move for move in largest if move.chance < share]
    untold = sum(not move.could_be_told for move in sweep.moves)
    new = ""
    if sweep.new_at is not None:
        new = f"; the sweep shows what the model's structure does not have, near {sweep.new_at / (2 * pi):.4g} Hz"
    if moved:
        words = ", ".join([f"{named(moved[0].parameter)} moved {_by(moved[0])}", *map(_also, moved[1:NAMED])])
        return Outcome.MOVED, words + (f", and {len(moved) - NAMED} more" if len(moved) > NAMED else "") + new
    if untold == len(sweep.moves) and not new:
        return Outcome.OPEN, "the model's tests differ too much, or the sweep is too noisy, to tell a move of any"
    rest = f"; of {untold} no move could be told" if untold else ""
    first = largest[0]
    none = f"none moved by more than chance; {_also(first)} comes nearest{rest}{new}"
    return Outcome.MOVED if new else Outcome.HOLDS, none


def named(parameter: Parameter) -> str:
    """A parameter in a sentence."""
    if parameter.quantity:
        quantity = {"omega": "frequency", "zeta": "damping"}[parameter.quantity]
        return f"the {quantity} of {parameter.kind} mode {parameter.index}"
    if parameter.kind in ("gain", "delay_s"):
        return {"gain": "the gain", "delay_s": "the dead time"}[parameter.kind]
    return f"{parameter.kind.replace('_', ' ')} {parameter.index}"


def _by(move: Move) -> str:
    """How far it moved, in percent and in standard errors."""
    if move.errors == inf:
        return "to the other sign"
    how = f"by {relative(move.share)}" if move.parameter.value else f"from 0 to {1e3 * move.value:.3g} ms"
    errors = abs(move.errors)
    return f"{how} ({errors:.{3 if errors < 1000 else 4}g} standard errors)"


def relative(share: float) -> str:
    """A share in percent with its sign, in two digits or in whole numbers."""
    percent = 100 * share
    return f"{percent:+.2g} %" if abs(percent) < 99.5 else f"{percent:+.0f} %"


def _also(move: Move) -> str:
    return f"{named(move.parameter)} {_by(move)}"


def _margins(promised: Promise, on_plant: OnPlant, is_within: bool) -> tuple[Outcome, str]:
    before, after = promised.margins, on_plant.margins
    if not isinstance(before, Margins):
        return Outcome.OPEN, f"the design has none with its own model: {before}"
    if not isinstance(after, Margins):
        return Outcome.MOVED, f"the loop is NOT stable with the new plant ({after})"
    new, old = told_apart(after.modulus.value, before.modulus.value, 3, lambda value, digits: f"{value:.{digits}g}")
    robust = f"|W_a C S| reaches {before.W_a_C_S.value:.3g} and promises nothing"
    if promised.modulus:
        robust = f"|W_a C S| leaves {promised.modulus:.3g} to every plant within W_a"
        robust += "" if is_within else ", and promises nothing to this one"
    said = f"the modulus margin is {new}, {old} with the model; {robust}"
    if after.modulus.value < (1 - LOST) * promised.modulus:
        return Outcome.MOVED, f"the loop is stable, but {said}"
    return Outcome.HOLDS, f"the loop is stable, and {said}"


def _guarantee(promised: Promise, on_plant: OnPlant) -> tuple[Outcome, str]:
    if promised.missing:
        return Outcome.OPEN, f"the design guarantees nothing: {promised.missing}"
    if on_plant.sector is None:
        return Outcome.MOVED, "nothing is guaranteed of a loop that is not stable"
    found, asked = told_apart(on_plant.sector, promised.sector, 3, sector_text)
    if on_plant.sector < (1 - LOST) * promised.sector:
        lost = f"the circle criterion gives the sector {found}, and {asked} is promised"
        if promised.sector >= 1:
            lost = f"it is NOT guaranteed that windup ends whatever the control: the circle criterion gives {found}"
        return Outcome.MOVED, f"with the new plant {lost}"
    if promised.sector >= 1:
        return Outcome.HOLDS, "windup ends whatever the control with the new plant too (found on a grid, not proved)"
    return Outcome.HOLDS, f"the circle criterion gives the sector {found} (on a grid, not proved), {asked} is promised"
