"""Tests as the fit of a model used them: what a figure or a table compares with its plant."""

from __future__ import annotations

from collections.abc import Sequence

from identification.model.model_file import IdentifiedModel
from identification.sweeps.joined_bands import joined
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
    fitted = {} if model.fit is None else {test.name: test for test in model.fit.tests}
    together = joined(tests) if tests else None
    found = []
    for test in [together] if together is not None and together.name in fitted else tests:
        used = alias_free(test, model.plant)
        if (own := fitted.get(used.name)) is not None:
            used = conjugated(used) if own.conjugated != used.conjugated else used
            kept = (used.omega >= own.band[0]) & (used.omega <= own.band[1])
            used = only(used, kept, "not used by the fit") if kept.any() else used
        found.append(used)
    return found
