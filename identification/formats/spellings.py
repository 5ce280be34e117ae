"""What the columns of other tools are called, and which of ours each is."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, replace

from identification.formats.columns import FREQUENCIES, INPUTS, POLAR

WORDS = {  # of a quantity, whatever their case; a dot may follow
    "frequency": ("frequency", "freq", "f", "angular frequency", "omega", "w", "ω", "stimulus"),
    "magnitude": ("magnitude", "mag", "gain", "amplitude", "log mag", "lin mag", "abs"),
    "phase": ("phase", "angle", "ang", "arg", "phi"),
    "real": ("real", "real part", "re"),
    "imag": ("imag", "imaginary", "imaginary part", "im"),
    "coherence": ("coherence", "coh"),
    "time": ("time", "t"),
    "input": ("input",),
    "output": ("output",),
}
HERTZ = {"hz": 1.0, "khz": 1e3, "MHz": 1e6, "MHZ": 1e6, "ghz": 1e9, "mHz": 1e-3}
SECONDS = {"s": 1.0, "sec": 1.0, "second": 1.0, "seconds": 1.0, "ms": 1e-3, "us": 1e-6, "µs": 1e-6, "μs": 1e-6}
DEGREES, RADIANS = ("deg", "degree", "degrees", "°", "º"), ("rad", "radian", "radians")
UNITS = {  # of a quantity: which name of ours it makes, and how many of our unit it is
    "frequency": {unit: ("frequency_hz", size) for unit, size in HERTZ.items()}
    | dict.fromkeys(("rad/s", "rad/sec", "rad_s", "1/s"), ("omega", 1.0)),
    "magnitude": {"db": ("magnitude_db", 1.0)} | dict.fromkeys(("abs", "lin", "linear", "u"), ("magnitude", 1.0)),
    "phase": dict.fromkeys(DEGREES, ("phase_deg", 1.0)) | dict.fromkeys(RADIANS, ("phase_rad", 1.0)),
    "time": {unit: ("time_s", size) for unit, size in SECONDS.items()},
}
UNITLESS = {"real": "real", "imag": "imag", "coherence": "coherence", "output": "output"}  # any unit or none
LINEAR = ("abs", "lin mag")
OPEN = {  # what a name without a unit may mean
    "frequency": FREQUENCIES,
    "magnitude": POLAR[0],
    "phase": POLAR[1],
    "time": ("time_s",),
    "input": INPUTS,
}
PARTS = {"real": "real", "imag": "imag", "db": "magnitude_db", "deg": "phase_deg"}  # S21(REAL)
PREFIXES = {"re": "real", "im": "imag", "db": "magnitude_db", "mag": "magnitude", "ang": "phase_deg"}  # re:Trc1

_WORD = {word: quantity for quantity, words in WORDS.items() for word in words}
_NAME = re.compile(rf"(?:(.*?)[\s:_]+)??({'|'.join(sorted(map(re.escape, _WORD), key=len, reverse=True))})\.?")
_BRACKETED = re.compile(r"(.*?)\s*[(\[{]([^()\[\]{}]*)[)\]}]")
_AFTER = re.compile(r"(.+?)(?:\s*/\s*|\s*,\s*|\s+in\s+|[\s_]+)(\S+)")
_FUNCTION = re.compile(r"(re|real|im|imag|abs|arg|phi)\s*[({](.*?)[)}]\s*(?:[(\[](.*?)[)\]])?", re.IGNORECASE)
_PARAMETER = re.compile(r"([SA]\d+)\s*\((\w+)\)", re.IGNORECASE)
_PREFIXED = re.compile(r"(re|im|db|mag|ang)(?::|(?=Trc|Mem))(\S+)")
_TRACE = re.compile(r"trace \d+:?\s*")


@dataclass(frozen=True)
class Spelling:
    """What a header says.

    Parameters
    ----------
    label
        Of which response, where a file holds several, such as ``ch1``; else empty.
    ours
        The name of ours, or None where the header lacks the unit.
    factor
        How many of our unit one of the file's is.
    may_be
        The names of ours among which the unit would decide.
    """

    label: str
    ours: str | None
    factor: float = 1.0
    may_be: tuple[str, ...] = ()


def spelt(name: str) -> Spelling | None:
    """What a column's name means, or None; the table of what is read, and from where, is in docs/how_to/files.md."""
    if found := _PREFIXED.fullmatch(name):
        return Spelling(found[2], PREFIXES[found[1]])
    if (found := _PARAMETER.fullmatch(name)) and found[2].lower() in PARTS:
        return Spelling(found[1].lower(), PARTS[found[2].lower()])
    for pattern in (_BRACKETED, _AFTER):
        if (parts := pattern.fullmatch(name)) and (said := _said(parts[1], parts[2])) and said.ours:
            return said
    if (found := _FUNCTION.fullmatch(name)) and (said := _said(found[1], found[3] or "")):
        return replace(said, label=found[2].lower())
    return _said(name, "")


def factor_of(name: str, ours: str) -> float:
    """How many of our unit one of the unit is that a column's name gives, where ``ours`` is what it stands for."""
    units = [parts[2] for pattern in (_BRACKETED, _AFTER) if (parts := pattern.fullmatch(name))]
    return next((factor for unit in units if (factor := size_of(unit, ours)) is not None), 1.0)


def size_of(unit: str, ours: str) -> float | None:
    """How many of the unit of a name of ours a unit is, or None where it is none of that name."""
    known = [found for units in UNITS.values() if (found := _of_unit(units, unit)) and found[0] == ours]
    return known[0][1] if known else None


def _said(text: str, unit: str) -> Spelling | None:
    """What a name and its unit say together; a unit alone tells a frequency or a time."""
    if not text:
        alone = _of_unit(UNITS["frequency"] | UNITS["time"], unit)
        return Spelling("", *alone) if alone else None
    if not (found := _NAME.fullmatch(text.strip().casefold())):
        return None
    label, quantity = _TRACE.sub("", found[1] or ""), _WORD[found[2]]
    if label and quantity in ("frequency", "time", "input", "output"):
        return None
    if quantity in UNITLESS:
        return Spelling(label, UNITLESS[quantity])
    if found[2] in LINEAR or (quantity == "magnitude" and "/" in unit):
        return Spelling(label, "magnitude")
    known = _of_unit(UNITS.get(quantity, {}), unit)
    return Spelling(label, *known) if known else Spelling(label, None, may_be=OPEN[quantity])


def _of_unit(units: Mapping[str, tuple[str, float]], unit: str) -> tuple[str, float] | None:
    """What a unit is, in its own case where that matters (MHz, mHz), and else in any."""
    return units.get(unit.strip(), units.get(unit.strip().lower()))
