"""Which lines of a record's spectrum the input excites: the band of a sweep, the harmonics of a repeated input."""

from __future__ import annotations

import numpy as np

from identification.base.arrays import Real, Whole
from identification.sweeps.local_models import SIGNIFICANT

EXCITED = 1e-3  # of the typical power of the excited lines (-30 dB)
PERIODIC = 0.95  # correlation with itself, periods later, of an input that is repeated


def period_of(u: Real, *, shortest: int) -> float:
    """Samples in a period of the input ``u`` (N,), its size if it is not repeated.

    The number is whole where a whole one is as near as the correlation tells, else what the correlation tells. A period
    has ``shortest`` samples at least: half of them are its lines.
    """
    swing = u - np.mean(u)
    lag = np.arange(u.size // 2 + 1)
    products = np.fft.irfft(np.abs(np.fft.rfft(swing, 2 * u.size)) ** 2)[lag]
    energy = np.concatenate([[0.0], np.cumsum(swing**2)])
    overlapping = np.sqrt(energy[u.size - lag] * (energy[-1] - energy[lag]))
    alike = products > PERIODIC * np.maximum(overlapping, energy[-1] / 4)
    late = max(u.size // 4, shortest)
    if not alike[late:].any():
        return float(u.size)
    longest = late + int(np.argmax(products[late:] * alike[late:]))
    for count in range(longest // shortest, 0, -1):
        period = longest / count
        if alike[np.rint(period * np.arange(1, count + 1)).astype(int)].all():
            break
    return float(round(period)) if abs(round(period) * count - longest) <= 1 else period


def whole_periods(u: Real, y: Real, period: float) -> tuple[Real, Real, int]:
    """The last whole periods of input and output, both (N,), one sample before them, and the number of periods.

    A record of whole periods loses its first, in which the plant settles; one of a single period is left as it is.
    """
    periods = max(1, int((u.size - 1) // period))
    kept = round(periods * period) + 1
    return u[-kept:], y[-kept:], periods


def excited_harmonics(power: Real, scatter: Real) -> Whole:
    """Find the harmonics that a repeated input excites: all, odd ones, or any others.

    Parameters
    ----------
    power, scatter
        (L,) the mean's power at 0, 1, ... times the fundamental frequency, and the variance of the mean.

    Returns
    -------
    Whole
        (K,) numbers of the harmonics with a power of EXCITED and more of the typical one,
        in the octave around them and in all. What is typical in all is that of evenly weighted harmonics or that of
        harmonics weighted by their frequency, see :func:`excited_band`.
    """
    number = np.arange(1, power.size)
    power, scatter = power[number], scatter[number]
    total, square = (np.concatenate([[0.0], np.cumsum(power**exponent)]) for exponent in (1, 2))
    first = np.ceil(number / np.sqrt(2)).astype(int) - 1
    last = np.minimum(np.floor(number * np.sqrt(2)).astype(int), number.size)
    here, among = square[last] - square[first], total[last] - total[first]
    weak = power * among < EXCITED * here
    enough = np.zeros(number.size, dtype=bool)
    for weighted in (power, power * number):
        enough |= weighted * np.sum(weighted) >= EXCITED * np.sum(weighted**2)
    return np.asarray(number[enough & ~weak & (power > SIGNIFICANT * scatter)])


def excited_band(power: Real, *, smoothing: int) -> Whole:
    """Find the run of neighbouring lines that holds most of the input's energy.

    Parameters
    ----------
    power
        (L,) of the input at the lines 1, 2, ... L.
    smoothing
        Lines over which the mean power is that of the run, odd and not more than L.

    Returns
    -------
    Whole
        The run's indices into ``power``, increasing by one.

    Notes
    -----
    The energy of a sweep whose frequency grows exponentially falls as 1/frequency: of the run of evenly weighted
    lines and that of lines weighted by their frequency the one over more octaves is taken, the smoothed ones apart.
    """
    runs = [_run(power, power * np.arange(1, power.size + 1.0) ** slope, smoothing) for slope in (0, 1)]
    return max(runs, key=lambda run: run[-1] / max(run[0], smoothing))


def _run(power: Real, weighted: Real, smoothing: int) -> Whole:
    # A noisy input has single weak lines, so the run is found on a wide mean; its ends are then cut on a narrow one.
    wide, narrow = (np.convolve(weighted, np.full(width, 1 / width), mode="same") for width in (smoothing, 3))
    threshold = EXCITED * np.sum(wide**2) / np.sum(wide)
    excited = np.concatenate([[False], wide > threshold, [False]])
    starts, stops = np.flatnonzero(np.diff(excited.astype(int))).reshape(-1, 2).T
    energy = np.concatenate([[0.0], np.cumsum(power)])
    best = np.argmax(energy[stops] - energy[starts])
    run = np.arange(starts[best], stops[best])
    inside = np.flatnonzero(narrow[run] > threshold)
    return run[inside[0] : inside[-1] + 1]
