"""A first guess of the plant from one response, with no starting point given: dead time, then rational part."""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.polynomial import Polynomial, chebyshev

from identification.base.arrays import Complex, Real
from identification.fitting.dead_time import turn_of
from identification.model.structure import Structure

ITERATIONS = 8
HELD = 500_000  # numbers of the lines of all dead times that are tried at a time
TURNS = 0.05  # cost a line that a dead time of a turn or more has to gain
LEAST_ZETA = 1e-5  # of a mode
APART = 1.05  # least zeta of a mode that is written as two real roots
BAND = 10.0  # modes are sought up to this factor outside the band


def most_zeta(omega: Real) -> float:
    """The largest damping ratio that is sought at lines (M,): of two real roots at both ends of the search."""
    return BAND * float(np.sqrt(omega.max() / omega.min())) / 2


def guesses(
    omega: Real, response: Complex, sigma: Real, likely_delays: Real, structure: Structure, keep: int
) -> list[Real]:
    """The ``keep`` best first guesses of a structure, best first.

    Parameters
    ----------
    omega, response, sigma
        (M,) frequencies of order 1, response and the assumed standard deviation of its error.
    likely_delays
        (L,) near one of which the dead time lies, see :func:`identification.fitting.dead_time.likely_delays`.
    structure
        Of the plant.

    Returns
    -------
    list of (p,) arrays
        theta of :class:`identification.model.structure.Structure`, its gain left at 0.

    Notes
    -----
    Sanathanan-Koerner iterations for all delays of a grid about the likely ones: (j omega)^q e^{j omega h} H is fitted
    by N/D of the structure's degrees, D's leading coefficient 1, in Chebyshev polynomials of omega^2 (even and odd
    powers of j omega apart). Poles in the right half plane are reflected, and zeros are as far as the structure has
    fewer there.
    """
    delays, costs, best = _rational_fits(omega, response, sigma, likely_delays, structure)
    # dead times of a turn or more are tried only where shorter ones fail: noise must not choose among turns
    order = np.argsort(costs + TURNS * omega.size * (delays >= turn_of(omega)))[:keep]
    return [_guess(structure, best[k], delays[k], omega[-1], omega) for k in order]


def unstable_poles(
    omega: Real, response: Complex, sigma: Real, likely_delays: Real, structure: Structure
) -> tuple[float, Complex]:
    """How near a plant with poles on any side comes, as a median share of the response, and its poles on the right.

    Parameters
    ----------
    omega, response, sigma, likely_delays, structure
        As for :func:`guesses`.
    """
    delays, costs, best = _rational_fits(omega, response, sigma, likely_delays, structure)
    k = int(np.argmin(costs))
    numerator, denominator = np.split(best[k], [structure.zeros + structure.right + 1])
    top, bottom = (_at(part, omega) for part in (numerator, _monic(denominator)))
    target = (1j * omega) ** float(structure.integrators) * response * np.exp(1j * delays[k] * omega)
    poles = _roots(_monic(denominator), omega[-1])
    return float(np.median(np.abs(top / (bottom * target) - 1))), poles[poles.real > 0]


