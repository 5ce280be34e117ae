"""What lines can say of a dead time: equally spaced ones hardly tell it from one that is some turns longer."""

from __future__ import annotations

import numpy as np

from identification.base.arrays import Complex, Real

SAME = 0.02  # of the spacing, within which lines are equally spaced, or a multiple of half of it
MORE_TURNS = 3  # of the phase from line to line, that are tried for a dead time
MOST_DELAYS = 100_000  # dead times that are told apart: lines very unevenly apart could tell more


def spacing_of(omega: Real) -> float | None:
    """The step in rad/s of which all steps between lines (M,) are multiples, the least of them; None without one."""
    steps = np.diff(omega)
    counts = np.rint((omega - omega[0]) / steps.min())
    spacing = float((omega[-1] - omega[0]) / counts[-1])
    apart = np.abs(omega - omega[0] - counts * spacing)
    return spacing if np.max(apart) < SAME * spacing else None


def same_turn(omega: Real) -> float | None:
    """The dead time in seconds of whose multiples lines (M,) in rad/s say nothing; None where they say something.

    Lines c + k d turn by exp(-j c 2 pi/d), all alike, in 2 pi/d seconds: if c is a multiple of d, that is nothing, and
    if it is one of d/2, that is the gain's sign.
    """
    spacing = spacing_of(omega)
    if spacing is None:
        return None
    halves = 2 * omega[0] / spacing
    return 2 * np.pi / spacing if abs(halves - np.rint(halves)) < SAME else None


def tells_turns(omega: Real) -> bool:
    """Whether lines (M,) are equally spaced and yet tell dead times apart that differ by a turn from line to line."""
    return spacing_of(omega) is not None and same_turn(omega) is None


def turns_sign(omega: Real) -> bool:
    """Whether :func:`same_turn` seconds turn the phase by half a turn, at all lines."""
    spacing = spacing_of(omega)
    return spacing is not None and bool(np.rint(2 * omega[0] / spacing) % 2)


def group_delay(omega: Real, response: Complex) -> float:
    """The dead time in seconds that the phase increments between neighbouring lines agree on best.

    Notes
    -----
    The phase is not unwrapped: one wrong turn at a sharp zero would tilt all that follows. Each increment, wrapped
    to (-pi, pi], votes for the delays h with increment + h * step near a multiple of 2 pi; the delay with
    the most votes wins. Equal steps cannot tell a delay from one that is a turn of the usual step longer.
    """
    step = np.diff(omega)
    increment = np.angle(response[1:] * response[:-1].conj())
    finest = 0.25 / np.max(step)
    delays = np.arange(0.0, min(turn_of(omega), MOST_DELAYS * finest), finest)
    votes = np.zeros(delays.size)
    for block in np.array_split(np.arange(delays.size), 1 + delays.size * step.size // 500_000):
        votes[block] = np.cos(increment + delays[block, None] * step).sum(axis=1)
    best = delays[np.argmax(votes)]
    left = np.angle(np.exp(1j * (increment + best * step)))
    return max(0.0, float(best - np.median(left / step)))


def likely_delays(omega: Real, response: Complex) -> Real:
    """The dead times (K,) in seconds, not all positive, near one of which that of a response (M,) lies.

    They are that of :func:`group_delay` and one turn less, since a lead looks like a delay of almost a turn; and some
    turns more, where the lines are equally spaced and yet tell these apart.
    """
    more = MORE_TURNS if tells_turns(omega) else 0
    return np.asarray(group_delay(omega, response) + np.arange(-1, more + 1) * turn_of(omega))


def turn_of(omega: Real) -> float:
    """The dead time in seconds that turns the phase once from one of most lines (M,) to the next."""
    return 2 * np.pi / float(np.quantile(np.diff(omega), 0.1))
