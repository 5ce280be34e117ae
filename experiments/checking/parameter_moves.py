"""Which parameters of the plant moved between the model's tests and a new sweep, in standard errors and in percent."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import chdtrc, ndtr, stdtr, stdtrit

from experiments.checking.new_sweep import NewSweep
from identification.base.arrays import Real
from identification.fitting.nominal_plant import NOISE, ONE_PLANT
from identification.model.fit_record import FitRecord
from identification.model.model_file import IdentifiedModel
from identification.model.parameter import Parameter

TOLD = 9.0  # relative move beyond which nothing is said of a parameter


@dataclass(frozen=True)
class Move:
    """How one parameter of the new sweep differs from the model's.

    Parameters
    ----------
    parameter
        The model's.
    value
        The new sweep's, in the same unit.
    errors
        The difference over its standard error: of logarithms, but for the dead time; infinite where the gain has
        changed its sign.
    chance
        Probability of a difference as large where nothing moved, times the number of parameters (Bonferroni), or 1; at
        least that with which the whole plant's likelihood gains as much by chance.
    found_from
        Relative move from which it would have been found; of a dead time that the model has not, in seconds.
    is_open
        Whether the tests are too few to tell: it would be called a move if their standard errors were known for sure.
    """

    parameter: Parameter
    value: float
    errors: float
    chance: float
    found_from: float
    is_open: bool

    @property
    def could_be_told(self) -> bool:
        """Whether a move to ten times its value would have been found."""
        return self.parameter.value == 0 or self.found_from < TOLD

    @property
    def share(self) -> float:
        """By what share of the model's value it moved, above 0 where its magnitude grew; infinite from 0."""
        before = self.parameter.value
        return self.value / before - 1 if before else float(np.inf) * (self.value > 0)


def tests_differ(record: FitRecord) -> bool:
    """Whether a model's tests differ by more than their noise, so that another one will, too."""
    agree = record.agreement_of_tests
    return record.scatter is not None and agree is not None and agree < ONE_PLANT


def moves(model: IdentifiedModel, record: FitRecord, sweep: NewSweep, level: float) -> tuple[Move, ...]:
    """Each parameter of a sweep's own fit against the model's.

    Parameters
    ----------
    model, record
        The model and how it was fitted.
    sweep
        The new sweep, with its fit in the model's structure.
    level
        Probability with which any parameter is to be called moved though none did.

    Notes
    -----
    The variance of the difference is the sum of the noise's of both, and of what the structure leaves in both. Where
    the model's tests differ by more than their noise, so will a new one: by their standard deviation s, and from their
    mean of n by (1 + 1/n) s^2, and by more where the new sweep is noisier than they were. The sum is compared by
    Student's distribution with Welch's degrees of freedom. The model's noise is taken to be as well known as that of
    as many sweeps like the new one as it has tests. No parameter moved where the sweep is as likely with the model's
    plant as with its own fit: of what it hardly shows, such as a zero beside a pole, that fit may be anywhere.
    """
    structure, fit, sure = sweep.fit.structure, sweep.fit, sweep.sure
    count, size = len(record.tests), structure.free
    before, after = structure.theta(model.plant), fit.theta
    unit = np.append(np.abs([each.value for each in model.plant.parameters[:-1]]), 1.0)
    noise, misfit = np.array(record.noise) / unit, np.array(record.misfit) / unit
    own = np.diag(sure.covariance)
    parts = [(own * (1 + fit.misfit), sure.freedom)]
    if tests_differ(record):
        spread = count * (np.array(record.scatter) / unit) ** 2
        noisier = np.maximum(own * (1 + fit.misfit) - count * noise**2, 0.0)
        parts = [(noisier, sure.freedom), (spread * (1 + 1 / count), np.full(own.size, count - 1.0))]
    else:
        parts.append((noise**2, count * sure.freedom))
    lines = sum(2 * test.lines - structure.free - NOISE for test in record.tests)
    parts.append((misfit**2, np.full(own.size, float(max(1, lines)))))
    variance = np.sum([part for part, _ in parts], axis=0)
    freedom = variance**2 / np.sum([part**2 / nu for part, nu in parts], axis=0)
    errors = (after - before) / np.sqrt(variance)
    if fit.sign != np.sign(model.plant.gain):
        errors[0] = np.inf
    alike = chdtrc(size, max(0.0, sweep.gained))
    by_student, by_normal = size * 2 * stdtr(freedom, -np.abs(errors)), size * 2 * ndtr(-np.abs(errors))
    chance = np.minimum(1.0, np.maximum(by_student, alike))
    is_open = (by_student >= level) & (np.maximum(by_normal, alike) < level)
    seen = stdtrit(freedom, 1 - level / (2 * size)) * np.sqrt(variance)
    return tuple(
        Move(parameter, value, float(errors[k]), float(chance[k]), _share(seen, k, parameter), bool(is_open[k]))
        for k, (parameter, value) in enumerate(zip(model.plant.parameters, _values(sweep), strict=True))
        if k < size
    )


def _values(sweep: NewSweep) -> list[float]:
    return [each.value for each in sweep.fit.plant.parameters]


def _share(seen: Real, k: int, parameter: Parameter) -> float:
    """A difference of theta as a share of the parameter."""
    if parameter.kind == "delay_s":
        return float(seen[k] / parameter.value if parameter.value else seen[k])
    return float(np.expm1(min(seen[k], 700.0)))