def _rational_fits(
    omega: Real, response: Complex, sigma: Real, likely_delays: Real, structure: Structure
) -> tuple[Real, Real, Real]:
    """For K dead times: these, the costs (K,) and the coefficients (K, p)."""
    width = omega[-1] - omega[0]
    far = 3 * (max(structure.zeros + structure.right, structure.poles) // 2) + 3
    near = likely_delays[:, None] + np.arange(-far, far + 1) / width
    delays = np.unique(np.maximum(0.0, near)) if structure.delayed else np.zeros(1)
    integrators = (1j * omega) ** float(structure.integrators)
    parts = np.array_split(delays, min(delays.size, 1 + delays.size * omega.size // HELD))
    found = [_iterated(part, omega, integrators * response, np.abs(integrators) * sigma, structure) for part in parts]
    costs, best = (np.concatenate(of_parts) for of_parts in zip(*found, strict=True))
    return delays, costs, best


def _iterated(delays: Real, omega: Real, response: Complex, noise: Real, structure: Structure) -> tuple[Real, Real]:
    """Iterations for the dead times (K,): the least costs (K,) and their coefficients (K, p).

    With the rows b_k of :func:`_basis`, N has the columns c_k b_k and D the columns c_k b_k target, c_k being 1 or j.
    So all inner products are sums of b_i b_k, weighted, times the real or the imaginary part of the target or neither.
    """
    zeros, poles = structure.zeros + structure.right, structure.poles
    basis = _basis(omega / omega[-1], max(zeros, poles))
    first, second = np.triu_indices(len(basis))
    is_odd = (first + second) % 2 == 1
    pairs = [(i, k, basis[i] * basis[k]) for i, k in ((first[odd], second[odd]) for odd in (~is_odd, is_odd))]

    def summed(weight: Real, odd: int) -> Real:
        """Sums (K, p, p) over the lines of b_i b_k times the weight (K, M), where i + k is odd or where it is even."""
        i, k, products = pairs[odd]
        sums = np.zeros((delays.size, len(basis), len(basis)))
        sums[:, i, k] = sums[:, k, i] = weight @ products.T
        return sums

    turned = np.exp(1j * (delays[:, None] * omega)) * response
    real, imaginary, square = turned.real.copy(), turned.imag.copy(), np.square(np.abs(response))
    sign = np.where(np.arange(len(basis)) % 2, -1.0, 1.0)  # of Re(c_i* j c_k) where i + k is odd
    numerator, denominator = slice(zeros + 1), slice(poles + 1)
    costs, best = np.full(delays.size, np.inf), np.zeros((delays.size, zeros + 1 + poles))
    size: Real = np.ones_like(real)  # |D|^2 of the iteration before
    for _ in range(ITERATIONS):
        weight = 1 / (np.square(noise) * size)
        mixed = -(summed(weight * real, 0) + sign * summed(weight * imaginary, 1))[:, numerator, denominator]
        plain, power = (
            summed(weight, 0)[:, numerator, numerator],
            summed(weight * square, 0)[:, denominator, denominator],
        )
        every = np.block([[plain, mixed], [np.swapaxes(mixed, 1, 2), power]])
        gram, moment = every[:, :-1, :-1], -every[:, :-1, -1]
        scale = np.sqrt(np.einsum("kii->ki", gram)) + np.finfo(float).tiny
        gram = gram / (scale[:, :, None] * scale[:, None, :]) + 1e-14 * np.eye(gram.shape[1])
        solution = np.linalg.solve(gram, (moment / scale)[..., None])[..., 0] / scale
        top, bottom = _values(solution[:, numerator], basis), _values(_monic(solution[:, zeros + 1 :]), basis)
        size = np.maximum(np.square(bottom[0]) + np.square(bottom[1]), np.finfo(float).tiny)
        apart = np.square(real * bottom[0] - imaginary * bottom[1] - top[0])
        apart += np.square(real * bottom[1] + imaginary * bottom[0] - top[1])
        cost = np.sum(np.log1p(apart / (np.square(noise) * size)), axis=1)
        better = cost < costs
        costs[better], best[better] = cost[better], solution[better]
    return costs, best


def _monic(coefficients: Real) -> Real:
    """Coefficients (..., p) of D with its leading one, (..., p + 1)."""
    return np.concatenate([coefficients, np.ones((*coefficients.shape[:-1], 1))], axis=-1)


def _basis(x: Real, degree: int) -> Real:
    """Rows (degree + 1, M): row k is T_(k // 2)(2 x^2 - 1), times x for odd k. Times j for odd k it is like (j x)^k."""
    rows = np.repeat(chebyshev.chebvander(2 * x**2 - 1, degree // 2).T, 2, axis=0)[: degree + 1]
    rows[1::2] *= x
    return np.asarray(rows, dtype=float)


def _at(coefficients: Real, omega: Real) -> Complex:
    """A polynomial (M,) with coefficients (p,) of :func:`_basis` at lines (M,), x being omega over the highest."""
    real, imaginary = _values(coefficients, _basis(omega / omega[-1], coefficients.size - 1))
    return np.asarray(real + 1j * imaginary)


def _values(coefficients: Real, basis: Real) -> tuple[Real, Real]:
    """Real and imaginary part (..., M) of polynomials with coefficients (..., p) over the first rows of a basis."""
    count = coefficients.shape[-1]
    return coefficients[..., ::2] @ basis[:count:2], coefficients[..., 1::2] @ basis[1:count:2]


@cache
def _in_powers_of_s(degree: int) -> Real:
    """Row k: the coefficients of row k of :func:`_basis`, or j times it, in s = j x, lowest power first."""
    t = Polynomial([-1.0, 0.0, -2.0])  # 2 x^2 - 1
    rows = np.zeros((degree + 1, degree + 1))
    for k in range(degree + 1):
        even = Polynomial(chebyshev.cheb2poly(np.eye(degree + 1)[k // 2]))(t).coef[: 2 * (k // 2) + 1]
        rows[k, k % 2 : k % 2 + even.size] = even
    return rows


def _guess(structure: Structure, solution: Real, delay: float, top: float, omega: Real) -> Real:
    numerator, denominator = np.split(solution, [structure.zeros + structure.right + 1])
    zeros, poles = _roots(numerator, top), _roots(_monic(denominator), top)
    left, right = _divided(zeros, structure.right)
    sides = [
        _modes_and_rates(roots, *counts, omega)
        for roots, counts in zip((left, right, poles), structure.sides, strict=True)
    ]
    modes, rates = ([np.log(side[kind]).ravel() for side in sides] for kind in (0, 1))
    return np.concatenate([[0.0], *modes, *rates, [delay]])


def _roots(coefficients: Real, top: float) -> Complex:
    """The roots in units of omega from coefficients of :func:`_basis`; of pairs the one above the real axis."""
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
