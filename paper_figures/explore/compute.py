"""What the page draws of a state, each part computed again only where its own numbers have changed."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from design.anti_windup.corrected_compensator import RATES, SETTLED
from design.chapter_2.design_delay_free import design_delay_free
from design.chapters_3_4.chosen_poles import pairs_of
from design.chapters_3_4.design_extended import design_extended
from design.choices import SECTOR, WEAKER
from design.design_file import Design
from design.parameters import DelayFreeParameters
from design.stability.characteristic_roots import roots_right_of
from design.stability.margins import Margins, delay_loop, margins_of
from experiments.engine.simulate import Run
from experiments.runs.against_none import said_against_none
from experiments.runs.compare_anti_windups import run_all, span
from experiments.runs.design_loop import design_loop
from experiments.runs.guarantee import guarantee
from experiments.runs.references import Reference
from experiments.runs.region import longest_run, require_within_region
from experiments.runs.sector_promise import judge_run
from experiments.runs.simulate_design import PERIODS
from identification.base.arrays import Real
from identification.base.errors import InputError
from identification.model.model_file import IdentifiedModel
from identification.model.modes import Mode
from identification.model.plant import PlantModel
from paper_figures.explore.nyquist import Nyquist, nyquist_of
from paper_figures.explore.state import Choices, State, TruePlant
from paper_figures.look.fast_swings import merged

KEPT = 32  # designs and linear loops that are remembered
SAMPLES = 2001  # of a run
STEP_SAMPLES = 1001
STEP_LENGTH = 4  # times what the loop's own transients take to fall to 1 %
STEP = Reference((0.0,), (0.0,), (0.0,), 1.0)


@dataclass(frozen=True, eq=False)
class Linear:
    """The loop without limits.

    Parameters
    ----------
    nyquist
        Its curves and discs.
    time_s, model, true
        The answers to a unit step of the reference, shape (n,), the time in seconds; NaN from where one diverges.
    unstable
        Characteristic roots of the true loop in the right half plane.
    """

    nyquist: Nyquist
    time_s: Real
    model: Real
    true: Real
    unstable: int


@dataclass(frozen=True)
class Judged:
    """What takes longer than a run.

    Parameters
    ----------
    model, true
        The margins of the loop with either plant, or the sentence that says why there are none.
    promised
        What the anti-windup guarantees of the run.
    """

    model: Margins | str
    true: Margins | str
    promised: str


class Explorer:
    """Computes what states ask for, and remembers what they share.

    Parameters
    ----------
    design
        As the file has it.
    start
        Its own state, see :func:`paper_figures.explore.state.start_of`: with the choices of it the design is that of
        the file.
    """

    def __init__(self, design: Design, start: State) -> None:
        self.file, self.start = design, start
        self.designed = lru_cache(KEPT)(self._designed)
        self.linear = lru_cache(KEPT)(self._linear)
        self.run = lru_cache(KEPT)(self._run)
        self._margins = lru_cache(KEPT)(self._margins_of)
        self._step = lru_cache(KEPT)(self._step_of)

    def _designed(self, choices: Choices) -> Design:
        """The design of the choices, for the rest that of the file; raises InputError as designs do."""
        file, own = self.file, self.file.corrected
        if choices == self.start.choices:
            return file
        model = IdentifiedModel(file.plant, file.additive_bound, signals=file.signals)
        same = choices.recovery_s == self.start.choices.recovery_s and self._recovers_as_the_loop()
        recovery_s = None if same else choices.recovery_s
        sector = own.sector if choices.guarantee == own.guarantee and own.sector not in (SECTOR, *WEAKER) else None
        parameters = file.parameters
        if isinstance(parameters, DelayFreeParameters):
            found = design_delay_free(
                model,
                choices.reference_omegas,
                parameters.epsilon,
                recovery_s,
                sector,
                own.bandwidth,
                choices.guarantee,
            )
        else:
            sinusoids = tuple(omega for omega in file.reference_omegas if omega)
            chosen = sorted(parameters.pairs) == sorted(pairs_of(parameters.a, sinusoids))
            found = design_extended(
                model,
                choices.reference_omegas,
                choices.a,
                None if chosen else parameters.pairs,
                parameters.method,
                parameters.inverse_epsilon,
                parameters.roll_off.level if parameters.roll_off else None,
                recovery_s,
                sector,
                own.bandwidth,
                choices.guarantee,
            )
        return replace(found, added=file.added)

    def _recovers_as_the_loop(self) -> bool:
        """Whether the recovery of the file is that of its loop, to the lattice of the poles; else it was given."""
        share = self.file.corrected.judgement.recovery_s / _settled_s(self.file)
        return 10 ** (-1.01 / RATES) < share < 10 ** (0.01 / RATES)

    def true_plant(self, true: TruePlant) -> PlantModel:
        """The plant that the loop of a run has."""
        model = self.file.loop_plant

        def moved(modes: tuple[Mode, ...]) -> tuple[Mode, ...]:
            return tuple(replace(mode, omega=mode.omega * true.mode_frequency) for mode in modes)

        return replace(
            model,
            gain=model.gain * true.gain,
            zero_modes=moved(model.zero_modes),
            pole_modes=moved(model.pole_modes),
            delay_s=true.delay_s,
        )

    def _linear(self, choices: Choices, true: TruePlant) -> Linear:
        design, plant = self.designed(choices), self.true_plant(true)
        loop = delay_loop(design, plant)
        model, moved = self._step(choices, self.start.true), self._step(choices, true)
        nyquist, unstable = nyquist_of(design, loop), roots_right_of(loop, 0.0)
        return Linear(nyquist, model.time_s, model.outputs["output"], moved.outputs["output"], unstable)

    def _step_of(self, choices: Choices, true: TruePlant) -> Run:
        design = self.designed(choices)
        loop = design_loop(design, STEP, "corrected", self.true_plant(true))
        time_s = np.linspace(0.0, STEP_LENGTH * _settled_s(design), STEP_SAMPLES)
        return run_all({"step": loop}, (-math.inf, math.inf), time_s)["step"]

    def _run(self, state: State) -> Run:
        """The saturated run from rest; NaN from where it diverges. Raises InputError as a simulation does."""
        design, plant, reference = self.designed(state.choices), self.true_plant(state.true), state.reference
        until_s = min(PERIODS * span(design, reference), longest_run(plant))
        require_within_region(plant, reference, state.limits)
        loop = design_loop(design, reference, "corrected", plant)
        return run_all({"run": loop}, state.limits, np.linspace(0.0, until_s, SAMPLES))["run"]

    def judged(self, state: State) -> Judged:
        """What the audit says of a state, and the guarantee of its run."""
        design, plant, run = self.designed(state.choices), self.true_plant(state.true), self.run(state)
        promised = "No guarantee: the run diverges"
        if np.isfinite(run.control[-1]):
            loop = design_loop(design, state.reference, "corrected", plant)
            given = guarantee(design, "corrected", plant)
            promised = str(judge_run(given, loop, state.limits, run, state.reference, plant))
        model = self._margins(state.choices, self.start.true)
        return Judged(model, self._margins(state.choices, state.true), promised)

    def saved(self, choices: Choices) -> str:
        """The text of design.json for the choices, with what each anti-windup does beside none in one run."""
        design = self.designed(choices)
        if design is self.file:
            return design.to_json()
        return replace(design, compared=tuple(said_against_none(design).splitlines())).to_json()

    def _margins_of(self, choices: Choices, true: TruePlant) -> Margins | str:
        design = self.designed(choices)
        try:
            return margins_of(delay_loop(design, self.true_plant(true)), design.additive_bound)
        except InputError as error:
            return str(error)


def saturated(run: Run) -> Real:
    """Beginning and end of each time in which the control is beyond a limit, in seconds, shape (k, 2).

    Times that lie closer than two samples are one.
    """
    edges = np.concatenate([[run.time_s[0]], run.events_s, [run.time_s[-1]]])
    first = run.control[0] != run.saturated_control[0]
    out = np.concatenate([[first], run.modes != 0])
    times = np.stack([edges[:-1][out], edges[1:][out]], axis=1)
    return merged(times, 2 * (run.time_s[1] - run.time_s[0]))


def _settled_s(design: Design) -> float:
    """The time in seconds in which the design's own transients fall to 1 %."""
    parameters = design.parameters
    if isinstance(parameters, DelayFreeParameters):
        assert design.hinf is not None
        return math.log(1 / SETTLED) / (2 * design.hinf.decay_rate)
    return math.log(1 / SETTLED) / parameters.pace
