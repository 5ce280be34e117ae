"""The model's response, its derivatives and the least squares step: where a fit spends its time."""

from __future__ import annotations

import numpy as np
from scipy.linalg.lapack import dposv

from identification.base.arrays import Complex, Real
from identification.model.structure import Structure

EVALUATIONS = 30
BLOCK = 8192  # lines whose derivatives are held at a time
MOST_DAMPED = 1e8  # a step beyond it changes nothing
LEAST_DAMPED = 1e-14


def response_of(structure: Structure, theta: Real, omega: Real) -> Complex:
    """|K|/s^q prod(zeros)/prod(poles) exp(-delay s) at s = j omega, (M,)."""
    return _response(structure, theta, omega)[0]


def log_jacobian(structure: Structure, theta: Real, omega: Real) -> Complex:
    """Derivative of the logarithm of :func:`response_of` with respect to theta, (M, p)."""
    return _with_derivatives(structure, theta, omega)[1].T


def _response(structure: Structure, theta: Real, omega: Real) -> tuple[Complex, Complex, Complex]:
    """Response (M,) and the factors of modes (n, M) and of real roots (k, M), zeros first."""
    integrators, left_modes, right_modes, pole_modes, left_rates, right_rates, _ = structure.counts
    zeros, real_zeros = left_modes + right_modes, left_rates + right_rates
    modes = zeros + pole_modes
    natural, damping = np.exp(theta[1 : 1 + 2 * modes].reshape(modes, 2).T)[:, :, None]
    damping[left_modes:zeros] *= -1
    rate = np.exp(theta[1 + 2 * modes : -1])[:, None]
    rate[left_rates:real_zeros] *= -1
    x = omega / natural
    factors = np.empty((modes, omega.size), dtype=complex)
    factors.real, factors.imag = 1 - x * x, 2 * damping * x
    real_factors = np.ones((len(rate), omega.size), dtype=complex)
    real_factors.imag = omega / rate
    value = np.exp(theta[0] - 1j * theta[-1] * omega)
    if integrators:
        value *= 1j**-integrators * omega ** -float(integrators)
    for row in (*factors[:zeros], *real_factors[:real_zeros]):
        value *= row
    for row in (*factors[zeros:], *real_factors[real_zeros:]):
        value /= row
    return value, factors, real_factors


def _with_derivatives(structure: Structure, theta: Real, omega: Real) -> tuple[Complex, Complex]:
    """Response (M,) and the derivative of its logarithm, (p, M)."""
    value, factors, real_factors = _response(structure, theta, omega)
    modes, (zeros, _), (real_zeros, _) = len(factors), structure.modes, structure.real
    logs = np.empty((theta.size, omega.size), dtype=complex)
    logs[0], logs[-1] = 1.0, -1j * omega
    of_modes, of_rates = logs[1 : 1 + 2 * modes].reshape(modes, 2, omega.size), logs[1 + 2 * modes : -1]
    # a factor 1 - x^2 + j d x: its slopes along log omega and log zeta are 2 x^2 - j d x and j d x
    size = np.square(factors.real) + np.square(factors.imag)
    damped = factors.imag / size
    of_modes[:, 1].real, of_modes[:, 1].imag = factors.imag * damped, factors.real * damped
    twice = (2 - 2 * factors.real) / size
    of_modes[:, 0].real, of_modes[:, 0].imag = twice * factors.real, -twice * factors.imag
    of_modes[:, 0] -= of_modes[:, 1]
    of_rates[...] = 1 / real_factors - 1
    of_modes[zeros:] *= -1
    of_rates[real_zeros:] *= -1
    return value, logs


def stacked(columns: Complex) -> Real:
    """Complex columns (M, p) as real rows (p, 2M), real and imaginary parts interleaved."""
    return np.ascontiguousarray(columns.T).view(float)


def information(structure: Structure, theta: Real, omega: Real, sigma: Real) -> Real:
    """Products (p, p) of the derivatives of :func:`response_of` over sigma (M,), summed over the lines."""
    total = np.zeros((structure.size, structure.size))
    for first in range(0, omega.size, BLOCK):
        part = slice(first, first + BLOCK)
        value, logs = _with_derivatives(structure, theta, omega[part])
        rows = (value / sigma[part] * logs).view(float)
        total += rows @ rows.T
    return total


def normal_equations(
    structure: Structure, theta: Real, omega: Real, response: Complex, sigma: Real, *, soft: bool
) -> tuple[float, Real, Real]:
    """Cost of the residuals (model - response)/sigma, its half slope (p,) and Gauss and Newton's curvature (p, p).

    Parameters are those of :func:`least_squares`.
    """
    cost, slope, curvature = 0.0, np.zeros(theta.size), np.zeros((theta.size, theta.size))
    for first in range(0, omega.size, BLOCK):
        part = slice(first, first + BLOCK)
        value, logs = _with_derivatives(structure, theta, omega[part])
        rows = (value / sigma[part] * logs).view(float)
        residual = ((value - response[part]) / sigma[part]).view(float)
        weighted = rows
        if soft:
            square = np.square(residual).reshape(-1, 2).sum(axis=1)
            root = np.sqrt(1 + square)
            cost += float(np.sum(2 * square / (1 + root)))  # 2 (root - 1)
            weighted = rows / np.repeat(root, 2)
        else:
            cost += float(residual @ residual)
        slope += weighted @ residual
        curvature += weighted @ rows.T
    return cost, slope, curvature


def least_squares(
    structure: Structure,
    theta: Real,
    omega: Real,
    response: Complex,
    sigma: Real,
    bounds: tuple[Real, Real],
    *,
    soft: bool,
    tolerance: float,
) -> Real:
    """The theta (p,) within bounds of least (soft) squares of (model - response)/sigma, from ``theta``.

    Parameters
    ----------
    structure
        Of the model.
    theta
        (p,) where to start, within ``bounds``.
    omega, response, sigma
        (M,) frequencies, response and the standard deviation of its error.
    bounds
        Least and largest theta, (p,) each.
    soft
        Soft-L1 loss instead of least squares.
    tolerance
        The relative change of the cost at which the search ends.

    Notes
    -----
    Levenberg and Marquardt's method; a parameter at its bound stays there while the slope pushes it out. The normal
    equations of a few scaled parameters are solved: singular values of 2M rows, as scipy.optimize.least_squares takes
    them, cost ten times the rest.
    """
    lower, upper = bounds
    cost, slope, curvature = normal_equations(structure, theta, omega, response, sigma, soft=soft)
    damping, scale = 1e-3, np.zeros(theta.size)
    for _ in range(EVALUATIONS):
        scale = np.maximum(scale, curvature.diagonal())
        free = np.flatnonzero(((theta > lower) | (slope < 0)) & ((theta < upper) | (slope > 0)) & (scale > 0))
        if not free.size:
            break
        unit = np.sqrt(scale[free])
        scaled = curvature[free][:, free] / unit / unit[:, None]
        while True:
            damped = scaled.copy()
            damped.flat[:: free.size + 1] += damping
            _, step, failed = dposv(damped, -slope[free] / unit)
            moved = theta.copy()
            if not failed:
                moved[free] += step / unit
                moved = np.minimum(np.maximum(moved, lower), upper)
                reached, *there = normal_equations(structure, moved, omega, response, sigma, soft=soft)
                if reached < cost:
                    break
            damping *= 8
            if damping > MOST_DAMPED:
                return theta
        gained, cost, theta = cost - reached, reached, moved
        slope, curvature = there
        damping = max(damping / 8, LEAST_DAMPED)
        if gained <= tolerance * cost:
            break
    return theta
