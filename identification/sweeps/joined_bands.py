"""Tests of different bands -> one, since a test says nothing of a mode that its band does not hold."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from identification.sweeps.response import FrequencyResponse

SHARE = 0.8  # of the logarithm of the whole band, that each test of several has to hold to be fitted on its own
APART = 1e-9  # relative distance to which lines at the same frequency are moved


def joined_bands(tests: Sequence[FrequencyResponse]) -> list[FrequencyResponse]:
    """The tests, or all their lines as one test where the band of one is less than SHARE of the whole.

    Held records stay apart: the aliases in their responses are those of their own sampling.
    """
    if len(tests) < 2:
        return list(tests)
    low, high = min(test.omega[0] for test in tests), max(test.omega[-1] for test in tests)
    alike = all(np.log(test.omega[-1] / test.omega[0]) > SHARE * np.log(high / low) for test in tests)
    if alike or any(test.record is not None and test.record.held for test in tests):
        return list(tests)
    return [joined(tests)]


def joined(tests: Sequence[FrequencyResponse]) -> FrequencyResponse:
    """All lines of one or more tests as one test, which has the names of all; one alone is left as it is."""
    if len(tests) == 1:
        return tests[0]
    omega = np.concatenate([test.omega for test in tests])
    order = np.argsort(omega, kind="stable")
    omega = omega[order]
    for again in np.flatnonzero(np.diff(omega) <= APART * omega[:-1]) + 1:
        omega[again] = omega[again - 1] * (1 + APART)
    excitations = [np.ones_like(test.omega) if test.excitation is None else test.excitation for test in tests]
    return FrequencyResponse(
        omega=omega,
        response=np.concatenate([test.response for test in tests])[order],
        coherence=None,
        name=" and ".join(test.name for test in tests),
        excitation=np.concatenate(excitations)[order],
        synthetic=any(test.synthetic for test in tests),
        left_out=tuple(
            replace(lines, reason=f"{lines.reason} ({test.name})") for test in tests for lines in test.left_out
        ),
        remarks=(
            *(f"{test.name}: {said}" for test in tests for said in test.remarks),
            f"{len(tests)} tests of different bands are fitted together: how tests scatter is not known",
        ),
        conjugated=all(test.conjugated for test in tests),
    )
