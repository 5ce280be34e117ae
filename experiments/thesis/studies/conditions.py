"""The conditions of the thesis's runs: the limits that it prints or that its words imply, and the length of a run."""

from __future__ import annotations

from data.thesis import printed_numbers
from design.design_file import Design
from experiments.thesis.printed_choices import thesis_reference
from experiments.thesis.studies import chapter_2, chapter_4
from experiments.thesis.studies.desaturation import PERIODS

MULTIPLES = (0.8, 0.9, 0.95, 0.98, 1.05, 1.2, 1.5)  # of the control that perfect tracking needs
USUAL_MULTIPLE = 1.2


def usual_limit(design: Design) -> float:
    """The limit that the design kind's own experiment takes: the printed one, or the one found from the thesis's words.

    Raises
    ------
    InputError
        There is none, see :func:`experiments.thesis.studies.chapter_4.usual_limit`.
    """
    if design.kind == "delay-free":
        return float(printed_numbers()["delay_free"]["limit"])
    return chapter_4.usual_limit(design)


def usual_periods(design: Design) -> int:
    """The length of a run in periods of the reference, as in the design kind's own experiment."""
    return PERIODS if design.kind == "extended" else chapter_2.PERIODS


def several_limits(design: Design) -> list[float]:
    """The printed limit, or 1.2 times what perfect tracking needs; and then 0.8 to 1.5 times that."""
    required = thesis_reference(design.kind, design.reference_omegas).required(design.loop_plant).value
    usual = printed_numbers()[design.kind.replace("-", "_")].get("limit", USUAL_MULTIPLE * required)
    return [usual, *(multiple * required for multiple in MULTIPLES)]
