"""A T_so that keeps the tracking conditions and makes the loop stable for every plant within W_a.

That is for those with as many poles in the right half plane as the model.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from design.blocks.block import Block, bound_block, fastest_root, plant_block
from design.blocks.frequency_peak import CERTIFIED, block_norm, frequency_grid, peak
from design.blocks.inner_outer import inner_outer
from design.chapters_3_4.tracking import RolledOff, TrackingConditions, outer_part
from design.stability.margins import tracking_floor
from identification.base.arrays import Real, Whole
from identification.base.errors import InputError
from identification.model.additive_bound import AdditiveBound
from identification.model.plant import PlantModel

MOST_POLES = 3  # of the roll-off, beyond the least order
PER_DECADE = 10  # rates that are tried
COARSE = 12  # frequencies a decade that exclude a rate at once
STEPS = 8  # of 0.1 % each, by which a rate is lowered whose level cannot be proved


@dataclass(frozen=True)
class Redesign:
    """A T_so with a roll-off.

    Parameters
    ----------
    T_so
        With ``order`` poles at -rate beside those that were given.
    rate, order
        In rad/s, and how many.
    peak
        ||W_a C S||_inf, proved as :func:`design.blocks.frequency_peak.block_norm` says.
    sensitivity
        ||S||_inf = ||1 - T_so T_si||_inf, by search on a refined grid.
    """

    T_so: Block
    rate: float
    order: int
    peak: float
    sensitivity: float


class Loop:
    """|W_a C S| and |S| of a plant with T_so of given poles and any roll-off, C S = T_so/P_o being exact.

    Parameters
    ----------
    plant, bound
        P with its dead time, and W_a.
    wanted, poles
        As for :func:`design.chapters_3_4.tracking.outer_part`.
    """

    def __init__(
        self, plant: PlantModel, bound: AdditiveBound, wanted: TrackingConditions, poles: Sequence[complex]
    ) -> None:
        self.wanted, self.poles = wanted, tuple(poles)
        self.T_si, P_o = inner_outer(plant)
        self.per_T_so = bound_block(bound) * P_o.inverse()
        self.family = RolledOff(wanted, poles)
        self.roots = (*poles, *self.per_T_so.zeros, *self.per_T_so.poles, *(1j * omega for omega in wanted.omegas))

    def robustness(self, omega: Real, rate: Real, order: int) -> Real:
        """|W_a C S| at frequencies (n,) in rad/s for rates (m,) in rad/s, shape (m, n)."""
        return np.asarray(np.abs(self.per_T_so(1j * omega) * self.family.T_so(omega, rate, order)))

    def sensitivity(self, omega: Real, rate: Real, order: int) -> Real:
        """|S| likewise."""
        return np.asarray(np.abs(1 - self.T_si(1j * omega) * self.family.T_so(omega, rate, order)))

    def peak(self, of: Callable[[Real, Real, int], Real], rate: float, order: int) -> float:
        """The largest value found of one of the two."""
        roots = (*self.roots, *(complex(-rate),) * bool(order))
        return peak(lambda omega: of(omega, np.array([rate]), order)[0], roots)[0]

    def meets(self, rate: float, order: int, limit: float, most: float) -> bool:
        """Whether ||W_a C S|| <= limit and ||S|| <= most with a roll-off, as far as the search shows."""
        robust = self.peak(self.robustness, rate, order) <= limit
        return robust and (most == np.inf or self.peak(self.sensitivity, rate, order) <= most)


def least_order(plant: PlantModel) -> int:
    """How many poles of the roll-off the controller cannot do without.

    K = T_so/P_o is proper where T_so has as many poles more than zeros as P, and the realisation of C without hidden
    modes is proper where it has as many as P has poles in Re s >= 0; one comes from the conditions.
    """
    return max(plant.relative_degree, max(plant.integrators, 0) + len(plant.unstable_poles), 1) - 1


def robust_outer_part(
    plant: PlantModel,
    bound: AdditiveBound,
    wanted: TrackingConditions,
    a: float,
    poles: Sequence[complex],
    level: float,
    order: int | None = None,
    most: float = np.inf,
) -> Redesign:
    """The latest roll-off found of T_so with ||W_a C S|| <= level.

    Parameters
    ----------
    plant, bound
        P with its dead time, and W_a.
    wanted, poles
        As for :func:`design.chapters_3_4.tracking.outer_part`; the roll-off's poles come in addition.
    a
        How fast the loop is to be, rad/s: rates from a hundredth of it, or of the slowest sinusoid, are tried.
    level
        Between 0 and 1.
    order
        Of the roll-off; every one from the least to MOST_POLES more unless given.
    most
        What ||S|| is to be at most, as far as a search on a refined grid shows, where a roll-off that is tried has it.

    Raises
    ------
    InputError
        The level is out of its range, below what tracking forbids whatever the controller, or was not met.

    Notes
    -----
    With the model as the plant C S = K = T_so/P_o exactly. Tracking asks for T(j omega) = 1 at the reference's
    frequencies, where therefore |W_a C S| = |W_a/P| for every controller: where that exceeds 1 no controller is
    robust. Elsewhere T_so may be as small as we like, since values on the axis can be interpolated by functions that
    are small away from them. The roll-off is one family of such functions: for each number of poles the first of a
    grid of falling rates that meets the level, raised by bisection, and of these the one with the least ||S||. That
    ||W_a C S|| is at most the level is proved for what is returned, by :func:`design.blocks.frequency_peak.block_norm`;
    that no later roll-off meets it is not.
    """
    floor = require_possible(plant, bound, wanted, level)
    loop = Loop(plant, bound, wanted, poles)
    limit, least = level * (1 - CERTIFIED), least_order(plant)
    orders = range(least, least + MOST_POLES + 1) if order is None else (order,)
    coarse = frequency_grid(loop.roots, COARSE)
    met: list[Redesign] = []
    best = np.inf
    fast = 10 * max(fastest_root(plant_block(plant), bound_block(bound)), a)
    slow = min((a, *wanted.omegas)) / 100
    rates = np.geomspace(fast, slow, int(PER_DECADE * np.log10(fast / slow)) + 2)
    for order in orders:
        tried = rates if order else rates[:1]
        seen = loop.robustness(coarse, tried, order).max(axis=1)
        best = min(best, float(seen.min()))
        for calm in (np.inf, most)[: 1 + (most < np.inf)]:  # the latest that meets the level is the calmest, mostly
            found = _latest_of(loop, tried, np.flatnonzero(seen <= limit), order, limit, calm)
            proved = [] if found is None else _proved(loop, found, order, limit)
            met += proved
            if proved and proved[0].sensitivity <= most:
                break
    if met:
        return min(met, key=lambda redesign: redesign.sensitivity)
    raise InputError(
        f"||W_a C S|| is {best:.6g} or more with every roll-off tried, of up to {orders[-1]} poles; expected at most "
        f"{level:g}, for example by a smaller a, e and f (every controller has {floor:.4g} or more)"
    )


def require_possible(
    plant: PlantModel,
    bound: AdditiveBound,
    wanted: TrackingConditions,
    level: float,
    band: tuple[float, float] = (0.0, np.inf),
) -> float:
    """The least ||W_a C S|| of any controller that tracks; raises InputError where the level is not above it.

    ``band`` is what was measured, rad/s: the error names frequencies in it at which the model is better known.
    """
    if not 0 < level < 1:
        raise InputError(f"the level of |W_a C S| is {level:g}; expected between 0 and 1")
    at = (*((0.0,) if wanted.at_zero else ()), *wanted.omegas)
    values = [tracking_floor(plant, bound, [omega]) for omega in at]
    floor = max(values)
    if floor >= level:
        beyond = at[int(np.argmax(values))]
        accepted = "a level above that, or " if floor < 1 else ""
        raise InputError(
            f"|W_a C S| is |W_a/P| = {floor:.6g} at {beyond:.6g} rad/s with every controller that follows a reference "
            f"there; expected less than the level {level:g}: {accepted}{_known(plant, bound, level, band)}"
        )
    return floor


def _known(plant: PlantModel, bound: AdditiveBound, level: float, band: tuple[float, float]) -> str:
    """Where in the band |W_a/P| is below a level, in words: the widest interval in octaves."""
    share = bound_block(bound) * plant_block(plant).without_delay().inverse()
    omega = frequency_grid(share.zeros + share.poles)
    omega = omega[(omega >= band[0]) & (omega <= band[1])]
    below = np.concatenate([[False], np.abs(share(1j * omega)) < level, [False]])
    starts, ends = np.flatnonzero(np.diff(below.astype(int)) == 1), np.flatnonzero(np.diff(below.astype(int)) == -1) - 1
    if not len(starts):
        measured = " where it was measured" if band[1] < np.inf else ""
        return (
            f"a tighter W_a, by more poles of it or more similar tests (nowhere{measured} is |W_a/P| below the level)"
        )
    widest = int(np.argmax(omega[ends] / omega[starts]))
    low, high = omega[starts[widest]], omega[ends[widest]]
    return (
        "a tighter W_a, by more poles of it or more similar tests, or another frequency (|W_a/P| is below the level "
        f"from {low:.4g} to {high:.4g} rad/s)"
    )


def _proved(loop: Loop, rate: float, order: int, limit: float) -> list[Redesign]:
    """The design with this rate, or one lower by up to STEPS thousandths, whose level is proved; else none."""
    for _ in range(STEPS):
        T_so = outer_part(loop.wanted, (*loop.poles, *(complex(-rate),) * order))
        norm, _ = block_norm(loop.per_T_so * T_so)
        if norm <= limit:
            return [Redesign(T_so, rate, order, norm, loop.peak(loop.sensitivity, rate, order))]
        rate *= 1 - 1e-3
    return []


def _latest_of(loop: Loop, rates: Real, candidates: Whole, order: int, limit: float, most: float) -> float | None:
    """The first of falling rates, among the candidates, that meets the limits, raised by bisection to 1e-3."""
    for k in candidates:
        low = float(rates[k])
        if not loop.meets(low, order, limit, most):
            continue
        high = float(rates[k - 1]) if k else low
        while high > low * 1.001:
            middle = float(np.sqrt(low * high))
            low, high = (middle, high) if loop.meets(middle, order, limit, most) else (low, middle)
        return low
    return None
