"""design.json, the contract between design and experiments."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from design.anti_windup.compensator import AntiWindup
from design.blocks.block import Block, plant_denominator
from identification.base.errors import InputError
from identification.model.model_file import (
    bound_from_dict,
    bound_to_dict,
    member,
    number,
    plant_from_dict,
    plant_to_dict,
    read_json,
)
from identification.model.plant import AdditiveBound, PlantModel

SCHEMA = 2
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
    reference_omegas
        Angular frequencies of the reference in rad/s; 0 is a constant.
    blocks
        The design's transfer functions by the thesis's names, see README.
    hinf
        gamma_lower, gamma, W1, W2 and what else the synthesis found; None for an extended design.
    anti_windup
        ``thesis``, ``corrected`` and any others: theta1_tilde and one_plus as :meth:`AntiWindup.to_dict` has them,
        what was chosen (alpha, beta, gamma of (2.23); sector, bandwidth) and the members of
        :class:`design.anti_windup.judge.Judgement`.
    parameters
        What was chosen: epsilon, or a, the pairs e, f and the method for Q.
    """

    kind: str
    plant: PlantModel
    additive_bound: AdditiveBound
    reference_omegas: tuple[float, ...]
    blocks: Mapping[str, Block]
    hinf: Mapping[str, Any] | None
    anti_windup: Mapping[str, Mapping[str, Any]]
    parameters: Mapping[str, Any]

    @property
    def loop_plant(self) -> PlantModel:
        """The plant as the design sees it: without dead time in chapter 2."""
        return self.plant.without_delay() if self.kind == "delay-free" else self.plant

    def compensator(self, name: str) -> AntiWindup:
        """theta1~ of this name, such as ``thesis`` or ``corrected``; raises InputError when there is none."""
        if name not in self.anti_windup:
            raise InputError(f"there is no anti-windup '{name}'; the design has {', '.join(self.anti_windup)}")
        return AntiWindup.from_dict(self.anti_windup[name])

    def controller_parts(self) -> tuple[Block, Block]:
        """The blocks of C = forward/(1 - feedback exp(-h s)) with h the plant's dead time, (3.10) and (3.31).

        Chapter 2: K A/Lambda, no feedback. Chapters 3 and 4: K and T_so.
        """
        if self.kind == "delay-free":
            return self.blocks["K"] * plant_denominator(self.plant) * self.blocks["Lambda"].inverse(), Block(0.0)
        return self.blocks["K"], self.blocks["T_so"]

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
            "reference_omegas": list(self.reference_omegas),
            "parameters": dict(self.parameters),
            "blocks": {name: block.to_dict() for name, block in self.blocks.items()},
            "hinf": hinf,
            "anti_windup": {name: dict(facts) for name, facts in self.anti_windup.items()},
        }
        return json.dumps(content, indent=2, allow_nan=False) + "\n"


def read_design(path: Path, kind: str | None = None) -> Design:
    """Read a design.json.

    Parameters
    ----------
    path
        The file.
    kind
        What it has to be, ``delay-free`` or ``extended``; either unless given.

    Raises
    ------
    InputError
        No such file, not JSON, another schema or kind, or a member missing or of the wrong form.
    """
    content = read_json(path, SCHEMA)
    try:
        if content.get("kind") not in KINDS:
            raise InputError(f"kind is {content.get('kind')!r}; expected one of {', '.join(KINDS)}")
        if kind not in (None, content["kind"]):
            raise InputError(f"kind is '{content['kind']}'; expected '{kind}'")
        hinf = content.get("hinf")
        if hinf is not None:
            hinf = dict(member(content, "hinf"))
            for name in ("gamma_lower", "gamma", "decay_rate", "gamma_line_lower", "gamma_line"):
                number(hinf, name)
            hinf |= {name: Block.from_dict(member(hinf, name)) for name in ("W1", "W2")}
        anti_windup = member(content, "anti_windup")
        blocks = member(content, "blocks")
        design = Design(
            kind=content["kind"],
            plant=plant_from_dict(member(content, "plant")),
            additive_bound=bound_from_dict(member(content, "additive_bound")),
            reference_omegas=_omegas(content),
            blocks={name: Block.from_dict(member(blocks, name)) for name in blocks},
            hinf=hinf,
            anti_windup={name: member(anti_windup, name) for name in anti_windup},
            parameters=member(content, "parameters"),
        )
        if (hinf is not None) != (design.kind == "delay-free"):
            raise InputError(f"hinf belongs to a delay-free design and to no other; kind is '{design.kind}'")
        needed = ("K", "Lambda", "G_A") if design.kind == "delay-free" else ("K", "T_so", "C0")
        for name in needed:
            if name not in design.blocks:
                raise InputError(f"the block '{name}' is missing")
            if design.blocks[name].delay_s:
                raise InputError(f"the block '{name}' has a dead time; expected none, the loop has the plant's")
        for name in {*design.anti_windup, "thesis", "corrected"}:
            design.compensator(name)
        for name in ("bandwidth", "recovery_s"):
            if not 1e-100 < number(design.anti_windup["corrected"], name) < 1e100:
                raise InputError(f"'{name}' of the corrected anti-windup is not a positive number")
    except InputError as error:
        raise InputError(f"{path}: {error}") from None
    return design


def _omegas(content: Mapping[str, Any]) -> tuple[float, ...]:
    """The member reference_omegas; raises InputError when it is no list of numbers that are not negative."""
    given = content.get("reference_omegas")
    if not isinstance(given, list) or not given:
        raise InputError(f"reference_omegas is {given!r}; expected a list of numbers")
    omegas = tuple(number({"reference_omegas": omega}, "reference_omegas") for omega in given)
    if min(omegas) < 0:
        raise InputError(f"reference_omegas has {min(omegas):g}; expected no negative number")
    return omegas
