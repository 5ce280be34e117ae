"""A T_so that keeps the tracking conditions and makes the loop stable for every plant within W_a."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from design.blocks.block import Block, bound_block, fastest_root, plant_block
from design.blocks.frequency_peak import CERTIFIED, block_norm, peak, searched_norm
from design.chapters_3_4.interpolate_Q import Conditions
from design.chapters_3_4.smith_predictor import FreePart, rolled_off, stabiliser
from design.stability.margins import tracking_floor
from identification.base.errors import InputError
from identification.model.additive_bound import AdditiveBound
from identification.model.plant import PlantModel

MOST_POLES = 3  # of the roll-off, beyond what the plant's own excess of poles takes
PER_DECADE = 10


@dataclass(frozen=True)
class Redesign:
    """The free part with a roll-off.

    Parameters
    ----------
    free
        Q, C_0 and T_so.
    rate, order
        T_so has ``order`` additional poles at -rate (rad/s); with none the design meets the level as it is.
    peak
        ||W_a C S||_inf.
    sensitivity
        ||S||_inf = ||1 - T_so exp(-T_d s)||_inf, by search on a refined grid.
    """

    free: FreePart
    rate: float
    order: int
    peak: float
    sensitivity: float


def robust_free_part(
    plant: PlantModel,
    bound: AdditiveBound,
    wanted: Conditions,
    pairs: Sequence[tuple[float, float]],
    level: float,
) -> Redesign:
    """The latest roll-off found of T_so with ||W_a C S|| <= level: the loop around every plant within W_a is stable.

    Parameters
    ----------
    plant, bound
        P with its dead time, and W_a.
    wanted, pairs
        As for :func:`design.chapters_3_4.smith_predictor.rolled_off`.
    level
        Between 0 and 1.

    Raises
    ------
    InputError
        The level is out of its range, below what tracking forbids whatever the controller, or was not met.

    Notes
    -----
    With the model as the plant C S = K = s T_so/(K R_0) exactly. Tracking asks for T(j omega) = 1 at the reference's
    frequencies, where therefore |W_a C S| = |W_a/P| for every controller: where that exceeds 1 no controller is
    robust. Elsewhere T_so may be as small as we like, since values on the axis can be interpolated by functions that
    are small away from them. The roll-off is one family of such functions: for each number of poles the first of a
    grid of falling rates that meets the level, raised by bisection, and of these the one with the least ||S||. That
    ||W_a C S|| is at most the level is proved for what is returned, by :func:`design.blocks.frequency_peak.block_norm`;
    that no later roll-off meets it is not.
    """
    if not 0 < level < 1:
        raise InputError(f"the level of |W_a C S| is {level:g}; expected between 0 and 1")
    floor = tracking_floor(plant, bound, (0.0, *wanted.omegas))
    if floor >= level:
        raise InputError(
            f"|W_a/P| is {floor:.4g} at a frequency of the reference, and so is |W_a C S| for every controller that "
            f"follows it; expected less than the level {level:g}"
        )
    excess = plant_block(plant).relative_degree - 1
    W_a = bound_block(bound)

    def attempt(rate: float, order: int) -> Redesign:
        free = rolled_off(wanted, pairs, rate, order)
        product = W_a * stabiliser(plant, free.T_so)[2]
        robustness, _ = searched_norm(product)
        T = Block(free.T_so.gain, free.T_so.zeros, free.T_so.poles, wanted.delay_s)
        sensitivity, _ = peak(lambda omega: np.abs(1 - T(1j * omega)), T.zeros + T.poles)
        return Redesign(free, rate, order, robustness, sensitivity)

    met: list[Redesign] = []
    best = np.inf
    fast, slow = _ends(plant, bound, wanted)
    rates = np.geomspace(fast, slow, int(PER_DECADE * np.log10(fast / slow)) + 2)
    for order in range(excess, excess + MOST_POLES + 1):
        above = None
        for rate in rates if order else rates[:1]:
            found = attempt(float(rate), order)
            best = min(best, found.peak)
            if found.peak <= level * (1 - CERTIFIED):
                latest = found if above is None else _latest(attempt, found, above, level * (1 - CERTIFIED))
                proved, _ = block_norm(W_a * stabiliser(plant, latest.free.T_so)[2])
                if proved <= level * (1 - CERTIFIED):
                    met.append(latest)
                break
            above = found
    if met:
        return min(met, key=lambda redesign: redesign.sensitivity)
    raise InputError(
        f"no roll-off tried, of up to {excess + MOST_POLES} poles, brings ||W_a C S|| below {best:.4g}, the level "
        f"is {level:g}; expected a slower a, e and f (no controller gets below {floor:.4g})"
    )


def _ends(plant: PlantModel, bound: AdditiveBound, wanted: Conditions) -> tuple[float, float]:
    """A decade above the fastest root of plant and W_a, and a hundredth of the slowest of what T_so already has."""
    fastest = fastest_root(plant_block(plant), bound_block(bound))
    return 10 * max(fastest, wanted.a), min((wanted.a, *wanted.omegas)) / 100


def _latest(attempt: Callable[[float, int], Redesign], low: Redesign, high: Redesign, level: float) -> Redesign:
    """Bisection between a rate that meets the level and a greater one that does not, to 1e-3."""
    while high.rate > low.rate * 1.001:
        middle = attempt(float(np.sqrt(low.rate * high.rate)), low.order)
        low, high = (middle, high) if middle.peak <= level else (low, middle)
    return low
