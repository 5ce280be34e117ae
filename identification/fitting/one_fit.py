"""What a fit of one test says: parameters, how sure they are, noise, and what is left."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from identification.base.arrays import Real
from identification.model.plant import PlantModel
from identification.model.structure import Structure


@dataclass(frozen=True)
class OneFit:
    """The plant of one test.

    Parameters
    ----------
    name
        The test's.
    structure
        Of the plant.
    theta
        (p,) parameters of the structure in physical units, modes sorted by omega.
    sign
        Of the gain.
    covariance
        (p, p) of theta, from residuals that are noise.
    deviance
        -2 log likelihood, of the response in units of its own.
    spread
        Factor between the covariance and the inverse curvature of the squared residuals, see
        :meth:`identification.fitting.single_test_fit.ScaledTest.finish`.
    misfit
        What the covariance of theta is to be multiplied by and added on account of residuals that are no noise but what
        the model leaves; 0 when neighbouring residuals correlate no more than by chance.
    floor, relative
        a and b of the noise E|error|^2 = a^2 + b^2 |P|^2, estimated; a in the response's unit. For soft-L1 errors
        the same of their scale.
    chi_square
        Squared residuals over their variance, per degree of freedom; near 1 because a and b are estimated.
    correlation
        Of neighbouring normalised residuals; 0 within 1/sqrt(lines) when they are noise.
    distance
        Median of |test - plant|/|test|.
    worst, worst_omega
        Largest |test - plant| over its sigma, and where it is, in rad/s.
    around
        Median of the same there and at the lines beside it.
    lines
        M, the number of frequencies.
    """

    name: str
    structure: Structure
    theta: Real
    sign: float
    covariance: Real
    deviance: float
    spread: float
    misfit: float
    floor: float
    relative: float
    chi_square: float
    correlation: float
    distance: float
    worst: float
    worst_omega: float
    around: float
    lines: int

    @property
    def errors(self) -> Real:
        """(p,) standard errors of theta from the residuals of this test, noise and misfit."""
        return np.sqrt(np.diag(self.covariance) * (1 + self.misfit))

    @property
    def plant(self) -> PlantModel:
        """The test's own model."""
        return self.structure.plant(self.theta, self.sign)
