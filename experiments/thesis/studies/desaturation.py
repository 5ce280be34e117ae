"""What the thesis says of the time in which chapter 4's loop leaves saturation."""

from __future__ import annotations

from math import tau

from data.thesis import printed_numbers

PERIODS = 5  # the thesis does not print its horizon


def desaturation(period_s: float) -> float:
    """The thesis's "around 4 seconds" in which the loop leaves saturation, as a share of its reference's period.

    Parameters
    ----------
    period_s
        Of the reference's slowest sinusoid; the printed one gives the printed time.
    """
    chosen = printed_numbers()["extended"]
    share = period_s / (tau / chosen["reference"]["omega"])
    return float(chosen["desaturation_s"] * share)
