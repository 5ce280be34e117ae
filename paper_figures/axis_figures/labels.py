"""What the figures of an axis share: the words for its anti-windups, for its limits, and values with their units."""

from __future__ import annotations

import pandas as pd

from paper_figures.look.captions import number, of_limits
from paper_figures.look.frequency_axis import plain

KINDS = {
    "none": "without anti-windup",
    "thesis": "second order, Eq. (2.23)",
    "corrected": "corrected",
    "back-calculation": "back-calculation",
    "conditioning": "conditioning",
    "observer": "observer",
    "internal-model": "internal model",
    "weston-postlethwaite": "Weston and Postlethwaite",
    "static": "static",
}
"""What the anti-windups are called."""

LOOKS = {
    "thesis": "thesis anti-windup",
    "corrected": "corrected anti-windup",
    "internal-model": "internal model",
    "weston-postlethwaite": "Weston and Postlethwaite",
}
"""The entries of ``style.LINES`` of those that have no entry by their words."""


def look_of(run: str) -> str:
    """The entry of ``style.LINES`` for the run of an anti-windup."""
    return LOOKS.get(run, KINDS.get(run, run))


def united(label: str, unit: str) -> str:
    """The label of an axis with the unit, where it is known."""
    return f"{label} [{plain(unit)}]" if unit else label


def with_unit(value: float, unit: str, digits: int = 3) -> str:
    """A value in words with its unit, where it is known."""
    return f"{number(value, digits)} {unit}".rstrip()


def limits_said(table: pd.DataFrame, unit: str) -> str:
    """The limits of a table in words: ``+-12 A`` or ``-3 to 12 A``."""
    return f"{of_limits(table)} {unit}".rstrip()
