"""Frequency response tests -> the plant of Thesis Eq. (2.20) with standard errors, from no starting point."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from identification.files import InputError
from identification.frequency_response import FrequencyResponse
from identification.likelihood import Likely
from identification.model import plant_to_dict
from identification.one_test import OneFit, ScaledTest, Undetermined, plant_from_theta
from identification.plant import PlantModel

Real = NDArray[np.float64]

MOST_MODES = 4
WHITE = 0.1  # correlation of neighbouring residuals below which nothing is left to explain
INSIGNIFICANT = 2.0  # a delay below this many standard errors of the noise is taken as none: it is bounded by 0
CORRELATED = 0.3  # correlation of neighbouring residuals above which a fit missed something


@dataclass(frozen=True)
class FitResult:
    """The nominal plant and how sure it is.

    Parameters
    ----------
    plant
        Mean of the tests' plants: geometric for gain, omega and zeta, arithmetic for the delay.
    noise, scatter
        (4n + 2,) standard errors of the nominal theta: from each test's noise, and from how the tests differ
        (None for one test). The scatter contains the noise.
    tests
        Each test's own fit.
    criterion
        Bayesian information criterion, summed over the tests, of each number of mode pairs tried.
    """

    plant: PlantModel
    noise: Real
    scatter: Real | None
    tests: tuple[OneFit, ...]
    criterion: dict[int, float]

    @property
    def modes(self) -> int:
        """n, the number of zero modes and of pole modes."""
        return len(self.plant.pole_modes)

    @property
    def errors(self) -> Real:
        """(4n + 2,) standard errors of the nominal theta: the larger of scatter and noise."""
        return self.noise if self.scatter is None else np.maximum(self.noise, self.scatter)

    @property
    def standard_errors(self) -> dict[str, Any]:
        """The standard errors of the nominal plant in the shape and units of model.json's ``plant``."""
        return errors_to_dict(self.plant, self.errors)


def fit_plant(
    tests: Sequence[FrequencyResponse],
    modes: int | None = None,
    seed: int = 0,
    tick: Callable[[], object] = lambda: None,
) -> FitResult:
    """Fit K/s prod(zero modes)/prod(pole modes) exp(-h s) to each test and average.

    Parameters
    ----------
    tests
        One or more responses of the same plant.
    modes
        n zero modes and n pole modes; None chooses n from 0 to 4 by the Bayesian information criterion, and
        looks no further once n leaves white residuals and n + 1 is no better.
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
    Each test is fitted on its own and the parameters are averaged: a fit to the mean of responses whose resonances
    differ would be too well damped. Each fit starts from :func:`identification.start.guesses` and maximises the
    likelihood of complex Gaussian errors of variance a^2 + b^2 |P|^2, a and b included. A mean delay within two
    standard errors of zero is reported as zero, its bound; each test's own estimate stays in its fit.
    """
    if not tests:
        raise InputError("no test was given; expected one or more sweeps")
    shortest = min(tests, key=lambda test: test.omega.size)
    most = shortest.omega.size // 4 - 1
    if modes is not None and most < modes:
        raise InputError(
            f"{shortest.name}: holds {shortest.omega.size} lines; "
            f"expected {4 * modes + 4} or more for {modes} mode pairs"
        )
    candidates = range(min(most, MOST_MODES) + 1) if modes is None else range(max(0, modes - 1), modes + 1)
    scaled = [ScaledTest(test) for test in tests]
    found: dict[int, list[Likely]] = {}
    criterion: dict[int, float] = {}
    best = candidates[0]
    for n in candidates:
        found[n] = _fit_all(scaled, n, found.get(n - 1), tick)
        criterion[n] = _criterion(scaled, found[n])
        if criterion[n] < criterion[best] or n == modes:
            best = n
        elif n > best and all(test.correlation(fit) < WHITE for test, fit in zip(scaled, found[best], strict=True)):
            break
    while modes is None and best > 0:
        pairs = zip(scaled, found[best - 1], found[best], strict=True)
        found[best - 1] = [test.prune(fit, richer) for test, fit, richer in pairs]
        criterion[best - 1] = _criterion(scaled, found[best - 1])
        if criterion[best - 1] > criterion[best]:
            break
        best -= 1
    rng = np.random.default_rng(seed)
    chosen = [
        test.restart(fit, rng) if test.correlation(fit) > CORRELATED else fit
        for test, fit in zip(scaled, found[best], strict=True)
    ]
    criterion[best] = _criterion(scaled, chosen)
    while True:
        try:
            return _nominal(tuple(test.finish(fit) for test, fit in zip(scaled, chosen, strict=True)), criterion)
        except Undetermined:
            # exact data leave a richer model nothing but rounding to explain
            if modes is not None or best - 1 not in found:
                raise
            best -= 1
            chosen = found[best]


