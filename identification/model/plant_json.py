"""Plant and bound as the objects of model.json and design.json, and numbers in a plant's shape."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import asdict
from typing import Any

from identification.base.errors import InputError, shown
from identification.base.json_object import number, numbers, whole
from identification.model.additive_bound import AdditiveBound
from identification.model.modes import Mode
from identification.model.plant import PlantModel

SLOWEST, FASTEST = 1e-20, 1e20
"""The least and the largest magnitude of a rate in rad/s or a damping ratio in a file; the second also limits the dead
time in s. Beyond them a design overflows."""


def shaped(plant: PlantModel, values: Iterable[float]) -> dict[str, Any]:
    """One number for each of ``plant.parameters``, such as its standard error, in the shape of a ``plant`` object."""
    content: dict[str, Any] = {
        "gain": 0.0,
        "zero_modes": [],
        "pole_modes": [],
        "delay_s": 0.0,
        "real_zeros": [],
        "real_poles": [],
    }
    for parameter, value in zip(plant.parameters, values, strict=True):
        if parameter.quantity == "omega":
            content[f"{parameter.kind}_modes"].append({"omega": value})
        elif parameter.quantity == "zeta":
            content[f"{parameter.kind}_modes"][-1]["zeta"] = value
        elif parameter.kind in content:
            content[parameter.kind] = value
        else:
            content[f"{parameter.kind}s"].append(value)
    return content


def from_shape(plant: PlantModel, content: Mapping[str, Any]) -> tuple[float, ...]:
    """Read what :func:`shaped` writes; raises InputError when it is not of the plant's shape."""
    counts = [len(of) for of in (plant.zero_modes, plant.pole_modes, plant.real_zeros, plant.real_poles)]
    modes = [_pairs(content, key) for key in ("zero_modes", "pole_modes")]
    rates = [_rates(content, key) for key in ("real_zeros", "real_poles")]
    if (counted := [len(of) for of in (*modes, *rates)]) != counts:
        raise InputError(f"the numbers of modes and real roots are {counted}; expected {counts}, as of the plant")
    middle = (*(value for of in modes for pair in of for value in pair), *(rate for of in rates for rate in of))
    return (number(content, "gain"), *middle, number(content, "delay_s"))


def plant_to_dict(plant: PlantModel) -> dict[str, Any]:
    """The ``plant`` object of model.json and design.json."""
    content = shaped(plant, (parameter.value for parameter in plant.parameters))
    rates = {key: content.pop(key) for key in ("real_zeros", "real_poles")}
    return content | {"integrators": plant.integrators} | rates


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
        delay_s=sized("delay_s", number(content, "delay_s"), least=0.0),
        integrators=whole(content, "integrators") if "integrators" in content else 1,
        real_zeros=_sized_rates(content, "real_zeros"),
        real_poles=_sized_rates(content, "real_poles"),
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
        rates = (sized(key, number(content, key)) for key in ("corner", "omega", "zeta"))
        return AdditiveBound.printed_form(number(content, "gain"), *rates)
    return AdditiveBound(
        gain=number(content, "gain"),
        zero_modes=_modes(content, "zero_modes"),
        pole_modes=_modes(content, "pole_modes"),
        real_zeros=_sized_rates(content, "real_zeros"),
        real_poles=_sized_rates(content, "real_poles"),
    )


def _modes(content: Mapping[str, Any], key: str) -> tuple[Mode, ...]:
    return tuple(Mode(sized("omega", omega), sized("zeta", zeta)) for omega, zeta in _pairs(content, key))


def sized(name: str, value: float, least: float = SLOWEST) -> float:
    """The value; raises InputError when its magnitude is not 0 and not between ``least`` and :data:`FASTEST`."""
    if value and not least <= abs(value) <= FASTEST:
        raise InputError(f"{shown(name)} is {value:g}; expected a magnitude from {least:g} to {FASTEST:g}")
    return value


def _pairs(content: Mapping[str, Any], key: str) -> list[tuple[float, float]]:
    """omega and zeta of each of the objects at ``key``."""
    modes = content.get(key)
    if not isinstance(modes, list) or not all(isinstance(mode, Mapping) for mode in modes):
        raise InputError(f"'{key}' is {shown(modes)}; expected a list of objects with 'omega' and 'zeta'")
    return [(number(mode, "omega"), number(mode, "zeta")) for mode in modes]


def _rates(content: Mapping[str, Any], key: str) -> tuple[float, ...]:
    """The list of numbers at ``key``; none where there is no such member."""
    return numbers(content, key) if key in content else ()


def _sized_rates(content: Mapping[str, Any], key: str) -> tuple[float, ...]:
    return tuple(sized(key, rate) for rate in _rates(content, key))
