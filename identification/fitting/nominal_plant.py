"""Several tests' fits -> one nominal plant with confidence intervals, and whether the tests agree."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import chdtrc

from identification.base.arrays import Real
from identification.base.errors import InputError
from identification.fitting.likelihood import maximise_together
from identification.fitting.one_fit import OneFit
from identification.fitting.single_test_fit import FINE, ScaledTest
from identification.model.covariance import Covariance, Matrix
from identification.model.plant import PlantModel
from identification.model.structure import Structure

ONE_PLANT = 0.01  # probability below which tests of one plant do not differ as much as these do
NOISE = 2  # parameters of a test's noise
WIDEST = 20.0  # half width, a logarithm, beyond which an interval says nothing


@dataclass(frozen=True)
class Nominal:
    """The nominal plant and how sure it is.

    Parameters
    ----------
    structure
        Of every test's plant and of the nominal one.
    theta
        (p,) nominal parameters of the structure: the likeliest for all tests at once where they agree, else the mean
        of each test's own.
    sign
        Of the gain.
    covariance
        Of theta; it has a scatter where the tests differ by more than their noise.
    scatter
        (p,) standard errors of theta from how the tests differ (None for one test). They contain the noise.
    agreement
        Probability that tests of one plant differ as much as these do (None for one test).
    """

    structure: Structure
    theta: Real
    sign: float
    covariance: Covariance
    scatter: Real | None
    agreement: float | None

    @property
    def plant(self) -> PlantModel:
        """The nominal plant."""
        return self.structure.plant(self.theta, self.sign)

    @property
    def noise(self) -> Real:
        """(p,) standard errors of theta from residuals that are noise."""
        return np.sqrt(np.diag(self.covariance.noise))

    @property
    def misfit(self) -> Real:
        """(p,) standard errors of theta from residuals that are no noise but what the model leaves."""
        return np.sqrt(np.diag(self.covariance.misfit))

    @property
    def scattered(self) -> bool:
        """Whether the tests differ by more than their noise."""
        return self.covariance.scatter is not None

    @property
    def errors(self) -> Real:
        """(p,) standard errors of theta: noise, or scatter where that is larger and the tests differ, and misfit."""
        random = self.noise if self.scatter is None or not self.scattered else np.maximum(self.noise, self.scatter)
        return np.hypot(random, self.misfit)

    @property
    def half_widths(self) -> Real:
        """(p,) of the 95 % intervals of theta."""
        return np.minimum(self.covariance.half_widths(np.eye(self.theta.size)), WIDEST)

    @property
    def intervals(self) -> tuple[Real, Real]:
        """Lower and upper ends (p,) of the 95 % intervals in physical units."""
        ends = [self._physical(self.theta + side * self.half_widths) for side in (-1, 1)]
        return np.minimum(*ends), np.maximum(*ends)

    def _physical(self, theta: Real) -> Real:
        values = np.append(np.exp(theta[:-1]), max(0.0, theta[-1])) * self.structure.signs()
        values[0] *= self.sign
        return values


def nominal_of(tests: Sequence[ScaledTest], fits: Sequence[OneFit]) -> Nominal:
    """The plant that stands for all tests.

    Parameters
    ----------
    tests, fits
        The tests and each one's own fit, all of one structure.

    Raises
    ------
    InputError
        The tests disagree about the gain's sign.

    Notes
    -----
    Whether the tests differ by more than noise is judged by how much less likely one plant for all makes them (twice
    the logarithm of the ratio is chi-square) and by Cochran's Q for each parameter, with Bonferroni's factors. If they
    do not, that one plant is the nominal one, as sure as the noise allows. If they do, the mean of the tests'
    parameters is, geometric for all but the delay, as sure as the scatter says by Student's distribution.

    What the model leaves in residuals that are no noise is the same in every test: its share of the standard errors
    does not become smaller by averaging. For residuals whose neighbours correlate by rho, more than by chance, the
    variance is taken as (1 + rho)/(1 - rho) of the noise's.
    """
    signs = {fit.sign for fit in fits}
    if len(signs) > 1:
        raise InputError(
            "the gain is positive in "
            f"{', '.join(fit.name for fit in fits if fit.sign > 0)} and negative in "
            f"{', '.join(fit.name for fit in fits if fit.sign < 0)}; expected tests of one plant"
        )
    thetas, count = np.array([fit.theta for fit in fits]), len(fits)
    structure, theta, agreement, scatter = fits[0].structure, thetas.mean(axis=0), None, None
    covariances = np.array([fit.covariance for fit in fits])
    noise = covariances.mean(axis=0) / count
    if count > 1:
        scatter = np.cov(thetas, rowvar=False) / count
        one, increase = _together(tests, fits)
        together = chdtrc(structure.free * (count - 1), increase)
        variances = np.einsum("tii->ti", covariances)
        mean = np.average(thetas, axis=0, weights=1 / variances)
        alone = chdtrc(count - 1, np.sum((thetas - mean) ** 2 / variances, axis=0))
        agreement = float(min(1.0, 2 * together, 2 * structure.free * alone.min()))
        if agreement >= ONE_PLANT:
            theta = one
            pairs = zip(tests, fits, strict=True)
            covariances = np.array([test.covariance_at(fit, theta) for test, fit in pairs])
            variances = np.einsum("tii->ti", covariances)
            # in units of typical standard errors, where the matrices are well conditioned
            units = np.sqrt(variances.mean(axis=0))
            information = np.linalg.inv(covariances / np.outer(units, units)).sum(axis=0)
            noise = np.linalg.inv(information) * np.outer(units, units)
            # weights that are estimated make a mean less sure than known ones (Meier, Biometrics 9, 1953)
            shares = 1 / variances / np.sum(1 / variances, axis=0)
            freedoms = np.array([[fit.lines * 2 - structure.free - NOISE] for fit in fits])
            wider = np.sqrt(1 + np.sum(4 / np.maximum(freedoms, 1) * shares * (1 - shares), axis=0))
            noise *= np.outer(wider, wider)
    misfit = np.mean([fit.misfit * covariance for fit, covariance in zip(fits, covariances, strict=True)], axis=0)
    differ = agreement is not None and agreement < ONE_PLANT
    return Nominal(
        structure=structure,
        theta=theta,
        sign=signs.pop(),
        covariance=Covariance(
            noise=_rows(noise),
            misfit=_rows(misfit),
            scatter=None if scatter is None or not differ else _rows(scatter),
            freedom=max(1, sum(2 * fit.lines - structure.free - NOISE for fit in fits)),
            count=count,
        ),
        scatter=None if scatter is None else np.sqrt(np.diag(scatter)),
        agreement=agreement,
    )


def _rows(matrix: Real) -> Matrix:
    return tuple(map(tuple, ((matrix + matrix.T) / 2).tolist()))


def _together(tests: Sequence[ScaledTest], fits: Sequence[OneFit]) -> tuple[Real, float]:
    """The one theta in physical units that is likeliest for all tests, and by how much the deviance is larger."""
    first, structure = tests[0], fits[0].structure
    parts = [
        replace(
            test.lines,
            omega=test.omega * (test.centre / first.centre),
            response=test.lines.response * (test.level / first.level),
            held_s=test.lines.held_s and test.lines.held_s * (first.centre / test.centre),
        )
        for test in tests
    ]
    weights = [1 / fit.errors**2 for fit in fits]
    start = first.to_scaled(structure, np.average([fit.theta for fit in fits], axis=0, weights=weights))
    theta, deviance = maximise_together(parts, structure, start, fits[0].sign, soft=first.soft, tolerance=FINE)
    # each test's own deviance is that of its response in units of its own level
    alone = sum(
        fit.deviance + 4 * test.omega.size * float(np.log(test.level / first.level))
        for test, fit in zip(tests, fits, strict=True)
    )
    return first.to_physical(structure, theta), deviance - alone
