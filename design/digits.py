"""A bound in so many significant digits, rounded to the side on which it stays a bound."""

from __future__ import annotations

from decimal import ROUND_CEILING, ROUND_FLOOR, Context


def lower_end(value: float, digits: int) -> str:
    """The greatest number of so many digits that, read as a double, is not above the value."""
    return _rounded(value, digits, ROUND_FLOOR)


def upper_end(value: float, digits: int) -> str:
    """The least number of so many digits that, read as a double, is not below the value."""
    return _rounded(value, digits, ROUND_CEILING)


def _rounded(value: float, digits: int, rounding: str) -> str:
    return f"{float(Context(prec=digits, rounding=rounding).create_decimal(repr(float(value)))):.{digits}g}"
