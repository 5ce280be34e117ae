"""A first guess of the plant from one response, with no starting point given: dead time, then rational part."""

from __future__ import annotations

import numpy as np
from numpy.polynomial import Polynomial, chebyshev
from numpy.typing import NDArray

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]

ITERATIONS = 8
UNTHREADED = 100_000  # multiplications of a matrix product; threads cost more than they bring at this size
BOUNDS = (1e-5, 10.0)  # of a mode's damping ratio
BAND = 10.0  # modes are sought up to this factor outside the band


def group_delay(omega: Real, response: Complex) -> float:
    """The dead time in seconds that the phase increments between neighbouring lines agree on best.

    Notes
    -----
    The phase is not unwrapped: one wrong turn at a sharp zero would tilt all that follows. Each increment, wrapped
    to (-pi, pi], votes for the delays h with increment + h * step near a multiple of 2 pi; the delay with
    the most votes wins. On coarse lines the increments themselves are ambiguous; uneven steps are not.
    """
    step = np.diff(omega)
    increment = np.angle(response[1:] * response[:-1].conj())
    finest = 0.25 / np.max(step)
    # A median increment over pi is an alias: so the usual step bounds the delays that can be told apart.
    delays = np.arange(0.0, np.pi / np.quantile(step, 0.1), finest)
    votes = np.zeros(delays.size)
    for block in np.array_split(np.arange(delays.size), 1 + delays.size * step.size // 500_000):
        votes[block] = np.cos(increment + delays[block, None] * step).sum(axis=1)
    best = delays[np.argmax(votes)]
    left = np.angle(np.exp(1j * (increment + best * step)))
    return max(0.0, float(best - np.median(left / step)))


def guesses(omega: Real, response: Complex, sigma: Real, modes: int, keep: int) -> list[Real]:
    """The ``keep`` best first guesses with ``modes`` zero and pole modes, best first.

    Parameters
    ----------
    omega, response, sigma
        (M,) frequencies of order 1, response and the assumed standard deviation of its error.
    modes
        n, the number of zero modes and of pole modes.

    Returns
    -------
    list of (4n + 1,) arrays
        Zero modes then pole modes as log omega, log zeta pairs, then the delay.

    Notes
    -----
    Sanathanan-Koerner iterations for all delays of a grid at once: j omega e^{j omega h} H is fitted by N/D, N and D of
    degree 2n with D's leading coefficient 1, in Chebyshev polynomials of omega^2 (even and odd powers
    of j omega apart). Roots in the right half plane are reflected.
    """
    width = omega[-1] - omega[0]
    turns = np.arange(-3 * modes - 3, 3 * modes + 4)
    delays = np.unique(np.maximum(0.0, group_delay(omega, response) + turns / width))
    top = omega[-1]
    even = chebyshev.chebvander(2 * (omega / top) ** 2 - 1, modes)
    odd = 1j * (omega / top)[:, None] * even[:, :modes]
    numerator = np.concatenate([even, odd], axis=1)
    denominator = np.concatenate([even[:, :modes], odd], axis=1)
    target = 1j * omega * response * np.exp(1j * delays[:, None] * omega)
    noise = omega * sigma
    rows = np.concatenate(
        [
            np.broadcast_to(numerator.T, (delays.size, numerator.shape[1], omega.size)),
            -target[:, None, :] * denominator.T,
        ],
        axis=1,
    )
    leading = target * even[:, modes]
    previous = np.ones_like(target)
    costs = np.full(delays.size, np.inf)
    best = np.zeros((delays.size, rows.shape[1]))
    for _ in range(ITERATIONS):
        weight = 1 / (noise * np.abs(previous))
        weighted = (rows * weight[:, None, :]).view(float)
        gram = _gram(weighted)
        scale = np.sqrt(np.einsum("kii->ki", gram)) + np.finfo(float).tiny
        gram = gram / (scale[:, :, None] * scale[:, None, :]) + 1e-14 * np.eye(gram.shape[1])
        moment = np.einsum("kim,km->ki", weighted, (leading * weight).view(float)) / scale
        solution = np.linalg.solve(gram, moment[..., None])[..., 0] / scale
        previous = even[:, modes] + np.einsum("kp,mp->km", solution[:, 2 * modes + 1 :], denominator)
        previous = np.where(previous == 0, np.finfo(float).tiny, previous)
        fitted = np.einsum("kp,mp->km", solution[:, : 2 * modes + 1], numerator) / previous
        cost = np.sum(np.log1p(np.abs((target - fitted) / noise) ** 2), axis=1)
        better = cost < costs
        costs[better], best[better] = cost[better], solution[better]
    order = np.argsort(costs)[:keep]
    return [_guess(best[k], delays[k], modes, top, omega) for k in order]


def _gram(rows: Real) -> Real:
    """Products of all pairs of rows, (K, p, N) to (K, p, p), in parts too small for the matrix library's threads."""
    count, size, length = rows.shape
    part = max(1, UNTHREADED // size**2)
    total = np.zeros((count, size, size))
    for first in range(0, length, part):
        block = np.ascontiguousarray(rows[:, :, first : first + part])
        total += block @ np.swapaxes(block, 1, 2)
    return total


def _guess(solution: Real, delay: float, modes: int, top: float, omega: Real) -> Real:
    zeros = solution[: 2 * modes + 1]
    poles = solution[2 * modes + 1 :]
    return np.concatenate(
        [
            _modes(zeros[: modes + 1], zeros[modes + 1 :], top, omega),
            _modes(np.append(poles[:modes], 1.0), poles[modes:], top, omega),
            [delay],
        ]
    )


def _modes(even: Real, odd: Real, top: float, omega: Real) -> Real:
    """Log omega, log zeta of each pair of roots of E(t) + (s/top) O(t), t = -2 (s/top)^2 - 1."""
    if odd.size == 0:
        return np.zeros(0)
    t = Polynomial([-1.0, 0.0, -2.0])
    s = Polynomial([0.0, 1.0])
    polynomial = Polynomial(chebyshev.cheb2poly(even))(t) + s * Polynomial(chebyshev.cheb2poly(odd))(t)
    coefficients = np.zeros(2 * odd.size + 1)
    coefficients[: polynomial.coef.size] = polynomial.coef
    # A vanishing leading coefficient means a mode far above the band.
    smallest = 1e-12 * np.max(np.abs(coefficients))
    coefficients[-1] = coefficients[-1] if abs(coefficients[-1]) > smallest else smallest
    roots = top * np.roots(coefficients[::-1])
    pairs = [root for root in roots if root.imag > 0]
    real = sorted(abs(root.real) for root in roots if root.imag == 0)
    found = [(abs(root), abs(root.real) / abs(root)) for root in pairs]
    found += [(np.sqrt(a * b), (a + b) / (2 * np.sqrt(a * b))) for a, b in zip(real[::2], real[1::2], strict=True)]
    found.sort()
    logs = np.log(np.clip(found, [omega[0] / BAND, 2 * BOUNDS[0]], [omega[-1] * BAND, BOUNDS[1] / 2]))
    return logs.ravel()
