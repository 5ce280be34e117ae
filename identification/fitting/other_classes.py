"""What a poor fit may be instead of noise: a response whose phase has the other sign, or an unstable plant."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from identification.base.arrays import Complex
from identification.base.errors import InputError
from identification.fitting.first_guess import unstable_poles
from identification.fitting.fit_plant import FitResult, fit_plant
from identification.fitting.grouped_lines import grouped
from identification.fitting.single_test_fit import ScaledTest
from identification.model.structure import Structure, Wanted
from identification.sweeps.response import FrequencyResponse, conjugated

SUSPECT = 0.02  # median distance of a test from its own fit, above which another class is looked at
NUMBERS = 3  # that a test has for each parameter, at least
LIKELY = 0.1  # median distance of a conjugate that is taken
ALIKE = 1.5  # times as far, that two plants fit alike
FEWEST = 30  # lines, of which single ones can be told as outliers
DECISIVE = 1.0  # deviance a line
ROBUST = 1.5  # times nearer, as a fit has to be that outliers hardly move
BETTER = 3.0  # times nearer, as a class has to be that is taken for the right one
RICHEST = Structure(0, 6, 6)  # that is looked at for unstable poles
SIMPLER = tuple(Structure(0, zeros, n) for n in range(5) for zeros in sorted({0, n}))


def reversed_fit(
    tests: Sequence[FrequencyResponse], wanted: Wanted, distance: float, deviance: float, *, soft: bool, seed: int
) -> FitResult | None:
    """The fit of the first test's conjugate, if that is far better than the test's own, at a median ``distance``.

    Far better is BETTER times nearer, or nearer and likelier by a deviance of DECISIVE a line than the test's own.

    An unstable plant's response is not taken for a stable one's conjugate: an unstable plant must be neither nearer nor
    as near and simpler. Responses of raw records are never reversed, and are not tried.
    """
    if distance < SUSPECT or any(test.record is not None for test in tests):
        return None
    turned = conjugated(tests[0])
    if _with_unstable_poles(turned, RICHEST)[0] > distance:
        return None
    try:
        result = fit_plant([turned], wanted, soft=soft, seed=seed)
    except InputError:
        return None
    found = result.tests[0].distance
    unstable, poles, structure = _with_unstable_poles(tests[0], result.structure)
    _, its_poles, its_structure = _with_unstable_poles(turned, result.structure)
    simpler = not its_poles.size and its_structure.free <= structure.free
    is_stable = not poles.size or ALIKE * found < unstable or (found < ALIKE * unstable and simpler)
    likelier = result.tests[0].deviance + DECISIVE * result.tests[0].lines < deviance
    is_nearer = BETTER * found < distance or (found < distance and likelier)
    return result if is_nearer and found < LIKELY and is_stable else None


def robust_fit(test: FrequencyResponse, wanted: Wanted, distance: float, *, seed: int) -> FitResult | None:
    """The fit that single lines hardly move, if it is far nearer to most lines than least squares, at ``distance``."""
    if distance < SUSPECT or test.omega.size < FEWEST:
        return None
    try:
        result = fit_plant([test], wanted, soft=True, seed=seed)
    except InputError:
        return None
    return result if ROBUST * result.tests[0].distance < distance else None


def refuse_unstable(test: FrequencyResponse, structure: Structure | None, distance: float) -> None:
    """Raise InputError where a plant with poles in the right half plane comes far nearer than any stable one.

    Parameters
    ----------
    test
        The first.
    structure
        Of the stable plant; None where its fit was refused.
    distance
        Median of the test from the stable plant, over the response.
    """
    if distance < SUSPECT:
        return
    found, poles, _ = _with_unstable_poles(test, structure or RICHEST)
    if not (poles.size and BETTER * found < distance):
        return
    scaled = ScaledTest(grouped(test), soft=False)
    if BETTER * found < scaled.distance(scaled.fit(RICHEST, None, np.inf)):
        said = ", ".join(f"{pole.real:.4g}" + (f" +- {pole.imag:.4g}j" if pole.imag else "") for pole in poles)
        raise InputError(
            f"{test.name}: an unstable plant, with poles at {said} rad/s, fits to {100 * found:.2g} %, the best stable "
            f"one to {100 * distance:.2g} %; expected a plant without poles in the right half plane"
        )


def _with_unstable_poles(test: FrequencyResponse, structure: Structure) -> tuple[float, Complex, Structure]:
    """How near a plant with poles on any side comes, as a median share, its poles within the band on the right, and it.

    It is the simplest of those that come about as near as any.
    """
    scaled = ScaledTest(grouped(test), soft=False)
    response = scaled.lines.response
    sigma = np.asarray(np.sqrt(np.abs(response) ** 2 * scaled.lines.excitation))
    every = [each for each in (*SIMPLER, structure, RICHEST) if NUMBERS * each.free < 2 * scaled.omega.size]
    tried = [(*unstable_poles(scaled.omega, response, sigma, scaled.likely_delays, each), each) for each in every]
    nearest = min(found for found, _, _ in tried)
    found, poles, which = next(each for each in tried if each[0] <= ALIKE * nearest)
    return found, poles[(np.abs(poles) > scaled.omega[0]) & (np.abs(poles) < scaled.omega[-1])] * scaled.centre, which
