"""Conditions of chapter 4 beyond a limit +-L and an initial output: what else the thesis does not print."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from design.blocks.block import plant_block
from design.blocks.state_space import StateSpace, realize
from experiments.engine.ready_loop import ReadyLoop
from experiments.engine.saturated_loop import SaturatedLoop
from experiments.runs.design_loop import Controller, plant_loop
from experiments.runs.disturbances import Disturbances, steps
from experiments.runs.references import Reference
from experiments.thesis.printed_choices import chapter_4, thesis_reference
from experiments.thesis.unprinted.chapter_4_conditions import (
    SAMPLES_PER_PERIOD,
    Prepared,
    held_state,
    outcomes_of,
    prepared,
)
from experiments.thesis.unprinted.printed_outcomes import (
    COUNTED_FROM_THE_END,
    READINGS,
    after_saturation,
)
from experiments.thesis.unprinted.wide_loops import Loops, as_printed, cancelling, usual, without_integrator
from identification.model.plant import PlantModel

LIMIT_EXCESS = 1e-4, 3.0  # of a limit over the input that the reference takes, relative
LATEST_S = 4.5  # of a disturbance: what "around 4" seconds means at most
DIGITS = 6  # of a condition: what a table shows is what was run

CONTROLLER = ("controller_held", "controller_cosine", "controller_sine")
"""The control that the states of T_so would go on with: held + cosine cos(omega t) + sine sin(omega t)."""
MODES = ("mode_1", "mode_1_quarter", "mode_2", "mode_2_quarter")
"""What the plant's modes add to y at t = 0, and what they would add a quarter of a period later without damping."""
DISTURBANCE = ("disturbance", "disturbance_s")
"""The level of a step that is added to the output, and when it comes."""


class Axis(NamedTuple):
    """A condition that is searched from ``low`` to ``high``; by equal ratios of what it exceeds ``above``, if any."""

    name: str
    low: float
    high: float
    above: float | None = None

    def at(self, share: float) -> float:
        """The value at a share, 0 to 1, of the range, with :data:`DIGITS` digits."""
        if self.above is None:
            value = self.low + share * (self.high - self.low)
        else:
            first, last = self.low - self.above, self.high - self.above
            value = self.above + first * (last / first) ** share
        return float(f"{value:.{DIGITS}g}")


@dataclass(frozen=True)
class Case:
    """Chapter 4's loop under an upper limit, an initial output, and what else is searched.

    Parameters
    ----------
    name
        For people.
    added
        Names of what is searched besides the upper limit and y(0): "lower", :data:`CONTROLLER`, :data:`MODES` or
        :data:`DISTURBANCE`. Without "lower" the lower limit is minus the upper one.
    loops
        Makes the blocks.
    delay
        "exact", or "pade" as of :class:`experiments.thesis.unprinted.chapter_4_conditions.Conditions`.
    from_the_end
        Whether the 4.46 s are counted from the last saturation on, and not from t = 0.
    """

    name: str
    added: tuple[str, ...] = ()
    loops: Callable[[], Loops] = usual
    delay: str = "exact"
    from_the_end: bool = False

    @property
    def readings(self) -> Mapping[str, tuple[str, ...]]:
        """Of each outcome."""
        return COUNTED_FROM_THE_END if self.from_the_end else READINGS

    @cached_property
    def reference(self) -> Reference:
        """r(t) = 50 sin(1.5 t + pi/2)."""
        return thesis_reference("extended", chapter_4().reference_omegas)

    @cached_property
    def axes(self) -> tuple[Axis, ...]:
        """The upper limit, y(0), and what is added."""
        required, r_0 = self.reference.required(self.loops().plant).value, float(self.reference(np.array(0.0)))
        least, most = (required * (1 + excess) for excess in LIMIT_EXCESS)
        ranges = {
            "lower": Axis("lower", least, most, above=required),
            **{name: Axis(name, -required, required) for name in CONTROLLER},
            **{name: Axis(name, -r_0, r_0) for name in MODES},
            "disturbance": Axis("disturbance", -r_0, r_0),
            "disturbance_s": Axis("disturbance_s", 0.01, LATEST_S),
        }
        first = Axis("upper", least, most, above=required), Axis("initial_output", -r_0, 2 * r_0)
        return *first, *(ranges[name] for name in self.added)

    @cached_property
    def prepared(self) -> dict[str, Prepared]:
        """The loops "none", without anti-windup, and "thesis", with it."""
        plant, none, thesis = self.loops()
        return {"none": self._prepare(plant, none), "thesis": self._prepare(plant, thesis)}

    def outcomes(self, kind: str, values: Mapping[str, float], samples: int = SAMPLES_PER_PERIOD) -> dict[str, float]:
        """What a loop comes to in every reading, from so many samples of each of five periods.

        Parameters
        ----------
        kind
            "none" or "thesis".
        values
            Of all :attr:`axes`, by name.
        samples
            Of a period.

        Returns
        -------
        dict
            NaN is never; all are NaN when the loop diverges.
        """
        limits = -values.get("lower", values["upper"]), values["upper"]
        found = outcomes_of(self.started(kind, values), kind, limits, self.reference, samples)
        return after_saturation(found) if kind == "thesis" else found

    def started(self, kind: str, values: Mapping[str, float]) -> ReadyLoop:
        """A loop of :attr:`prepared` under the initial conditions and the disturbance of ``values``."""
        started = self.prepared[kind].starting_at(**values)
        if "disturbance" not in values:
            return started
        unit = started.loop.resets
        resets = replace(unit, times_s=np.array([values["disturbance_s"]]), values=values["disturbance"] * unit.values)
        return replace(started, loop=replace(started.loop, resets=resets))

    def _prepare(self, plant: PlantModel, controller: Controller) -> Prepared:
        unit_step = steps([(1.0, 1.0)] if "disturbance" in self.added else [])
        loop = plant_loop(controller, plant, self.reference, Disturbances(output=unit_step))
        directions = _directions(plant, controller, loop, self.reference.omegas[0])
        wanted = ("initial_output", *(name for name in self.added if name in directions))
        return prepared(loop, {name: directions[name] for name in wanted}, self.delay)


