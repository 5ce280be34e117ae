"""design.json, the contract between design and experiments."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from html import escape
from pathlib import Path
from typing import Any, TypeVar

from design.anti_windup.compensator import AntiWindup
from design.anti_windup.judge import Compensator, CorrectedCompensator, PrintedCompensator
from design.anti_windup.linear_loop import LinearLoop
from design.blocks.block import Block, plant_denominator
from design.blocks.inner_outer import inner_outer
from design.hinf.mixed_sensitivity import Synthesis
from design.parameters import DelayFreeParameters, ExtendedParameters
from identification.base.errors import InputError, shown
from identification.base.json_object import member, number, read_json, require_all_read, texts
from identification.model.additive_bound import AdditiveBound
from identification.model.plant import PlantModel
from identification.model.plant_json import bound_from_dict, bound_to_dict, plant_from_dict, plant_to_dict
from identification.model.signals import UNNAMED, Signals

SCHEMA = 3
KINDS = ("delay-free", "extended")

Named = TypeVar("Named")
Asked = str | Compensator | AntiWindup | None
"""How a caller names an anti-windup, see :meth:`Design.chosen`."""


@dataclass(frozen=True, repr=False)
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
        The design's transfer functions by the thesis's names, see docs/reference/design_json.md.
    hinf
        What the synthesis found; None for an extended design.
    parameters
        What was chosen.
    thesis, corrected
        The anti-windups that every design carries.
    added
        Any others by their names.
    compared
        What each does beside none in one run, a sentence each, the one that does harm first, then what the loop does
        without anti-windup and under which conditions; empty where none was run.
    signals
        Names and units of the plant's input and output.
    """

    kind: str
    plant: PlantModel
    additive_bound: AdditiveBound
    reference_omegas: tuple[float, ...]
    blocks: Mapping[str, Block]
    hinf: Synthesis | None
    parameters: DelayFreeParameters | ExtendedParameters
    thesis: PrintedCompensator
    corrected: CorrectedCompensator
    added: Mapping[str, Compensator] = field(default_factory=dict)
    compared: tuple[str, ...] = ()
    signals: Signals = UNNAMED

    def __repr__(self) -> str:
        omegas = ", ".join(f"{omega:.4g}" for omega in self.reference_omegas)
        return f"Design({self.kind}, reference at {omegas} rad/s, anti-windups {', '.join(self.anti_windup)})"

    def _repr_html_(self) -> str:
        """What each anti-windup is worth, as a notebook shows it."""
        from pandas import DataFrame

        table = DataFrame({name: asdict(each.judgement) for name, each in self.anti_windup.items()}).T
        return f"<p>{escape(repr(self))}</p>{table.to_html()}"

    def __post_init__(self) -> None:
        if self.kind not in KINDS:
            raise InputError(f"kind is {shown(self.kind)}; expected one of {', '.join(KINDS)}")

    @property
    def loop_plant(self) -> PlantModel:
        """The plant as the design sees it: without dead time in chapter 2."""
        return self.plant.without_delay() if self.kind == "delay-free" else self.plant

    @property
    def anti_windup(self) -> dict[str, Compensator]:
        """Every anti-windup by its name, ``thesis`` and ``corrected`` first."""
        return {"thesis": self.thesis, "corrected": self.corrected, **self.added}

    @property
    def free(self) -> ExtendedParameters:
        """The free parameters a, e, f, ... of an extended design; raises InputError for another one."""
        if not isinstance(self.parameters, ExtendedParameters):
            raise InputError(f"the design is '{self.kind}'; expected 'extended'")
        return self.parameters

    def compensator(self, name: str) -> AntiWindup:
        """theta1~ of this name, such as ``thesis`` or ``corrected``; raises InputError when there is none."""
        return _named(self.anti_windup, name).kind

    def chosen(self, asked: Asked) -> AntiWindup | None:
        """theta1~ as a caller may ask for it; ``none`` and None are no anti-windup.

        A name is one that the design holds, or of :data:`design.anti_windup.other_anti_windups.OTHERS`, which are made
        as they are asked for. Raises InputError where there is no such anti-windup.
        """
        if isinstance(asked, str):
            if asked == "none" or asked in self.anti_windup:
                return None if asked == "none" else self.compensator(asked)
            from design.anti_windup.other_anti_windups import OTHERS  # only here: nothing else needs them

            if asked not in OTHERS:
                known = f"expected {', '.join(self.anti_windup)} of the design, or {', '.join(OTHERS)}"
                raise InputError(f"there is no anti-windup '{asked}'; {known}")
            return OTHERS[asked](self.linear_loop)
        return asked.kind if isinstance(asked, Compensator) else asked

    @property
    def linear_loop(self) -> LinearLoop:
        """What the anti-windups of others are made of."""
        pole = self.parameters.a if isinstance(self.parameters, ExtendedParameters) else None
        recovery_s, bandwidth = self.corrected.judgement.recovery_s, self.corrected.bandwidth
        return LinearLoop(self.loop_plant, *self.controller_parts(), pole, self.reference_omegas, recovery_s, bandwidth)

    def controller_parts(self) -> tuple[Block, Block]:
        """The blocks of C = forward/(1 - feedback exp(-h s)) with h the plant's dead time, (3.10) and (3.31).

        Chapter 2: K A/Lambda, no feedback. Chapters 3 and 4: K and T_so B, with the inner factor B of the plant's zeros
        in the right half plane, which the thesis's class has not.
        """
        if self.kind == "delay-free":
            return self.blocks["K"] * plant_denominator(self.plant) * self.blocks["Lambda"].inverse(), Block(0.0)
        return self.blocks["K"], self.blocks["T_so"] * inner_outer(self.plant)[0].without_delay()

    def to_dict(self) -> dict[str, Any]:
        """The object of design.json."""
        return {
            "schema": SCHEMA,
            "kind": self.kind,
            "signals": self.signals.to_dict(),
            "plant": plant_to_dict(self.plant),
            "additive_bound": bound_to_dict(self.additive_bound),
            "reference_omegas": list(self.reference_omegas),
            "parameters": self.parameters.to_dict(),
            "blocks": {name: block.to_dict() for name, block in self.blocks.items()},
            "hinf": None if self.hinf is None else self.hinf.to_dict(),
            "anti_windup": {name: each.to_dict() for name, each in self.anti_windup.items()},
            "compared": list(self.compared),
        }

    def to_json(self) -> str:
        """The text of design.json; every number is finite or this raises ValueError."""
        return json.dumps(self.to_dict(), indent=2, allow_nan=False) + "\n"


