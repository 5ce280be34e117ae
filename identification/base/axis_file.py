"""axis.toml: what an engineer knows of an axis; its keys are the names of options of the commands."""

from __future__ import annotations

import json
import math
import textwrap
import tomllib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path
from typing import Any

from identification.base.errors import InputError, shown
from identification.base.files import read_text

WIDTH = 100  # of a comment, in characters
SINUSOIDS = ("amplitude", "phase", "offset", "slope")
"""The keys of a reference that is computed, beside its frequencies."""
SUPERSEDES = dict.fromkeys(SINUSOIDS, ("reference",)) | {
    "reference": SINUSOIDS,
    "reference-omega": ("reference-hz",),
}
"""Option -> the keys of a file that it takes the place of, beside its own."""


def _number(value: object) -> float | None:
    """The finite number that a value is, else None; true and false are none."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return None
    try:
        return float(value) if math.isfinite(value) else None
    except OverflowError:
        return None


def _numbers(value: object) -> tuple[float, ...] | None:
    found = [_number(each) for each in (value if isinstance(value, list | tuple) else [value])]
    numbers = tuple(each for each in found if each is not None)
    return numbers if len(numbers) == len(found) > 0 else None


def _frequencies(value: object) -> tuple[float, ...] | None:
    numbers = _numbers(value)
    return numbers if numbers and min(numbers) >= 0 and len(set(numbers)) == len(numbers) else None


def _limits(value: object) -> tuple[float, ...] | None:
    numbers = _numbers(value) or ()
    pair = (-numbers[0], numbers[0]) if len(numbers) == 1 else numbers
    return pair if len(pair) == 2 and pair[0] < pair[1] else None


def _positive(value: object) -> float | None:
    number = _number(value)
    return number if number is not None and number > 0 else None


def _size(value: object) -> float | None:
    number = _number(value)
    return number if number is not None and number >= 0 else None


def _text(value: object) -> str | None:
    return str(value) if isinstance(value, str | Path) and str(value) else None


READERS: Mapping[str, tuple[Callable[[object], Any], str]] = {
    "text": (_text, "text in quotes"),
    "number": (_number, "a finite number"),
    "positive": (_positive, "a positive finite number"),
    "size": (_size, "a finite number, 0 or more"),
    "numbers": (_numbers, "a finite number, or several as [1, 0.2]"),
    "frequencies": (_frequencies, "a frequency, 0 or more, or several that differ as [0.5, 2]"),
    "limits": (_limits, "[low, high] with low < high, or one positive number for both sides"),
}
"""Kind of a value -> what reads one, or gives None; and what is expected."""


@dataclass(frozen=True)
class Key:
    """A line of the file.

    Parameters
    ----------
    kind
        A name in :data:`READERS`, or words with ``|`` between, one of which it is.
    example
        A value as TOML has it.
    comment
        What it is and in which unit.
    """

    kind: str
    example: str
    comment: str

    def read(self, value: object, place: str) -> Any:
        """The value, a float, a tuple of floats or text; raises InputError, which begins with ``place``, if it is none.

        One number for the limits becomes a pair.
        """
        words = self.kind.split("|")
        read, expected = READERS.get(self.kind, (lambda word: word if word in words else None, f"one of {words}"))
        found = read(value)
        if found is None:
            seen = list(value) if isinstance(value, tuple) else value
            raise InputError(f"{place} is {shown(seen)}; expected {expected}")
        return found


KEYS = {
    "input-name": Key(
        "text", '"motor current"', "Name of the plant's input: the quantity that the drive is commanded."
    ),
    "input-unit": Key("text", '"A"', "Unit of the plant's input."),
    "output-name": Key("text", '"position"', "Name of the plant's output: the quantity that the sensor measures."),
    "output-unit": Key("text", '"mm"', "Unit of the plant's output."),
    "reference-hz": Key(
        "frequencies",
        "[0.5, 2]",
        "Frequencies in Hz that the output follows without steady error; 0 is a constant, as for a step.",
    ),
    "amplitude": Key(
        "numbers",
        "[1, 0.2]",
        "Amplitude of the reference at each of these frequencies, in the output's unit; at 0 its level.",
    ),
    "phase": Key(
        "numbers",
        "[0, 1.57]",
        "Phase at each of these frequencies, in radians: the reference is the sum of amplitude sin(omega t + phase).",
    ),
    "offset": Key("number", "0.0", "Constant that is added to the reference, in the output's unit. Default: 0."),
    "slope": Key("number", "0.1", "Slope of a ramp that is added to the reference, in the output's unit per second."),
    "reference": Key(
        "text",
        '"trajectory.csv"',
        "CSV file of the reference with the columns time_s and reference, instead of amplitude, phase, offset and "
        "slope. The path is relative to the folder of this file.",
    ),
    "limit": Key("limits", "[-10, 10]", "Lower and upper saturation limit of the actuator, in the input's unit."),
    "rate-limit": Key("positive", "2000", "Largest change of the actuator's output per second, in the input's unit."),
    "rate": Key("positive", "2000", "Sampling rate of the controller's computer in Hz."),
    "quantum": Key(
        "size", "0.005", "Distance between two levels of the actuator, in the input's unit; 0 for no levels."
    ),
    "robust-level": Key(
        "positive",
        "0.5",
        "The design keeps |W_a C S| at or below this level. Below 1 the loop is stable with every plant within the "
        "bound W_a that has as many poles in the right half plane.",
    ),
    "guarantee": Key(
        "global|robust|sector",
        '"robust"',
        "What the anti-windup guarantees. global: the windup ends for every control. robust: also for every plant "
        "within W_a. sector: up to a largest control.",
    ),
    "recovery": Key(
        "positive", "0.5", "The slowest mode of the anti-windup falls to 1 % within this time, in seconds."
    ),
}
"""Every key, in the order of the file."""

HEAD = """\
# An axis: a plant between its actuator and its sensor, and its task. You may leave out any line.
# With --axis and the name of this file, a command reads each line as the option of the same name. An option on the
# command line replaces the line."""


