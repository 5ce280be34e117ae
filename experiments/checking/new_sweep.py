"""New sweeps of a plant that has a model -> their lines within the model's band, and the fits in its structure."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from identification.base.arrays import Real
from identification.base.errors import InputError
from identification.fitting.one_fit import OneFit
from identification.fitting.same_structure import deviance_of, fit_same_structure
from identification.fitting.single_test_fit import Misfit, Undetermined
from identification.fitting.small_sample import Sureness, sureness
from identification.model.model_file import IdentifiedModel
from identification.model.structure import Structure
from identification.sweeps.joined_bands import SHARE, joined_bands
from identification.sweeps.noise_lines import only, without_noise
from identification.sweeps.response import FrequencyResponse, alias_free, conjugated

EDGE = 1e-9  # relative, within which a line is on the edge of the band


@dataclass(frozen=True)
class NewSweep:
    """One new sweep and its own fit in the model's structure.

    Parameters
    ----------
    test
        Its lines within the model's band, without the aliases of a held input.
    fit
        Its likeliest plant.
    sure
        How sure that is.
    gained
        By how much likelier it is than the model's plant: twice the logarithm of the ratio.
    """

    test: FrequencyResponse
    fit: OneFit
    sure: Sureness
    gained: float

    @property
    def noise(self) -> Real:
        """(M,) standard deviations of the lines' errors; what neighbouring residuals share is no noise."""
        shared = self.fit.correlation if self.fit.misfit else 0.0
        sigma = self.sure.sigma(self.fit.plant(1j * self.test.omega), self.test.excitation)
        return np.asarray(sigma * np.sqrt(1 - shared))

    @property
    def freedom(self) -> int:
        """Degrees of freedom of the noise: real numbers less parameters, the noise's two among them."""
        return 2 * self.fit.lines - self.fit.structure.free - 2


def lines_to_check(model: IdentifiedModel, tests: Sequence[FrequencyResponse]) -> list[FrequencyResponse]:
    """The new sweeps as a fit would use them, within the band in which the model was measured.

    Parameters
    ----------
    model
        With its record of the fit, where it has one: it says the band, and whether the sign of the phase is reversed.
    tests
        As they are read.

    Raises
    ------
    InputError
        Every line of a sweep is noise, none lies within the band, or the sweeps hold too little of it.

    Notes
    -----
    As in a fit, sweeps of different bands are taken together, and less than SHARE of a band tells no plant.
    """
    record = model.fit
    if record is not None and record.conjugated:
        tests = [conjugated(test) for test in tests]
    used = without_noise(tests)
    if record is None:
        return joined_bands(used)
    low, high = record.band
    used = joined_bands([_within(test, low, high) for test in used])
    for test in used:
        first, last = test.omega[[0, -1]]
        if np.log(last / first) < SHARE * np.log(high / low):
            raise InputError(
                f"{test.name}: has lines from {_hz(first)} to {_hz(last)} Hz; expected {100 * SHARE:.0f} % or more of "
                f"the decades from {_hz(low)} to {_hz(high)} Hz, where the model was measured"
            )
    return used


def _within(test: FrequencyResponse, low: float, high: float) -> FrequencyResponse:
    kept = (test.omega >= low * (1 - EDGE)) & (test.omega <= high * (1 + EDGE))
    if not kept.any():
        raise InputError(
            f"{test.name}: has lines from {_hz(test.omega[0])} to {_hz(test.omega[-1])} Hz; expected some from "
            f"{_hz(low)} to {_hz(high)} Hz, where the model was measured"
        )
    return only(test, kept, "outside the band of the model")


def _hz(omega: float) -> str:
    return f"{omega / (2 * np.pi):.6g}"


def fitted(model: IdentifiedModel, test: FrequencyResponse) -> NewSweep | str:
    """A sweep with its own fit in the model's structure, or why no plant of this structure fits it.

    Raises
    ------
    InputError
        The model is of no class that a fit has, or the sweep does not determine the plant's parameters.
    """
    record = model.fit
    structure = Structure.of(model.plant, delayed=record is None or "no dead time" not in record.structure)
    if 2 * test.omega.size < 2 * (structure.free + 2):
        raise InputError(
            f"{test.name}: has {test.omega.size} lines where the model was measured; expected {structure.free + 2} or "
            f"more for a plant with {structure}"
        )
    soft = record is not None and record.loss == "soft-L1"
    try:
        fit = fit_same_structure(test, structure, model.plant, soft=soft)
    except Misfit as error:
        return str(error)
    except Undetermined:
        raise InputError(
            f"{test.name}: its {test.omega.size} lines from {_hz(test.omega[0])} to {_hz(test.omega[-1])} Hz do not "
            f"determine a plant with {structure}; expected lines where its modes show"
        ) from None
    gained = deviance_of(test, structure, model.plant, soft=soft) - fit.deviance
    return NewSweep(alias_free(test, fit.plant), fit, sureness(fit, test), gained)
