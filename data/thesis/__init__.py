"""Thesis: what it prints: its numbers in thesis.toml, its statements in claims.csv, its equations in equations.csv."""

from __future__ import annotations

import tomllib
from functools import cache
from pathlib import Path
from typing import Any

from identification.base.errors import MissingFile
from identification.model.model_file import IdentifiedModel
from identification.model.plant_json import bound_from_dict, plant_from_dict

THESIS = Path(__file__).resolve().parent


@cache
def printed_numbers() -> dict[str, Any]:
    """Return data/thesis/thesis.toml as nested dictionaries; its comments give the units and the places in print.

    Table 4.1 and what else the thesis chose, as printed.
    """
    return tomllib.loads((THESIS / "thesis.toml").read_text(encoding="utf-8"))


def model_named(name: str) -> IdentifiedModel:
    """The thesis's own sets: ``table`` and ``implied``.

    Both come with the printed bound (2.22). ``table`` is Table 2.1 as printed; ``implied`` is the set
    that gives back the transfer functions printed after it.

    Raises
    ------
    MissingFile
        Another name, which a file would have to have.
    """
    plants = printed_numbers()["plants"]
    if name not in plants:
        raise MissingFile(f"{name}: no such file")
    return IdentifiedModel(plant_from_dict(plants[name]), bound_from_dict(printed_numbers()["additive_bound"]))
