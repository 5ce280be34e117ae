"""The loop of chapter 4 under any limit from any initial output, and what it comes to."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cache, cached_property
from typing import Any, NamedTuple

import numpy as np

from design.blocks.block import plant_block
from design.blocks.state_space import StateSpace, realize
from design.design_file import Design
from experiments.engine.pade import with_pade
from experiments.engine.ready_loop import ReadyLoop, ready_loop
from experiments.engine.saturated_loop import SaturatedLoop
from experiments.engine.simulate import DivergenceError, simulate
from experiments.runs.design_loop import design_loop
from experiments.runs.references import Reference
from experiments.thesis.printed_choices import chapter_4, thesis_reference
from experiments.thesis.studies.chapter_4 import PADE_ORDER
from experiments.thesis.studies.desaturation import PERIODS
from experiments.thesis.unprinted.printed_outcomes import OUTCOMES, with_anti_windup, without_anti_windup

SETS = ("implied", "table")
DELAYS = ("exact", "pade")
SAMPLES_PER_PERIOD = 500


class Point(NamedTuple):
    """A limit +-limit of the actuator, in its unit, and y(0), in the unit of the plant's output."""

    limit: float
    output: float


class Prepared(NamedTuple):
    """A loop from rest, and by how much a unit of each initial condition moves its state (n,)."""

    rest: ReadyLoop
    by: Mapping[str, np.ndarray]

    def starting_at(self, **values: float) -> ReadyLoop:
        """The loop under initial conditions, of all that move its state; other values are passed over."""
        return self.rest.starting_from(self.rest.loop.x0 + sum(values[name] * move for name, move in self.by.items()))


@dataclass(frozen=True)
class Conditions:
    """Chapter 4's loop under one parameter set, with the exact dead time or its approximation.

    Parameters
    ----------
    set_name
        One of :data:`SETS`.
    delay
        "exact", or "pade": every dead time replaced by its second-order Pade approximation, as section 4.2 does.
    """

    set_name: str
    delay: str

    def __reduce__(self) -> tuple[Any, ...]:
        """Another process makes its loops once and not for each piece of work."""
        return _kept, (self.set_name, self.delay)

    @cached_property
    def design(self) -> Design:
        """Chapter 4's."""
        return chapter_4(self.set_name)

    @cached_property
    def reference(self) -> Reference:
        """r(t) = 50 sin(1.5 t + pi/2)."""
        return thesis_reference("extended", self.design.reference_omegas)

    @cached_property
    def required(self) -> float:
        """The most that the input of perfect tracking reaches, in the actuator's unit."""
        return self.reference.required(self.design.loop_plant).value

    @property
    def initial_reference(self) -> float:
        """r(0) in the unit of the output."""
        return float(self.reference(np.array(0.0)))

    @cached_property
    def _prepared(self) -> dict[str, Prepared]:
        kinds = {"none": None, "thesis": self.design.compensator("thesis")}
        return {
            name: from_output(design_loop(self.design, self.reference, kind), self.design, self.delay)
            for name, kind in kinds.items()
        }

    def loop(self, kind: str, output: float) -> ReadyLoop:
        """The loop "none" (without anti-windup) or "thesis" (with the thesis's) from y(0) = ``output``, see
        :func:`starting_at`."""
        return self._prepared[kind].starting_at(initial_output=output)

    def outcomes(self, kind: str, point: Point, samples: int = SAMPLES_PER_PERIOD) -> dict[str, float]:
        """Those of :func:`outcomes_of` for the loop of :meth:`loop`."""
        limits = -point.limit, point.limit
        return outcomes_of(self.loop(kind, point.output), kind, limits, self.reference, samples)

    def both(self, point: Point, samples: int = SAMPLES_PER_PERIOD) -> dict[str, float]:
        """The outcomes of both loops."""
        return self.outcomes("none", point, samples) | self.outcomes("thesis", point, samples)


@cache
def _kept(set_name: str, delay: str) -> Conditions:
    return Conditions(set_name, delay)


def outcomes_of(
    loop: ReadyLoop, kind: str, limits: tuple[float, float], reference: Reference, samples: int = SAMPLES_PER_PERIOD
) -> dict[str, float]:
    """What a loop "none" or "thesis" comes to in every reading, from so many samples of each of five periods.

    NaN is never; all are NaN when the loop diverges.
    """
    period = reference.period_s
    time_s = np.linspace(0.0, PERIODS * period, PERIODS * samples + 1)
    try:
        run = simulate(loop, limits, time_s)
    except DivergenceError:
        return dict.fromkeys(OUTCOMES[kind], math.nan)
    if kind == "none":
        return without_anti_windup(run, period)
    return with_anti_windup(run, reference.amplitude, period)


def from_output(loop: SaturatedLoop, design: Design, delay: str) -> Prepared:
    """:func:`prepared` for a loop of a design, to start from any ``initial_output`` as :func:`starting_at` does."""
    return prepared(loop, {"initial_output": starting_at(loop, design, 1.0).x0 - loop.x0}, delay)


def prepared(loop: SaturatedLoop, directions: Mapping[str, np.ndarray], delay: str) -> Prepared:
    """A loop from rest with the error as its only output, and the dead time of :attr:`Conditions.delay`.

    ``directions`` is what a unit of each initial condition adds to its state (n,).
    """
    watched = replace(loop, outputs={"error": loop.outputs["error"]})

    def starting(direction: np.ndarray | float) -> SaturatedLoop:
        moved = replace(watched, x0=watched.x0 + direction)
        return with_pade_at_rest(moved, PADE_ORDER) if delay == "pade" else moved

    rest = starting(0.0)
    return Prepared(ready_loop(rest), {name: starting(by).x0 - rest.x0 for name, by in directions.items()})


def starting_at(loop: SaturatedLoop, design: Design, output: float) -> SaturatedLoop:
    """The loop of a design from y(0) = ``output``, everything else at rest.

    Parameters
    ----------
    loop
        As :func:`experiments.runs.design_loop.design_loop` makes it of ``design``, without Pade approximations.
    design
        Its plant integrates.
    output
        In the unit of the plant's output.

    Returns
    -------
    SaturatedLoop
        The plant starts in the state that it keeps without input, A x = 0 and C x = ``output``: the integrator holds
        it, the modes are at rest. Controller and anti-windup are at zero, and so is the input of the past, so that
        y = ``output`` until the dead time is over.
    """
    held = output * held_state(realize(plant_block(design.loop_plant)))
    first = len(thesis_reference(design.kind, design.reference_omegas).generator().start)
    x0 = loop.x0.copy()
    x0[first : first + len(held)] = held
    return replace(loop, x0=x0)


def held_state(P: StateSpace) -> np.ndarray:
    """The state (n,) in which a plant that integrates keeps the output 1 without input: A x = 0, C x = 1."""
    held: np.ndarray = np.linalg.lstsq(np.vstack([P.A, P.C]), np.append(np.zeros(len(P.b)), 1.0))[0]
    held /= P.C[0] @ held
    return held


def with_pade_at_rest(loop: SaturatedLoop, order: int) -> SaturatedLoop:
    """:func:`experiments.engine.pade.with_pade`, the delayed signals having been for ever what they are at t = 0."""
    padded, n = with_pade(loop, order), len(loop.x0)
    x0 = padded.x0.copy()
    x0[n:] = np.linalg.solve(padded.A[n:, n:], -padded.A[n:, :n] @ loop.x0)
    return replace(padded, x0=x0)
