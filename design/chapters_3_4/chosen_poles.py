"""The poles of T_so that are chosen where the designer chooses none: as fast as bound, dead time and data allow."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from design.blocks.block import bound_block, fastest_root, plant_block
from design.blocks.frequency_peak import frequency_grid
from design.chapters_3_4.interpolate_Q import poles_of
from design.chapters_3_4.robust_roll_off import MOST_POLES, Loop, least_order
from design.chapters_3_4.tracking import TrackingConditions
from identification.base.errors import InputError
from identification.model.additive_bound import AdditiveBound
from identification.model.plant import PlantModel

PEAK = 2.0
"""||S|| that the choice keeps where it can: a modulus margin of 1/2."""
AHEAD = 10.0  # times the fastest sinusoid of the reference: no faster a loop is chosen
SLOWEST = 1e-3  # of the fastest a that is tried
A_DECADE = 8  # values of a
RATES = 6  # of the roll-off, a decade
COARSE = 10  # frequencies a decade


@dataclass(frozen=True)
class ChosenPace:
    """How fast the loop is to be.

    Parameters
    ----------
    a
        In rad/s: every pole of T_so but those of the roll-off has the real part -a.
    reason
        What holds a down, in words.
    """

    a: float
    reason: str


def pairs_of(a: float, omegas: tuple[float, ...]) -> tuple[tuple[float, float], ...]:
    """e and f of s^2 + e s + f for each sinusoid, rad/s: roots of real part -a, no slower than the sinusoid."""
    return tuple((2 * a, max(a, omega) ** 2) for omega in omegas)


def fixed_poles(wanted: TrackingConditions, a: float, pairs: Sequence[tuple[float, float]]) -> tuple[complex, ...]:
    """The poles of T_so without its roll-off: the pairs' roots, and -a for every condition that is no sinusoid's.

    Raises
    ------
    InputError
        a is not positive, or see :func:`design.chapters_3_4.interpolate_Q.poles_of`.
    """
    if not (np.isfinite(a) and a > 0):
        raise InputError(f"a = {a:g} rad/s; expected a positive number")
    alone = wanted.count - 2 * len(wanted.omegas) + wanted.zeros_at_zero
    return (complex(-a),) * alone + poles_of(wanted.omegas, pairs)


def chosen_pace(
    plant: PlantModel, bound: AdditiveBound, wanted: TrackingConditions, level: float, highest_omega: float | None
) -> ChosenPace:
    """The largest a of a grid for which a roll-off meets ||W_a C S|| <= level and ||S|| <= PEAK.

    Parameters
    ----------
    plant, bound, wanted
        P, W_a and the conditions on T_so.
    level
        Between 0 and 1.
    highest_omega
        The highest measured line in rad/s; None: not known.

    Returns
    -------
    ChosenPace
        Where no a keeps ||S|| <= PEAK, the one with the least ||S||. Both are read on a grid of frequencies here; the
        design that is made of it is judged again.

    Notes
    -----
    No a exceeds ten times the fastest sinusoid of the reference (for a constant alone, a tenth of the highest line, or
    of the fastest root): a faster loop follows nothing better and asks more of the actuator. Nor does it exceed the
    highest line: beyond it W_a is an assumption.
    """
    fastest = fastest_root(plant_block(plant), bound_block(bound))
    beyond = min(fastest, highest_omega or fastest)
    known = f"the highest line, {beyond:.4g} rad/s" if highest_omega else f"the fastest root, {beyond:.4g} rad/s"
    if wanted.omegas:
        top, why = AHEAD * max(wanted.omegas), "ten times the fastest sinusoid of the reference"
        if top > beyond:
            top, why = beyond, known
    else:
        top, why = beyond / 10, f"a tenth of {known}"
    decades = -np.log10(SLOWEST)
    best: tuple[float, float] | None = None
    for k in range(int(A_DECADE * decades) + 1):
        a = top * 10 ** (-k / A_DECADE)
        found = _least_sensitivity(plant, bound, wanted, a, level)
        if found <= PEAK:
            return ChosenPace(
                a, why if k == 0 else f"the largest for which |W_a C S| <= {level:g} and ||S|| <= {PEAK:g}"
            )
        if best is None or found < best[0]:
            best = found, a
    assert best is not None
    return ChosenPace(best[1], f"||S|| is least there, {best[0]:.3g}; none keeps it below {PEAK:g}")


def _least_sensitivity(
    plant: PlantModel, bound: AdditiveBound, wanted: TrackingConditions, a: float, level: float
) -> float:
    """The least ||S|| over roll-offs that meet the level, on a grid; infinite where none does."""
    loop = Loop(plant, bound, wanted, fixed_poles(wanted, a, pairs_of(a, wanted.omegas)))
    omega = frequency_grid(loop.roots, COARSE)
    fastest = fastest_root(plant_block(plant), bound_block(bound))
    ends = 10 * max(fastest, a), min(a, *wanted.omegas) / 10
    rates = np.geomspace(*ends, int(RATES * np.log10(ends[0] / ends[1])) + 2)
    least, best = least_order(plant), np.inf
    for order in range(least, least + MOST_POLES + 1):
        tried = rates if order else rates[:1]
        met = np.flatnonzero(loop.robustness(omega, tried, order).max(axis=1) <= level)
        if len(met):
            best = min(best, float(loop.sensitivity(omega, tried[met[:1]], order).max()))
    return best
