"""What a user says about files that do not say it themselves."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field


@dataclass(frozen=True)
class Reading:
    """How files of sweeps are read.

    Parameters
    ----------
    columns
        For a name in the file, of a column, a variable or a field, the name of ours that it stands for, such as
        ``{"Frequency (Hz)": "frequency_hz"}``.
    node, direction
        Of a universal file, the response's node and direction whose functions are read; None takes those of a file
        that holds one only.
    resample
        Whether a record with uneven time stamps is brought to an even grid instead of being refused.
    """

    columns: Mapping[str, str] = field(default_factory=dict)
    node: int | None = None
    direction: int | None = None
    resample: bool = False
