"""Residuals at single frequencies -> the envelope that bounds are measured against."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from identification.base.arrays import Real, Whole

WIDTH = 0.1  # of the narrowest notch that is followed, in log frequency,
PARTS = 30  # or, where less, the band over this,
RESIDUALS = 4  # and the number in it: that as many random ones are small together is rare


@dataclass(frozen=True)
class Envelope:
    """The level of residuals, linear between its frequencies in double logarithmic scales.

    Parameters
    ----------
    omega
        (K,) rad/s, increasing.
    level
        (K,) positive, at least the largest residual there.
    """

    omega: Real
    level: Real

    def __call__(self, omega: Real) -> Real:
        """The level at omega (M,) rad/s, without rounding at its own frequencies; zero outside the residuals' band."""
        last = self.omega.size - 1
        before = np.clip(np.searchsorted(self.omega, omega, side="right") - 1, 0, last)
        after = np.minimum(before + 1, last)
        width = np.where(after > before, np.log(self.omega[after] / self.omega[before]), 1.0)
        inside = (omega >= self.omega[0]) & (omega <= self.omega[last])
        share = np.where(inside, np.log(omega / self.omega[before]) / width, 0.0)
        return np.where(inside, self.level[before] * (self.level[after] / self.level[before]) ** share, 0.0)


def envelope_of(omega: Real, residual: Real) -> Envelope:
    """The smallest over all windows that hold a frequency of the largest residual in the window.

    Parameters
    ----------
    omega, residual
        (M,) rad/s, in any order and repeated as it comes, and magnitudes, not all zero.

    Notes
    -----
    This is a morphological closing: peaks stay as they are, while a notch is filled up to the lower of its two
    sides, if it is narrower than WIDTH or holds fewer than RESIDUALS. A residual is the length of a random complex
    number; single ones come near zero by chance, and a bound need not follow them down. A window that holds
    RESIDUALS is as wide as the lines are apart, so sparse tests, tests on different lines, and a single test need
    nothing of their own. Where all are zero the level is that between the nearest others, or of the nearest one.
    """
    frequencies, largest, count = largest_of(omega, residual)
    level = np.full(frequencies.size, largest.max())
    # windows that are the narrowest to begin somewhere, and, seen from the other end, the narrowest to end there
    for side in (slice(None), slice(None, None, -1)):
        distance = np.abs(np.log(frequencies[side] / frequencies[side][0]))
        level[side] = np.minimum(level[side], _closed(distance, largest[side], count[side]))
    held = level > 0
    level[[0, -1]] = level[held][[0, -1]]
    held[[0, -1]] = True
    return Envelope(frequencies[held], level[held])


def largest_of(omega: Real, residual: Real) -> tuple[Real, Real, Whole]:
    """The different frequencies (K,) of (M,), the largest residual at each, and the number of residuals there."""
    frequencies, where, count = np.unique(omega, return_inverse=True, return_counts=True)
    largest = np.zeros(frequencies.size)
    np.maximum.at(largest, where, residual)
    return frequencies, largest, count


def _closed(x: Real, values: Real, count: Whole) -> Real:
    """Smallest of the largest value of each window that holds a point; infinity where none does."""
    upto = np.cumsum(count)
    width = min(WIDTH, x[-1] / PARTS)
    last = np.maximum(np.searchsorted(x, x + width), np.searchsorted(upto, upto - count + RESIDUALS))
    last = last[last < x.size]
    closed = np.full(x.size, np.inf)
    if last.size:
        largest = _over(np.maximum, values, np.arange(last.size), last)
        first_window = np.searchsorted(last, np.arange(x.size))
        last_window = np.minimum(np.arange(x.size), last.size - 1)
        inside = first_window <= last_window
        closed[inside] = _over(np.minimum, largest, first_window[inside], last_window[inside])
    return closed


def _over(extreme: np.ufunc, values: Real, first: Whole, last: Whole) -> Real:
    """np.maximum or np.minimum over values[first : last + 1] for arrays of ends, by doubling the length."""
    level = np.log2(last - first + 1).astype(int)
    found = np.empty(first.size)
    for k in range(int(level.max(initial=-1)) + 1):
        here = level == k
        found[here] = extreme(values[first[here]], values[last[here] - 2**k + 1])
        values = extreme(values[: -(2**k)], values[2**k :])
    return found
