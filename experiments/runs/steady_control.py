"""The control that keeps a plant's output on a reference in the steady state, and the most that it ever reaches."""

from __future__ import annotations

import math
from collections.abc import Sequence
from fractions import Fraction
from typing import NamedTuple

import numpy as np

from identification.model.plant import PlantModel

PI = Fraction(314159265358979323846264338327950288419716939937510582097494459230781640628620899, 10**80)
UNIT = 2.0**-52  # twice what one rounding changes
SAME = 1e-9  # as a share: as near to the ratio of two whole numbers two frequencies have it
LARGEST = 1000  # denominator of such a ratio
HARMONICS = 20_000  # most of a common slowest frequency
POINTS = 64  # of the fastest harmonic
PARTS = 16  # into which an interval that may hold the maximum is divided
CLOSE = 1e-13  # of the sum of the amplitudes: as near as a maximum is found


class Peak(NamedTuple):
    """The supremum of a size over time as it is computed, and an upper bound of it, all roundings included."""

    value: float
    at_most: float


class Wave(NamedTuple):
    """amplitude sin(omega t + phase_rad), omega > 0; ``doubt`` bounds what amplitude and phase are off, as a share."""

    amplitude: float
    omega: float
    phase_rad: float
    doubt: float


def response(plant: PlantModel, amplitude: float, omega: float, phase_rad: float) -> Wave:
    """The input amplitude/P(j omega) that makes the output amplitude sin(omega t + phase_rad), but for the dead time.

    The dead time shifts every wave by the same time, which makes no difference to what they reach.
    """
    needed = amplitude / complex(plant.without_delay()(1j * omega))
    factors = [*plant.zero_modes, *plant.pole_modes]
    # a mode near its resonance cancels all but its damping
    lost = sum(
        (1 + omega / mode.omega) ** 2 * (1 + abs(mode.zeta)) / abs(complex(mode(1j * omega))) for mode in factors
    )
    doubt = 16 * UNIT * (2 + lost + len(plant.real_zeros) + len(plant.real_poles))
    return Wave(abs(needed), omega, phase_rad + math.atan2(needed.imag, needed.real), doubt)


def steady_constant(plant: PlantModel, offset: float, slope: float) -> float:
    """The constant control that keeps a plant's output on offset + slope t once its transients are over.

    Parameters
    ----------
    plant
        K/s^q times factors that are 1 at s = 0; its zeros may lie in either half plane.
    offset, slope
        In the output's unit, and in that unit a second.

    Returns
    -------
    float
        In the input's unit: offset/K for q = 0 and slope/K for q = 1; 0 for q = 2, since such a plant keeps its speed
        by itself. Infinite where the control has to grow for ever: under a slope for q = 0, and under a constant or a
        slope for q < 0, where the control is the integral of r/K.
    """
    if (slope and plant.integrators < 1) or (offset and plant.integrators < 0):
        return math.inf
    return {0: offset, 1: slope}.get(plant.integrators, 0.0) / plant.gain


def peak(waves: Sequence[Wave], constant: float, doubt: float = 0.0) -> Peak:
    """The supremum over all time of |constant + sum of waves|.

    Parameters
    ----------
    waves
        Any number of waves.
    constant
        In their unit; infinite where the control grows for ever.
    doubt
        Bounds what the constant is off.

    Notes
    -----
    Waves whose frequencies are harmonics of one, up to the 20,000th and to 1e-9 of themselves, have a common period:
    their largest and least sum is found by branch and bound with the bound of the second derivative. Sets of waves
    without a common period are taken as independent; by Kronecker's theorem they then come as near as one likes to
    all their largest sums at once. The upper bound is one whether they are independent or not.
    """
    highest, lowest, error = 0.0, 0.0, doubt
    for group in _groups(waves):
        high, error_high = _largest(group, +1)
        low, error_low = _largest(group, -1)
        highest, lowest, error = highest + high, lowest + low, error + max(error_high, error_low)
    value = max(highest + constant, lowest - constant)
    return Peak(value, value + error + 4 * UNIT * (len(waves) + 1) * (abs(value) + abs(constant)))


def _groups(waves: Sequence[Wave]) -> list[list[tuple[int, Wave]]]:
    """Sets of waves with their harmonics of a common frequency; no two sets have one."""
    groups: list[list[Wave]] = []
    for wave in waves:
        for group in groups:
            if _harmonics([*group, wave]) is not None:
                group.append(wave)
                break
        else:
            groups.append([wave])
    return [list(zip(_harmonics(group) or [1], group, strict=True)) for group in groups]


def _harmonics(group: Sequence[Wave]) -> list[int] | None:
    ratios = [Fraction(wave.omega / group[0].omega).limit_denominator(LARGEST) for wave in group]
    exact = (wave.omega / group[0].omega for wave in group)
    if any(abs(ratio - x) > SAME * x for ratio, x in zip(ratios, exact, strict=True)):
        return None
    common = math.lcm(*(ratio.denominator for ratio in ratios))
    harmonics = [int(ratio * common) for ratio in ratios]
    divisor = math.gcd(*harmonics)
    return None if max(harmonics) > HARMONICS * divisor else [k // divisor for k in harmonics]


def _largest(group: Sequence[tuple[int, Wave]], sign: int) -> tuple[float, float]:
    """The largest value of sign times a sum of waves with a common period, and a bound of its error."""
    total = sum(wave.amplitude for _, wave in group)
    k = np.array([harmonic for harmonic, _ in group], dtype=float)
    amplitude, phase = (np.array([getattr(wave, name) for _, wave in group]) for name in ("amplitude", "phase_rad"))
    doubt = sum(
        2 * w.amplitude * (w.doubt + UNIT * (16 * harmonic + abs(w.phase_rad) + 8 + len(k))) for harmonic, w in group
    )
    if len(group) == 1:
        return total, doubt

    def values(x: np.ndarray) -> np.ndarray:
        waves = [a * np.sin(n * x + p) for a, n, p in zip(amplitude, k, phase, strict=True)]
        return np.asarray(sign * np.sum(waves, axis=0))

    step = 2 * math.pi / (POINTS * int(k.max()))
    starts, best, bend = np.arange(POINTS * int(k.max())) * step, -math.inf, float(amplitude @ k**2)
    while True:
        left, right = values(starts), values(starts + step)
        best, excess = max(best, float(left.max()), float(right.max())), bend * step**2 / 8
        if excess <= CLOSE * total:
            return best, excess + doubt
        starts = starts[np.maximum(left, right) + excess + 1e-15 * total >= best]
        step /= PARTS
        starts = (starts[:, None] + step * np.arange(PARTS)).ravel()
