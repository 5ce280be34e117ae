"""model.json, the contract between identification and design: the plant, its standard errors, its bound, its fit."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from html import escape
from pathlib import Path
from typing import Any, TypeVar

from identification.base.errors import InputError
from identification.base.json_object import member, read_json, require_all_read
from identification.model.additive_bound import AdditiveBound
from identification.model.fit_record import FitRecord, Numbers
from identification.model.plant import PlantModel
from identification.model.plant_json import (
    bound_from_dict,
    bound_to_dict,
    from_shape,
    plant_from_dict,
    plant_to_dict,
    shaped,
)
from identification.model.signals import UNNAMED, Signals

SCHEMA = 1

Record = TypeVar("Record")


@dataclass(frozen=True, repr=False)
class IdentifiedModel:
    """What identification hands to design.

    Parameters
    ----------
    plant
        The nominal model P(s).
    additive_bound
        W_a(s), at every line at least as large as the distance between P and every test.
    standard_errors
        One for each of ``plant.parameters``, in their units; None when the parameters were not estimated (the thesis's
        printed sets).
    fit
        How the model came about; None where there was no fit, or where an older version wrote less of it.
    signals
        Names and units of the plant's input and output.
    """

    plant: PlantModel
    additive_bound: AdditiveBound
    standard_errors: Numbers | None = None
    fit: FitRecord | None = None
    signals: Signals = UNNAMED

    def __repr__(self) -> str:
        plant = self.plant
        zeros, poles = len(plant.zero_modes), len(plant.pole_modes)
        return (
            f"IdentifiedModel(gain {plant.gain:.4g}, integrators {plant.integrators}, {zeros} zero and {poles} pole "
            f"modes, dead time {plant.delay_s:.4g} s; W_a of order {self.additive_bound.order})"
        )

    def _repr_html_(self) -> str:
        """The plant's parameters with their standard errors, as a notebook shows them."""
        from pandas import DataFrame

        parameters = self.plant.parameters
        names = [each.label for each in parameters]
        table = DataFrame({"parameter": names, "value": [each.value for each in parameters]})
        if self.standard_errors is not None:
            table["standard error"] = self.standard_errors
        return f"<p>{escape(repr(self))}</p>{table.to_html(index=False)}"

    def to_dict(self) -> dict[str, Any]:
        """The object of model.json."""
        errors = self.standard_errors
        return {
            "schema": SCHEMA,
            "signals": self.signals.to_dict(),
            "plant": plant_to_dict(self.plant),
            "standard_errors": None if errors is None else shaped(self.plant, errors),
            "additive_bound": bound_to_dict(self.additive_bound),
            "fit": {} if self.fit is None else self.fit.to_dict(self.plant),
        }

    def to_json(self) -> str:
        """The text of model.json; every number is finite or this raises ValueError."""
        return json.dumps(self.to_dict(), indent=2, allow_nan=False) + "\n"


def read_model(path: Path | str) -> IdentifiedModel:
    """Read a model.json.

    Raises
    ------
    InputError
        No such file, not JSON, another schema, a member that is not known, or a number missing or out of range.
    """
    content = read_json(Path(path), SCHEMA)
    try:
        plant = plant_from_dict(member(content, "plant"))
        bound = bound_from_dict(member(content, "additive_bound"))
        signals = Signals.from_dict(member(content, "signals")) if "signals" in content else UNNAMED
        errors = _recorded(content, "standard_errors", lambda found: from_shape(plant, found))
        fit = _recorded(content, "fit", lambda found: FitRecord.from_dict(found, plant, bound))
        model = IdentifiedModel(plant, bound, errors, fit, signals)
        require_all_read(content, model.to_dict())
    except InputError as error:
        raise InputError(f"{path}: {error}") from None
    return model


def _recorded(content: Mapping[str, Any], key: str, read: Callable[[Mapping[str, Any]], Record]) -> Record | None:
    """What a fit leaves beside the model; None where there is nothing."""
    if content.get(key) in (None, {}):
        return None
    try:
        return read(member(content, key))
    except InputError as error:
        raise InputError(f"{error} (of {key!r}, which may be left out)") from None
