"""What the claims are computed from: numbers with the rounding of their print, and the models made of them."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from typing import Any

import pandas as pd

from data.thesis import THESIS, printed_numbers
from experiments.thesis.claims.printed_number import PrintedNumber, read_number
from identification.model.plant import PlantModel
from identification.model.plant_json import plant_from_dict

Inputs = Mapping[str, float]

_REFERENCE = ("amplitude", "offset", "period_s", "phase_rad")
_SIDES = {"n": "zero_modes", "d": "pole_modes"}


def rounded_inputs(ledger: pd.DataFrame) -> dict[str, PrintedNumber]:
    """The numbers that are known only to their last digit.

    Parameters
    ----------
    ledger
        Strings, with at least the columns ``id`` and ``printed``.

    Returns
    -------
    dict
        ``printed.ID`` for every row of the ledger; ``implied.gain``, ``implied.pole_modes.0.omega`` and so on for
        the plant, with the digits that thesis.toml writes.

    Notes
    -----
    The plant was identified, so its numbers are rounded. What the thesis chose is exact: W_a, whose zero alpha is
    said to cancel, epsilon, alpha, beta, gamma, a, e, f and the references. The ``.0`` that TOML asks for at the
    end of a whole number is no printed digit.
    """
    text = (THESIS / "thesis.toml").read_text(encoding="utf-8")
    content = tomllib.loads(text, parse_float=lambda digits: digits.removesuffix(".0"))
    rows = ledger[["id", "printed"]].itertuples(index=False)
    implied = _leaves("implied", content["plants"]["implied"])
    return {f"printed.{name}": read_number(text) for name, text in rows} | {
        key: read_number(digits) for key, digits in implied
    }


def transcribed(inputs: Inputs) -> dict[str, float]:
    """The printed inputs as data/thesis/thesis.toml holds them for the rest of this project, in the ledger's units."""
    values = printed_numbers()
    plant, bound, pid = values["plants"]["table"], values["additive_bound"], values["pid"]
    chapter_2, chapter_4 = values["delay_free"], values["extended"]
    modes = {f"{side}{k}": mode for side in "nd" for k, mode in enumerate(plant[_SIDES[side]], start=1)}
    return {
        **{f"pid.{name}": pid[name] for name in ("time_constant_s", "delay_s", "limit")},
        "pid.plant_gain": pid["gain"],
        **{f"excitation.{name}": values["excitation"][name] for name in ("amplitude", "start_hz", "stop_hz")},
        "table_2_1.K": plant["gain"],
        "table_2_1.h": 1e3 * plant["delay_s"],
        **{f"table_2_1.{key}_{name}": mode[key] for name, mode in modes.items() for key in ("omega", "zeta")},
        **{f"W_a_2_22.{name}": bound[name] for name in ("gain", "corner", "zeta", "omega")},
        **{f"delay_free.reference.{name}": chapter_2["reference"][name] for name in _REFERENCE},
        "delay_free.reference.frequency_hz": 1 / chapter_2["reference"]["period_s"],
        "delay_free.limit": chapter_2["limit"],
        "delay_free.epsilon": chapter_2["epsilon"],
        **{f"extended.reference.{name}": chapter_4["reference"][name] for name in ("amplitude", "omega", "phase_rad")},
        "extended.desaturation_s": chapter_4["desaturation_s"],
        **{f"table_4_1.{name}": chapter_4[name] for name in "aef"},
    }


def plant_of(inputs: Inputs) -> PlantModel:
    """The plant of the set ``implied``."""
    return plant_from_dict(
        {
            "gain": inputs["implied.gain"],
            "delay_s": inputs["implied.delay_s"],
            "zero_modes": [_mode(inputs, f"implied.zero_modes.{k}") for k in range(2)],
            "pole_modes": [_mode(inputs, f"implied.pole_modes.{k}") for k in range(2)],
        }
    )


def _mode(inputs: Inputs, name: str) -> dict[str, float]:
    return {key: inputs[f"{name}.{key}"] for key in ("omega", "zeta")}


def _leaves(name: str, content: Any) -> list[tuple[str, str]]:
    if isinstance(content, Mapping):
        return [leaf for key, part in content.items() for leaf in _leaves(f"{name}.{key}", part)]
    if isinstance(content, list):
        return [leaf for k, part in enumerate(content) for leaf in _leaves(f"{name}.{k}", part)]
    return [(name, content)]