def read_design(path: Path | str, kind: str | None = None) -> Design:
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
        No such file, not JSON, another schema or kind, or a member missing, not known or of the wrong form.
    """
    content = read_json(Path(path), SCHEMA)
    try:
        if content.get("kind") not in KINDS:
            raise InputError(f"kind is {shown(content.get('kind'))}; expected one of {', '.join(KINDS)}")
        if kind not in (None, content["kind"]):
            raise InputError(f"kind is '{content['kind']}'; expected '{kind}'")
        delay_free = content["kind"] == "delay-free"
        hinf = None if content.get("hinf") is None else Synthesis.from_dict(member(content, "hinf"))
        anti_windup, blocks = member(content, "anti_windup"), member(content, "blocks")
        parameters, kinds = member(content, "parameters"), {name: member(anti_windup, name) for name in anti_windup}
        design = Design(
            kind=content["kind"],
            plant=plant_from_dict(member(content, "plant")),
            additive_bound=bound_from_dict(member(content, "additive_bound")),
            reference_omegas=_omegas(content),
            blocks={name: Block.from_dict(member(blocks, name)) for name in blocks},
            hinf=hinf,
            parameters=(DelayFreeParameters if delay_free else ExtendedParameters).from_dict(parameters),
            thesis=PrintedCompensator.from_dict(_named(kinds, "thesis")),
            corrected=CorrectedCompensator.from_dict(_named(kinds, "corrected")),
            added={n: Compensator.from_dict(kinds[n]) for n in kinds if n not in ("thesis", "corrected")},
            compared=texts(content, "compared") if "compared" in content else (),
            signals=Signals.from_dict(member(content, "signals")) if "signals" in content else UNNAMED,
        )
        if (hinf is not None) != delay_free:
            raise InputError(
                f"kind is '{design.kind}' {'without' if delay_free else 'with'} hinf; expected hinf in a delay-free "
                "design alone"
            )
        needed = ("K", "Lambda", "G_A") if delay_free else ("K", "T_so")
        for name in needed:
            if name not in design.blocks:
                raise InputError(f"the block '{name}' is missing")
            if design.blocks[name].delay_s:
                raise InputError(f"the block '{name}' has a dead time; expected none, the loop has the plant's")
        corrected = design.corrected
        for name, value in (("bandwidth", corrected.bandwidth), ("recovery_s", corrected.judgement.recovery_s)):
            if not 1e-100 < value < 1e100:
                raise InputError(f"'{name}' of the corrected anti-windup is not a positive number")
        require_all_read(content, design.to_dict())
    except InputError as error:
        raise InputError(f"{path}: {error}") from None
    return design


def _named(anti_windups: Mapping[str, Named], name: str) -> Named:
    """The anti-windup of this name; raises InputError when there is none."""
    if name not in anti_windups:
        raise InputError(f"there is no anti-windup '{name}'; the design has {', '.join(anti_windups)}")
    return anti_windups[name]


def _omegas(content: Mapping[str, Any]) -> tuple[float, ...]:
    """The member reference_omegas; raises InputError when it is no list of numbers that are not negative."""
    given = content.get("reference_omegas")
    if not isinstance(given, list) or not given:
        raise InputError(f"reference_omegas is {shown(given)}; expected a list of numbers")
    omegas = tuple(number({"reference_omegas": omega}, "reference_omegas") for omega in given)
    if min(omegas) < 0:
        raise InputError(f"reference_omegas has {min(omegas):g}; expected no negative number")
    return omegas
