"""The model's response, its derivatives and the least squares step, compiled: where a fit spends its time."""

from __future__ import annotations

import numpy as np

from identification.base.arrays import Complex, Real
from identification.base.compiled import njit
from identification.model.structure import Structure

EVALUATIONS = 30
BLOCK = 32768  # lines whose derivatives are held at a time


def response_of(structure: Structure, theta: Real, omega: Real) -> Complex:
    """|K|/s^q prod(zeros)/prod(poles) exp(-delay s) at s = j omega, (M,)."""
    return _derive(theta, structure.counts, omega, False)[0]


def log_jacobian(structure: Structure, theta: Real, omega: Real) -> Complex:
    """Derivative of the logarithm of :func:`response_of` with respect to theta, (M, p)."""
    return _derive(theta, structure.counts, omega, True)[1]


@njit()
def _derive(theta, counts, omega, derive):  # type: ignore[no-untyped-def]
    """Response (M,) and, if asked for, the derivative of its logarithm (M, p)."""
    integrators, left_modes, right_modes, pole_modes, left_rates, right_rates, real_poles = counts
    zero_modes, real_zeros = left_modes + right_modes, left_rates + right_rates
    modes, rates = zero_modes + pole_modes, real_zeros + real_poles
    value = np.empty(omega.size, dtype=np.complex128)
    logs = np.empty((omega.size if derive else 0, theta.size), dtype=np.complex128)
    gain, delay = np.exp(theta[0]), theta[-1]
    natural, damping = np.exp(theta[1 : 1 + 2 * modes : 2]), 2 * np.exp(theta[2 : 2 + 2 * modes : 2])
    damping[left_modes:zero_modes] *= -1
    rate = np.exp(theta[1 + 2 * modes : 1 + 2 * modes + rates])
    rate[left_rates:real_zeros] *= -1
    for m in range(omega.size):
        w = omega[m]
        total = gain * (np.cos(delay * w) - 1j * np.sin(delay * w)) / (1j * w) ** integrators
        for i in range(modes):
            x = 1j * w / natural[i]
            factor = 1 + (damping[i] + x) * x
            total = total * factor if i < zero_modes else total / factor
            if derive:
                inverse = (1.0 if i < zero_modes else -1.0) / factor
                logs[m, 1 + 2 * i] = -(damping[i] + 2 * x) * x * inverse
                logs[m, 2 + 2 * i] = damping[i] * x * inverse
        for i in range(rates):
            x = 1j * w / rate[i]
            total = total * (1 + x) if i < real_zeros else total / (1 + x)
            if derive:
                logs[m, 1 + 2 * modes + i] = (-1.0 if i < real_zeros else 1.0) * x / (1 + x)
        if derive:
            logs[m, 0] = 1.0
            logs[m, -1] = -1j * w
        value[m] = total
    return value, logs


def stacked(columns: Complex) -> Real:
    """Complex columns (M, p) as real rows (p, 2M), real and imaginary parts interleaved."""
    return np.ascontiguousarray(columns.T).view(float)


