"""The designs of chapters 2 and 4 as the thesis chose them, for either of its parameter sets."""

from __future__ import annotations

from functools import cache

from design.contract import Design
from design.delay_free import design_delay_free
from design.extended import design_extended
from identification.model import read_model
from identification.thesis import printed


@cache
def chapter_2(set_name: str = "implied") -> Design:
    """The delay-free design with the printed period and epsilon, and the weights that are ours.

    Parameters
    ----------
    set_name
        "implied" or "table".
    """
    chosen = printed()["delay_free"]
    return design_delay_free(read_model(set_name), chosen["reference"]["period_s"], chosen["epsilon"])


@cache
def chapter_4(set_name: str = "implied") -> Design:
    """The extended design by the zeros of Q, with the printed frequency, a, e and f (Table 4.1).

    Parameters
    ----------
    set_name
        "implied" or "table".
    """
    chosen = printed()["extended"]
    omega, pairs = chosen["reference"]["omega"], [(chosen["e"], chosen["f"])]
    return design_extended(read_model(set_name), [omega], chosen["a"], pairs)
