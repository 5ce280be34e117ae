"""One test -> its likeliest plant of a known structure, from a plant that is near and from no starting point."""

from __future__ import annotations

import numpy as np

from identification.fitting.grouped_lines import grouped
from identification.fitting.least_squares import response_of
from identification.fitting.likelihood import Likely, noise_levels
from identification.fitting.one_fit import OneFit
from identification.fitting.single_test_fit import SAME, ScaledTest
from identification.model.plant import PlantModel
from identification.model.structure import Structure
from identification.sweeps.response import FrequencyResponse

FIRST_ERRORS = 0.05  # of the response, that are assumed before any are known


def fit_same_structure(test: FrequencyResponse, structure: Structure, near: PlantModel, *, soft: bool) -> OneFit:
    """The likeliest plant of a structure for one test.

    Parameters
    ----------
    test
        The response.
    structure
        Of the plant.
    near
        A plant of this structure, from which the first of two searches starts. The other starts from nothing, so that a
        plant that is far from it is found too.
    soft
        Soft-L1 loss instead of least squares.

    Raises
    ------
    Misfit
        No such plant is near the test.
    Undetermined
        The test does not determine the plant's parameters.
    """
    group = grouped(test)
    few = ScaledTest(group, soft)
    start = Likely(structure, few.to_scaled(structure, structure.theta(near)), 1.0, 0.0, FIRST_ERRORS, np.nan)
    found, other = few.follow(few, start), few.fit(structure, None, np.inf)
    if other.deviance < found.deviance - SAME:
        found = other
    found = few.other_turns(found)
    if group is test:
        return few.finish(found)
    whole = ScaledTest(test, soft)
    return whole.finish(whole.taken_over(few, found))


def deviance_of(test: FrequencyResponse, structure: Structure, plant: PlantModel, *, soft: bool) -> float:
    """-2 log likelihood of a test if a plant of the structure were the true one, comparable with that of its fit."""
    scaled = ScaledTest(test, soft)
    theta, sign = scaled.to_scaled(structure, structure.theta(plant)), float(np.sign(plant.gain))
    model = sign * response_of(structure, theta, scaled.omega)
    error = np.abs(scaled.lines.response - scaled.lines.aliases(structure, theta, sign) - model) ** 2
    return noise_levels(error, np.abs(model) ** 2, scaled.lines.excitation, soft)[2]
