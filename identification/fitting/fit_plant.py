"""Frequency response tests -> the plant of Thesis Eq. (2.20) with confidence intervals, from no starting point."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from identification.base.errors import InputError
from identification.fitting.grouped_lines import grouped
from identification.fitting.likelihood import Likely
from identification.fitting.nominal_plant import Nominal, nominal_of
from identification.fitting.one_fit import OneFit
from identification.fitting.single_test_fit import Misfit, ScaledTest, Undetermined
from identification.fitting.structure_fits import ALIKE, LAST_RESORT
from identification.fitting.structure_selection import Selection
from identification.model.plant import PlantModel
from identification.model.structure import Structure, Wanted
from identification.sweeps.response import FrequencyResponse, alias_free, require_one_band

MOST_ALIKE = 3  # structures that are named beside the chosen one
OPEN = 3.5  # half width of the interval of a gain or a root, a logarithm, from which the data do not determine it
FAR = 2.0  # times as far from the tests as the plant of least criterion
CORRELATED = 0.3  # correlation of neighbouring residuals above which a fit may have missed something
APART = 2.0  # standard errors of their distance by which two real roots are told from a mode of zeta near 1


@dataclass(frozen=True)
class FitResult:
    """The nominal plant, how sure it is, and how it came about.

    Parameters
    ----------
    nominal
        The plant that stands for all tests.
    tests
        Each test's own fit.
    distances
        For each test the median of |test - nominal plant|/|test|.
    criterion
        Bayesian information criterion, summed over the tests, of each structure that was fitted to all.
    chosen
        Which of these it is; the plant's own may have two real roots for a mode of zeta > 1.
    alike
        By how much the criterion of other structures differs from that of the chosen one, where it hardly tells them
        apart, and where it is less: the chosen one has fewer roots outside the band, or roots that the data determine.
    overdispersion
        By what the deviance is divided in the criterion; above 1 the residuals are no noise.
    soft
        Whether the loss was soft-L1.
    """

    nominal: Nominal
    tests: tuple[OneFit, ...]
    distances: tuple[float, ...]
    criterion: dict[Structure, float]
    chosen: Structure
    alike: dict[Structure, float]
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
        Too few lines for the parameters, parameters that the data do not determine, no stable plant near the data, or
        tests that disagree about the gain's sign.

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
    criterion = {structure: value for structure, value in criterion.items() if value < LAST_RESORT or structure == best}
    nearest = max(test.distance(fit) for test, fit in zip(selection.tests, selection.fits[best], strict=True))
    # exact data leave a richer structure nothing but rounding to explain
    simpler = [s for s in criterion if s.size < best.size]
    refusal: InputError | None = None
    found: list[FitResult] = []
    for structure in [best, *sorted(simpler, key=criterion.__getitem__)]:
        try:
            fits = _finished(whole, selection, structure)
        except (Undetermined, Misfit) as error:
            refusal = refusal or error
            continue
        nominal = nominal_of(whole, fits)
        result = FitResult(
            nominal=nominal,
            tests=tuple(fits),
            distances=tuple(median_distance(nominal.plant, test) for test in tests),
            criterion=criterion,
            chosen=structure,
            alike={
                other: value - criterion[structure]
                for other, value in sorted(criterion.items(), key=lambda item: item[1])[: 1 + MOST_ALIKE]
                if other != structure and value - criterion[structure] < ALIKE
            },
            overdispersion=selection.overdispersion,
            soft=soft,
        )
        told = nominal.structure.frequencies()
        told[0] = True
        if np.all(nominal.half_widths[told] < OPEN) and max(fit.distance for fit in fits) < FAR * nearest:
            return result
        found.append(result)
    if not found:
        assert refusal is not None
        raise refusal
    # a plant that fits, with roots that are open, is better than one that does not fit
    return min(found, key=lambda result: max(fit.distance for fit in result.tests))


def median_distance(plant: PlantModel, test: FrequencyResponse) -> float:
    """The median over a test's lines of |test - plant|/|test|; lines of no response are left out."""
    seen = test.response != 0
    clean = alias_free(test, plant)
    return float(np.median(np.abs(clean.response - plant(1j * test.omega))[seen] / np.abs(clean.response[seen])))


def _finished(whole: Sequence[ScaledTest], selection: Selection, structure: Structure) -> list[OneFit]:
    """Each test's last fit by a structure; two real roots that all tests tell apart are written as such."""
    likely = [
        fit if test is few else test.taken_over(few, fit)
        for test, few, fit in zip(whole, selection.tests, selection.fits[structure], strict=True)
    ]
    fits = [test.finish(fit) for test, fit in zip(whole, likely, strict=True)]
    rewritten = [_with_real_roots(test, fit) for test, fit in zip(whole, fits, strict=True)]
    asked = selection.wanted.real is not None or selection.wanted.modes is not None
    if asked or len({fit.structure for fit in rewritten}) > 1:
        return fits
    try:
        real = [test.finish(fit) for test, fit in zip(whole, rewritten, strict=True)]
    except Undetermined:
        return fits
    return real if all(map(_are_apart, real)) else fits


def _with_real_roots(test: ScaledTest, fit: OneFit) -> Likely:
    structure, theta = fit.structure.with_real_roots(test.to_scaled(fit.structure, fit.theta))
    return Likely(structure, theta, fit.sign, fit.floor / test.level, fit.relative, fit.deviance)


def _are_apart(fit: OneFit) -> bool:
    """Whether the real roots of each kind are further apart than their errors."""
    for part in fit.structure.parts[3:]:
        rates, covariance = fit.theta[part], fit.covariance[part, part]
        variances = np.diag(covariance)
        of_distance = variances[1:] + variances[:-1] - 2 * np.diag(covariance, 1)
        if np.any(np.diff(rates) < APART * np.sqrt(of_distance)):
            return False
    return True
