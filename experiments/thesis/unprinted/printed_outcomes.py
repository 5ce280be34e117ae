"""What the thesis prints of its saturated runs: the numbers, our readings of its words, where a limit gives them."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from itertools import pairwise

import numpy as np
from scipy.optimize import brentq, minimize_scalar

from experiments.engine.simulate import Run
from experiments.runs.metrics import last_saturation, settling_time
from experiments.thesis.claims.ledger import read_ledger
from experiments.thesis.claims.printed_number import PrintedNumber, read_number

CLAIMS = {
    "error": "extended.tracking_error",
    "desaturation": "extended.desaturation_s",
    "recovery": "extended.recovery_s",
    "delay_free_error": "delay_free.tracking_error",
}
"""Outcome -> its row in claims.csv."""

READINGS = {
    "error": ("error_overall", "error_after_1s", "error_after_saturation", "error_last_period"),
    "desaturation": ("desaturation_s",),
    "recovery": ("recovery_saturation_s", "recovery_1_s", "recovery_2_s", "recovery_5_s", "recovery_to_offset_s"),
}
"""Outcome of chapter 4 -> the quantities that its words may mean, all ours; see the two functions that compute them."""

BANDS = {"recovery_1_s": 0.01, "recovery_2_s": 0.02, "recovery_5_s": 0.05}
CONVERGED_PERCENT = 1.0  # of the amplitude: the error of the last period of a run that "converges to zero"

_RESOLUTION = 1e-6  # of a limit, relative
_NEVER = 1e6  # stands for what never happens, in any unit
_REACH = 20  # half units: farther from a level its crossing is bisected, nearer it is interpolated


@cache
def printed_outcomes() -> dict[str, PrintedNumber]:
    """The printed numbers of :data:`CLAIMS`: 8.6 m, 4 s, 4.46 s (section 4.2) and 0.098 % (section 2.4).

    Raises
    ------
    InputError
        The ledger is missing or is not one.
    """
    printed = read_ledger().set_index("id")["printed"]
    return {outcome: read_number(printed[claim]) for outcome, claim in CLAIMS.items()}


def without_anti_windup(run: Run, span_s: float) -> dict[str, float]:
    """What section 4.2 says of Fig. 4.1 and 4.2, read off a run with the output ``error``.

    Parameters
    ----------
    run
        Of the loop without anti-windup.
    span_s
        Length of the last period in seconds.

    Returns
    -------
    dict
        The largest |e| in the unit of the output: ``error_overall``; ``error_after_1s``, from t = 1 s on;
        ``error_after_saturation``, from the last saturation on, NaN if that never comes; ``error_last_period``.
        ``desaturation_s``: the time of the last saturation, 0 without any, NaN when the run ends in saturation.
    """
    time_s, size = run.time_s, np.abs(run.outputs["error"])
    last = last_saturation(run)
    return {
        "error_overall": float(size.max()),
        "error_after_1s": float(size[time_s >= 1.0].max()),
        "error_after_saturation": float(size[time_s >= last].max()) if last <= time_s[-1] else math.nan,
        "error_last_period": float(size[time_s >= time_s[-1] - span_s].max()),
        "desaturation_s": last,
    }


def with_anti_windup(run: Run, amplitude: float, span_s: float) -> dict[str, float]:
    """What section 4.2 says of Fig. 4.3, read off a run with the output ``error``.

    Parameters
    ----------
    run
        Of the loop with the thesis's anti-windup.
    amplitude
        Of the reference, in the unit of the output.
    span_s
        Length of the last period in seconds.

    Returns
    -------
    dict
        ``recovery_saturation_s``: the time of the last saturation. ``recovery_1_s``, ``recovery_2_s``,
        ``recovery_5_s``: after it |e| stays within 1, 2, 5 % of the amplitude. ``recovery_to_offset_s``: after it e
        stays within 1 % of the amplitude from the offset that it keeps, the middle between the extremes of the last
        period. Each is NaN when it never comes. ``final_error_percent`` and ``final_offset_percent``: the largest |e|
        of the last period, and that middle, in percent of the amplitude.
    """
    time_s, error = run.time_s, run.outputs["error"]
    tail = error[time_s >= time_s[-1] - span_s]
    offset = (tail.max() + tail.min()) / 2
    settled = {name: settled_s(time_s, error, band * amplitude) for name, band in BANDS.items()}
    return {
        "recovery_saturation_s": last_saturation(run),
        **settled,
        "recovery_to_offset_s": settled_s(time_s, error - offset, BANDS["recovery_1_s"] * amplitude),
        "final_error_percent": 100 * float(np.abs(tail).max()) / amplitude,
        "final_offset_percent": 100 * float(offset) / amplitude,
    }


def settled_s(time_s: np.ndarray, error: np.ndarray, band: float) -> float:
    """The time at which |error| enters ``band`` for good, between the samples by a straight line; NaN if never.

    Parameters
    ----------
    time_s, error
        Shape (s,).
    band
        In the unit of the error.
    """
    first = settling_time(time_s, error, band)
    if not first > time_s[0]:  # from the beginning, or never
        return first
    last = int(np.searchsorted(time_s, first)) - 1
    # e and not |e| is smooth: it enters through the side of the band on which it was
    edge = math.copysign(band, error[last])
    share = (error[last] - edge) / (error[last] - error[last + 1])
    return float(time_s[last] + share * (time_s[last + 1] - time_s[last]))


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

    grid = sorted(known)
    if all(miss(left) * miss(right) > 0 for left, right in pairwise(grid)):
        place = grid.index(min(grid, key=lambda limit: abs(miss(limit))))
        around = grid[max(place - 1, 0)], grid[min(place + 1, len(grid) - 1)]
        turn = minimize_scalar(lambda limit: abs(miss(limit)), bounds=around, method="bounded", options={"maxiter": 12})
        grid = sorted({*grid, float(turn.x)})
    cuts = {grid[0], grid[-1]}
    for level in (printed.value - printed.half_unit, printed.value, printed.value + printed.half_unit):
        for left, right in pairwise(grid):
            if miss(left, level) * miss(right, level) < 0:
                crossing = float(brentq(clipped, left, right, args=(level,), xtol=_RESOLUTION * max(-left, right)))
                miss(crossing)
                if level != printed.value:
                    cuts.add(crossing)

    found: list[Found] = []
    for low, high in pairwise(sorted(cuts)):
        away = 2 * _RESOLUTION * max(-low, high)  # nearer to a cut it is not known on which side of it a limit lies
        middle = (low + high) / 2
        miss(middle)
        inside = [limit for limit in known if low + away < limit < high - away] or [middle]
        best = min(inside, key=lambda limit: abs(miss(limit)))
        if abs(miss(best)) <= printed.half_unit:
            found.append(Found(low, high, best, known[best]))
    if found:
        return _joined(found, printed)
    best = min(known, key=lambda limit: abs(miss(limit)))
    return [Found(math.nan, math.nan, *((best, known[best]) if known[best] < _NEVER else (math.nan, math.nan)))]


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
