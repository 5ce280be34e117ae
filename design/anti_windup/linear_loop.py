"""A design's loop without saturation, as far as the anti-windups of others are made of it."""

from __future__ import annotations

from dataclasses import dataclass

from design.blocks.block import Block
from identification.model.plant import PlantModel


@dataclass(frozen=True)
class LinearLoop:
    """C and P, and the freedom that the design's own anti-windup leaves.

    Parameters
    ----------
    plant
        P as the design sees it.
    forward, feedback
        C = forward/(1 - feedback exp(-h s)), h the plant's dead time; without a feedback of chapter 2.
    pole
        a of T_so in rad/s; None in chapter 2.
    omegas
        Frequencies of the reference in rad/s.
    recovery_s, bandwidth
        Of the design's corrected anti-windup: the pace and the fastest pole of others that leave them free.
    """

    plant: PlantModel
    forward: Block
    feedback: Block
    pole: float | None
    omegas: tuple[float, ...]
    recovery_s: float
    bandwidth: float
