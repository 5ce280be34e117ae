"""The loop of Fig. 2.6 with a computer as its controller and a real actuator: sampled, rounded, late and slow."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import partial

import numpy as np

from design.anti_windup.compensator import AntiWindup
from design.blocks.block import Block, fastest_root, plant_block
from design.blocks.state_space import StateSpace, block_diagonal, realize
from design.chapters_3_4.realisation import realised
from design.design_file import Asked, Design
from experiments.drive.compiled_steps import Actuator, Series, run
from experiments.drive.difference_equations import METHODS as RULES
from experiments.drive.difference_equations import SampledBlock, held, sample_block, sample_memory, split
from experiments.drive.matched_controller import matched_controller
from experiments.engine.simulate import MOST_STEPS, DivergenceError, limit_pair
from experiments.engine.watched import Tick, watched
from experiments.runs.disturbances import UNDISTURBED, Disturbances, Signal
from experiments.runs.references import Reference, SampledReference
from identification.base.errors import InputError
from identification.model.plant import PlantModel

METHODS = ("matched", *RULES)
"""How the controller is discretised."""
FORMS = ("coprime", "thesis")
"""How the controller is realised."""
FAR = 1e15  # times the fastest root, or as many times less: a rate with which numbers are rounding
MOST_LEVELS = 2.0**53  # which are still whole numbers
SPARE = 1e-12  # relative: the quotient of two decimals may come out a rounding below a whole number


@dataclass(frozen=True)
class Drive:
    """The computer and the actuator between the controller's equations and the plant.

    Parameters
    ----------
    rate_hz
        1/T_s, samples a second.
    method
        How the controller is discretised: ``matched``, made again for the plant with a held input, see
        :func:`experiments.drive.matched_controller.matched_controller`, or block by block, ``tustin`` or ``exact``, see
        :func:`experiments.drive.difference_equations.sample_block`.
    limits
        (sigma_1, sigma_2) of the saturation, sigma_1 < sigma_2, either may be infinite; one number is +- that.
    quantum
        Distance of the actuator's levels, whole multiples of it within the limits; 0 is none.
    rate_limit
        The most that the actuator's output changes in a second; inf is no limit.
    input_delay_s
        From the sampling instant to the actuator's answer: computation and transport.
    resolution
        Of the computer's own numbers, in the actuator's unit: v is cut down to a multiple of it, as a shift of a
        fixed-point number does; 0 is none.
    """

    rate_hz: float
    method: str
    limits: tuple[float, float]
    quantum: float = 0.0
    rate_limit: float = math.inf
    input_delay_s: float = 0.0
    resolution: float = 0.0

    def __post_init__(self) -> None:
        low, high = limit_pair(self.limits)
        object.__setattr__(self, "limits", (low, high))
        if not 0 < self.rate_hz < math.inf:
            raise InputError(f"the rate is {self.rate_hz:g} Hz; expected a positive number")
        if self.method not in METHODS:
            raise InputError(f"the method is '{self.method}'; expected {', '.join(METHODS[:-1])} or {METHODS[-1]}")
        if not 0 <= self.quantum < math.inf:
            raise InputError(f"the quantum is {self.quantum:g}; expected 0 for none, or a positive number")
        if not self.rate_limit > 0:
            raise InputError(
                f"the rate limit is {self.rate_limit:g} a second; expected a positive number, inf for no limit"
            )
        if not 0 <= self.input_delay_s < math.inf:
            raise InputError(f"the input delay is {self.input_delay_s:g} s; expected 0 or a positive number")
        if not 0 <= self.resolution < math.inf:
            raise InputError(f"the resolution is {self.resolution:g}; expected 0 or a positive number")
        largest = max((abs(end) for end in self.limits if math.isfinite(end)), default=0.0)
        if self.quantum > 0 and largest / self.quantum > MOST_LEVELS:
            raise InputError(f"the quantum is {self.quantum:g}; expected 0, or no less than the limits over 2^53")
        lowest, highest = self.levels
        if lowest > highest:
            raise InputError(f"no multiple of the quantum {self.quantum:g} lies within {low:g} and {high:g}")

    @property
    def levels(self) -> tuple[float, float]:
        """The lowest and the highest level, in quanta; both infinite without a quantum."""
        if self.quantum == 0:
            return -math.inf, math.inf
        low, high = (end / self.quantum for end in self.limits)
        return float(np.ceil(low - SPARE * abs(low))), float(np.floor(high + SPARE * abs(high)))

    @property
    def actuator(self) -> Actuator:
        """What the compiled steps take of the actuator."""
        low, high = self.limits
        return Actuator(float(low), float(high), float(self.quantum), *self.levels, float(self.rate_limit))


@dataclass(frozen=True, repr=False)
class SampledRun:
    """A run at the sampling instants t_k = k T_s.

    Parameters
    ----------
    time_s, reference, output, error
        t_k, r, y and r - y, shape (s,).
    control
        u, which the computer finds from these samples and holds, before saturation, shape (s,).
    saturated_control
        What the actuator gives out at t_k (just after it, where it jumps): u saturated, rounded, late and slewing.
    measured
        y with the measurement noise, shape (s,); None without noise.
    """

    time_s: np.ndarray
    reference: np.ndarray
    output: np.ndarray
    error: np.ndarray
    control: np.ndarray
    saturated_control: np.ndarray
    measured: np.ndarray | None = None

    def slewed(self, drive: Drive) -> bool:
        """Whether the actuator of the run's drive was ever still on its way when the next command was issued."""
        asked = np.clip(np.append(0.0, self.control), *drive.limits)
        return bool(np.any(np.abs(np.diff(asked)) > drive.rate_limit / drive.rate_hz))

    def __repr__(self) -> str:
        return f"SampledRun({self.time_s.size} samples up to {self.time_s[-1]:.6g} s)"


