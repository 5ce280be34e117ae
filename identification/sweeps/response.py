"""One test: its raw record, if there is one, and its frequency response."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

from identification.base.arrays import Complex, Real
from identification.model.plant import PlantModel
from identification.model.pulse_response import aliases


@dataclass(frozen=True)
class Record:
    """The raw record of a test.

    Parameters
    ----------
    sampling_s
        Seconds from one sample to the next.
    input, output
        (N,) samples.
    held
        The input is the command of a converter that holds each value for one interval. Otherwise both channels
        are band-limited alike before they are sampled.
    """

    sampling_s: float
    input: Real
    output: Real
    held: bool


@dataclass(frozen=True)
class FrequencyResponse:
    """One test: the response of the plant at M lines.

    Parameters
    ----------
    omega
        (M,) rad/s, positive, increasing.
    response
        (M,) complex, output unit per input unit.
    coherence
        (M,) between 0 and 1, or None. Kept for the reader; no weight is made of it, since it is as noisy
        as the response and errs together with it.
    name
        What to call this test.
    excitation
        (M,) how the error's variance goes from line to line on account of the excitation alone, or None for alike.
    synthetic
        The file says of itself that it is synthetic.
    record
        What the response was estimated from, or None where the file holds the response.
    path
        The file, or None.
    """

    omega: Real
    response: Complex
    coherence: Real | None
    name: str
    excitation: Real | None = None
    synthetic: bool = False
    record: Record | None = None
    path: Path | None = None


def alias_free(test: FrequencyResponse, plant: PlantModel) -> FrequencyResponse:
    """The response of a test without the aliases that a held input puts on that of ``plant``; others as they are."""
    if test.record is None or not test.record.held:
        return test
    return replace(test, response=test.response - aliases(plant, test.record.sampling_s, test.omega))