def _fit_all(
    tests: list[ScaledTest], modes: int, simpler: list[Likely] | None, tick: Callable[[], object]
) -> list[Likely]:
    """Each test on its own; one stuck far from the others is tried again from the best of them."""
    fits = []
    for i, test in enumerate(tests):
        fits.append(test.fit(modes, simpler[i] if simpler else None))
        tick()
    leader = min(range(len(tests)), key=lambda i: fits[i].deviance / tests[i].omega.size)
    return [test.adopt(fit, tests[leader], fits[leader]) for test, fit in zip(tests, fits, strict=True)]


def _criterion(tests: list[ScaledTest], fits: list[Likely]) -> float:
    """Bayesian information criterion: two numbers a line, two parameters of the noise."""
    return sum(
        fit.deviance + (fit.theta.size + 2) * np.log(2 * test.omega.size) for test, fit in zip(tests, fits, strict=True)
    )


def _nominal(tests: tuple[OneFit, ...], criterion: dict[int, float]) -> FitResult:
    signs = {test.sign for test in tests}
    if len(signs) > 1:
        raise InputError(
            "the gain is positive in "
            f"{', '.join(t.name for t in tests if t.sign > 0)} and negative in "
            f"{', '.join(t.name for t in tests if t.sign < 0)}; expected tests of one plant"
        )
    thetas = np.array([test.theta for test in tests])
    count = len(tests)
    theta = thetas.mean(axis=0)
    noise = np.sqrt(np.sum([test.errors**2 for test in tests], axis=0)) / count
    if theta[-1] < INSIGNIFICANT * noise[-1]:
        theta[-1] = 0.0
    return FitResult(
        plant=plant_from_theta(theta, signs.pop()),
        noise=noise,
        scatter=thetas.std(axis=0, ddof=1) / np.sqrt(count) if count > 1 else None,
        tests=tests,
        criterion=criterion,
    )


def errors_to_dict(plant: PlantModel, errors: Real) -> dict[str, Any]:
    """Standard errors (4n + 2,) of theta in the shape and units of the ``plant`` object of model.json."""
    n = len(plant.pole_modes)
    relative = errors[1:-1].reshape(2, n, 2)
    return {
        "gain": float(abs(plant.gain) * errors[0]),
        **{
            key: [
                {"omega": float(mode.omega * of[0]), "zeta": float(mode.zeta * of[1])}
                for mode, of in zip(modes, relative[kind], strict=True)
            ]
            for kind, (key, modes) in enumerate((("zero_modes", plant.zero_modes), ("pole_modes", plant.pole_modes)))
        },
        "delay_s": float(errors[-1]),
    }


def fit_to_dict(result: FitResult) -> dict[str, Any]:
    """The facts of a fit that model.json records."""
    return {
        "modes": result.modes,
        "method": "maximum likelihood, each test on its own; geometric mean of the parameters, mean delay",
        "criterion": {"name": "BIC", "by_modes": {str(n): value for n, value in result.criterion.items()}},
        "noise_standard_errors": errors_to_dict(result.plant, result.noise),
        "scatter_standard_errors": (None if result.scatter is None else errors_to_dict(result.plant, result.scatter)),
        "tests": [
            {
                "name": test.name,
                "lines": test.lines,
                "plant": plant_to_dict(test.plant),
                "standard_errors": errors_to_dict(test.plant, test.errors),
                "noise": {"floor": test.floor, "relative": test.relative},
                "chi_square": test.chi_square,
                "residual_correlation": test.correlation,
            }
            for test in result.tests
        ],
    }
