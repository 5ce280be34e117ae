"""Which lines of a record's spectrum the input excites: the band of a sweep, the harmonics of a repeated input."""

from __future__ import annotations

import numpy as np

from identification.base.arrays import Real, Whole

EXCITED = 1e-3  # of the typical power of the excited lines (-30 dB)
PERIODIC = 0.95  # correlation with itself, periods later, of an input that is repeated


def whole_periods(u: Real, y: Real, *, shortest: int) -> tuple[Real, Real, int]:
    """Cut a record with a repeated input to whole periods.

    Parameters
    ----------
    u, y
        (N,) input and output.
    shortest
        Samples that a period has at least: half of them are its lines.

    Returns
    -------
    tuple
        The last whole periods of both channels and one sample before them, and the number of periods; the whole
        record and 1 if the input is not repeated. A record of whole periods loses its first, in which the
        plant settles.
    """
    swing = u - np.mean(u)
    lag = np.arange(u.size // 2 + 1)
    products = np.fft.irfft(np.abs(np.fft.rfft(swing, 2 * u.size)) ** 2)[lag]
    energy = np.concatenate([[0.0], np.cumsum(swing**2)])
    overlapping = np.sqrt(energy[u.size - lag] * (energy[-1] - energy[lag]))
    alike = products > PERIODIC * np.maximum(overlapping, energy[-1] / 4)
    late = max(u.size // 4, shortest)
    if not alike[late:].any():
        return u, y, 1
    longest = late + int(np.argmax(products[late:] * alike[late:]))
    for count in range(longest // shortest, 0, -1):
        period = longest / count
        if alike[np.rint(period * np.arange(1, count + 1)).astype(int)].all():
            break
    periods = int((u.size - 1) // period)
    kept = round(periods * period) + 1
    return u[-kept:], y[-kept:], periods


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
