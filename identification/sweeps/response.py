"""One test: its raw record, if there is one, and its frequency response."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from identification.base.arrays import Complex, Real
from identification.base.errors import InputError
from identification.model.plant import PlantModel
from identification.model.pulse_response import aliases

if TYPE_CHECKING:
    from control import FrequencyResponseData


WIDEST = 1e9  # ratio of the highest to the lowest frequency


@dataclass(frozen=True, repr=False)
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

    def __repr__(self) -> str:
        held = ", held input" if self.held else ""
        return f"Record({self.input.size} samples at {1 / self.sampling_s:g} Hz{held})"


@dataclass(frozen=True)
class LeftOut:
    """Lines of a test that are not used.

    Parameters
    ----------
    omega, response
        (K,) as in :class:`FrequencyResponse`.
    reason
        Why, such as "outside the given band".
    """

    omega: Real
    response: Complex
    reason: str

    def __str__(self) -> str:
        low, high = self.omega.min() / (2 * np.pi), self.omega.max() / (2 * np.pi)
        count = self.omega.size
        return f"{count} line{'s' if count > 1 else ''} from {low:.4g} to {high:.4g} Hz left out: {self.reason}"


@dataclass(frozen=True, repr=False)
class FrequencyResponse:
    """One test: the response of the plant at M lines.

    Parameters
    ----------
    omega
        (M,) rad/s, positive, increasing; else InputError.
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
    left_out
        Lines that are not used.
    remarks
        What was left out or changed while the test was read.
    conjugated
        Whether the sign of the phase is another than that in the file.
    """

    omega: Real
    response: Complex
    coherence: Real | None
    name: str
    excitation: Real | None = None
    synthetic: bool = False
    record: Record | None = None
    path: Path | None = None
    left_out: tuple[LeftOut, ...] = ()
    remarks: tuple[str, ...] = ()
    conjugated: bool = False

    def __post_init__(self) -> None:
        omega, response = np.asarray(self.omega, dtype=float), np.asarray(self.response, dtype=complex)
        object.__setattr__(self, "omega", omega)
        object.__setattr__(self, "response", response)
        if not (omega.ndim == 1 and omega.shape == response.shape and omega.size):
            raise InputError(
                f"{self.name}: omega and response have the shapes {omega.shape} and {response.shape}; expected equal "
                "lengths of at least 1"
            )
        if not (np.isfinite(omega).all() and np.isfinite(response).all()):
            raise InputError(f"{self.name}: omega or response is not finite; expected finite numbers")
        if omega[0] <= 0 or np.any(np.diff(omega) <= 0):
            raise InputError(f"{self.name}: omega is not increasing from above 0; expected that, without duplicates")

    def __repr__(self) -> str:
        low, high = self.omega[[0, -1]] / (2 * np.pi)
        synthetic = ", synthetic" if self.synthetic else ""
        return f"FrequencyResponse('{self.name}', {self.omega.size} lines, {low:.4g} to {high:.4g} Hz{synthetic})"

    def to_control(self) -> FrequencyResponseData:
        """The response as python-control's frequency response data; its names hold no dots."""
        from control import FrequencyResponseData

        return FrequencyResponseData(self.response, self.omega, name=self.name.replace(".", "_"))

    @classmethod
    def from_control(cls, data: FrequencyResponseData) -> FrequencyResponse:
        """A test of python-control's frequency response data; its name is the data's.

        Raises
        ------
        InputError
            More than one input or output, or frequencies or values that are none of a test.
        """
        if not data.issiso():
            raise InputError(f"the data have {data.ninputs} inputs and {data.noutputs} outputs; expected one of each")
        return cls(data.omega, data.frdata[0, 0], None, data.name)


def require_one_band(tests: Sequence[FrequencyResponse]) -> None:
    """Refuse tests of which no plant can be computed together: raises InputError where lines lie WIDEST times apart."""
    low, high = min(test.omega[0] for test in tests), max(test.omega[-1] for test in tests)
    if high / WIDEST > low:
        raise InputError(
            f"the lines lie from {low:.6g} to {high:.6g} rad/s; expected a band whose ends are no more than {WIDEST:g} "
            "times apart"
        )


def alias_free(test: FrequencyResponse, plant: PlantModel) -> FrequencyResponse:
    """The response of a test without the aliases that a held input puts on that of ``plant``; others as they are."""
    if test.record is None or not test.record.held:
        return test
    return replace(test, response=test.response - aliases(plant, test.record.sampling_s, test.omega), record=None)


def conjugated(test: FrequencyResponse) -> FrequencyResponse:
    """The test with the sign of its phase reversed, also at the lines that are left out."""
    left = tuple(replace(lines, response=lines.response.conj()) for lines in test.left_out)
    return replace(test, response=test.response.conj(), left_out=left, conjugated=not test.conjugated)
