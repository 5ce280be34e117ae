"""The audit of a design: stability with the exact dead time, margins, |W_a C S|, and every anti-windup it carries."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from design.block import bound_block, plant_block
from design.contract import Design
from design.frequency import frequency_grid
from design.judgement import Judgement, judge, robust_sector
from design.mixed_sensitivity import Infimum, infimum
from design.printed_optimum import least_f
from design.quasi_polynomial import CharacteristicRoots, rightmost_roots
from design.robustness import Margins, delay_loop, margins_of, tracking_floor
from design.smith_predictor import anti_windup_controller, smith_controller
from identification.files import InputError
from identification.model import IdentifiedModel, number
from identification.plant import AdditiveBound, PlantModel

ROOTS = 5  # rightmost characteristic roots that are named


@dataclass(frozen=True)
class Audit:
    """What can be said of a design before anything is simulated.

    Parameters
    ----------
    roots
        The rightmost characteristic roots of the nominal loop with its exact dead time.
    margins
        Of the nominal loop, or the sentence that says why it has none.
    with_delay
        The same of a delay-free design on the plant with its dead time; None where that is the nominal loop.
    tracking_floor
        No controller that follows the reference has a smaller ||W_a C S||.
    covered_delay_s
        Every plant whose dead time differs from the nominal one by less than this, in seconds, lies within W_a.
    same_controller
        The largest |C_aw/C_s - 1| over a grid of frequencies, of an extended design with the exact inverse; else None.
    infimum
        Of (2.8), of a delay-free design; else None.
    anti_windup
        Name -> its judgement.
    robust_sector
        Name -> the largest sector for every plant within W_a; 0 when |W_a C S| reaches 1.
    least_f
        alpha, beta, gamma and f of the best of the printed form (2.23) within the corrected one's bandwidth.
    """

    roots: CharacteristicRoots
    margins: Margins | str
    with_delay: Margins | str | None
    tracking_floor: float
    covered_delay_s: float
    same_controller: float | None
    infimum: Infimum | None
    anti_windup: dict[str, Judgement]
    robust_sector: dict[str, float]
    least_f: tuple[float, float, float, float]


def audit(design: Design) -> Audit:
    """Audit a design; nothing is taken from the file but plant, W_a, blocks and the compensators themselves."""
    plant, bound = design.loop_plant, design.additive_bound
    model = IdentifiedModel(plant, bound, None, {})
    forward, feedback = design.controller_parts()
    P = plant_block(plant)
    roots = tuple(root for part in (P, forward, feedback) for root in part.zeros + part.poles)

    def robustness(omega: np.ndarray) -> np.ndarray:
        s = 1j * omega
        returned = 1 - feedback(s) * np.exp(-plant.delay_s * s) + P(s) * forward(s)
        return np.asarray(np.abs(bound(s) * forward(s) / returned))

    same = None
    if design.kind == "extended" and not design.parameters.get("inverse_epsilon"):
        s = 1j * np.geomspace(1e-3, 1e4, 2000)
        C_s = smith_controller(plant, design.blocks["C0"], s)
        same = float(np.max(np.abs(anti_windup_controller(plant, forward, feedback, s) / C_s - 1)))
    interval = None
    if design.hinf is not None:
        interval = infimum(
            design.blocks["G_A"], design.hinf["W1"], design.hinf["W2"], number(design.hinf, "decay_rate")
        )
    kinds = {name: design.compensator(name) for name in design.anti_windup}
    return Audit(
        roots=rightmost_roots(delay_loop(design, plant), ROOTS),
        margins=_margins(design, plant),
        with_delay=_margins(design, design.plant) if plant != design.plant else None,
        tracking_floor=tracking_floor(plant, bound, design.reference_omegas),
        covered_delay_s=covered_delay(plant, bound),
        same_controller=same,
        infimum=interval,
        anti_windup={name: judge(model, kind) for name, kind in kinds.items()},
        robust_sector={name: robust_sector(kind, robustness, roots) for name, kind in kinds.items()},
        least_f=least_f(bound, number(design.anti_windup["corrected"], "bandwidth")),
    )


def covered_delay(plant: PlantModel, bound: AdditiveBound) -> float:
    """The largest change of the dead time, in seconds, for which the plant stays within W_a; infinite if every one.

    |P| |exp(-j omega tau) - 1| = 2 |P| |sin(omega tau/2)| <= |W_a| at every omega. No change of an integrator's gain is
    covered by any W_a that is finite at s = 0.
    """
    P, W_a = plant_block(plant), bound_block(bound)
    omega = frequency_grid(P.zeros + P.poles + W_a.zeros + W_a.poles, per_decade=200)
    s = 1j * omega
    share = np.abs(W_a(s) / P(s)) / 2
    inside = share < 1
    return float(np.min(2 / omega[inside] * np.arcsin(share[inside]), initial=np.inf))


def _margins(design: Design, plant: PlantModel) -> Margins | str:
    try:
        return margins_of(delay_loop(design, plant), design.additive_bound)
    except InputError as error:
        return str(error)
