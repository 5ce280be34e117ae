"""Frequency response tests -> the plant of Thesis Eq. (2.20) with confidence intervals, from no starting point."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from identification.base.errors import InputError
from identification.fitting.grouped_lines import grouped
from identification.fitting.nominal_plant import Nominal, nominal_of
from identification.fitting.single_test_fit import OneFit, ScaledTest, Undetermined
from identification.fitting.structure_selection import Selection
from identification.model.plant import PlantModel
from identification.model.structure import Structure, Wanted
from identification.sweeps.response import FrequencyResponse, require_one_band

CORRELATED = 0.3  # correlation of neighbouring residuals above which a fit may have missed something


@dataclass(frozen=True)
class FitResult:
    """The nominal plant, how sure it is, and how it came about.

    Parameters
    ----------
    nominal
        The plant that stands for all tests.
    tests
        Each test's own fit.
    criterion
        Bayesian information criterion, summed over the tests, of each structure that was fitted to all.
    overdispersion
        By what the deviance is divided in the criterion; above 1 the residuals are no noise.
    soft
        Whether the loss was soft-L1.
    """

    nominal: Nominal
    tests: tuple[OneFit, ...]
    criterion: dict[Structure, float]
    overdispersion: float
    soft: bool

    @property
    def plant(self) -> PlantModel:
        """The nominal plant."""
        return self.nominal.plant

    @property
    def structure(self) -> Structure:
        """Of every test's plant and of the nominal one."""
        return self.nominal.structure


def fit_plant(
    tests: Sequence[FrequencyResponse],
    wanted: Wanted | None = None,
    *,
    soft: bool = False,
    seed: int = 0,
    tick: Callable[[], object] = lambda: None,
) -> FitResult:
    """Fit K/s^q prod(zeros)/prod(poles) exp(-h s) to each test and average.

    Parameters
    ----------
    tests
        One or more responses of the same plant.
    wanted
        Numbers of integrators, modes and real roots; what it leaves open, the Bayesian information criterion
        chooses.
    soft
        Soft-L1 loss, which outliers can hardly move, instead of least squares.
    seed
        Of the random restarts, which are needed only when a fit leaves correlated residuals.
    tick
        Called after each fit of a test: a place for a progress bar.

    Raises
    ------
    InputError
        Too few lines for the parameters, parameters that the data do not determine, no stable minimum phase
        plant near the data, or tests that disagree about the gain's sign.

    Notes
    -----
    Each fit starts from :func:`identification.fitting.first_guess.guesses` and maximises the
    likelihood of complex errors of variance a^2 + b^2 |P|^2, a and b included. The mean of responses is never fitted:
    where resonances differ it is too well damped.

    Each test is fitted on its own first; how they become one plant,
    :func:`identification.fitting.nominal_plant.nominal_of` says.

    Of very many lines groups stand for them until the structure is chosen, see
    :func:`identification.fitting.grouped_lines.grouped`; the plant is that of all lines.

    A held record's response has the aliases of the plant on it. They are computed from the parameters and taken away,
    in turn with the fit.
    """
    if not tests:
        raise InputError("no test was given; expected one or more sweeps")
    require_one_band(tests)
    wanted = wanted or Wanted()
    groups = [grouped(test) for test in tests]
    selection = Selection([ScaledTest(group, soft) for group in groups], wanted, tick)
    whole = [
        few if group is test else ScaledTest(test, soft)
        for test, group, few in zip(tests, groups, selection.tests, strict=True)
    ]
    best = selection.search()
    rng = np.random.default_rng(seed)
    pairs = list(zip(selection.tests, selection.fits[best], strict=True))
    selection.fits[best] = [
        test.restart(fit, rng) if test.correlation(fit) > CORRELATED else fit for test, fit in pairs
    ]
    criterion = {structure: selection.criterion(structure) for structure in selection.fits}
    criterion = {structure: value for structure, value in criterion.items() if np.isfinite(value)}
    # exact data leave a richer structure nothing but rounding to explain
    simpler = [s for s in criterion if s.size < best.size]
    for structure in [best, *sorted(simpler, key=criterion.__getitem__)]:
        try:
            fits = [
                test.finish(fit if test is few else test.taken_over(few, fit))
                for test, few, fit in zip(whole, selection.tests, selection.fits[structure], strict=True)
            ]
        except Undetermined as error:
            undetermined = error
            continue
        nominal = nominal_of(whole, fits)
        return FitResult(nominal, tuple(fits), criterion, selection.overdispersion, soft)
    raise undetermined
