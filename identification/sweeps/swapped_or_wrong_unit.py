"""What no plant's frequency response shows, but a swapped input and output or a phase in another unit does."""

from __future__ import annotations

import numpy as np

from identification.base.arrays import Complex, Real

MOST_LINES = 400
LEAST, MOST_TURNS = 6.5, 250  # of the phase over the band: rad, more than a turn, and turns
FEWEST_LINES = 6  # in half of the band
EDGE = 0.1  # of the band at its top, where zeros above it turn the phase
ALIGNED = 0.6  # mean of the lines' unit phasors
DECISIVE = 2.5  # times better aligned than by any dead time
RESOLVED = 0.5  # rad from line to line, far from the half turn where a dead time looks like its opposite
SPAN, JUMP = 1.01, 0.8  # turns: the phase stays within the one and yet steps by more than the other
BEND = 1.0  # neper; with its phase in 6.3 degrees a response bends 0.6 at most in a study of 20000 plants


def lead_time(omega: Real, response: Complex) -> float:
    """Seconds by which the output leads the input, where that is beyond doubt; else 0.

    Parameters
    ----------
    omega
        (M,) rad/s, positive, increasing.
    response
        (M,) complex.

    Notes
    -----
    The magnitude of a plant without zeros in the right half plane tells its phase but for the dead time (Bode). That
    phase is taken off, with the magnitude going on as a power of omega outside the band, and what is left is turned
    back by leads and dead times tau: exp(j omega tau) aligns all lines if tau is the dead time. What lies just above
    the band bends the phase near the top, so a lead has to align both halves of the rest, and each better than any
    dead time does. It also has to turn the phase by more than one turn over the band: less may be a plant's zeros.
    """
    spacing = np.median(np.diff(omega)) / omega[-1]
    lines = np.flatnonzero(response)
    if lines.size > MOST_LINES:  # by chance: evenly thinned lines would make a long dead time look like a lead
        lines = np.sort(np.random.default_rng(0).choice(lines, MOST_LINES, replace=False))
    if lines.size < 2 * FEWEST_LINES:
        return 0.0
    x = omega[lines] / omega[-1]
    left = np.exp(1j * (np.angle(response[lines]) - _minimum_phase(x, np.log(np.abs(response[lines])))))
    band = (1 - EDGE) * (x[-1] - x[0])
    most = min(RESOLVED / spacing * band, 2 * np.pi * MOST_TURNS)
    turned = np.arange(0, most, np.pi / 2)  # rad over the band
    leads = turned > LEAST
    if not leads.any():
        return 0.0
    halves = [x < x[0] + band / 2, (x >= x[0] + band / 2) & (x <= x[0] + band)]
    if min(half.sum() for half in halves) < FEWEST_LINES:
        return 0.0
    back = np.exp(1j * np.outer(turned / band, x))
    led = np.array([np.abs(back[leads].conj()[:, half] @ left[half]) / half.sum() for half in halves])
    lagged = np.array([np.abs(back[:, half] @ left[half]) / half.sum() for half in halves])
    convincing = np.all((led > ALIGNED) & (led > DECISIVE * lagged.max(axis=1, keepdims=True)), axis=0)
    if not convincing.any():
        return 0.0
    best = np.argmax(np.where(convincing, led.min(axis=0), 0))
    return float(turned[leads][best] / band / omega[-1])


def _minimum_phase(x: Real, level: Real) -> Real:
    """Phase (M,) in rad, but for a constant, of the plant without dead time whose ln|P| is ``level`` (M,).

    Bode's integral of the level's slope, exact for straight pieces; a power of x only adds a constant.
    """
    rest = level - np.polyval(np.polyfit(np.log(x), level, 1), np.log(x))
    total, gap = x + x[:, None], x - x[:, None]
    kernel = total * np.log(total) - gap * np.log(np.abs(np.where(gap == 0, 1, gap)))
    return np.asarray(np.diff(kernel, axis=1) @ (np.diff(rest) / np.diff(x)) / np.pi)


def wrap(phase: Real, turn: float) -> int | None:
    """The first line (from 0) at which a phase is seen to be wrapped at ``turn``, or None.

    The phase (M,) stays within one turn, and yet steps by almost a turn from one line to the next.
    """
    step = np.abs(np.diff(phase))
    wrapped = step > JUMP * turn
    return int(np.argmax(wrapped)) + 1 if np.ptp(phase) < SPAN * turn and wrapped.any() else None


def bends(omega: Real, magnitude: Real) -> bool:
    """Whether the magnitude (M,) departs so far from a power of omega that its phase moves by many degrees (Bode)."""
    lines = np.flatnonzero(magnitude)
    x, level = np.log(omega[lines]), np.log(magnitude[lines])
    return lines.size > 2 and float(np.ptp(level - np.polyval(np.polyfit(x, level, 1), x))) > BEND
