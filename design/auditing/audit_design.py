"""The audit of a design: stability with the exact dead time, margins, |W_a C S|, and every anti-windup it carries."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from design.anti_windup.chosen_guarantee import chosen_guarantee
from design.anti_windup.condition import Robustness
from design.anti_windup.judge import Judgement, judge, robust_sector, settling_of_slowest
from design.anti_windup.thesis_compensator import least_f
from design.blocks.block import Block, bound_block, fastest_root, geometric_scale, plant_block, plant_numerator
from design.blocks.frequency_peak import frequency_grid
from design.chapters_3_4.smith_predictor import anti_windup_controller, smith_controller, stabiliser
from design.design_file import Design
from design.hinf.mixed_sensitivity import Infimum, Synthesis, assess, infimum
from design.parameters import ExtendedParameters
from design.stability.axis import HALVE, NO_ZERO, first_edges, judged_cells
from design.stability.characteristic_roots import CharacteristicRoots, largest_beyond, rightmost_roots
from design.stability.jet import jet
from design.stability.margins import Margins, delay_loop, margins_of, robustness_of, tracking_floor
from identification.base.errors import InputError
from identification.model.additive_bound import AdditiveBound
from identification.model.plant import PlantModel

Result = TypeVar("Result")

CERTAIN = 1e-9  # of a covered dead time, by which it is told too small
ROOTS = 5  # rightmost characteristic roots that are named


@dataclass(frozen=True, repr=False)
class Audit:
    """What can be said of a design before anything is simulated.

    Parameters
    ----------
    roots
        The rightmost characteristic roots of the nominal loop with its exact dead time, or why they were not found.
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
    stabiliser, infimum
        What K reaches and the infimum of (2.8), of a delay-free design, or why they were not found; else None.
    anti_windup
        Name -> its judgement.
    output_recovery_s
        Name -> time in seconds in which the slowest mode of theta2, and with it y_d after a windup, falls to 1 %.
    guarantee
        What the corrected one guarantees, judged again and not read, as a sentence without its full stop.
    robust_sector
        Name -> the largest sector for every plant within W_a; 0 when |W_a C S| reaches 1 or the loop is not stable.
    least_f
        alpha, beta, gamma and f of the best of the printed form (2.23) within the corrected one's bandwidth.
    """

    roots: CharacteristicRoots | str
    margins: Margins | str
    with_delay: Margins | str | None
    tracking_floor: float
    covered_delay_s: float
    same_controller: float | None
    stabiliser: Synthesis | str | None
    infimum: Infimum | str | None
    anti_windup: dict[str, Judgement]
    output_recovery_s: dict[str, float]
    guarantee: str
    robust_sector: dict[str, float]
    least_f: tuple[float, float, float, float]

    def __repr__(self) -> str:
        if isinstance(self.margins, str):
            return f"Audit({self.margins})"
        modulus, robust = self.margins.modulus.value, self.margins.W_a_C_S.value
        names = ", ".join(self.anti_windup)
        return f"Audit(modulus margin {modulus:.4g}, |W_a C S| at most {robust:.4g}; anti-windups {names})"


def audit(design: Design) -> Audit:
    """Audit a design; nothing is taken from the file but plant, W_a, blocks and the compensators themselves.

    Raises
    ------
    InputError
        The blocks do not belong to the plant.
    """
    _require_consistent(design)
    plant, bound = design.loop_plant, design.additive_bound
    forward, feedback = design.controller_parts()
    loop = delay_loop(design, plant)
    margins = _attempt(lambda: margins_of(loop, bound))
    roots = _attempt(lambda: rightmost_roots(loop, ROOTS))
    blocks = (loop.plant, forward, feedback, bound_block(bound))
    shapes = tuple(root for block in blocks for root in block.zeros + block.poles)
    if not isinstance(roots, str):
        shapes += tuple(complex(root) for root in roots.roots)

    robustness = robustness_of(loop, bound)
    same = None
    chosen = design.parameters
    if isinstance(chosen, ExtendedParameters) and not chosen.inverse_epsilon and "C0" in design.blocks:
        s = 1j * frequency_grid(shapes, per_decade=20)
        s = s[np.abs(s) > 1e-2 * chosen.a]  # below, both are differences that vanish
        if not s.size:
            raise InputError(f"the parameter a is {chosen.a:g} rad/s; expected one among the blocks' frequencies")
        C_s = smith_controller(plant, design.blocks["C0"], s)
        same = float(np.max(np.abs(anti_windup_controller(plant, forward, feedback, s) / C_s - 1)))
    reached = interval = None
    if design.hinf is not None:
        G_A, K = design.blocks["G_A"], design.blocks["K"]
        W1, W2, decay_rate = design.hinf.W1, design.hinf.W2, design.hinf.decay_rate
        reached = _attempt(lambda: assess(G_A, W1, W2, K, decay_rate))
        interval = _attempt(lambda: infimum(G_A, W1, W2, decay_rate))
    guaranteed = isinstance(margins, Margins) and margins.is_guaranteed
    kinds = {name: each.kind for name, each in design.anti_windup.items()}
    sectors = {
        name: robust_sector(kind, robustness.magnitude, shapes) if guaranteed else 0.0 for name, kind in kinds.items()
    }
    delayed = None
    if plant != design.plant:
        delayed = _attempt(lambda: margins_of(delay_loop(design, design.plant), bound))
    return Audit(
        roots=roots,
        margins=margins,
        with_delay=delayed,
        tracking_floor=tracking_floor(plant, bound, design.reference_omegas),
        covered_delay_s=covered_delay(plant, bound),
        same_controller=same,
        stabiliser=reached,
        infimum=interval,
        anti_windup={name: judge(plant, bound, kind) for name, kind in kinds.items()},
        output_recovery_s={name: settling_of_slowest(kind.theta2(plant)) for name, kind in kinds.items()},
        guarantee=_guarantee(design, robustness, guaranteed),
        robust_sector=sectors,
        least_f=least_f(bound, design.corrected.bandwidth),
    )


def _guarantee(design: Design, robustness: Robustness, is_robust: bool) -> str:
    """What the corrected theta1~ guarantees, its condition judged for the roots in the file; or why it does not."""
    own, plant = design.corrected, design.loop_plant
    try:
        unstable = plant_block(plant).unstable_poles
        _, condition, said = chosen_guarantee(unstable, own.guarantee, own.sector, robustness)
    except InputError as error:
        return f"NOT met, {error}"
    if not own.kind.theta2(plant).is_stable:
        return "NOT met, theta2 is not stable"
    if own.guarantee == "robust" and not is_robust:
        return "NOT met, the loops around the plants within W_a are not known to be stable"
    return said if condition.holds(own.kind) else f"NOT met, of M = 1 + theta1~ {condition} does not hold"


def _attempt(compute: Callable[[], Result]) -> Result | str:
    """What was computed, or the sentence with which it was refused: the audit goes on without it."""
    try:
        return compute()
    except InputError as error:
        return str(error)


def _require_consistent(design: Design) -> None:
    """Refuse blocks that do not follow from the plant and from each other, (2.6) or (3.29)."""
    plant, blocks = design.loop_plant, design.blocks
    if isinstance(design.parameters, ExtendedParameters):
        expected, found = stabiliser(plant, blocks["T_so"], design.parameters.inverse_epsilon), blocks["K"]
    else:
        expected, found = plant_numerator(plant) * blocks["Lambda"].inverse(), blocks["G_A"]
    s = geometric_scale(expected) * np.array([0.1, 1.0 + 0.5j, 7.0])
    if not np.allclose(found(s), expected(s), rtol=1e-6, atol=0.0):
        raise InputError("the blocks do not belong to the plant; expected a design that 'python -m design' wrote")


def covered_delay(plant: PlantModel, bound: AdditiveBound) -> float:
    """The largest change of the dead time, in seconds, for which the plant stays within W_a; infinite if every one.

    |P| |exp(-j omega tau) - 1| = 2 |P| |sin(omega tau/2)| <= |W_a| at every omega. 0 where 2 |P| stays above |W_a| as
    omega grows, and beside two integrators. No change of an integrator's gain is covered by any W_a that is finite at
    s = 0. With r = |W_a/P| the value is the least (2/omega) arcsin(r/2) where r < 2, less :data:`CERTAIN` of it. It is
    bounded from below on cells of omega, which are halved while the bound leaves room for less.
    """
    P, W_a = plant_block(plant).without_delay(), bound_block(bound)
    share = W_a * P.inverse()
    if share.relative_degree > 0 or (share.relative_degree == 0 and abs(share.gain) < 2) or share.zeros.count(0) > 1:
        return 0.0
    top = 2 * fastest_root(share) if share.zeros + share.poles else 1.0
    farthest = top / np.finfo(float).eps
    while largest_beyond(share.inverse(), 0.0, top) > 0.5:
        if top > farthest:
            return 0.0  # |W_a| tends to 2 |P| and not from above, as far as rounding shows
        top *= 2
    over_s = share * Block(1.0, (), (0j,))
    zeros, poles = (tuple(root for root in roots if root) for roots in (over_s.zeros, over_s.poles))
    rest = Block(over_s.gain, zeros, poles)
    order, best = -over_s.poles.count(0), np.inf

    def judge(centre: np.ndarray, half: np.ndarray) -> np.ndarray:
        nonlocal best
        found = jet((over_s,), 0.0, centre, half)
        # where a pole at zero is near, only what is left without it is bounded
        least = np.maximum(found.least, jet((rest,), 0.0, centre, half).least * (centre + half) ** order)
        best = min(best, float(np.min(_shift(np.abs(found.value), centre))))
        return np.where(_shift(least, centre - half) < (1 - CERTAIN) * best, HALVE, NO_ZERO)

    judged_cells(judge, first_edges(share.zeros + share.poles, top))
    return float((1 - CERTAIN) * best)


def _shift(ratio: np.ndarray, omega: np.ndarray) -> np.ndarray:
    """(2/omega) arcsin(omega ratio/2), which grows with both; inf beyond the arcsine's range."""
    x = omega * ratio / 2
    with np.errstate(divide="ignore", invalid="ignore"):
        found = np.where(x < 1, ratio * np.where(x > 0, np.arcsin(np.minimum(x, 1.0)) / x, 1.0), np.inf)
    return np.asarray(found)
