"""The poles of T_so that are chosen where the designer chooses none: as fast as bound, dead time and data allow."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from design.blocks.block import bound_block, fastest_root, plant_block
from design.blocks.frequency_peak import frequency_grid
from design.chapters_3_4.interpolate_Q import poles_of
from design.chapters_3_4.robust_roll_off import MOST_POLES, Loop, least_order
from design.chapters_3_4.tracking import TrackingConditions
from identification.base.errors import InputError
from identification.model.additive_bound import AdditiveBound
from identification.model.plant import PlantModel

CALM = 0.98  # of PEAK on the coarse grid, so that it is met on a fine one
PEAK = 2.0
"""||S|| that the choice keeps where it can: a modulus margin of 1/2."""
AHEAD = 10.0  # times the fastest sinusoid of the reference: no faster a loop is chosen
SLOWEST = 1e-3  # of the fastest a that is tried, and
BELOW = 0.1  # of the slowest root of P and W_a: a is tried down to the lower one
A_DECADE = 8  # values of a
RATES = 4  # of the roll-off, a decade
COARSE = 30  # frequencies a decade
THIN = 3  # of the frequencies around a resonance, every so many


@dataclass(frozen=True)
class ChosenPace:
    """How fast the loop is to be.

    Parameters
    ----------
    a
        In rad/s: every pole of T_so but those of the roll-off has the real part -a.
    order
        Of the roll-off.
    most
        What ||S|| is to be at most; infinite where PEAK is not to be had.
    reason
        What holds a down, in words.
    """

    a: float
    order: int
    most: float
    reason: str


class _Option(NamedTuple):
    """An a and a roll-off that meet the level."""

    pace: float  # rad/s, of the slowest pole
    sensitivity: float
    a: float
    order: int


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
    """The a and the order of the roll-off whose slowest pole is fastest, with ||W_a C S|| <= level and ||S|| <= PEAK.

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
        Where nothing keeps ||S|| <= PEAK, that of the least ||S||. Both norms are read on a grid of frequencies, for
        each a of a grid with the latest roll-off of each order; the design that is made of it is judged again.

    Raises
    ------
    InputError
        No a of the grid meets the level.

    Notes
    -----
    No a exceeds ten times the fastest sinusoid of the reference (for a constant alone, a tenth of the highest line, or
    of the fastest root): a faster loop follows nothing better and asks more of the actuator. Nor does it exceed the
    highest line: beyond it W_a is an assumption.
    """
    fastest = fastest_root(plant_block(plant), bound_block(bound))
    beyond = min(fastest, highest_omega or fastest)
    known = f"the {'fastest root' if beyond == fastest else 'highest line'}, {beyond:.4g} rad/s"
    if wanted.omegas:
        top, why = AHEAD * max(wanted.omegas), "ten times the fastest sinusoid of the reference"
        if top > beyond:
            top, why = beyond, known
    else:
        top, why = beyond / AHEAD, f"a tenth of {known}"
    roots = (*plant_block(plant).zeros, *plant_block(plant).poles, *bound_block(bound).zeros, *bound_block(bound).poles)
    bottom = min(SLOWEST * top, BELOW * min(abs(root) for root in roots if root))
    options: list[_Option] = []
    for k in range(int(A_DECADE * np.log10(top / bottom)) + 1):
        a = top * 10 ** (-k / A_DECADE)
        if any(option.sensitivity <= CALM * PEAK and option.pace >= a for option in options):
            break  # no slower a has a faster slowest pole
        options += _options(plant, bound, wanted, a, level)
    if not options:
        raise InputError(
            f"no pole a of the loop from {bottom:.3g} to {top:.3g} rad/s gives |W_a C S| <= {level:g}; expected a "
            "tighter W_a or another frequency of the reference"
        )
    calm = [option for option in options if option.sensitivity <= CALM * PEAK]
    best = min(calm or options, key=lambda option: (-option.pace if calm else 0.0, option.sensitivity))
    if not calm:
        return ChosenPace(best.a, best.order, np.inf, f"||S|| is least there, about {best.sensitivity:.3g}")
    limited = f"the fastest found with |W_a C S| <= {level:g} and ||S|| <= {PEAK:g}"
    return ChosenPace(best.a, best.order, PEAK, why if best.a == top and best.pace == top else limited)


def _options(
    plant: PlantModel, bound: AdditiveBound, wanted: TrackingConditions, a: float, level: float
) -> list[_Option]:
    """For each order the latest roll-off of a grid that meets the level, norms read on a grid of frequencies."""
    loop = Loop(plant, bound, wanted, fixed_poles(wanted, a, pairs_of(a, wanted.omegas)))
    fine = frequency_grid(loop.roots, COARSE)
    omega = fine[::THIN]
    fastest = fastest_root(plant_block(plant), bound_block(bound))
    ends = 10 * max(fastest, a), min((a, *wanted.omegas)) / 10
    rates = np.geomspace(*ends, int(RATES * np.log10(ends[0] / ends[1])) + 2)
    least, found = least_order(plant), []
    for order in range(least, least + MOST_POLES + 1):
        tried = rates if order else rates[:1]
        met = np.flatnonzero(loop.robustness(omega, tried, order).max(axis=1) <= level)
        if len(met):
            sensitivity = float(loop.sensitivity(fine, tried[met[:1]], order).max())
            pace = min(a, float(tried[met[0]])) if order else a
            found.append(_Option(pace, sensitivity, a, order))
            if pace == a:
                break  # more poles would only add to it
    return found