def instants(rate_hz: float, until_s: float) -> np.ndarray:
    """The sampling instants from 0 to ``until_s``."""
    return np.arange(int(until_s * rate_hz * (1 + SPARE)) + 1) / rate_hz


def simulate_sampled(
    design: Design,
    reference: Reference | SampledReference,
    anti_windup: Asked,
    drive: Drive,
    until_s: float,
    plant: PlantModel | None = None,
    tick: Tick | None = None,
    disturbances: Disturbances = UNDISTURBED,
    form: str = FORMS[0],
) -> SampledRun:
    """Run a design from rest with its controller on a computer.

    Parameters
    ----------
    design, reference, anti_windup, plant
        As :func:`experiments.runs.design_loop.design_loop` takes them; the controller keeps the design's model.
    drive
        The computer and the actuator.
    until_s
        Length of the run in seconds, one sample at least.
    tick
        Called some times a second with the number of samples done since the last call.
    disturbances
        At the plant's input, between the actuator and the plant's dead time, at its output, and noise, all of
        continuous time; the computer's samples hold what the last two are at the sampling instants.
    form
        ``coprime``, the realisation without hidden modes of :mod:`design.chapters_3_4.realisation`, or ``thesis``, K
        and T_so as drawn in Fig. 2.6.

    Raises
    ------
    InputError
        The run is shorter than a sample or has too many steps, or the rate is too low for the controller's equations
        to have one solution.
    DivergenceError
        The loop diverges.

    Notes
    -----
    At t_k the computer samples r and y, noise and all, no filter before it, and solves the equations of
    :func:`experiments.runs.design_loop.design_loop` with each block replaced by its difference equation. It knows the
    limits, but neither the rounding nor the slewing: u_tilde = u - sat(u). By Tustin's rule theta1~ has a direct part
    (and so has theta2 where its dead time is below one sample), so that

        u = u_0 - d (u - sat(u)),   that is   u - sat(u) = (u_0 - sat(u_0))/(1 + d),

    the one solution while 1 + d > 0. The actuator's output goes from where it is toward the latest command in a
    straight line, then stands. The plant's state is carried exactly, by series, from end to end of these lines; its
    dead time and the input delay only say which of its states is sampled.
    """
    samples = until_s * drive.rate_hz
    if not 1 - SPARE <= samples < math.inf:
        raise InputError(
            f"the run lasts {until_s:g} s; expected a finite time of one sample, {1 / drive.rate_hz:g} s, at least"
        )
    series = _series(design.loop_plant if plant is None else plant, drive, until_s, disturbances.input)
    controller = controller_blocks(design, design.chosen(anti_windup), drive, form)
    time_s = instants(drive.rate_hz, until_s)
    r, output, noise = reference(time_s), disturbances.output, disturbances.noise
    seen = r - disturbances.seen(time_s)
    y, u, command, start, reached = watched(
        partial(run, *controller, drive.resolution, series, drive.actuator, 1 / drive.rate_hz, seen), tick
    )
    if reached < len(r):
        raise DivergenceError(float(time_s[reached]))
    y = y + output(time_s) if output else y
    return SampledRun(time_s, r, y, r - y, u, _actuator(drive, command, start), y + noise(time_s) if noise else None)


