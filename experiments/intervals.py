"""What is known of a number."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Interval:
    """A number known to lie between ``lower`` and ``upper``."""

    lower: float
    upper: float
