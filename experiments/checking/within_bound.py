"""Whether a new sweep lies within W_a of the model: at its lines, and between them as far as its own fit says."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import fdtrc

from experiments.checking.new_sweep import NewSweep
from identification.base.arrays import Real
from identification.bound.bound_residuals import GRID
from identification.bound.tightest_bound import resonances
from identification.fitting.least_squares import log_jacobian, response_of
from identification.model.model_file import IdentifiedModel


@dataclass(frozen=True)
class Reach:
    """Where a sweep comes farthest from the model, beside W_a.

    Parameters
    ----------
    omega
        In rad/s: where noise explains the distance beyond W_a least, or, where it is nowhere beyond, where distance
        over W_a is largest.
    distance, bound
        |P_new - P| and |W_a| there, output unit per input unit.
    chance
        Probability, at most, with which noise alone makes a plant within W_a look so anywhere; 1 where it is within.
    """

    omega: float
    distance: float
    bound: float
    chance: float

    @property
    def ratio(self) -> float:
        """Distance over W_a."""
        return self.distance / self.bound


def reach_at_lines(model: IdentifiedModel, sweep: NewSweep, *, or_fit: bool = False) -> Reach:
    """How far the lines of a sweep lie from the model.

    Parameters
    ----------
    model, sweep
        The model and the new sweep with its own fit.
    or_fit
        Whether W_a is as large as the distance of that fit where it is smaller: what is left beyond, no plant of the
        model's structure explains.

    Notes
    -----
    Of a plant within W_a a line exceeds W_a by no more than its error. With sigma^2 estimated with nu degrees of
    freedom, |error| > c sigma has the probability (1 + 2 c^2/nu)^(-nu/2), which is F's distribution with 2 and nu. It
    counts once for each line (Bonferroni).
    """
    omega = sweep.test.omega
    distance = np.abs(sweep.test.response - model.plant(1j * omega))
    bound = np.abs(model.additive_bound(1j * omega))
    if or_fit:
        bound = np.maximum(bound, np.abs(sweep.fit.plant(1j * omega) - model.plant(1j * omega)))
    beyond = np.maximum(distance - bound, 0.0) / sweep.noise
    nu = sweep.freedom
    chance = np.exp(-nu / 2 * np.log1p(2 * beyond**2 / nu))
    return _farthest(omega, distance, bound, omega.size * chance)


def reach_between_lines(model: IdentifiedModel, sweep: NewSweep) -> Reach:
    """How far the sweep's own fit lies from the model within the sweep's band.

    Notes
    -----
    The distance's own error follows from the covariance of the fit's parameters, along the difference. It is exceeded
    at no frequency at all with the probability that Scheffe's intervals give for p parameters together.
    """
    fit, (low, high) = sweep.fit, sweep.test.omega[[0, -1]]
    omega = np.concatenate([low * np.exp(np.linspace(0, np.log(high / low), GRID)), resonances(model.plant, fit.plant)])
    omega = np.unique(omega[(omega >= low) & (omega <= high)])
    difference = fit.plant(1j * omega) - model.plant(1j * omega)
    distance, bound = np.abs(difference), np.abs(model.additive_bound(1j * omega))
    response = fit.sign * response_of(fit.structure, fit.theta, omega)
    slopes = response[:, None] * log_jacobian(fit.structure, fit.theta, omega)
    along = np.real(np.conj(difference / np.where(distance > 0, distance, 1.0))[:, None] * slopes)
    covariance = sweep.sure.covariance * (1 + fit.misfit)
    error = np.sqrt(np.maximum(np.einsum("mp,pq,mq->m", along, covariance, along), np.finfo(float).tiny))
    beyond = np.maximum(distance - bound, 0.0) / error
    chance = fdtrc(fit.structure.free, sweep.freedom, beyond**2 / fit.structure.free)
    return _farthest(omega, distance, bound, chance)


def _farthest(omega: Real, distance: Real, bound: Real, chance: Real) -> Reach:
    at = int(np.lexsort((-distance / bound, np.minimum(chance, 1.0)))[0])
    return Reach(float(omega[at]), float(distance[at]), float(bound[at]), float(min(1.0, chance[at])))
