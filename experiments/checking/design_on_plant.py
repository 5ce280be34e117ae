"""What a design still has on the plant of a new sweep: a stable loop, its margins, the sector of its anti-windup."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from design.anti_windup.circle_criterion import circle_sector
from design.anti_windup.compensator import AntiWindup
from design.blocks.block import bound_block, plant_block
from design.design_file import Design
from design.stability.margins import Margins, delay_loop, margins_of, responses
from experiments.runs.guarantee import guarantee, guarantee_within
from identification.base.arrays import Real
from identification.base.errors import InputError
from identification.model.model_file import IdentifiedModel
from identification.model.plant import PlantModel


@dataclass(frozen=True)
class Promise:
    """What a design has to keep on the plant of a new sweep.

    Parameters
    ----------
    margins
        Of its loop with the model, the dead time exact; or why there are none.
    modulus
        Least modulus margin, which every plant within W_a leaves: modulus margin times 1 - ||W_a C S||; 0 where that
        says nothing.
    sector
        Least sector of the circle criterion for the corrected anti-windup: 1, whatever the control, of a guarantee that
        is no sector; of a sector what is left of it for every plant within W_a. 0: nothing is guaranteed.
    missing
        Why nothing is, as a sentence without its full stop; else empty.
    """

    margins: Margins | str
    modulus: float
    sector: float
    missing: str


@dataclass(frozen=True)
class OnPlant:
    """The same design on one plant.

    Parameters
    ----------
    margins
        Of its loop with this plant, its dead time exact; or why there are none: it is not stable.
    sector
        The largest found of the circle criterion for the corrected anti-windup in this loop; None without margins.
    """

    margins: Margins | str
    sector: float | None


def require_of_model(design: Design, model: IdentifiedModel) -> None:
    """Refuse a design of another model: raises InputError where plant or W_a are not the same numbers."""
    if design.plant == model.plant and design.additive_bound == model.additive_bound:
        return
    which = "plant" if design.plant != model.plant else "W_a"
    raise InputError(f"the design's {which} is not that of the model; expected a design of this model")


def promise(design: Design) -> Promise:
    """What a design has to keep, judged again and not read."""
    own = design.corrected
    margins = _margins(design, design.plant)
    if not isinstance(margins, Margins):
        return Promise(margins, 0.0, 0.0, margins)
    modulus = margins.modulus.value * max(0.0, 1 - margins.W_a_C_S.value)
    given = guarantee(design, own.kind)
    if not given.missing and own.guarantee == "sector":
        given = guarantee_within(design, own.kind)
    if given.missing:
        return Promise(margins, modulus, 0.0, given.missing)
    # a delay-free design has no more on its own plant, whose dead time it ignores
    sector = min(given.sector, sector_with(design, own.kind, design.plant), 1.0)
    return Promise(margins, modulus, sector, "")


def on_plant(design: Design, true: PlantModel) -> OnPlant:
    """A design on a plant with as many integrators as its model, and no other pole in the closed right half plane."""
    margins = _margins(design, true)
    return OnPlant(margins, sector_with(design, design.corrected.kind, true) if isinstance(margins, Margins) else None)


def _margins(design: Design, plant: PlantModel) -> Margins | str:
    try:
        return margins_of(delay_loop(design, plant), design.additive_bound)
    except InputError as error:
        return str(error)


def sector_with(design: Design, anti_windup: AntiWindup, true: PlantModel) -> float:
    """The largest sector found of the circle criterion in the loop with a true plant, which is stable.

    Parameters
    ----------
    design, anti_windup
        The controller, and theta1~ with a stable theta2.
    true
        P + Delta.

    Returns
    -------
    float
        From 1 on the windup ends whatever the control; 0: none. The lowest point is searched on a grid that resolves
        all roots, and refined there; that none is missed is not proved.

    Notes
    -----
    By step 8 of docs/explanation/anti_windup.md the dead zone sees theta1~ - C S_Delta Delta (1 + theta1~) with
    C S_Delta Delta = C S Delta/(1 + C S Delta), here of one known Delta and not of every one within W_a. With S and P
    of the model 1 + theta1~ becomes (1 + theta1~)/(1 + C S Delta), whose poles are those of theta1~ and the roots of
    the loop with P + Delta. Where that is stable a sector k < 1 bounds the norm of u - sat(u) as for the model, and one
    from 1 on its integral, by Parseval's theorem. Delta is stable but for the model's own integrators, at which
    1 + theta1~ is zero: so the output returns.
    """
    plant, M = design.loop_plant, anti_windup.one_plus
    loop = delay_loop(design, plant)

    def moved(omega: Real) -> Real:
        s = 1j * omega
        changed = responses(loop, omega)[1] * (true(s) - plant(s))
        return np.asarray(np.real(changed / (1 + changed) * M(s)))

    blocks = plant_block(plant), plant_block(true), bound_block(design.additive_bound), loop.forward, loop.feedback, M
    roots = tuple(root for block in blocks for root in block.zeros + block.poles)
    return circle_sector(anti_windup.theta1_tilde, moved, roots)
