"""Numbers in so many significant digits: bounds that stay bounds, and two numbers that are told apart."""

from __future__ import annotations

from collections.abc import Callable
from decimal import ROUND_CEILING, ROUND_FLOOR, Context

EXACT = 17  # digits, in which no two doubles are said alike
SHOWN = 0.05  # of a difference that is rounded away


def lower_end(value: float, digits: int) -> str:
    """The greatest number of so many digits that, read as a double, is not above the value."""
    return _rounded(value, digits, ROUND_FLOOR)


def upper_end(value: float, digits: int) -> str:
    """The least number of so many digits that, read as a double, is not below the value."""
    return _rounded(value, digits, ROUND_CEILING)


def told_apart(first: float, second: float, digits: int, said: Callable[[float, int], str]) -> tuple[str, str]:
    """Two numbers as ``said`` says them in ``digits`` significant digits, or in as many more as tell them apart."""
    while first != second and digits < EXACT and said(first, digits) == said(second, digits):
        digits += 1
    return said(first, digits), said(second, digits)


def _rounded(value: float, digits: int, rounding: str) -> str:
    return f"{float(Context(prec=digits, rounding=rounding).create_decimal(repr(float(value)))):.{digits}g}"


def percent(share: float) -> str:
    """A share in percent: two digits, or whole numbers from 100."""
    return f"{100 * share:.2g}" if share < 0.995 else f"{100 * share:.0f}"


def showing_difference(found: float, expected: float) -> tuple[str, str]:
    """Two numbers with ten digits, or with as many more as show by how much they differ."""
    apart = found - expected
    for count in range(10, EXACT + 1):
        texts = (f"{found:.{count}g}", f"{expected:.{count}g}")
        if abs(float(texts[0]) - float(texts[1]) - apart) <= SHOWN * abs(apart):
            break
    return texts
