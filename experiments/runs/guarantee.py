"""What a design guarantees of its saturated runs with one anti-windup: a sector, that windup ends, or why nothing.

What the sector is good for, and which sector a run needs, says :mod:`experiments.runs.sector_promise`; how much windup
a run has left without one, :mod:`experiments.runs.windup_bound`.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from design.anti_windup.circle_criterion import circle_sector
from design.anti_windup.compensator import AntiWindup
from design.anti_windup.kyp_certificate import Storage, proved_storage
from design.blocks.block import bound_block, plant_block
from design.blocks.frequency_peak import frequency_grid
from design.design_file import Asked, Design
from design.stability.margins import delay_loop, margins_of, robustness_of
from experiments.runs.words import sector_text
from identification.base.errors import InputError
from identification.model.plant import PlantModel

FINE = 200  # frequencies a decade where a true plant is compared with the bound
OUTSIDE = "the true plant is not within W_a of the model, or has another number of poles in the right half plane"
TURNED = 1.0  # rad between neighbouring frequencies, beyond which exp(-j omega (h' - h)) may be anything


@dataclass(frozen=True)
class Guarantee:
    """What a design promises of its runs with one anti-windup.

    Parameters
    ----------
    sector
        k_c: it promises something of every run that needs a smaller sector; 0: of none; 1: whatever the control.
    missing
        Why of none, as a sentence without its full stop; else empty.
    any_plant
        Whether it is one for every plant within W_a with as many poles in the right half plane.
    storage
        Of a positive real 1 + theta1~ with the design's own plant; else None.
    """

    sector: float
    missing: str = ""
    any_plant: bool = False
    storage: Storage | None = field(default=None, compare=False)


def guarantee(design: Design, anti_windup: Asked, plant: PlantModel | None = None) -> Guarantee:
    """What a design promises of its runs under a reference.

    Parameters
    ----------
    design, anti_windup
        The design and its theta1~, or the name of that; without one nothing is promised.
    plant
        The true plant, the model unless given. Another one is covered only as one of all plants within W_a.
    """
    kind = design.chosen(anti_windup)
    if kind is None:
        return Guarantee(0.0, "there is no anti-windup")
    if plant is None or plant == design.loop_plant:
        certificate = design.corrected.certificate if kind == design.corrected.kind else None
        storage = None if certificate is None else proved_storage(kind.one_plus, certificate)
        return _without_criterion(design, kind) or Guarantee(circle_sector(kind.theta1_tilde), storage=storage)
    if not _is_within(design, plant):
        return Guarantee(0.0, OUTSIDE)
    return guarantee_within(design, kind)


def guarantee_within(design: Design, anti_windup: AntiWindup) -> Guarantee:
    """What a design promises of runs with every plant within W_a that has as many poles in Re s > 0 as the model.

    See :func:`design.anti_windup.popov.robust_loss`.
    """
    if missing := _without_criterion(design, anti_windup):
        return missing
    from design.anti_windup.popov import robust_loss  # only here: it takes a third of a second to import

    plant, bound = design.loop_plant, design.additive_bound
    loop = delay_loop(design, plant)
    try:
        margins = margins_of(loop, bound)
    except InputError as error:
        return Guarantee(0.0, str(error))
    if not margins.is_guaranteed:
        reached = f"{margins.W_a_C_S.value:.3g}"
        return Guarantee(0.0, f"|W_a C S| reaches {reached}, so nothing is promised for the plants within W_a")

    robustness = robustness_of(loop, bound)
    loss = robust_loss(anti_windup.one_plus, robustness.magnitude)
    roots = robustness.roots + anti_windup.one_plus.zeros + anti_windup.one_plus.poles
    return Guarantee(circle_sector(anti_windup.theta1_tilde, loss, roots), any_plant=True)


def _without_criterion(design: Design, anti_windup: AntiWindup) -> Guarantee | None:
    if not anti_windup.theta1_tilde.is_stable:
        return Guarantee(0.0, "theta1~ is not stable by itself, so that no criterion applies")
    if anti_windup.theta2(design.loop_plant).is_stable:
        return None
    sector = sector_text(circle_sector(anti_windup.theta1_tilde))
    return Guarantee(
        0.0,
        "theta2 is not stable, so the output does not return to that of the linear loop (for the control alone the "
        f"circle criterion gives the sector {sector})",
    )


def _is_within(design: Design, true: PlantModel) -> bool:
    """Whether |P_true - P| <= |W_a| on a fine grid and as omega -> 0 and infinity, with as many poles in Re s > 0.

    |W_a C S| < 1 keeps how often the Nyquist curve turns about -1, so that with another number the loop is not stable.
    """
    plant, bound = design.loop_plant, design.additive_bound
    blocks = plant_block(plant), plant_block(true), bound_block(bound)
    if len(blocks[0].unstable_poles) != len(blocks[1].unstable_poles):
        return False
    if plant.integrators != true.integrators or (plant.integrators and plant.gain != true.gain):
        return False  # the difference has a pole at s = 0
    if min(plant.relative_degree, true.relative_degree) < blocks[2].relative_degree:
        return False  # the bound falls faster
    omega = frequency_grid([root for block in blocks for root in block.zeros + block.poles], per_decade=FINE)
    s = 1j * omega
    turned = np.gradient(omega) * abs(true.delay_s - plant.delay_s) > TURNED
    difference = np.where(turned, np.abs(true(s)) + np.abs(plant(s)), np.abs(true(s) - plant(s)))
    return bool(np.all(difference <= np.abs(bound(s))))
