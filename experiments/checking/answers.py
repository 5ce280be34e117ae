"""What a check found -> an answer to each question about each sweep: whether it holds, and a sentence."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from enum import Enum
from math import inf, pi

from design.stability.margins import Margins
from experiments.checking.check_model import ModelCheck, SweepCheck
from experiments.checking.design_on_plant import OnPlant, Promise
from experiments.checking.parameter_moves import Move, tests_differ
from experiments.checking.within_bound import Reach
from experiments.runs.words import sector_text
from identification.base.digits import told_apart
from identification.model.parameter import Parameter

ROUNDING = 1e-6  # relative, by which a distance, a margin or a sector may differ for rounding
NAMED = 3  # parameters that a sentence names


class Outcome(Enum):
    """Of a question; its value is the word for it."""

    HOLDS = "holds"
    OUTSIDE = "OUTSIDE"
    MOVED = "MOVED"
    LOST = "LOST"
    OPEN = "unknown"

    @property
    def fails(self) -> bool:
        """Whether a check fails by it."""
        return self in (Outcome.OUTSIDE, Outcome.MOVED, Outcome.LOST)


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
        Whether it holds; ``OUTSIDE`` of a sweep that leaves W_a where nothing shows that the plant moved, ``MOVED`` of
        W_a and of parameters where that is shown, ``LOST`` of margins and of a guarantee.
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


def fails(given: Sequence[Answer]) -> bool:
    """Whether anything does not hold."""
    return any(each.outcome.fails for each in given)


def answers_of_sweep(found: ModelCheck, sweep: SweepCheck) -> Iterator[Answer]:
    """The answers about one sweep."""

    def answer(question: str, outcome: Outcome, sentence: str) -> Answer:
        return Answer(sweep.name, question, outcome, sentence)

    if sweep.at_lines is None or sweep.between_lines is None or sweep.beyond_fit is None:
        nowhere = f"no plant of the model's structure is near the sweep ({sweep.sweep})"
        yield answer("within W_a", Outcome.MOVED, nowhere)
        rest = ("parameters", "margins", "guarantee") if found.promise else ("parameters",)
        yield from (answer(question, Outcome.OPEN, "no plant was fitted to the sweep") for question in rest)
        return
    parameters = _parameters(found, sweep)
    bound = _bound(found, (sweep.at_lines, sweep.between_lines), sweep.beyond_fit, parameters[0])
    yield answer("within W_a", *bound)
    yield answer("parameters", *parameters)
    if found.promise is not None and sweep.design is not None:
        yield answer("margins", *_margins(found.promise, sweep.design, bound[0] is Outcome.HOLDS))
        yield answer("guarantee", *_guarantee(found.promise, sweep.design))


def _bound(found: ModelCheck, looked: Sequence[Reach], beyond_fit: Reach, parameters: Outcome) -> tuple[Outcome, str]:
    worst, share = min(looked, key=lambda reach: (reach.chance, -reach.ratio)), found.share / len(looked)
    where = _hertz(worst.omega)
    if abs(worst.ratio - 1) <= ROUNDING:
        return Outcome.HOLDS, f"the sweep lies within W_a, which it touches at {where}"
    if worst.ratio < 1:
        ratio, _ = told_apart(worst.ratio, 1.0, 2, _digits)
        return (
            Outcome.HOLDS,
            f"the sweep lies within W_a: its distance from the model is at most {ratio} of W_a, at {where}",
        )
    record = found.model.fit
    if worst.chance >= share:
        return (
            Outcome.HOLDS,
            f"the sweep leaves W_a at {where} by no more than its noise explains: {_apart(found, worst)}",
        )
    left = f"the sweep leaves W_a at {where} by more than its noise explains: {_apart(found, worst)}"
    if record is None:
        return (
            Outcome.OUTSIDE,
            f"{left}; the model has no record of its tests, which could show whether the plant moved",
        )
    if not tests_differ(record) or parameters is Outcome.MOVED:
        return Outcome.MOVED, left
    if beyond_fit.chance < share:
        line = f"no plant with the model's structure meets the line at {_hertz(beyond_fit.omega)}"
        return Outcome.MOVED, f"{left}; {line}"
    many = f"the model's own {len(record.tests)} tests differ by more than noise"
    if parameters is Outcome.OPEN:
        return Outcome.OUTSIDE, f"{left}; {many}, too much to show whether the plant moved"
    return (
        Outcome.OUTSIDE,
        f"{left}; {many}, and another test of the same plant may differ as much: nothing shows that the plant moved",
    )


def _apart(found: ModelCheck, worst: Reach) -> str:
    unit = f" {found.model.signals.gain_unit}".rstrip()
    distance, bound = _told(worst.distance, worst.bound, lambda value, digits: f"{value:.{digits}g}{unit}")
    return f"it is {distance} from the model there, and W_a is {bound}"


def _hertz(omega: float) -> str:
    return f"{omega / (2 * pi):.4g} Hz"


def _digits(value: float, digits: int) -> str:
    return f"{value:.{digits}g}"


def _told(new: float, old: float, said: Callable[[float, int], str]) -> tuple[str, str]:
    """Two numbers in three digits, or in as many more as tell them apart where they differ by more than rounding."""
    return told_apart(old if abs(new - old) <= ROUNDING * abs(old) else new, old, 3, said)


def _parameters(found: ModelCheck, sweep: SweepCheck) -> tuple[Outcome, str]:
    share, record = found.share, found.model.fit
    if sweep.moves is None or record is None:
        return Outcome.OPEN, "the model does not say how sure its parameters are, so that only W_a was compared"
    largest = sorted(sweep.moves, key=lambda move: (move.chance, -abs(move.errors)))
    moved = [move for move in largest if move.chance < share]
    untold = sum(not move.could_be_told for move in sweep.moves)
    new = ""
    if sweep.new_at is not None:
        new = f"the sweep shows dynamics that the model's structure lacks, near {_hertz(sweep.new_at)}"
    if moved:
        words = ", ".join([f"{named(moved[0].parameter)} moved {_by(moved[0])}", *map(_also, moved[1:NAMED])])
        words += f", and {len(moved) - NAMED} more" if len(moved) > NAMED else ""
        return Outcome.MOVED, "; ".join([words, *([new] if new else [])])
    if untold == len(sweep.moves) and not new:
        return (
            Outcome.OPEN,
            "the model's tests differ too much, or the sweep is too noisy, to detect a move of any parameter",
        )
    first, open_moves = largest[0], [move for move in largest if move.is_open]
    if open_moves and not new:
        words = ", ".join(
            f"{named(move.parameter)} differs {_by(move)}, and {_least(move)}" for move in open_moves[:NAMED]
        )
        tests = f"{len(record.tests)} test{'s are' if len(record.tests) > 1 else ' is'}"
        return Outcome.OPEN, f"{tests} too few to show whether a parameter moved: {words}"
    none = "no parameter moved by more than chance"
    none += f"; {named(first.parameter)}, which differs {_by(first)}, comes nearest to a move"
    none += f" ({_least(first)})" if first.could_be_told else ""
    rest = [f"no move of {untold} of the {len(sweep.moves)} parameters can be detected"] if untold else []
    return Outcome.MOVED if new else Outcome.HOLDS, "; ".join([*([new] if new else []), none, *rest])


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
    return f"{how} ({f'{errors:.3g}' if errors < 1000 else f'{errors:.0f}'} standard errors)"


def relative(share: float) -> str:
    """A share in percent with its sign, in two digits or in whole numbers."""
    percent = 100 * share
    return f"{percent:+.2g} %" if abs(percent) < 99.5 else f"{percent:+.0f} %"


def found_from(move: Move) -> str:
    """The least move that would have been found."""
    if not move.parameter.value:
        return f"{1e3 * move.found_from:.2g} ms"
    return relative(move.found_from)[1:] if move.could_be_told else "never"


def _least(move: Move) -> str:
    if not move.could_be_told:
        return "no move of it can be detected"
    return f"only a move of {found_from(move)} or more can be detected"


def _also(move: Move) -> str:
    return f"{named(move.parameter)} {_by(move)}"


def _margins(promised: Promise, on_plant: OnPlant, is_within: bool) -> tuple[Outcome, str]:
    before, after = promised.margins, on_plant.margins
    if not isinstance(before, Margins):
        return Outcome.OPEN, f"the design has no margins with its own model: {before}"
    if not isinstance(after, Margins):
        return Outcome.LOST, f"the loop is NOT stable with the new plant ({after})"
    new, old = _digits(after.modulus.value, 3), _digits(before.modulus.value, 3)
    to_whom = "to every plant within W_a" + ("" if is_within else ", which this one is not")
    if after.modulus.value < (1 - ROUNDING) * promised.modulus:
        new, least = _told(after.modulus.value, promised.modulus, _digits)
        least = f"less than the {least} that the design promises {to_whom}"
        return Outcome.LOST, f"the loop is stable, but its modulus margin is {new}, {least}; with the model it is {old}"
    said = f"its modulus margin is {new}, {'as with the model' if new == old else f'and {old} with the model'}"
    robust = f"|W_a C S| reaches {before.W_a_C_S.value:.3g}, so the design promises no margin within W_a"
    if promised.modulus:
        robust = f"the design promises at least {promised.modulus:.3g} {to_whom}"
    return Outcome.HOLDS, f"the loop is stable, and {said}; {robust}"


def _guarantee(promised: Promise, on_plant: OnPlant) -> tuple[Outcome, str]:
    if promised.missing:
        return Outcome.OPEN, f"the design guarantees nothing: {promised.missing}"
    if on_plant.sector is None:
        return Outcome.LOST, "an unstable loop has no guarantee"
    found, asked = _told(on_plant.sector, promised.sector, sector_text)
    if on_plant.sector < (1 - ROUNDING) * promised.sector:
        lost = f"the circle criterion gives the sector {found}, less than the {asked} that is promised"
        if promised.sector >= 1:
            lost = f"it is NOT guaranteed that windup ends whatever the control: {lost}"
        return Outcome.LOST, f"with the new plant {lost}"
    if promised.sector >= 1:
        return Outcome.HOLDS, "windup ends whatever the control with the new plant too (found on a grid, not proved)"
    given = f"the circle criterion gives the sector {found} with the new plant (found on a grid, not proved)"
    return Outcome.HOLDS, f"{given}, and {asked} is promised"
