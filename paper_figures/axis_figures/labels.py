"""What the figures of an axis share: the words for its anti-windups and their lines, and labels with units."""

from __future__ import annotations

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
