"""A number as the thesis prints it: its value, and half a unit of its last printed digit."""

from __future__ import annotations

from dataclasses import dataclass
from decimal import Decimal, InvalidOperation
from fractions import Fraction

from identification.files import InputError

WORDS = {"no": "0"}  # "the output signal has no overshoot"


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


def read_number(text: str) -> PrintedNumber:
    """Read a decimal number (``3.062e4``), a fraction of integers (``1/40``, exact) or a word of :data:`WORDS`.

    Raises
    ------
    InputError
        The text is none of these.
    """
    text = WORDS.get(text, text)
    try:
        if "/" in text:
            return PrintedNumber(float(Fraction(text)), 0.0)
        number = Decimal(text)
    except (InvalidOperation, ValueError, ZeroDivisionError):
        number = Decimal("NaN")
    exponent = number.as_tuple().exponent
    if not isinstance(exponent, int):  # NaN and infinities have a letter there
        raise InputError(f"{text!r} is not a number; expected one like 3.062e4 or 1/40")
    return PrintedNumber(float(number), float(Decimal(5).scaleb(exponent - 1)))