def information(structure: Structure, theta: Real, omega: Real, sigma: Real) -> Real:
    """Products (p, p) of the derivatives of :func:`response_of` over sigma (M,), summed over the lines."""
    total = np.zeros((structure.size, structure.size))
    for first in range(0, omega.size, BLOCK):
        part = slice(first, first + BLOCK)
        model = response_of(structure, theta, omega[part]) / sigma[part]
        rows = stacked(model[:, None] * log_jacobian(structure, theta, omega[part]))
        total += rows @ rows.T
    return total


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

    ``tolerance`` is the relative change of the cost at which the search ends.
    """
    return np.asarray(_least_squares(theta, structure.counts, omega, response, sigma, *bounds, soft, tolerance))


@njit()
def _normal_at(theta, counts, omega, response, sigma, soft):  # type: ignore[no-untyped-def]
    """What :func:`_normal` gives at theta, BLOCK lines at a time."""
    cost, slope, curvature = 0.0, np.zeros(theta.size), np.zeros((theta.size, theta.size))
    for first in range(0, omega.size, BLOCK):
        last = first + BLOCK
        value, logs = _derive(theta, counts, omega[first:last], True)
        more = _normal(value, logs, response[first:last], sigma[first:last], soft)
        cost, slope, curvature = cost + more[0], slope + more[1], curvature + more[2]
    return cost, slope, curvature


@njit()
def _normal(value, logs, response, sigma, soft):  # type: ignore[no-untyped-def]
    """Cost of the residuals (value - response)/sigma, its half slope (p,) and Gauss and Newton's curvature (p, p)."""
    size = logs.shape[1]
    cost, slope, curvature = 0.0, np.zeros(size), np.zeros((size, size))
    row = np.empty(size, dtype=np.complex128)
    for m in range(value.size):
        residual = (value[m] - response[m]) / sigma[m]
        square = residual.real**2 + residual.imag**2
        root = np.sqrt(1 + square)
        cost += 2 * square / (1 + root) if soft else square  # 2 (root - 1)
        weight = 1 / root if soft else 1.0
        scaled = value[m] / sigma[m]
        for i in range(size):
            row[i] = scaled * logs[m, i]
            slope[i] += weight * (residual.real * row[i].real + residual.imag * row[i].imag)
            for j in range(i + 1):
                curvature[i, j] += weight * (row[i].real * row[j].real + row[i].imag * row[j].imag)
    for i in range(size):
        for j in range(i):
            curvature[j, i] = curvature[i, j]
    return cost, slope, curvature


@njit()
def _solve(matrix, shift, right):  # type: ignore[no-untyped-def]
    """Solution of (matrix + shift I) x = right by Cholesky's factors; False when it is not positive definite."""
    size = right.size
    factor, x = np.zeros((size, size)), right.copy()
    for i in range(size):
        for j in range(i + 1):
            left = matrix[i, j] + (shift if i == j else 0.0)
            for k in range(j):
                left -= factor[i, k] * factor[j, k]
            if i > j:
                factor[i, j] = left / factor[j, j]
            elif left > 0:
                factor[i, i] = np.sqrt(left)
            else:
                return False, x
        for k in range(i):
            x[i] -= factor[i, k] * x[k]
        x[i] /= factor[i, i]
    for i in range(size - 1, -1, -1):
        for k in range(i + 1, size):
            x[i] -= factor[k, i] * x[k]
        x[i] /= factor[i, i]
    return True, x


@njit()
def _least_squares(theta, counts, omega, response, sigma, lower, upper, soft, tolerance):  # type: ignore[no-untyped-def]
    """Levenberg and Marquardt's method; a parameter at its bound stays there while the slope pushes it out.

    The normal equations of a few scaled parameters are solved: singular values of 2M rows, as
    scipy.optimize.least_squares takes them, cost ten times the rest.
    """
    cost, slope, curvature = _normal_at(theta, counts, omega, response, sigma, soft)
    damping, scale = 1e-3, np.zeros(theta.size)
    for _ in range(EVALUATIONS):
        scale = np.maximum(scale, np.diag(curvature))
        inside = ((theta > lower) | (slope < 0)) & ((theta < upper) | (slope > 0)) & (scale > 0)
        free = np.flatnonzero(inside)
        unit = np.sqrt(scale[free])
        scaled = np.empty((free.size, free.size))
        for i in range(free.size):
            for j in range(free.size):
                scaled[i, j] = curvature[free[i], free[j]] / (unit[i] * unit[j])
        downhill = -slope[free] / unit
        while True:
            solved, step = _solve(scaled, damping, downhill)
            moved = theta.copy()
            if solved:
                moved[free] += step / unit
            moved = np.minimum(np.maximum(moved, lower), upper)
            reached, moved_slope, moved_curvature = _normal_at(moved, counts, omega, response, sigma, soft)
            if solved and reached < cost:
                break
            damping *= 8
            if damping > 1e8:
                return theta
        gained, cost, theta = cost - reached, reached, moved
        slope, curvature = moved_slope, moved_curvature
        damping = max(damping / 8, 1e-14)
        if gained <= tolerance * cost:
            break
    return theta
