"""Maximum likelihood fit of one response from one first guess: parameters, noise and how likely."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identification.start import BAND, BOUNDS

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]

ALTERNATIONS = 4
EVALUATIONS = 60
RATIOS = 20.0  # of floor and relative error at the median response: logarithm of the largest
GAIN = 20.0  # the gain is sought up to this factor's logarithm from the one that fits the guess
CLOSEST = 1e-8  # no relative error below this is believed: files do not carry more digits


@dataclass(frozen=True)
class Likely:
    """A fit with n mode pairs in scaled frequency.

    Parameters
    ----------
    theta
        (4n + 2,) log |gain|, then log omega and log zeta of zero modes and of pole modes, then the delay.
    sign
        Of the gain.
    floor, relative
        a and b in E|error|^2 = (a^2 + b^2 |P|^2) times the excitation's factor.
    deviance
        -2 log likelihood.
    """

    theta: Real
    sign: float
    floor: float
    relative: float
    deviance: float


def response_of(theta: Real, omega: Real) -> Complex:
    """|gain|/s prod(zero modes)/prod(pole modes) exp(-delay s) at s = j omega, (M,)."""
    s = 1j * omega
    n = (theta.size - 2) // 4
    value = np.exp(theta[0] - theta[-1] * s) / s
    for i in range(2 * n):
        x = s * np.exp(-theta[1 + 2 * i])
        factor = 1 + (2 * np.exp(theta[2 + 2 * i]) + x) * x
        value = value * factor if i < n else value / factor
    return value


def log_jacobian(theta: Real, omega: Real) -> Complex:
    """Derivative of the logarithm of :func:`response_of` with respect to theta, (M, 4n + 2)."""
    s = 1j * omega
    n = (theta.size - 2) // 4
    jacobian = np.empty((omega.size, theta.size), dtype=complex)
    jacobian[:, 0] = 1.0
    jacobian[:, -1] = -s
    for i in range(2 * n):
        x = s * np.exp(-theta[1 + 2 * i])
        damping = 2 * np.exp(theta[2 + 2 * i]) * x
        inverse = (1 if i < n else -1) / (1 + damping + x * x)
        jacobian[:, 1 + 2 * i] = -(damping + 2 * x * x) * inverse
        jacobian[:, 2 + 2 * i] = damping * inverse
    return jacobian


def noise_levels(error: Real, power: Real, excitation: Real) -> tuple[float, float]:
    """Maximum likelihood a^2 and b^2 of E|error|^2 = (a^2 + b^2 power) excitation, from (M,) squared errors.

    The common factor follows from the ratio a^2/b^2 in closed form; the ratio is searched for on a grid twice refined,
    since the likelihood can have an optimum at either end besides the one within.
    """
    typical = float(np.median(power))
    q = error / excitation
    log_ratio, half_width = 0.0, RATIOS
    for _ in range(3):
        grid = log_ratio + np.linspace(-half_width, half_width, 25)
        shape = np.exp(grid)[:, None] + power / typical
        factor = np.maximum(np.mean(q / shape, axis=1), CLOSEST**2 * typical)
        deviance = np.sum(np.log(factor[:, None] * shape) + q / (factor[:, None] * shape), axis=1)
        best = int(np.argmin(deviance))
        log_ratio, half_width = float(grid[best]), half_width / 12
    return float(factor[best] * np.exp(log_ratio)), float(factor[best] / typical)


def maximise(omega: Real, response: Complex, excitation: Real, theta: Real, sigma: Real, *, tolerance: float) -> Likely:
    """Bounded least squares from ``theta`` with the errors' sigma (M,), then noise and parameters in turn.

    ``tolerance`` is the relative change of the sum of squares at which a turn ends. The gain in ``theta`` is not used.
    """
    n = (theta.size - 2) // 4
    mode = np.array([[np.log(omega[0] / BAND), np.log(omega[-1] * BAND)], np.log(BOUNDS)])
    theta, sign = _with_gain(omega, response, sigma, theta)
    lower = np.concatenate([[theta[0] - GAIN], np.tile(mode[:, 0], 2 * n), [0.0]])
    upper = np.concatenate([[theta[0] + GAIN], np.tile(mode[:, 1], 2 * n), [np.inf]])
    best: Likely | None = None
    for _ in range(ALTERNATIONS):
        theta = _least_squares(omega, sign * response, sigma, np.clip(theta, lower, upper), (lower, upper), tolerance)
        model = response_of(theta, omega)
        power, error = np.abs(model) ** 2, np.abs(sign * response - model) ** 2
        a2, b2 = noise_levels(error, power, excitation)
        variance = (a2 + b2 * power) * excitation
        deviance = 2 * float(np.sum(np.log(variance) + error / variance))
        if best is not None and deviance > best.deviance - 1e-3:
            break
        best = Likely(theta, sign, float(np.sqrt(a2)), float(np.sqrt(b2)), deviance)
        sigma = np.sqrt(variance)
    assert best is not None
    return best


def stacked(columns: Complex) -> Real:
    """Complex columns (M, p) as real rows (p, 2M), real and imaginary parts interleaved."""
    return np.ascontiguousarray(columns.T).view(float)


def _with_gain(omega: Real, response: Complex, sigma: Real, theta: Real) -> tuple[Real, float]:
    """Theta with the gain that fits best, and its sign."""
    shape = response_of(np.concatenate([[0.0], theta[1:]]), omega) / sigma
    gain = float(np.vdot(shape, response / sigma).real / np.vdot(shape, shape).real)
    gain = gain if gain != 0 else 1.0
    return np.concatenate([[np.log(abs(gain))], theta[1:]]), float(np.sign(gain))


def _least_squares(
    omega: Real, response: Complex, sigma: Real, theta: Real, bounds: tuple[Real, Real], tolerance: float
) -> Real:
    """Levenberg and Marquardt's method; a parameter at its bound stays there while the slope pushes it out.

    The normal equations of a few scaled parameters are solved: singular values of 2M rows, as
    scipy.optimize.least_squares takes them, cost ten times the rest. The products are einsum's and not the matrix
    library's, whose threads cost more than they bring at this size.
    """
    lower, upper = bounds
    model = response_of(theta, omega)
    residual = (model - response) / sigma
    cost = float(np.vdot(residual, residual).real)
    damping, scale = 1e-3, np.zeros(theta.size)
    for _ in range(EVALUATIONS):
        rows = stacked((model / sigma)[:, None] * log_jacobian(theta, omega))
        slope, curvature = np.einsum("im,m->i", rows, residual.view(float)), np.einsum("im,jm->ij", rows, rows)
        scale = np.maximum(scale, np.diag(curvature))
        free = np.flatnonzero(((theta > lower) | (slope < 0)) & ((theta < upper) | (slope > 0)) & (scale > 0))
        unit = np.sqrt(scale[free])
        scaled, downhill = curvature[np.ix_(free, free)] / (unit[:, None] * unit), -slope[free] / unit
        while True:
            moved = theta.copy()
            moved[free] += np.linalg.solve(scaled + damping * np.eye(free.size), downhill) / unit
            moved = np.clip(moved, lower, upper)
            model = response_of(moved, omega)
            residual = (model - response) / sigma
            reached = float(np.vdot(residual, residual).real)
            if reached < cost:
                break
            damping *= 8
            if damping > 1e8:
                return theta
        gained, cost, theta = cost - reached, reached, moved
        damping = max(damping / 8, 1e-14)
        if gained <= tolerance * cost:
            break
    return theta
