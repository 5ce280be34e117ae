"""What the input and the output of a plant are called, and their units."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

from identification.base.errors import InputError, shown
from identification.base.json_object import record

LONGEST = 40  # characters of a name or unit


@dataclass(frozen=True)
class Signals:
    """The names of a plant's input and output, and their units.

    Parameters
    ----------
    input_name, output_name
        One line of at most 40 characters, such as ``motor current``.
    input_unit, output_unit
        The same, such as ``A``; empty where nobody said, and of a number without a unit, whose unit may be given as 1.

    Raises
    ------
    InputError
        A name is empty, or a name or a unit is longer or does not print.
    """

    input_name: str = "input"
    input_unit: str = ""
    output_name: str = "output"
    output_unit: str = ""

    def __post_init__(self) -> None:
        for field, value in asdict(self).items():
            if value == "1" and field.endswith("unit"):
                object.__setattr__(self, field, "")
            least = 1 if field.endswith("name") else 0
            if not (least <= len(value) <= LONGEST and value.isprintable() and value == value.strip()):
                expected = f"{least} to {LONGEST} characters that print, without blanks at the ends"
                raise InputError(f"{field.replace('_', '-')} is {shown(value)}; expected {expected}")

    @property
    def input(self) -> str:
        """The input's name with its unit, as an axis has it: ``motor current [A]``."""
        return f"{self.input_name} [{self.input_unit}]" if self.input_unit else self.input_name

    @property
    def output(self) -> str:
        """The output's name with its unit."""
        return f"{self.output_name} [{self.output_unit}]" if self.output_unit else self.output_name

    @property
    def gain_unit(self) -> str:
        """The unit of a response, output over input: ``m/A``; empty where both are unknown."""
        if not (self.input_unit or self.output_unit):
            return ""
        below = f"({self.input_unit})" if any(c in self.input_unit for c in " */.") else self.input_unit
        return f"{self.output_unit or '1'}/{below}" if below else self.output_unit

    def to_dict(self) -> dict[str, str]:
        """The member ``signals`` of model.json and design.json."""
        return asdict(self)

    @classmethod
    def from_dict(cls, content: Mapping[str, Any]) -> Signals:
        """Read what :meth:`to_dict` writes; raises InputError when a member is missing or of the wrong form."""
        return record(cls, content)


UNNAMED = Signals()
"""Of a plant of which nobody said."""