def read_axis(path: Path) -> dict[str, Any]:
    """Read an axis.toml.

    Returns
    -------
    dict
        Key -> value, see :meth:`Key.read`; ``reference`` as a path from the current folder.

    Raises
    ------
    InputError
        No such file, no TOML, an unknown key, a value of the wrong kind, or see :func:`require_consistent`.
    """
    try:
        content = tomllib.loads(read_text(path))
    except (tomllib.TOMLDecodeError, RecursionError, ValueError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(f"{path}: is not TOML ({error}); expected lines such as limit = [-10, 10]") from None
    found = {}
    for name, value in content.items():
        if name not in KEYS:
            close = get_close_matches(name, KEYS, 1)
            meant = f"did you mean {close[0]}?" if close else f"expected {', '.join(KEYS)}"
            raise InputError(f"{path}: {shown(name)} is not a key of an axis file; {meant}")
        found[name] = KEYS[name].read(value, f"{path}: {name}")
    if "reference" in found:
        found["reference"] = str(path.parent / found["reference"])
    require_consistent(found, f"{path}: ")
    return found


def require_consistent(values: Mapping[str, Any], place: str = "") -> None:
    """Refuse two references at once, and numbers of a reference that are not as many as its frequencies.

    Raises
    ------
    InputError
        The sentence begins with ``place``.
    """
    for name in SINUSOIDS:
        if name in values and "reference" in values:
            raise InputError(
                f"{place}both {name} and reference {shown(values['reference'])} are given; expected one of them"
            )
    counts = {name: len(values[name]) for name in ("reference-hz", "amplitude", "phase") if name in values}
    if len(set(counts.values())) > 1:
        said = ", ".join(f"{count} of {name}" for name, count in counts.items())
        raise InputError(f"{place}the counts differ: {said}; expected one value for each frequency")


def axis_text(values: Mapping[str, Any], notes: Mapping[str, str]) -> str:
    """The text of an axis.toml with a comment at every key.

    Parameters
    ----------
    values
        Key -> value, see :meth:`Key.read`. The other keys stand there as examples behind a #.
    notes
        Key -> what is said of its value in a comment of its own.
    """
    parts = [HEAD]
    for name, key in KEYS.items():
        comments = [key.comment] + ([notes[name]] if name in notes else [])
        lines = [line for text in comments for line in textwrap.wrap(text, WIDTH, break_on_hyphens=False)]
        value = f"{name} = {_toml(values[name])}" if name in values else f"# {name} = {key.example}"
        parts.append("\n".join([*(f"# {line}" for line in lines), value]))
    return "\n\n".join(parts) + "\n"


def _toml(value: object) -> str:
    if isinstance(value, tuple):
        return f"[{', '.join(map(repr, value))}]"
    if not isinstance(value, str):
        return repr(value)
    try:
        value.encode("utf-8")
    except UnicodeEncodeError:
        raise InputError(f"{shown(value)} is not UTF-8; expected a name that a TOML file can hold") from None
    return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
