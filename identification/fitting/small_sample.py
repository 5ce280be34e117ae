"""How sure the parameters of one fit are where few lines tell them: noise levels and covariance, degrees of freedom."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from identification.base.arrays import Complex, Real
from identification.fitting.grouped_lines import grouped
from identification.fitting.least_squares import log_jacobian, response_of, stacked
from identification.fitting.likelihood import noise_levels
from identification.fitting.one_fit import OneFit
from identification.sweeps.response import FrequencyResponse, alias_free

ROUNDS = 2  # of leverages and noise levels in turn
LEAST_LEFT = 0.02  # share of a line's noise that its residual keeps, at least
ALIKE = 1e-6  # eigenvalue of the levels' scaled information below which the lines tell only one of them


@dataclass(frozen=True)
class Sureness:
    """Of the parameters theta (p,) of one fit.

    Parameters
    ----------
    covariance
        (p, p), from residuals that are noise.
    freedom
        (p,) degrees of freedom of Student's distribution that each parameter's error over its standard error follows.
    floor, relative
        a and b of the noise E|error|^2 = (a^2 + b^2 |P|^2) excitation; a in the response's unit.
    """

    covariance: Real
    freedom: Real
    floor: float
    relative: float

    def sigma(self, response: Complex, excitation: Real | None) -> Real:
        """Standard deviations (M,) of the complex errors of lines with this response of the plant."""
        variance = self.floor**2 + self.relative**2 * np.abs(response) ** 2
        return np.sqrt(variance if excitation is None else variance * excitation)


def sureness(fit: OneFit, test: FrequencyResponse) -> Sureness:
    """How sure a fit is, with the noise levels corrected for what the fit takes out of the residuals.

    Parameters
    ----------
    fit, test
        The fit, and the response that it was made of.

    Notes
    -----
    A parameter that few lines decide, such as that of a narrow notch, bends to their noise: their residuals are too
    small and with them the noise that is estimated there. The residual of line m keeps 1 - h_m of the noise's
    variance, h_m being its leverage; divided by that, residuals give the noise levels a^2 and b^2 of
    :func:`identification.fitting.likelihood.noise_levels`. The variance of a parameter is a function of these two,
    whose own covariance gives the degrees of freedom (Satterthwaite, Biometrics Bull. 2, 1946). Of very many lines
    groups stand for them, see :func:`identification.fitting.grouped_lines.grouped`. Errors of a soft-L1 fit come out
    larger than they are where there are outliers.
    """
    structure, lines = fit.structure, grouped(alias_free(test, fit.plant))
    omega = lines.omega
    size = structure.free  # a dead time that is not asked for is no parameter
    excitation = np.ones_like(omega) if lines.excitation is None else lines.excitation
    model = response_of(structure, fit.theta, omega)
    derivatives = (model[:, None] * log_jacobian(structure, fit.theta, omega))[:, :size]
    error, power = np.abs(fit.sign * lines.response - model) ** 2, np.abs(model) ** 2
    a2, b2 = fit.floor**2, fit.relative**2
    for _ in range(ROUNDS):
        rows, inverse, _ = _inverted(derivatives, (a2 + b2 * power) * excitation)
        kept = 1 - np.einsum("pm,pq,qm->m", rows, inverse, rows).reshape(-1, 2).mean(axis=1)
        a2, b2, _ = noise_levels(error / np.maximum(kept, LEAST_LEFT), power, excitation)
    variance = (a2 + b2 * power) * excitation
    rows, inverse, units = _inverted(derivatives, variance)
    shares = np.array([excitation, power * excitation]) / variance  # slopes of the variance's logarithm along a^2, b^2
    slopes = np.array([np.diag(inverse @ (rows * np.repeat(share, 2)) @ rows.T @ inverse) for share in shares])
    known = (shares * np.maximum(kept, LEAST_LEFT)) @ shares.T
    scale = 1 / np.sqrt(np.diag(known))
    of_levels = np.linalg.pinv(known * np.outer(scale, scale), rcond=ALIKE, hermitian=True) * np.outer(scale, scale)
    freedom = 2 * np.diag(inverse) ** 2 / np.einsum("ik,ij,jk->k", slopes, of_levels, slopes)
    covariance = np.zeros((structure.size, structure.size))
    covariance[:size, :size] = inverse * np.outer(units, units) / 2  # of complex errors: half in each part
    freedom = np.append(freedom, [np.inf] * (structure.size - size))
    return Sureness(covariance, freedom, float(np.sqrt(a2)), float(np.sqrt(b2)))


def _inverted(derivatives: Complex, variance: Real) -> tuple[Real, Real, Real]:
    """The rows (p, 2M) over the noise in units (p,) in which their squares add up to 1, and the inverse (p, p)."""
    rows = stacked(derivatives / np.sqrt(variance)[:, None])
    units = 1 / np.sqrt(np.sum(rows**2, axis=1))
    rows = rows * units[:, None]
    return rows, np.linalg.inv(rows @ rows.T), units
