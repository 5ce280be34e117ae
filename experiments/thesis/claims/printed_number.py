"""A number as the thesis prints it: its value, half a unit of its last digit, and how it may stand in LaTeX."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from decimal import Decimal, InvalidOperation
from fractions import Fraction

from identification.base.errors import InputError, shown


@dataclass(frozen=True)
class PrintedNumber:
    """A printed number.

    Parameters
    ----------
    value
        In its own unit.
    half_unit
        Half a unit of the last printed digit, in the same unit; 0 for a number that is printed exactly.
    """

    value: float
    half_unit: float


# "the output signal has no overshoot", "minimum degree of Q(s) as two"; a statement is printed as true
WORDS = {"no": PrintedNumber(0.0, 0.5), "two": PrintedNumber(2.0, 0.0), "true": PrintedNumber(1.0, 0.0)}


def read_number(text: str) -> PrintedNumber:
    """Read a printed number.

    Parameters
    ----------
    text
        A decimal number (``3.062e4``), a fraction of integers (``1/40``, exact), one of pi (``pi/2``, exact), a range
        (``0..1``, whose half unit is half its width) or a word of :data:`WORDS`.

    Raises
    ------
    InputError
        The text is none of these.
    """
    if text in WORDS:
        return WORDS[text]
    try:
        if ".." in text:
            low, high = map(float, text.split(".."))
            return PrintedNumber((low + high) / 2, (high - low) / 2)
        if text.startswith("pi/"):
            return PrintedNumber(math.pi / int(text[3:]), 0.0)
        if "/" in text:
            return PrintedNumber(float(Fraction(text)), 0.0)
        number = Decimal(text)
    except (InvalidOperation, ValueError, ZeroDivisionError):
        number = Decimal("NaN")
    exponent = number.as_tuple().exponent
    if not isinstance(exponent, int):  # NaN and infinities have a letter there
        raise InputError(f"{shown(text)} is not a number; expected one like 3.062e4, 1/40, pi/2 or 0..1")
    return PrintedNumber(float(number), float(Decimal(5).scaleb(exponent - 1)))


def patterns(text: str) -> list[str]:
    r"""How a ledger's number may stand in LaTeX, its sign apart, as regular expressions.

    ``3.062e4`` is 3.062 \times 10^4, ``1/40`` also \frac{1}{40}, ``pi/2`` is \pi/2, a range is its two ends. A word
    stands as itself, and ``true`` nowhere.
    """
    if text in WORDS:
        return [] if text == "true" else [rf"\b{text}\b"]
    if ".." in text:
        return [pattern for end in text.split("..") for pattern in patterns(end)]
    if text.startswith("pi/"):
        return [r"\\pi/" + text[3:]]
    text = text.removeprefix("-")
    if "/" in text:
        up, down = text.split("/")
        return [rf"(?<![\d.])(?:{up}/{down}|\\frac\{{{up}\}}\{{{down}\}})(?!\d|\.\d)"]
    mantissa, _, exponent = text.partition("e")
    power = rf"\s*\\times\s*10\^(?:\{{{exponent}\}}|{exponent})" if exponent else ""
    return [rf"(?<![\d.]){re.escape(mantissa)}{power}(?!\d|\.\d)"]
