"""A test of many lines -> one of some thousands, on which structures and first guesses are tried."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from identification.sweeps.response import FrequencyResponse

MOST_LINES = 8192  # beyond, neighbouring lines are taken together
SAME = 1e-3  # of the lines' mean distance, in logarithm: what is nearer is one line that was read twice


def grouped(test: FrequencyResponse) -> FrequencyResponse:
    """The test with neighbouring lines averaged, each by its own weight; as it is where lines are few and apart.

    Notes
    -----
    Lines that lie together by SAME are one. Of more than MOST_LINES those of a cell are, and the cells are as wide as
    no more than 2/MOST_LINES of the band and of its logarithm: so narrow that within one a dead time hardly
    turns the phase, and a mode of zeta over some thousandths hardly bends the response. What else is in a cell, the
    average blurs, so that it may decide what is tried but no number that is given: each test is fitted at last at
    all of its lines. An average's errors are as small as its lines are many, which ``excitation`` says.
    """
    position = np.log(test.omega)
    cell = np.cumsum(np.diff(position, prepend=position[0]) > SAME * (position[-1] - position[0]) / position.size)
    if cell[-1] >= MOST_LINES:
        place = (position - position[0]) / (position[-1] - position[0])
        place += (test.omega - test.omega[0]) / (test.omega[-1] - test.omega[0])
        cell = np.floor(place / 2 * MOST_LINES)
    first = np.flatnonzero(np.diff(cell, prepend=-1.0))
    if first.size == test.omega.size:
        return test
    weight = np.ones_like(test.omega) if test.excitation is None else 1 / test.excitation
    total = np.add.reduceat(weight, first)
    return replace(
        test,
        omega=np.add.reduceat(weight * test.omega, first) / total,
        response=np.asarray(np.add.reduceat(weight * test.response, first) / total, dtype=complex),
        coherence=None,
        excitation=1 / total,
    )