def _series(plant: PlantModel, drive: Drive, until_s: float, disturbance: Signal | None) -> Series:
    """The plant as the run carries it, its dead time and the drive's in whole samples and a rest."""
    T = 1 / drive.rate_hz
    P = realize(plant_block(plant))
    A, b, c, through = P.A, P.b, P.C[0], float(P.d[0])
    knots, pieces = np.zeros(0), np.zeros((0, 0))
    if disturbance is not None:
        source = disturbance.generator()
        g, n = len(source.start), len(b)
        A, b, c = block_diagonal(A, source.matrix), np.pad(b, (0, g)), np.append(c, through * source.row)
        A[:n, n:] = np.outer(P.b, source.row)
        knots = np.append(0.0, source.resets.times_s)
        pieces = np.vstack([source.start, source.resets.values.reshape(-1, g)])
    norm = float(np.abs(np.column_stack([A, b])).sum(axis=1).max())  # of one second
    steps = until_s * drive.rate_hz * math.ceil(norm * T)
    if steps > MOST_STEPS:
        raise InputError(
            f"the run needs {steps:.3g} steps, set by its rate and the plant's fastest pole; expected at most "
            f"{MOST_STEPS:.3g} (a shorter run)"
        )
    late_s = min(drive.input_delay_s + plant.delay_s, until_s + 2 * T)  # beyond the run is beyond
    whole, rest = split(late_s, T)
    ahead_s = late_s - plant.delay_s  # of the plant's own time, in which commands are not late
    early = max(math.ceil(ahead_s / T - SPARE), 0) if len(knots) else 0
    read = (1 - rest) * T
    parts = [held(StateSpace(A, b, c[None], np.zeros(1)), length_s) for length_s in (read, T - read)]
    ahead, into = (np.array(each) for each in zip(*parts, strict=True))
    return Series(A, b, c, through, norm, whole, read, knots - ahead_s, pieces, early, ahead, into)


def controller_blocks(
    design: Design, anti_windup: AntiWindup | None, drive: Drive, form: str
) -> tuple[SampledBlock, SampledBlock, SampledBlock, float]:
    """What makes v of e, and of v; theta1~, and theta2 behind its dead time; what v takes of itself at once."""
    if form not in FORMS:
        raise InputError(f"the form is '{form}'; expected {' or '.join(FORMS)}")
    fastest = fastest_root(*design.controller_parts(), plant_block(design.loop_plant))
    if fastest and not fastest / FAR <= drive.rate_hz <= fastest * FAR:
        raise InputError(
            f"the rate is {drive.rate_hz:g} Hz, and the loop's fastest root {fastest:.3g} rad/s; expected a rate "
            f"from {fastest / FAR:.3g} to {fastest * FAR:.3g} Hz"
        )
    if drive.method == "matched":
        forward, feedback, theta = matched_controller(design, anti_windup, 1 / drive.rate_hz, form)
    else:
        forward, feedback, theta = _by_rule(design, anti_windup, drive, form)
    around = float(feedback.at_once.sum())
    if not (around < 1 and 1 + theta.d[0] + forward.d[0] * theta.at_once[1] / (1 - around) > 0):
        raise InputError(
            f"at {drive.rate_hz:g} Hz the method {drive.method} gives the controller an algebraic loop without one "
            "solution; expected a higher rate, or another method"
        )
    return forward, feedback, theta, around


def _by_rule(
    design: Design, anti_windup: AntiWindup | None, drive: Drive, form: str
) -> tuple[SampledBlock, SampledBlock, SampledBlock]:
    """The blocks of :func:`controller_blocks`, each discretised by itself."""
    delay_s, T = design.loop_plant.delay_s, 1 / drive.rate_hz
    first, second = design.controller_parts()
    compensator = (Block(0.0), Block(0.0))
    if anti_windup is not None:
        compensator = (anti_windup.theta1_tilde, anti_windup.theta2(design.loop_plant))
    if form == "thesis":
        feedback = sample_block(realize(second), [delay_s], T, drive.method)
    else:
        factors = realised(design)
        first, feedback = factors.forward, sample_memory(factors, T, drive.method)
    forward = sample_block(realize(first), [0.0], T, drive.method)
    return forward, feedback, sample_block(realize(*compensator), [0.0, delay_s], T, drive.method)


def _actuator(drive: Drive, command: np.ndarray, start: np.ndarray) -> np.ndarray:
    """The actuator's output at the sampling instants from the commands (s,) and where it stands as each is issued."""
    whole, rest = split(min(drive.input_delay_s, (len(command) + 2) / drive.rate_hz), 1 / drive.rate_hz)
    late, since = (whole + 1, (1 - rest) / drive.rate_hz) if rest else (whole, 0.0)
    moved = command
    if math.isfinite(drive.rate_limit):
        reach = drive.rate_limit * since
        moved = start + np.clip(command - start, -reach, reach)
    before = np.full(min(late, len(moved)), start[0])
    return np.concatenate([before, moved[: len(moved) - len(before)]])
