"""What the sliders of the page say, and how the page's address spells it."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from urllib.parse import urlencode

from design.choices import GUARANTEES
from design.design_file import Design
from design.parameters import ExtendedParameters
from experiments.runs.against_none import ROOM
from experiments.runs.references import Reference
from identification.base.errors import InputError, shown

Numbers = dict[str, tuple[float, ...]]
"""The numbers of a state by the names that the address has: those of the commands' options, where there is one."""

POSITIVE, NOT_NEGATIVE = (math.ulp(0.0), "a positive number"), (0.0, "zero or a positive number")
ALLOWED = dict.fromkeys(("a", "recovery", "gain", "mode-frequency"), POSITIVE)
ALLOWED |= dict.fromkeys(("reference-omega", "dead-time"), NOT_NEGATIVE)
"""The least that a number of a name may be, and how a sentence says so; others may be any finite number."""
GUARANTEE = "guarantee"


@dataclass(frozen=True)
class Choices:
    """What a change of designs the controller or its anti-windup anew.

    Parameters
    ----------
    reference_omegas
        In rad/s; 0 is a constant, and stays one.
    a
        Pole of the free part in rad/s; None in chapter 2, which has none.
    recovery_s
        Most time in seconds for the slowest mode of theta1~ to fall to 1 %.
    guarantee
        One of :data:`design.choices.GUARANTEES`.
    """

    reference_omegas: tuple[float, ...]
    a: float | None
    recovery_s: float
    guarantee: str


@dataclass(frozen=True)
class TruePlant:
    """How the true plant differs from the design's model.

    Parameters
    ----------
    gain, mode_frequency
        Factors of the gain, and of the frequencies of all modes, resonances and anti-resonances.
    delay_s
        Its dead time in seconds.
    """

    gain: float
    mode_frequency: float
    delay_s: float


@dataclass(frozen=True)
class State:
    """Everything that the page can be asked for.

    Parameters
    ----------
    choices, true
        Of the design, and of the true plant.
    limits
        (lower, upper) of the actuator, in the unit of the plant's input.
    amplitudes, phases_rad, offset
        Of the reference; of the first two one for each of its frequencies, in the output's unit and in radians.

    Raises
    ------
    InputError
        A number is not finite or out of its range, or the limits are not in order.
    """

    choices: Choices
    true: TruePlant
    limits: tuple[float, float]
    amplitudes: tuple[float, ...]
    phases_rad: tuple[float, ...]
    offset: float

    def __post_init__(self) -> None:
        for name, values in self.numbers.items():
            for value in values:
                least, expected = ALLOWED.get(name, (-math.inf, "a finite number"))
                if not (math.isfinite(value) and value >= least):
                    raise InputError(f"{name} is {value:g}; expected {expected}")
        low, high = self.limits
        if not low < high:
            raise InputError(f"the limits are {low:.12g} and {high:.12g}; expected the lower one first")
        if self.choices.guarantee not in GUARANTEES:
            found = shown(self.choices.guarantee)
            raise InputError(f"{GUARANTEE} is {found}; expected one of {', '.join(GUARANTEES)}")

    @property
    def numbers(self) -> Numbers:
        """All numbers of the state by their names."""
        choices, true = self.choices, self.true
        return {
            "limit": self.limits,
            "amplitude": self.amplitudes,
            "phase": self.phases_rad,
            "offset": (self.offset,),
            "reference-omega": choices.reference_omegas,
            "a": () if choices.a is None else (choices.a,),
            "recovery": (choices.recovery_s,),
            "gain": (true.gain,),
            "mode-frequency": (true.mode_frequency,),
            "dead-time": (true.delay_s,),
        }

    @property
    def reference(self) -> Reference:
        """r(t)."""
        return Reference(self.amplitudes, self.choices.reference_omegas, self.phases_rad, self.offset)

    @property
    def query(self) -> str:
        """The state as the part of an address behind its question mark, each number to its last digit."""
        words = [(name, repr(float(value))) for name, values in self.numbers.items() for value in values]
        return urlencode([*words, (GUARANTEE, self.choices.guarantee)])

    def changed(self, numbers: Mapping[str, Sequence[float]], guarantee: str | None = None) -> State:
        """The state with other numbers of these names; raises InputError as the class does."""
        every = self.numbers | {name: tuple(values) for name, values in numbers.items()}
        low, high = every["limit"]
        a = every["a"][0] if every["a"] else None
        recovery_s, gain, mode_frequency, delay_s = (
            every[name][0] for name in ("recovery", "gain", "mode-frequency", "dead-time")
        )
        choices = Choices(every["reference-omega"], a, recovery_s, guarantee or self.choices.guarantee)
        true = TruePlant(gain, mode_frequency, delay_s)
        return State(choices, true, (low, high), every["amplitude"], every["phase"], *every["offset"])


def start_of(design: Design, limits: tuple[float, float] | None = None, reference: Reference | None = None) -> State:
    """The state that a page begins with: the design as it is, and its own model as the true plant.

    Parameters
    ----------
    design
        Of either kind.
    limits
        Unless given, +-1.2 times the most that the control of perfect tracking reaches; +-1 where that needs none.
    reference
        Of the frequencies of the design. Unless given, sinusoids of amplitude 1, all at their crests as the run begins:
        a start that saturates most loops.

    Raises
    ------
    InputError
        See :class:`State`.
    """
    omegas, parameters = design.reference_omegas, design.parameters
    r = reference or Reference((1.0,) * len(omegas), omegas, (math.pi / 2,) * len(omegas), 0.0)
    if limits is None:
        needed = r.required(design.loop_plant).at_most
        most = ROOM * needed if 0 < needed < math.inf else 1.0
        limits = -most, most
    a = parameters.a if isinstance(parameters, ExtendedParameters) else None
    choices = Choices(omegas, a, design.corrected.judgement.recovery_s, design.corrected.guarantee)
    true = TruePlant(1.0, 1.0, design.loop_plant.delay_s)
    return State(choices, true, limits, r.amplitudes, r.phases_rad, r.offset)


def from_words(words: Mapping[str, Sequence[str]], start: State) -> State:
    """The state that an address asks for.

    Parameters
    ----------
    words
        The values of each name of :attr:`State.query`, as an address has them.
    start
        What the address leaves out is as here.

    Raises
    ------
    InputError
        A name is unknown, there are more or fewer values of one than of the start, one is no number, or see
        :class:`State`.
    """
    known, numbers = start.numbers, {}
    guarantee = start.choices.guarantee
    for name, given in words.items():
        count = 1 if name == GUARANTEE else len(known.get(name, ()))
        if not count:
            raise InputError(f"the address has {shown(name)}; expected {', '.join(known)} or {GUARANTEE}")
        if len(given) != count:
            raise InputError(f"the address has {name} {len(given)} times; expected {count} times")
        if name == GUARANTEE:
            guarantee = given[0]
            continue
        try:
            numbers[name] = [float(word) for word in given]
        except ValueError:
            raise InputError(f"the address has {name} = {shown(', '.join(given))}; expected numbers") from None
    return start.changed(numbers, guarantee)
