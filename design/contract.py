"""design.json, the contract between design and experiments."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from design.anti_windup import AntiWindup, printed_form, washout
from design.block import Block
from identification.files import InputError
from identification.model import (
    bound_from_dict,
    bound_to_dict,
    member,
    number,
    plant_from_dict,
    plant_to_dict,
    read_json,
)
from identification.plant import AdditiveBound, PlantModel

SCHEMA = 1
KINDS = ("delay-free", "extended")


@dataclass(frozen=True)
class Design:
    """A finished design of chapter 2 ("delay-free") or of chapters 3 and 4 ("extended").

    Parameters
    ----------
    kind
        One of :data:`KINDS`.
    plant
        The plant that the design is for; a delay-free design ignores its dead time.
    additive_bound
        W_a.
    reference_omega
        Angular frequency of the reference in rad/s.
    blocks
        The design's transfer functions by the thesis's names, see README.
    hinf
        gamma_lower, gamma, W1, W2 and what else the synthesis found; None for an extended design.
    anti_windup
        ``thesis``: alpha, beta, gamma of (2.23); ``corrected``: rate; each with its f and Popov sector.
    parameters
        What was chosen: epsilon, or a, e, f and the method for Q.
    """

    kind: str
    plant: PlantModel
    additive_bound: AdditiveBound
    reference_omega: float
    blocks: Mapping[str, Block]
    hinf: Mapping[str, Any] | None
    anti_windup: Mapping[str, Mapping[str, Any]]
    parameters: Mapping[str, Any]

    @property
    def loop_plant(self) -> PlantModel:
        """The plant as the design sees it: without dead time in chapter 2."""
        return self.plant.without_delay() if self.kind == "delay-free" else self.plant

    def thesis_anti_windup(self) -> AntiWindup:
        """theta1~ of (2.23) with the design's alpha, beta and gamma."""
        return printed_form(self.anti_windup["thesis"])

    def corrected_anti_windup(self) -> AntiWindup:
        """theta1~ with theta1~(0) = -1."""
        return washout(self.additive_bound, number(self.anti_windup["corrected"], "rate"))

    def to_json(self) -> str:
        """The text of design.json; every number is finite or this raises ValueError."""
        hinf = None
        if self.hinf is not None:
            hinf = {key: value.to_dict() if isinstance(value, Block) else value for key, value in self.hinf.items()}
        content = {
            "schema": SCHEMA,
            "kind": self.kind,
            "plant": plant_to_dict(self.plant),
            "additive_bound": bound_to_dict(self.additive_bound),
            "reference_omega": self.reference_omega,
            "parameters": dict(self.parameters),
            "blocks": {name: block.to_dict() for name, block in self.blocks.items()},
            "hinf": hinf,
            "anti_windup": {name: dict(facts) for name, facts in self.anti_windup.items()},
        }
        return json.dumps(content, indent=2, allow_nan=False) + "\n"


def read_design(path: Path) -> Design:
    """Read a design.json.

    Raises
    ------
    InputError
        No such file, not JSON, another schema or kind, or a member missing or of the wrong form.
    """
    content = read_json(path, SCHEMA)
    try:
        if content.get("kind") not in KINDS:
            raise InputError(f"kind is {content.get('kind')!r}; expected one of {', '.join(KINDS)}")
        hinf = content.get("hinf")
        if hinf is not None:
            hinf = dict(member(content, "hinf"))
            hinf |= {name: Block.from_dict(member(hinf, name)) for name in ("W1", "W2")}
        anti_windup = member(content, "anti_windup")
        blocks = member(content, "blocks")
        design = Design(
            kind=content["kind"],
            plant=plant_from_dict(member(content, "plant")),
            additive_bound=bound_from_dict(member(content, "additive_bound")),
            reference_omega=number(content, "reference_omega"),
            blocks={name: Block.from_dict(member(blocks, name)) for name in blocks},
            hinf=hinf,
            anti_windup={name: member(anti_windup, name) for name in ("thesis", "corrected")},
            parameters=member(content, "parameters"),
        )
        needed = ("K", "Lambda") if design.kind == "delay-free" else ("K", "T_so")
        for name in needed:
            if name not in design.blocks:
                raise InputError(f"the block '{name}' is missing")
            if design.blocks[name].delay_s:
                raise InputError(f"the block '{name}' has a dead time; expected none, the loop has the plant's")
        if not design.reference_omega > 0:
            raise InputError(f"reference_omega is {design.reference_omega:g}; expected a positive number")
        design.thesis_anti_windup()
        design.corrected_anti_windup()
    except InputError as error:
        raise InputError(f"{path}: {error}") from None
    return design
