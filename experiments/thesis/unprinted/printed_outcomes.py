"""What the thesis prints of its saturated runs: the numbers, and our readings of its words."""

from __future__ import annotations

import math
from functools import cache

import numpy as np

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

COUNTED_FROM_THE_END = READINGS | {"recovery": tuple(f"{name}_after" for name in READINGS["recovery"][1:])}
"""The same with 4.46 s counted from the last saturation of the run with anti-windup."""

OUTCOMES = {
    "none": (*READINGS["error"], *READINGS["desaturation"]),
    "thesis": (*READINGS["recovery"], "final_error_percent", "final_offset_percent"),
}
"""What is read off a run without anti-windup, and off one with the thesis's."""

BANDS = {"recovery_1_s": 0.01, "recovery_2_s": 0.02, "recovery_5_s": 0.05}
CONVERGED_PERCENT = 1.0  # of the amplitude: the error of the last period of a run that "converges to zero"


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


def after_saturation(outcomes: dict[str, float]) -> dict[str, float]:
    """The outcomes of :func:`with_anti_windup`, and each settling counted from the last saturation on."""
    last = outcomes["recovery_saturation_s"]
    return outcomes | {f"{name}_after": outcomes[name] - last for name in READINGS["recovery"][1:]}


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
