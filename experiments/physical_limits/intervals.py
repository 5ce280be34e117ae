"""What is known of a number."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Interval:
    """A number known to lie between ``lower`` and ``upper``."""

    lower: float
    upper: float


def outward(lower: float, upper: float) -> Interval:
    """The interval of two ends, not negative, that still holds when both are rounded to 12 digits, as tables are."""
    return Interval(lower * (1 - 1e-11), upper * (1 + 1e-11))
