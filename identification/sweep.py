"""Raw record of a sweep -> frequency response with the variance of each line (local polynomial method)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identification.files import InputError

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]
Windows = tuple[Complex, Real, Real]

ORDER = 2
COEFFICIENTS = 2 * (ORDER + 1)  # of the response and of the transient
SHORTEST_WINDOW = COEFFICIENTS + 3  # three degrees of freedom left for the variance
WINDOWS = 600  # aimed at; a longer record makes longer windows
EXCITED = 0.03  # of the typical power of the excited lines (-15 dB)
TOGETHER = 9  # windows in one test for a cut-off response
SIGNIFICANT = 4.0  # F ratio; noise alone gives about 1.2 +- 0.4
MATERIAL = 1e-5  # of the output's power
APART = 2.0  # variances with and without transient, where the two can be told apart
WEAKEST = 4.0  # lines whose variance is this much over the median's carry little and would widen a bound


@dataclass(frozen=True)
class SweepEstimate:
    """A response at M lines whose errors are independent.

    Parameters
    ----------
    omega
        (M,) rad/s, increasing.
    response
        (M,) output unit per input unit.
    variance
        (M,) estimate of E|error|^2, from what the local polynomials leave.
    excitation
        (M,) how the error's variance goes from line to line on account of the excitation alone: the variance is
        this times the power density of the noise. Its median is 1.
    """

    omega: Real
    response: Complex
    variance: Real
    excitation: Real


def estimate_response(dt: float, u: Real, y: Real) -> SweepEstimate:
    """Estimate the response from input ``u`` to output ``y``, both (N,), sampled every ``dt`` seconds.

    Both channels are taken as band-limited alike before they are sampled, as a signal analyser does: the ratio
    of their spectra is the continuous-time P(j omega), and no hold is divided out.

    Raises
    ------
    InputError
        Too few lines are excited, or the output never changes.

    Notes
    -----
    First differences of both channels bring an integrator's output back to rest. Their spectra are divided by that
    of the difference again, so that white noise on the output stays white. In each window of W lines

        Y(k + r) = (h0 + h1 r + h2 r^2) U(k + r) + (t0 + t1 r + t2 r^2) + V(k + r),

    where the second polynomial is what the record cuts off at its ends; it is left out when it explains
    nothing (it is hard to tell from the response to what a sweep does in its first and last seconds). The
    response is given at the three zeros of the cubic orthogonal on the window's lines: there the errors of
    a quadratic fitted by least squares are uncorrelated, so that nothing of the record is lost, and the
    cubic term leaves no bias. Windows do not overlap.

    References
    ----------
    Pintelon, Schoukens, "System Identification: A Frequency Domain Approach", 2nd ed., section 7.2.
    """
    if np.ptp(y) == 0:
        raise InputError("the output never changes; expected the response to a sweep")
    lines = np.arange(1, (u.size - 1) // 2)
    omega = 2 * np.pi * lines / ((u.size - 1) * dt)
    difference = -np.expm1(-1j * omega * dt)
    big_u, big_y = (np.fft.rfft(np.diff(x))[lines] / difference for x in (u, y))
    band = _excited_band(np.abs(big_u) ** 2)
    if band.size < 3 * SHORTEST_WINDOW:
        raise InputError(
            f"the input excites {band.size} spectral lines; expected {3 * SHORTEST_WINDOW} or more "
            "(a longer record or a wider sweep)"
        )
    half = max(SHORTEST_WINDOW, band.size // WINDOWS) // 2
    width = 2 * half + 1
    count = band.size // width
    windows = band[(band.size - count * width) // 2 :][: count * width].reshape(count, width)
    r = np.arange(-half, half + 1) / half
    node = np.sqrt((3 * half * (half + 1) - 1) / 5) / half
    nodes = np.array([-node, 0.0, node])

    omega_nodes = omega[windows[:, half]][:, None] + nodes * half * (omega[1] - omega[0])
    truncated = _local_polynomials(big_u[windows], big_y[windows], r, nodes, transient=True)
    at_rest = _local_polynomials(big_u[windows], big_y[windows], r, nodes, transient=False)
    power = np.sum(np.abs(big_y[windows]) ** 2, axis=1)
    response, gain, noise = truncated if _cut_off(truncated, at_rest, power, width) else at_rest
    carries = gain < WEAKEST * np.median(gain)
    return SweepEstimate(
        omega=omega_nodes[carries],
        response=response[carries],
        variance=(gain * noise)[carries],
        excitation=(gain / np.median(gain))[carries],
    )


def _local_polynomials(u: Complex, y: Complex, r: Real, nodes: Real, *, transient: bool) -> Windows:
    """Response at the nodes (C, 3), its variance per unit of noise (C, 3) and the noise (C, 1) of C windows."""
    level = np.sqrt(np.mean(np.abs(u) ** 2, axis=1))[:, None]
    powers = r[:, None] ** np.arange(ORDER + 1)
    regressors = (u / level)[..., None] * powers
    if transient:
        regressors = np.concatenate([regressors, np.broadcast_to(powers, regressors.shape)], axis=2)
    q, upper = np.linalg.qr(regressors)
    at_nodes = np.zeros((upper.shape[-1], nodes.size), dtype=complex)
    at_nodes[: ORDER + 1] = nodes ** np.arange(ORDER + 1)[:, None]
    # With R^H W = E the response E^T R^-1 Q^H y is W^H Q^H y, and the columns' squares of W are its variance.
    weights = np.linalg.solve(np.swapaxes(upper.conj(), 1, 2), np.broadcast_to(at_nodes, (len(u), *at_nodes.shape)))
    seen = np.swapaxes(q.conj(), 1, 2) @ y[..., None]
    response = (np.swapaxes(weights.conj(), 1, 2) @ seen)[..., 0] / level
    left = np.sum(np.abs(y - (q @ seen)[..., 0]) ** 2, axis=1, keepdims=True)
    return response, np.sum(np.abs(weights) ** 2, axis=1) / level**2, left / (r.size - upper.shape[-1])


def _cut_off(truncated: Windows, at_rest: Windows, power: Real, width: int) -> bool:
    """Whether the transient explains more than noise does: F ratio of neighbouring windows together.

    What is left must also be a material part of the output's power (C,): a quadratic is never quite the response.
    Windows where the two polynomials can hardly be told apart have no say: there a transient, which is free of the
    input's noise, explains the output better than the input does.
    """
    apart = np.mean(truncated[1], axis=1) < APART * np.mean(at_rest[1], axis=1)
    if not apart.any():
        return False
    full, reduced = width - COEFFICIENTS, width - ORDER - 1
    together = np.ones(min(TOGETHER, int(apart.sum())))
    left_with = np.convolve(full * truncated[2][apart, 0], together, mode="valid")
    left_without = np.convolve(reduced * at_rest[2][apart, 0], together, mode="valid")
    ratio = (left_without - left_with) / (reduced - full) / np.maximum(left_with / full, np.finfo(float).tiny)
    material = left_without > MATERIAL * np.convolve(power[apart], together, mode="valid")
    return bool(np.any(material & (ratio > SIGNIFICANT)))


def _excited_band(power: Real) -> NDArray[np.intp]:
    """Indices of the run of neighbouring lines that holds most of the input's energy."""
    # A noisy input has single weak lines, so the run is found on a wide mean; its ends are then cut on a narrow one.
    wide, narrow = (
        np.convolve(power, np.full(width, 1 / width), mode="same") for width in (2 * SHORTEST_WINDOW + 1, 3)
    )
    threshold = EXCITED * np.sum(wide**2) / np.sum(wide)
    excited = np.concatenate([[False], wide > threshold, [False]])
    starts, stops = np.flatnonzero(np.diff(excited.astype(int))).reshape(-1, 2).T
    energy = np.concatenate([[0.0], np.cumsum(power)])
    best = np.argmax(energy[stops] - energy[starts])
    run = np.arange(starts[best], stops[best])
    inside = np.flatnonzero(narrow[run] > threshold)
    return run[inside[0] : inside[-1] + 1]
