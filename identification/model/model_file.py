"""model.json, the contract between identification and design: the plant, its standard errors, its bound."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from identification.base.errors import InputError
from identification.base.files import read_text
from identification.model.plant import AdditiveBound, Mode, PlantModel

SCHEMA = 1


@dataclass(frozen=True)
class IdentifiedModel:
    """What identification hands to design.

    Parameters
    ----------
    plant
        The nominal model P(s).
    additive_bound
        W_a(s), at every line at least as large as the distance between P and every test.
    standard_errors
        One standard error for each parameter, in the shape of the ``plant`` object of model.json and in the
        parameters' own units; None when the parameters were not estimated (the thesis's printed sets).
    fit
        How the model came about: free-form facts that JSON can hold.
    """

    plant: PlantModel
    additive_bound: AdditiveBound
    standard_errors: Mapping[str, Any] | None = None
    fit: Mapping[str, Any] = field(default_factory=dict)

    def to_json(self) -> str:
        """The text of model.json; every number is finite or this raises ValueError."""
        content = {
            "schema": SCHEMA,
            "plant": plant_to_dict(self.plant),
            "standard_errors": self.standard_errors,
            "additive_bound": bound_to_dict(self.additive_bound),
            "fit": dict(self.fit),
        }
        return json.dumps(content, indent=2, allow_nan=False) + "\n"


def plant_to_dict(plant: PlantModel) -> dict[str, Any]:
    """The ``plant`` object of model.json and design.json."""
    return {
        "gain": plant.gain,
        "zero_modes": [asdict(mode) for mode in plant.zero_modes],
        "pole_modes": [asdict(mode) for mode in plant.pole_modes],
        "delay_s": plant.delay_s,
        "integrators": plant.integrators,
        "real_zeros": list(plant.real_zeros),
        "real_poles": list(plant.real_poles),
    }


def plant_from_dict(content: Mapping[str, Any]) -> PlantModel:
    """Read what :func:`plant_to_dict` writes (also the plants of thesis.toml, which leave out the last three members).

    Raises
    ------
    InputError
        A number is missing, is not a number, or is out of its range.
    """
    return PlantModel(
        gain=number(content, "gain"),
        zero_modes=_modes(content, "zero_modes"),
        pole_modes=_modes(content, "pole_modes"),
        delay_s=number(content, "delay_s"),
        integrators=content.get("integrators", 1),
        real_zeros=_numbers(content, "real_zeros"),
        real_poles=_numbers(content, "real_poles"),
    )


def bound_to_dict(bound: AdditiveBound) -> dict[str, Any]:
    """The ``additive_bound`` object of model.json and design.json: gain, corner, omega, zeta where it is (2.22)."""
    if bound.is_printed_form:
        return {"gain": bound.gain, "corner": bound.corner, **asdict(bound.resonance)}
    return {
        "gain": bound.gain,
        "zero_modes": [asdict(mode) for mode in bound.zero_modes],
        "pole_modes": [asdict(mode) for mode in bound.pole_modes],
        "real_zeros": list(bound.real_zeros),
        "real_poles": list(bound.real_poles),
    }


def bound_from_dict(content: Mapping[str, Any]) -> AdditiveBound:
    """Read what :func:`bound_to_dict` writes; raises InputError as :func:`plant_from_dict` does."""
    if "pole_modes" not in content:
        return AdditiveBound.printed_form(*(number(content, key) for key in ("gain", "corner", "omega", "zeta")))
    return AdditiveBound(
        gain=number(content, "gain"),
        zero_modes=_modes(content, "zero_modes"),
        pole_modes=_modes(content, "pole_modes"),
        real_zeros=_numbers(content, "real_zeros"),
        real_poles=_numbers(content, "real_poles"),
    )


def read_model(path: Path) -> IdentifiedModel:
    """Read a model.json.

    Raises
    ------
    InputError
        No such file, not JSON, another schema, or a number missing or out of range.
    """
    content = read_json(path, SCHEMA)
    try:
        return IdentifiedModel(
            plant=plant_from_dict(member(content, "plant")),
            additive_bound=bound_from_dict(member(content, "additive_bound")),
            standard_errors=content.get("standard_errors"),
            fit=content.get("fit", {}),
        )
    except InputError as error:
        raise InputError(f"{path}: {error}") from None


def read_json(path: Path, schema: int) -> dict[str, Any]:
    """Read a JSON object whose member ``schema`` must have the given value.

    Raises
    ------
    InputError
        No such file, not JSON, not an object, or another schema.
    """
    text = read_text(path)
    try:
        content = json.loads(text, parse_constant=_refuse_constant)
    except json.JSONDecodeError as error:
        raise InputError(f"{path}, line {error.lineno}: not JSON ({error.msg})") from None
    except (RecursionError, ValueError) as error:  # an InputError among them
        raise InputError(f"{path}: {error}") from None
    found = content.get("schema") if isinstance(content, dict) else None
    if found != schema:
        raise InputError(f"{path}: schema is {found!r}; expected {schema}")
    return content


def member(content: Mapping[str, Any], key: str) -> Mapping[str, Any]:
    """Return the JSON object at ``key``; raises InputError when there is none."""
    value = content.get(key)
    if not isinstance(value, Mapping):
        raise InputError(f"'{key}' is {value!r}; expected an object")
    return value


def number(content: Mapping[str, Any], key: str) -> float:
    """Return the number at ``key``; raises InputError when there is none."""
    value = content.get(key)
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise InputError(f"'{key}' is {value!r}; expected a number")
    try:
        return float(value)
    except OverflowError:
        raise InputError(f"'{key}' is an integer too large for a number") from None


def _modes(content: Mapping[str, Any], key: str) -> tuple[Mode, ...]:
    modes = content.get(key)
    if not isinstance(modes, list) or not all(isinstance(mode, Mapping) for mode in modes):
        raise InputError(f"'{key}' is {modes!r}; expected a list of objects with 'omega' and 'zeta'")
    return tuple(Mode(omega=number(mode, "omega"), zeta=number(mode, "zeta")) for mode in modes)


def _numbers(content: Mapping[str, Any], key: str) -> tuple[float, ...]:
    """The list of numbers at ``key``; none where there is no such member."""
    values = content.get(key, [])
    if not isinstance(values, list):
        raise InputError(f"'{key}' is {values!r}; expected a list of numbers")
    return tuple(number({key: value}, key) for value in values)


def _refuse_constant(name: str) -> float:
    raise InputError(f"holds {name}; expected finite numbers only")
