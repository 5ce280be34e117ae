"""What a user says about files that do not say it themselves."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from identification.base.errors import InputError
from identification.formats.columns import KNOWN, quoted


@dataclass(frozen=True)
class Reading:
    """How files of sweeps are read.

    Parameters
    ----------
    columns
        For a name in the file, of a column, a variable or a field, the name of ours that it stands for, such as
        ``{"Frequency (Hz)": "frequency_hz"}``.
    node, direction
        Of a universal file, the response's node and direction whose functions are read, or the reference's where
        only that varies; None takes those of a file that holds one only.
    resample
        Whether a record with uneven time stamps is brought to an even grid instead of being refused.

    Raises
    ------
    InputError
        ``columns`` holds a name of ours that there is not.
    """

    columns: Mapping[str, str] = field(default_factory=dict)
    node: int | None = None
    direction: int | None = None
    resample: bool = False

    @classmethod
    def of_options(cls, options: Mapping[str, Any]) -> Reading:
        """What the options of a command say, those that were not given being None."""
        return cls(**{name: value for name, value in options.items() if value is not None})

    def __post_init__(self) -> None:
        if unknown := sorted({*self.columns.values()} - KNOWN):
            names = ", ".join(sorted(KNOWN))
            raise InputError(f"--columns: {quoted(unknown[0])} is not a name of this program; expected one of {names}")
