"""Record of a repeated input -> frequency response at the harmonics of its period, its variance from the scatter."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from identification.base.arrays import Complex, Real, Whole
from identification.base.errors import InputError
from identification.sweeps.excited_lines import excited_harmonics
from identification.sweeps.usable_lines import FEWEST

FEWEST_PERIODS = 1.5  # that are left when the beginning of a record is dropped
HALVINGS = 8  # of the longest beginning that is dropped
TOLD = 12  # complex degrees of freedom, at least, of which the noise at a harmonic is told


@dataclass(frozen=True)
class Harmonics:
    """The response at K excited harmonics.

    Parameters
    ----------
    number
        (K,) the harmonics, 1 the first.
    response
        (K,) output's spectrum over the input's.
    gain
        (K,) the variance of its error over the power density of the noise.
    noise
        (K,) estimate of the noise's power density.
    """

    number: Whole
    response: Complex
    gain: Real
    noise: Real

    @property
    def uncertainty(self) -> float:
        """Mean logarithm of the error's variance."""
        return float(np.mean(np.log(self.gain * self.noise)))


def periodic_response(u: Real, y: Real, period: int, *, below: float) -> Harmonics:
    """Estimate the response from the mean of the periods, and its variance from their scatter.

    Parameters
    ----------
    u, y
        (N,) input and output.
    period
        Samples of a period: N/2 at most.
    below
        Harmonics from this number on are not used.

    Raises
    ------
    InputError
        Fewer than FEWEST harmonics are excited.

    Notes
    -----
    Under a repeated input the output of up to two integrators is periodic but for a parabola in time. Both are fitted
    to the record by least squares, which is exact: the parabola is what differs between samples of equal phase. It
    costs little at the lowest harmonics alone, and the scatter would not tell a ramp: it moves whole periods. What the
    record's beginning adds decays: the part of the record is dropped with which the error that the scatter tells is
    least.

    References
    ----------
    Pintelon, Schoukens, "System Identification: A Frequency Domain Approach", 2nd ed., section 2.5.
    """
    mean, rest = _mean_and_rest(u, period)
    scatter = np.sum(np.abs(_periods(rest, period)) ** 2, axis=0) / (u.size / period - 1) * (period / u.size)
    number = excited_harmonics(np.abs(np.fft.rfft(mean)) ** 2, scatter)
    number = number[number < below]
    if number.size < FEWEST:
        raise InputError(
            f"the input repeats itself every {period} samples and excites {number.size} harmonics of that; expected "
            f"{FEWEST} or more"
        )
    longest = u.size - FEWEST_PERIODS * period
    starts = {0, *(int(longest / 2**k) for k in range(HALVINGS))}
    looks = (_look(u[start:], y[start:], period, number) for start in sorted(starts))
    return min(looks, key=lambda look: look.uncertainty)


def _look(u: Real, y: Real, period: int, number: Whole) -> Harmonics:
    """The response at the harmonics ``number`` (K,) if nothing of the record is dropped."""
    place = np.linspace(-1, 1, u.size)
    means, rests = zip(*(_mean_and_rest(x, period) for x in (u, y, place, place**2)), strict=True)
    drift_rest, drift_mean = np.stack(rests[2:]), np.stack(means[2:])
    covariance = np.linalg.inv(drift_rest @ drift_rest.T)  # over the variance of a sample
    size = covariance @ (drift_rest @ rests[1])
    big_u, big_y = (np.fft.rfft(x)[number] for x in (means[0], means[1] - size @ drift_mean))
    response = big_y / big_u
    left_u, left_y = (_periods(x, period)[:, number] for x in (rests[0], rests[1] - size @ drift_rest))
    freedom = u.size / period - 1
    scatter = np.sum(np.abs(left_y - response * left_u) ** 2, axis=0) / freedom
    rounding = np.finfo(float).eps ** 2 * period * np.mean(y**2)
    drift = np.fft.rfft(drift_mean, axis=1)[:, number]
    of_drift = np.einsum("ik,ij,jk->k", drift.conj(), covariance, drift).real / period
    of_mean = np.mean(1 / np.bincount(np.arange(u.size) % period))
    return Harmonics(
        number=number,
        response=response,
        gain=(of_mean + of_drift) / np.abs(big_u) ** 2,
        noise=_running_mean(scatter, math.ceil(TOLD / freedom)) + rounding,
    )


def _mean_and_rest(x: Real, period: int) -> tuple[Real, Real]:
    """Mean (period,) of the samples of each phase, and what is left of them (N,)."""
    phase = np.arange(x.size) % period
    mean = np.bincount(phase, x) / np.bincount(phase)
    return mean, x - mean[phase]


def _periods(x: Real, period: int) -> Complex:
    """Spectrum of each period; zeros complete the last."""
    return np.fft.rfft(np.pad(x, (0, -x.size % period)).reshape(-1, period), axis=1)


def _running_mean(x: Real, width: int) -> Real:
    """Mean of ``x`` (K,) over the nearest ``width`` values, as many at the ends."""
    width = min(width, x.size)
    means = np.mean(np.lib.stride_tricks.sliding_window_view(x, width), axis=1)
    return np.asarray(means[np.clip(np.arange(x.size) - width // 2, 0, means.size - 1)])
