"""What a poor fit may be instead of noise: a response whose phase has the other sign, or an unstable plant."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from identification.base.errors import InputError
from identification.fitting.first_guess import unstable_poles
from identification.fitting.fit_plant import FitResult, fit_plant
from identification.fitting.grouped_lines import grouped
from identification.fitting.single_test_fit import ScaledTest
from identification.model.structure import Structure, Wanted
from identification.sweeps.response import FrequencyResponse

SUSPECT = 0.05  # median distance of a test from its own fit, above which another class is looked at
BETTER = 3.0  # times nearer, as a class has to be that is taken for the right one
RICHEST = Structure(0, 6, 6)  # that is looked at for unstable poles


def conjugated(test: FrequencyResponse) -> FrequencyResponse:
    """The test with the sign of its phase reversed, also at the lines that are left out."""
    left = tuple(replace(lines, response=lines.response.conj()) for lines in test.left_out)
    return replace(test, response=test.response.conj(), left_out=left)


def fits_reversed(tests: Sequence[FrequencyResponse], wanted: Wanted, distance: float, *, soft: bool) -> bool:
    """Whether the conjugate of the first test fits far better than the test itself, at a median ``distance``.

    Responses of raw records are never reversed, and are not tried.
    """
    if distance < SUSPECT or any(test.record is not None for test in tests):
        return False
    try:
        result = fit_plant([conjugated(tests[0])], wanted, soft=soft)
    except InputError:
        return False
    return BETTER * result.tests[0].distance < distance


def refuse_unstable(test: FrequencyResponse, result: FitResult | None, distance: float) -> None:
    """Raise InputError where a plant with poles in the right half plane comes far nearer than the stable one.

    Parameters
    ----------
    test
        The first.
    result
        Of the fit; None where it was refused.
    distance
        Median of the test from the stable plant, over the response.
    """
    if distance < SUSPECT:
        return
    scaled = ScaledTest(grouped(test), soft=False)
    response = scaled.lines.response
    structure = RICHEST if result is None else result.structure
    sigma = np.asarray(np.sqrt(np.abs(response) ** 2 * scaled.lines.excitation))
    found, poles = unstable_poles(scaled.omega, response, sigma, structure)
    inside = poles[(np.abs(poles) > scaled.omega[0]) & (np.abs(poles) < scaled.omega[-1])] * scaled.centre
    if BETTER * found < distance and inside.size:
        said = ", ".join(f"{pole.real:.4g}" + (f" +- {pole.imag:.4g}j" if pole.imag else "") for pole in inside)
        raise InputError(
            f"{test.name}: a plant with poles at {said} rad/s, in the right half plane, fits at {100 * found:.2g} %, a "
            f"stable one at {100 * distance:.2g} %; expected a stable plant, poles at s = 0 apart"
        )
