"""Which lines of an estimated response say something about the plant, and why the others do not."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from identification.base.arrays import Complex, Real
from identification.base.errors import InputError
from identification.sweeps.local_models import TOGETHER, pooled
from identification.sweeps.response import LeftOut

FEWEST = 9  # lines of a response: three windows
WEAKEST = 4.0  # a line whose variance is this much over that of others carries little and would widen a bound
WORTH = 0.1  # error over response of a line that says something, however well the others are known
DROWNED = 0.5  # error over response from which a band tells of the noise


@dataclass(frozen=True)
class SweepEstimate:
    """A response at M lines whose errors are independent; within a window that takes a pole they correlate by 0.3.

    Parameters
    ----------
    omega
        (M,) rad/s, increasing.
    response
        (M,) output unit per input unit.
    variance
        (M,) estimate of E|error|^2, from what the local models leave, or from the scatter of periods.
    excitation
        (M,) how the error's variance goes from line to line on account of the excitation alone: the variance is
        this times the power density of the noise. Its median is 1.
    left_out
        Lines that say too little about the plant, and why.
    """

    omega: Real
    response: Complex
    variance: Real
    excitation: Real
    left_out: tuple[LeftOut, ...]


def usable_lines(
    omega: Real, response: Complex, gain: Real, alone: Real, noise: Real, left_out: tuple[LeftOut, ...] = ()
) -> SweepEstimate:
    """Tell the lines that carry information from those to leave out.

    Parameters
    ----------
    omega, response
        (C, n) the nodes of C windows, in rad/s, and the response there; or C harmonics, each a node.
    gain, alone
        (C, n) the variance of its error over the power density of the noise, as it is and as it were if the record
        cut nothing off at its ends.
    noise
        (C,) power density of the noise in each window.
    left_out
        Other lines, which have been left out.

    Returns
    -------
    SweepEstimate
        Of the lines to keep. Lines beyond the band that the input excites are neither kept nor left out.

    Raises
    ------
    InputError
        Fewer than FEWEST lines are to keep.

    Notes
    -----
    Errors are compared with the response to find the band in which most octaves are clear; within it a small response
    is a measurement, as at an anti-resonance. A line that is excited less than those in an octave around it is left
    out, as at a sweep's ends, where a little of what no model sees does much. So is one that is excited less than most,
    unless it is as well known as they, relative to the response, or to a tenth: a response that falls by decades is
    known best where its errors are largest. Noise and response are those of several windows together, so that
    the noise of a line does not choose it.
    """
    typical, excited = pooled(np.median(gain, axis=1)), pooled(np.median(alone, axis=1))
    power = pooled(np.mean(np.abs(response) ** 2, axis=1))
    relative = np.maximum(noise, pooled(noise))[:, None] * gain / np.where(power > 0, power, np.inf)[:, None]
    centre = omega[:, omega.shape[1] // 2]
    octaves = np.gradient(np.log(centre))
    first, last = _best_run(np.where(np.median(relative, axis=1) < DROWNED**2, octaves, -octaves))
    drowned = np.ones(omega.shape, dtype=bool)
    drowned[first:last] = False
    torn = np.broadcast_to((typical > WEAKEST * excited)[:, None], omega.shape)
    weak = gain > WEAKEST * _around(centre, np.median(gain, axis=1))[:, None]
    if (rest := ~drowned & ~torn).any():
        little = max(WORTH**2, WEAKEST * float(np.median(relative[rest])))
        weak |= (gain > WEAKEST * np.median(gain[rest])) & (relative > little)
    kept = rest & ~weak
    ends = omega[kept][[0, -1]] if kept.any() else omega.ravel()[[0, -1]]
    reasons = {
        "the input excites them too little": weak & (omega >= ends[0]) & (omega <= ends[1]),
        "the transients at the ends of the record hide the response": torn & ~drowned & ~weak,
        "noise is more than half of the response": drowned & ~weak,
    }
    left_out += tuple(LeftOut(omega[lines], response[lines], why) for why, lines in reasons.items() if lines.any())
    if kept.sum() < FEWEST:
        why = "; ".join(map(str, left_out)) or "a longer record or a wider sweep"
        raise InputError(f"{kept.sum()} spectral lines can be used; expected {FEWEST} or more ({why})")
    return SweepEstimate(
        omega=omega[kept],
        response=response[kept],
        variance=(gain * noise[:, None])[kept],
        excitation=(gain / np.median(gain[kept]))[kept],
        left_out=left_out,
    )


def _around(omega: Real, level: Real) -> Real:
    """Median of ``level`` (C,) in an octave around each of the frequencies ``omega`` (C,), of TOGETHER at least."""
    here = np.arange(omega.size)
    first = np.minimum(np.searchsorted(omega, omega / np.sqrt(2)), np.maximum(here - TOGETHER // 2, 0))
    last = np.maximum(np.searchsorted(omega, omega * np.sqrt(2)), here + TOGETHER // 2 + 1)
    return np.array([np.median(level[i:j]) for i, j in zip(first, last, strict=True)])


def _best_run(worth: Real) -> tuple[int, int]:
    """Ends of the run of ``worth`` (C,) with the largest sum; an empty one if none is positive."""
    total = np.concatenate([[0.0], np.cumsum(worth)])
    gained = total - np.minimum.accumulate(total)
    last = int(np.argmax(gained))
    return int(np.argmin(total[: last + 1])), last
