"""A first guess of the plant from one response, with no starting point given: dead time, then rational part."""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.polynomial import Polynomial, chebyshev

from identification.base.arrays import Complex, Real
from identification.model.structure import Structure

ITERATIONS = 8
UNTHREADED = 100_000  # multiplications of a matrix product; threads cost more than they bring at this size
BOUNDS = (1e-5, 10.0)  # of a mode's damping ratio
MOST_DELAYS = 100_000  # dead times that are told apart: lines very unevenly apart could tell more
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
    delays = np.arange(0.0, min(np.pi / np.quantile(step, 0.1), MOST_DELAYS * finest), finest)
    votes = np.zeros(delays.size)
    for block in np.array_split(np.arange(delays.size), 1 + delays.size * step.size // 500_000):
        votes[block] = np.cos(increment + delays[block, None] * step).sum(axis=1)
    best = delays[np.argmax(votes)]
    left = np.angle(np.exp(1j * (increment + best * step)))
    return max(0.0, float(best - np.median(left / step)))


def guesses(omega: Real, response: Complex, sigma: Real, structure: Structure, keep: int) -> list[Real]:
    """The ``keep`` best first guesses of a structure, best first.

    Parameters
    ----------
    omega, response, sigma
        (M,) frequencies of order 1, response and the assumed standard deviation of its error.
    structure
        Of the plant.

    Returns
    -------
    list of (zeros + poles + 2,) arrays
        theta of :class:`identification.model.structure.Structure`, its gain left at 0.

    Notes
    -----
    Sanathanan-Koerner iterations for all delays of a grid at once: (j omega)^q e^{j omega h} H is fitted by N/D of the
    structure's degrees, D's leading coefficient 1, in Chebyshev polynomials of omega^2 (even and odd powers of
    j omega apart). Roots in the right half plane are reflected.
    """
    width = omega[-1] - omega[0]
    far = 3 * (max(structure.zeros, structure.poles) // 2) + 3
    delays = np.unique(np.maximum(0.0, group_delay(omega, response) + np.arange(-far, far + 1) / width))
    top = omega[-1]
    powers = _powers(omega / top, max(structure.zeros, structure.poles))
    numerator = powers[:, : structure.zeros + 1]
    denominator = powers[:, : structure.poles]
    integrators = (1j * omega) ** structure.integrators
    target = integrators * response * np.exp(1j * delays[:, None] * omega)
    noise = np.abs(integrators) * sigma
    rows = np.concatenate(
        [
            np.broadcast_to(numerator.T, (delays.size, numerator.shape[1], omega.size)),
            -target[:, None, :] * denominator.T,
        ],
        axis=1,
    )
    leading = target * powers[:, structure.poles]
    previous = np.ones_like(target)
    costs = np.full(delays.size, np.inf)
    best = np.zeros((delays.size, rows.shape[1]))
    for _ in range(ITERATIONS):
        weight = 1 / (noise * np.abs(previous))
        weighted = np.ascontiguousarray(rows * weight[:, None, :]).view(float)
        gram = _gram(weighted)
        scale = np.sqrt(np.einsum("kii->ki", gram)) + np.finfo(float).tiny
        gram = gram / (scale[:, :, None] * scale[:, None, :]) + 1e-14 * np.eye(gram.shape[1])
        moment = np.einsum("kim,km->ki", weighted, (leading * weight).view(float)) / scale
        solution = np.linalg.solve(gram, moment[..., None])[..., 0] / scale
        previous = powers[:, structure.poles] + np.einsum("kp,mp->km", solution[:, structure.zeros + 1 :], denominator)
        previous = np.where(previous == 0, np.finfo(float).tiny, previous)
        fitted = np.einsum("kp,mp->km", solution[:, : structure.zeros + 1], numerator) / previous
        cost = np.sum(np.log1p(np.abs((target - fitted) / noise) ** 2), axis=1)
        better = cost < costs
        costs[better], best[better] = cost[better], solution[better]
    order = np.argsort(costs)[:keep]
    return [_guess(structure, best[k], delays[k], top, omega) for k in order]


def _powers(x: Real, degree: int) -> Complex:
    """Columns like (j x)^0 ... (j x)^degree, (M, degree + 1): column k is T_(k // 2)(2 x^2 - 1), by j x for odd k."""
    even = chebyshev.chebvander(2 * x**2 - 1, degree // 2)
    columns = np.repeat(even, 2, axis=1)[:, : degree + 1].astype(complex)
    columns[:, 1::2] *= 1j * x[:, None]
    return columns


def _gram(rows: Real) -> Real:
    """Products of all pairs of rows, (K, p, N) to (K, p, p), in parts too small for the matrix library's threads."""
    count, size, length = rows.shape
    part = max(1, UNTHREADED // size**2)
    total = np.zeros((count, size, size))
    for first in range(0, length, part):
        block = np.ascontiguousarray(rows[:, :, first : first + part])
        total += block @ np.swapaxes(block, 1, 2)
    return total


@cache
def _in_powers_of_s(degree: int) -> Real:
    """Row k: the coefficients of column k of :func:`_powers` in s = j x, lowest power first."""
    t = Polynomial([-1.0, 0.0, -2.0])  # 2 x^2 - 1
    rows = np.zeros((degree + 1, degree + 1))
    for k in range(degree + 1):
        even = Polynomial(chebyshev.cheb2poly(np.eye(degree + 1)[k // 2]))(t).coef[: 2 * (k // 2) + 1]
        rows[k, k % 2 : k % 2 + even.size] = even
    return rows


def _guess(structure: Structure, solution: Real, delay: float, top: float, omega: Real) -> Real:
    zero_modes, real_zeros = _roots(solution[: structure.zeros + 1], top, omega)
    pole_modes, real_poles = _roots(np.append(solution[structure.zeros + 1 :], 1.0), top, omega)
    return np.concatenate([[0.0], zero_modes, pole_modes, real_zeros, real_poles, [delay]])


def _roots(coefficients: Real, top: float, omega: Real) -> tuple[Real, Real]:
    """Log omega, log zeta of each mode and log rate of the real root, if any, from coefficients of :func:`_powers`."""
    degree = coefficients.size - 1
    if degree == 0:
        return np.zeros(0), np.zeros(0)
    polynomial = coefficients @ _in_powers_of_s(degree)
    # A vanishing leading coefficient means a root far above the band.
    smallest = 1e-12 * np.max(np.abs(polynomial))
    polynomial[-1] = polynomial[-1] if abs(polynomial[-1]) > smallest else smallest
    roots = top * np.roots(polynomial[::-1])
    lowest, highest = omega[0] / BAND, omega[-1] * BAND
    real = np.sort(np.clip(np.abs(roots[roots.imag == 0].real), lowest, highest))
    alone, paired = real[: degree % 2], real[degree % 2 :]
    found = [(abs(root), abs(root.real) / abs(root)) for root in roots if root.imag > 0]
    found += [(np.sqrt(a * b), (a + b) / (2 * np.sqrt(a * b))) for a, b in zip(paired[::2], paired[1::2], strict=True)]
    modes = np.clip(np.array(sorted(found)).reshape(-1, 2), [lowest, 2 * BOUNDS[0]], [highest, BOUNDS[1] / 2])
    return np.log(modes).ravel(), np.log(alone)
