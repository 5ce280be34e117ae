"""What the thesis chose: its references, and its designs for either of its parameter sets."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from math import tau

from data.thesis import model_named, printed_numbers
from design.chapter_2.design_delay_free import design_delay_free
from design.chapters_3_4.design_extended import design_extended
from design.design_file import Design
from experiments.runs.references import Reference


@cache
def chapter_2(set_name: str = "implied") -> Design:
    """The delay-free design with the printed period and epsilon, and the weights that are ours.

    Parameters
    ----------
    set_name
        "implied" or "table".
    """
    chosen = printed_numbers()["delay_free"]
    model = model_named(set_name)
    return design_delay_free(model, [tau / chosen["reference"]["period_s"]], chosen["epsilon"])


@cache
def chapter_4(set_name: str = "implied") -> Design:
    """The extended design by the zeros of Q, with the printed frequency, a, e and f (Table 4.1).

    Parameters
    ----------
    set_name
        "implied" or "table".
    """
    chosen = printed_numbers()["extended"]
    omega, pairs = chosen["reference"]["omega"], [(chosen["e"], chosen["f"])]
    model = model_named(set_name)
    return design_extended(model, [omega], chosen["a"], pairs)


def thesis_reference(kind: str, omegas: Sequence[float]) -> Reference:
    """The thesis's reference for a design of this kind ("delay-free" or "extended") at other omegas in rad/s.

    Of several frequencies each has the thesis's amplitude and phase, which is our choice; omega = 0 is a constant.
    """
    values = printed_numbers()[kind.replace("-", "_")]["reference"]
    n = len(omegas)
    return Reference((values["amplitude"],) * n, tuple(omegas), (values["phase_rad"],) * n, values["offset"])