def _directions(plant: PlantModel, controller: Controller, loop: SaturatedLoop, omega: float) -> dict[str, np.ndarray]:
    """By how much a unit of each initial condition moves the state of a loop of :func:`plant_loop`."""
    P, T = realize(plant_block(plant)), controller.feedback
    sizes = [len(part.b) for part in (P, controller.forward, T, controller.theta)]
    at_P = len(loop.x0) - sum(sizes)  # what is generated comes first
    at_T = at_P + sizes[0] + sizes[1]

    def placed(first: int, state: np.ndarray) -> np.ndarray:
        full = np.zeros(len(loop.x0))
        full[first : first + len(state)] = state
        return full

    held, turning = (np.linalg.solve(s * np.eye(len(T.b)) - T.A, T.b + 0j) for s in (0.0, 1j * omega))
    of_T = dict(zip(CONTROLLER, (held.real, turning.real, turning.imag), strict=True))
    of_P = {"initial_output": held_state(P), **dict(zip(MODES, mode_states(P, plant), strict=True))}
    return {name: placed(at_P, state) for name, state in of_P.items()} | {
        name: placed(at_T, state) for name, state in of_T.items()
    }


def mode_states(P: StateSpace, plant: PlantModel) -> list[np.ndarray]:
    """Of each pole mode the states (n,) in which it adds Re exp(pole t), and Im exp(pole t), to y."""
    states = []
    poles, vectors = np.linalg.eig(P.A)
    for mode in plant.pole_modes:
        root = mode.omega * complex(-mode.zeta, math.sqrt(1 - mode.zeta**2))
        vector = vectors[:, np.argmin(np.abs(poles - root))]
        vector = vector / (P.C[0] @ vector)
        states += [vector.real, vector.imag]
    return states


CASES = (
    Case("equal limits"),
    Case("unequal limits", ("lower",)),
    Case("controller", CONTROLLER),
    Case("modes", MODES),
    Case("disturbance", DISTURBANCE),
    Case("as printed", loops=as_printed),
    Case("as printed, Pade", loops=as_printed, delay="pade"),
    Case("theta2 without 1/s", loops=without_integrator),
    Case("theta1~(0) = -1", loops=cancelling),
    Case("4.46 s after saturation", from_the_end=True),
)
"""What is searched; "equal limits" is the condition of the usual search."""
