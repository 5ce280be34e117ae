"""Tests as the fit of a model used them: what a figure or a table compares with its plant."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from identification.model.model_file import IdentifiedModel
from identification.sweeps.noise_lines import only
from identification.sweeps.response import FrequencyResponse, alias_free, conjugated


def as_fitted(model: IdentifiedModel, tests: Sequence[FrequencyResponse]) -> list[FrequencyResponse]:
    """The tests without the aliases of a held input, with the sign of the phase and the lines of the model's fit.

    Parameters
    ----------
    model
        One that was fitted to these tests, known by their names; others are left with all their lines.
    tests
        As they are read, or as they were kept.
    """
    bands = {} if model.fit is None else {test.name: test.band for test in model.fit.tests}
    found = []
    for test in tests:
        used = alias_free(test, model.plant)
        if model.fit is not None and model.fit.conjugated and not used.conjugated:
            used = conjugated(used)
        low, high = bands.get(used.name, (0.0, np.inf))
        kept = (used.omega >= low) & (used.omega <= high)
        found.append(only(used, kept, "not used by the fit") if kept.any() else used)
    return found
