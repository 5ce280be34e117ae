"""Chapter 4's loop with the blocks that the thesis prints, or that its words may mean."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

from data.thesis import printed_numbers
from design.anti_windup.compensator import AntiWindup, second_order
from design.blocks.block import Block
from design.blocks.state_space import realize
from experiments.runs.design_loop import Controller, realized_controller
from experiments.thesis.claims.ledger import read_ledger
from experiments.thesis.claims.printed_number import read_number
from experiments.thesis.printed_choices import chapter_4
from identification.model.modes import Mode
from identification.model.plant import PlantModel


class Loops(NamedTuple):
    """A plant, and its controller without anti-windup and with it."""

    plant: PlantModel
    none: Controller
    thesis: Controller


def usual() -> Loops:
    """Chapter 4's loop of the set ``implied``."""
    return _designed(chapter_4().compensator("thesis"))


def without_integrator() -> Loops:
    """The same with theta2 without its factor 1/s."""
    loops, kind = usual(), chapter_4().compensator("thesis")
    theta = realize(kind.theta1_tilde, kind.theta2(loops.plant) * Block(1.0, (0j,)))
    return loops._replace(thesis=replace(loops.thesis, theta=theta))


def cancelling() -> Loops:
    """The same with gamma = -1 in (2.23): 1 + theta1~ has a zero at s = 0, which cancels the integrator in theta2."""
    return _designed(_printed_anti_windup(gamma=-1.0))


def as_printed() -> Loops:
    """(4.8), C_aw, and theta1~ with the alpha, beta and gamma of section 2.4, as they are printed.

    Of the set ``implied`` this has 285 rad/s instead of 282 rad/s, and C_aw without the plant's fast pair.
    """
    plant, C_aw, nothing, kind = plant_4_8(), realize(printed_C_aw()), Block(0.0), _printed_anti_windup()
    none, thesis = (
        Controller(C_aw, realize(nothing), realize(*blocks), plant.delay_s)
        for blocks in ((nothing, nothing), (kind.theta1_tilde, kind.theta2(plant)))
    )
    return Loops(plant, none, thesis)


def plant_4_8() -> PlantModel:
    """P of (4.8) as it is printed."""
    number = _printed()

    def modes(side: str) -> tuple[Mode, ...]:
        names = (f"P.{side}_mode_{k}" for k in (1, 2))
        return tuple(Mode(number(f"{name}.omega"), number(f"{name}.two_zeta") / 2) for name in names)

    return PlantModel(number("P.gain"), modes("zero"), modes("pole"), number("P.delay_s"))


def printed_C_aw() -> Block:
    """C_aw as section 4.2 prints it, without the plant's fast pair."""
    number = _printed()

    def pair(name: str) -> tuple[complex, complex]:
        s1, s0 = number(f"C_aw.{name}.s1"), number(f"C_aw.{name}.s0")
        root = complex(-s1 / 2, math.sqrt(s0 - s1**2 / 4))
        return root, root.conjugate()

    turning = complex(0.0, math.sqrt(number("C_aw.pole_pair_1.s0")))
    zeros = (complex(-number("C_aw.zero_1")), *pair("zero_pair_1"), *pair("zero_pair_2"))
    return Block(number("C_aw.gain"), zeros, (0j, turning, turning.conjugate(), *pair("pole_pair_2")))


def _designed(kind: AntiWindup) -> Loops:
    design = chapter_4()
    return Loops(design.loop_plant, realized_controller(design, None), realized_controller(design, kind))


def _printed_anti_windup(gamma: float | None = None) -> AntiWindup:
    """(2.23) with the printed alpha and beta, and the printed gamma unless given."""
    chosen = printed_numbers()["delay_free"]
    return second_order(chosen["alpha"], chosen["beta"], chosen["gamma"] if gamma is None else gamma)


def _printed() -> Callable[[str], float]:
    printed = read_ledger().set_index("id")["printed"]
    return lambda name: read_number(printed[name]).value
