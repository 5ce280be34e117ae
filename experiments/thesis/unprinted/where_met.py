"""Where a printed number comes over the limit, in a reading of it that may jump or never happen."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import pairwise
from typing import Any

import numpy as np
from scipy.optimize import brentq, minimize_scalar

from experiments.thesis.claims.printed_number import PrintedNumber
from experiments.thesis.unprinted.printed_outcomes import printed_outcomes

_RESOLUTION = 1e-6  # of a limit, relative
_NEAREST = 1e-4  # of a limit, to which what comes nearest is followed
_NEVER = 1e6  # stands for what never happens, in any unit
_REACH = 20  # half units: farther from a level its crossing is bisected, nearer it is interpolated


@dataclass(frozen=True)
class Found:
    """A printed number, and what a reading comes to under the limits that were searched.

    Parameters
    ----------
    low, high
        An interval of the limit on which the reading is within half a unit of the last printed digit; NaN when there
        is none.
    closest
        The limit at which the reading comes nearest, within the interval if there is one; NaN if it never happens.
    computed
        The reading there; NaN when it never happens under any limit.
    """

    low: float
    high: float
    closest: float
    computed: float

    @property
    def met(self) -> bool:
        """Whether there is an interval."""
        return not math.isnan(self.low)


def where_met(
    reading: Callable[[float], float], limits: Sequence[float], values: Sequence[float], printed: PrintedNumber
) -> list[Found]:
    """Every interval of the limit on which a reading agrees with print; if there is none, where it comes nearest.

    Parameters
    ----------
    reading
        Of a limit; NaN for what never happens. It may jump.
    limits, values
        Shape (n,): increasing limits, and the reading at each, known already.
    printed
        What it is compared with.

    Returns
    -------
    list
        By increasing limit, at least one.

    Notes
    -----
    Between neighbours where the reading passes printed - half_unit, printed or printed + half_unit, the crossing or
    the jump is located to 1e-6 of the limit; where it never passes print, it is followed to where it comes nearest.
    What comes and goes between two neighbours is not seen.
    """
    known = {float(limit): _finite(value) for limit, value in zip(limits, values, strict=True)}

    def miss(limit: float, level: float = printed.value) -> float:
        limit = float(limit)
        if limit not in known:
            known[limit] = _finite(reading(limit))
        return known[limit] - level

    def clipped(limit: float, level: float) -> float:
        return float(np.clip(miss(limit, level), -_REACH * printed.half_unit, _REACH * printed.half_unit))

    def passed(level: float) -> list[tuple[float, float]]:
        return [pair for pair in pairwise(sorted(known)) if miss(pair[0], level) * miss(pair[1], level) < 0]

    grid = sorted(known)
    if not passed(printed.value) and all(miss(limit) for limit in grid):
        place = grid.index(min(grid, key=lambda limit: abs(miss(limit))))
        around = grid[max(place - 1, 0)], grid[min(place + 1, len(grid) - 1)]
        options: Any = {"maxiter": 12, "xatol": _NEAREST * around[1]}
        if len({known[grid[place]], *(known[limit] for limit in around)}) > 1:  # else it stays what it is
            minimize_scalar(lambda limit: abs(miss(limit)), bounds=around, method="bounded", options=options)
    cuts = {grid[0], grid[-1]}
    for level in (printed.value - printed.half_unit, printed.value, printed.value + printed.half_unit):
        for left, right in passed(level):
            near = _RESOLUTION * max(-left, right)
            if right - left > near:
                crossing = float(brentq(clipped, left, right, args=(level,), xtol=near))
                miss(crossing)
            else:  # a jump that another level has located
                crossing = next((cut for cut in cuts if left <= cut <= right), right)
            if level != printed.value:
                cuts.add(crossing)

    found: list[Found] = []
    for low, high in pairwise(sorted(cuts)):
        away = 2 * _RESOLUTION * max(-low, high)  # nearer to a cut it is not known on which side of it a limit lies
        inside = [limit for limit in known if low + away < limit < high - away] or [(low + high) / 2]
        best = min(inside, key=lambda limit: abs(miss(limit)))
        if abs(miss(best)) <= printed.half_unit:
            found.append(Found(low, high, best, known[best]))
    if found:
        return _joined(found, printed)
    best = min(known, key=lambda limit: abs(miss(limit)))
    return [Found(math.nan, math.nan, *((best, known[best]) if known[best] < _NEVER else (math.nan, math.nan)))]


def all_met(
    run: Callable[[float], Mapping[str, float]],
    known: Mapping[float, Mapping[str, float]],
    readings: Iterable[tuple[str, str]],
) -> list[tuple[str, str, list[Found]]]:
    """:func:`where_met` for several readings of the same runs: what is run for one is known to the next.

    Parameters
    ----------
    run
        Limit -> its readings, NaN for what never happens.
    known
        Limits with their readings.
    readings
        Each with its outcome.

    Returns
    -------
    list
        Outcome, reading, and where it is met.
    """
    known = dict(known)

    def value(limit: float, reading: str) -> float:
        if limit not in known:
            known[limit] = run(limit)
        return known[limit][reading]

    found = []
    for outcome, reading in readings:
        limits = sorted(known)
        values = [known[limit][reading] for limit in limits]
        found.append(
            (outcome, reading, where_met(partial(value, reading=reading), limits, values, printed_outcomes()[outcome]))
        )
    return found


def compared(outcome: str, found: Found) -> dict[str, float]:
    """What a table says of it: printed, tolerance (half a unit of the last digit), the interval, the closest limit."""
    number = printed_outcomes()[outcome]
    return {
        "printed": number.value,
        "tolerance": number.half_unit,
        "limit_low": found.low,
        "limit_high": found.high,
        "limit": found.closest,
        "computed": found.computed,
        "miss": found.computed - number.value,
        "met": int(found.met),
    }


def _joined(found: list[Found], printed: PrintedNumber) -> list[Found]:
    """Intervals that a cut parts without need are one."""
    joined = found[:1]
    for nxt in found[1:]:
        last = joined[-1]
        if nxt.low > last.high:
            joined.append(nxt)
        else:
            better = min(last, nxt, key=lambda one: abs(one.computed - printed.value))
            joined[-1] = Found(last.low, nxt.high, better.closest, better.computed)
    return joined


def _finite(value: float) -> float:
    return value if math.isfinite(value) else _NEVER
