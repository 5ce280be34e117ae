"""A first guess of the plant from one response, with no starting point given: dead time, then rational part."""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.polynomial import Polynomial, chebyshev

from identification.base.arrays import Complex, Real
from identification.fitting.dead_time import likely_delays, turn_of
from identification.model.structure import Structure

ITERATIONS = 8
UNTHREADED = 100_000  # multiplications of a matrix product; threads cost more than they bring at this size
TURNS = 0.05  # cost a line that a dead time of a turn or more has to gain
LEAST_ZETA = 1e-5  # of a mode
APART = 1.05  # least zeta of a mode that is written as two real roots
BAND = 10.0  # modes are sought up to this factor outside the band


def most_zeta(omega: Real) -> float:
    """The largest damping ratio that is sought at lines (M,): of two real roots at both ends of the search."""
    return BAND * float(np.sqrt(omega.max() / omega.min())) / 2


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
    list of (p,) arrays
        theta of :class:`identification.model.structure.Structure`, its gain left at 0.

    Notes
    -----
    Sanathanan-Koerner iterations for all delays of a grid at once: (j omega)^q e^{j omega h} H is fitted by N/D of the
    structure's degrees, D's leading coefficient 1, in Chebyshev polynomials of omega^2 (even and odd powers of
    j omega apart). Poles in the right half plane are reflected, and zeros are as far as the structure has fewer there.
    """
    delays, costs, best, _ = _rational_fits(omega, response, sigma, structure)
    # dead times of a turn or more are tried only where shorter ones fail: noise must not choose among turns
    order = np.argsort(costs + TURNS * omega.size * (delays >= turn_of(omega)))[:keep]
    return [_guess(structure, best[k], delays[k], omega[-1], omega) for k in order]


def unstable_poles(omega: Real, response: Complex, sigma: Real, structure: Structure) -> tuple[float, Complex]:
    """How near a plant with poles on any side comes, as a median share of the response, and its poles on the right.

    Parameters
    ----------
    omega, response, sigma, structure
        As for :func:`guesses`.
    """
    _, costs, best, fitted = _rational_fits(omega, response, sigma, structure)
    k = int(np.argmin(costs))
    poles = _roots(np.append(best[k, structure.zeros + structure.right + 1 :], 1.0), omega[-1])
    apart = np.abs(fitted[k] - 1)
    return float(np.median(apart)), poles[poles.real > 0]


def _rational_fits(
    omega: Real, response: Complex, sigma: Real, structure: Structure
) -> tuple[Real, Real, Real, Complex]:
    """For K dead times: the costs (K,), the coefficients (K, p) and the model over the response (K, M)."""
    width, zeros = omega[-1] - omega[0], structure.zeros + structure.right
    far = 3 * (max(zeros, structure.poles) // 2) + 3
    near = likely_delays(omega, response)[:, None] + np.arange(-far, far + 1) / width
    delays = np.unique(np.maximum(0.0, near)) if structure.delayed else np.zeros(1)
    top = omega[-1]
    powers = _powers(omega / top, max(zeros, structure.poles))
    numerator = powers[:, : zeros + 1]
    denominator = powers[:, : structure.poles]
    integrators = (1j * omega) ** float(structure.integrators)
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
    model = np.zeros_like(target)
    for _ in range(ITERATIONS):
        weight = 1 / (noise * np.abs(previous))
        weighted = np.ascontiguousarray(rows * weight[:, None, :]).view(float)
        gram = _gram(weighted)
        scale = np.sqrt(np.einsum("kii->ki", gram)) + np.finfo(float).tiny
        gram = gram / (scale[:, :, None] * scale[:, None, :]) + 1e-14 * np.eye(gram.shape[1])
        moment = np.einsum("kim,km->ki", weighted, (leading * weight).view(float)) / scale
        solution = np.linalg.solve(gram, moment[..., None])[..., 0] / scale
        previous = powers[:, structure.poles] + np.einsum("kp,mp->km", solution[:, zeros + 1 :], denominator)
        previous = np.where(previous == 0, np.finfo(float).tiny, previous)
        fitted = np.einsum("kp,mp->km", solution[:, : zeros + 1], numerator) / previous
        cost = np.sum(np.log1p(np.abs((target - fitted) / noise) ** 2), axis=1)
        better = cost < costs
        costs[better], best[better], model[better] = cost[better], solution[better], (fitted / target)[better]
    return delays, costs, best, model


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
    zeros = _roots(solution[: structure.zeros + structure.right + 1], top)
    poles = _roots(np.append(solution[structure.zeros + structure.right + 1 :], 1.0), top)
    left, right = _divided(zeros, structure.right)
    sides = [
        _modes_and_rates(roots, *counts, omega)
        for roots, counts in zip((left, right, poles), structure.sides, strict=True)
    ]
    modes, rates = ([np.log(side[kind]).ravel() for side in sides] for kind in (0, 1))
    return np.concatenate([[0.0], *modes, *rates, [delay]])


def _roots(coefficients: Real, top: float) -> Complex:
    """The roots in units of omega from coefficients of :func:`_powers`; of pairs the one above the real axis."""
    degree = coefficients.size - 1
    if degree == 0:
        return np.zeros(0, dtype=complex)
    polynomial = coefficients @ _in_powers_of_s(degree)
    # A vanishing leading coefficient means a root far above the band.
    smallest = 1e-12 * np.max(np.abs(polynomial))
    polynomial[-1] = polynomial[-1] if abs(polynomial[-1]) > smallest else smallest
    roots = np.asarray(top * np.roots(polynomial[::-1]), dtype=complex)
    return np.asarray(roots[roots.imag >= 0])


def _divided(roots: Complex, degree: int) -> tuple[Complex, Complex]:
    """The roots that stay left, and those of ``degree`` in all that are furthest to the right; pairs count twice."""
    left, right = [], []
    for root in sorted(roots, key=lambda root: -root.real / max(abs(root), 1e-300)):
        size = 2 if root.imag > 0 else 1
        if size <= degree:
            right.append(root)
            degree -= size
        else:
            left.append(root)
    if degree:  # only pairs are left: one of them is taken for two real roots
        pair = abs(left.pop(0))
        left.append(pair)
        right.append(pair)
    return np.array(left, dtype=complex), np.array(right, dtype=complex)


def _modes_and_rates(roots: Complex, modes: int, rates: int, omega: Real) -> tuple[Real, Real]:
    """Omega and zeta (modes, 2) and rates (rates,) of roots, reflected into the left half plane and the search."""
    lowest, highest = omega[0] / BAND, omega[-1] * BAND
    found = sorted((abs(root), abs(root.real) / abs(root)) for root in roots if root.imag > 0)
    real = sorted(np.clip(np.abs(roots[roots.imag == 0].real), lowest, highest).tolist())
    while len(found) > modes:  # the most damped is written as two real roots
        centre, zeta = found.pop(int(np.argmax([zeta for _, zeta in found])))
        spread = np.arccosh(max(zeta, APART))
        real = sorted([*real, *np.clip(centre * np.exp([-spread, spread]), lowest, highest)])
    alone, paired = real[:rates], real[rates:]
    found += [(np.sqrt(a * b), (a + b) / (2 * np.sqrt(a * b))) for a, b in zip(paired[::2], paired[1::2], strict=True)]
    limits = [lowest, 2 * LEAST_ZETA], [highest, most_zeta(omega) / 2]
    return np.clip(np.array(sorted(found)).reshape(-1, 2), *limits), np.array(alone)
