"""Numbers read off a run: peak, settling, lasting offset, last saturation."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from experiments.engine.simulate import Run


def last_saturation(run: Run) -> float:
    """The time in seconds at which the control leaves saturation for good; NaN when it never does or diverges.

    It is the last located event of the run, no sample; 0 when the control never saturates.
    """
    if not np.isfinite(run.control[-1]):
        return float("nan")
    if len(run.modes) == 0:
        return 0.0 if run.control[-1] == run.saturated_control[-1] else float("nan")
    return float(run.events_s[-1]) if run.modes[-1] == 0 else float("nan")


def settling_time(time_s: np.ndarray, error: np.ndarray, band: float) -> float:
    """The first sample time after which |error| stays within ``band``; NaN when the last sample is outside it."""
    outside = np.flatnonzero(~(np.abs(error) <= band))  # NaN, after a divergence, is outside
    if not len(outside):
        return float(time_s[0])
    return float("nan") if outside[-1] == len(time_s) - 1 else float(time_s[outside[-1] + 1])


def recovery(time_s: np.ndarray, distance: np.ndarray, band: float, period_s: float) -> float:
    """The first sample time after which a distance stays within ``band``, for a period at least; else NaN.

    Where the period is infinite it stays there for as long as it took, at least.
    """
    settled = settling_time(time_s, distance, band)
    stays = period_s if np.isfinite(period_s) else settled - time_s[0]
    return settled if settled + stays <= time_s[-1] * (1 + 1e-12) else float("nan")


def of_table(rate_limit: float) -> float:
    """A rate limit as a cell of a table: empty where there is none."""
    return rate_limit if np.isfinite(rate_limit) else float("nan")


def over_last(time_s: np.ndarray, error: np.ndarray, span_s: float) -> tuple[float, float]:
    """Offset (middle between the extremes) and ripple (half their distance) of the error over the last ``span_s``."""
    tail = error[time_s >= time_s[-1] - span_s]
    return float((tail.max() + tail.min()) / 2), float((tail.max() - tail.min()) / 2)
