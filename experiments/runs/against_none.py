"""Every anti-windup of a design beside none, in one run each: whether it does harm."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from design.blocks.block import fastest_root, plant_block
from design.design_file import Design
from experiments.engine.compiled_loop import FURTHEST as STEP
from experiments.engine.saturated_loop import SaturatedLoop
from experiments.engine.simulate import DivergenceError, Run, limit_pair, simulate
from experiments.runs.design_loop import design_loop
from experiments.runs.references import Reference
from experiments.runs.region import longest_run, require_within_region
from experiments.runs.run_length import span
from experiments.runs.sector_promise import finely
from experiments.runs.simulate_design import SAMPLES
from experiments.runs.words import limits_text
from identification.base.errors import InputError

ROOM = 1.2
"""Limits over what the reference needs, unless limits are given."""
BAND = 0.01  # of the reference's amplitude: nearer to the loop without limits a run has recovered
PERIODS = 10  # of the reference, see run_length.span; fewer where they take more than
STEPS = 1e5  # of the engine, for one run
WORTH = 0.1  # of BAND, and
SAME = 1e-3  # of the other: by so much one run must be worse than another


@dataclass(frozen=True)
class Outcome:
    """What one run did.

    Parameters
    ----------
    recovery_s
        The last time at which y is farther than :data:`BAND` of the amplitude from the run without limits; infinite
        where it still is in the last period, or the run diverges.
    last_error
        The largest distance of y from it in the last period, over the amplitude.
    largest_control
        The largest \\|u\\| over the larger limit, also between the samples.
    """

    recovery_s: float
    last_error: float
    largest_control: float


@dataclass(frozen=True)
class Comparison:
    """Runs of a design from rest under one reference and the same limits.

    Parameters
    ----------
    limits
        (lower, upper), in the actuator's unit.
    conditions
        Where the limits come from and under which reference the loop starts, in words that follow the limits.
    until_s
        Length of the runs in seconds.
    outcomes
        ``none`` first, then every anti-windup of the design.
    """

    limits: tuple[float, float]
    conditions: str
    until_s: float
    outcomes: dict[str, Outcome]

    def is_worse(self, name: str) -> bool:
        """Whether a run recovers later than without anti-windup, or is farther off in the last period."""
        own, none = self.outcomes[name], self.outcomes["none"]
        later = own.recovery_s > none.recovery_s * (1 + SAME)
        return later or own.last_error > none.last_error * (1 + SAME) + WORTH * BAND

    def __str__(self) -> str:
        """A sentence for each anti-windup: those that are worse than none, then the corrected one, then the others.

        Then one for the loop without anti-windup, and one for the conditions. One alone where no run reaches a limit.
        """
        where = f"under the limits {limits_text(*self.limits)}{self.conditions}"
        none = self.outcomes["none"]
        if all(each.largest_control <= 1 for each in self.outcomes.values()):
            return f"no anti-windup acts {where}: |u| reaches {none.largest_control:.3g} times the limit"
        names = [name for name in self.outcomes if name != "none"]
        names.sort(key=lambda name: (not self.is_worse(name), name != "corrected"))
        without = f"without anti-windup the loop {self._did(none)}"
        return "\n".join([*map(self._sentence, names), without, f"compared {where}"])

    def _sentence(self, name: str) -> str:
        own = self.outcomes[name]
        did = f"with {name} the loop {self._did(own)}"
        if self.is_worse(name):
            return f"{name} is WORSE than no anti-windup: {did}"
        if math.isinf(own.recovery_s):
            return f"{name} does not help: {did}"
        return f"{name} is no worse than no anti-windup: {did}"

    def _did(self, outcome: Outcome) -> str:
        """What a run does: recovered is y within BAND of what it is without limits, off how far it is from that."""
        if math.isinf(outcome.last_error):
            return "diverges"
        recovers = f"recovers after {outcome.recovery_s:.3g} s"
        if outcome.recovery_s == 0:
            recovers = "recovers at once"
        if math.isinf(outcome.recovery_s):
            recovers = f"does not recover within {self.until_s:.3g} s"
        off = f"{_percent(outcome.last_error)} off the loop without limits in the last period"
        return f"{recovers}, is {off}, and |u| reaches {outcome.largest_control:.3g} times the limit"


def said_against_none(design: Design) -> str:
    """What each anti-windup of a design does beside none in one run, a line each; or why there is no run."""
    try:
        return str(against_none(design))
    except InputError as error:
        return f"not compared with no anti-windup: {error}"


def against_none(
    design: Design, reference: Reference | None = None, limits: tuple[float, float] | None = None
) -> Comparison:
    """Run a design with none and with each of its anti-windups.

    Parameters
    ----------
    design
        Of either kind.
    reference
        r(t); unless given, sinusoids of amplitude 1 at the frequencies of the design, all at their crests as it begins:
        a start that saturates most loops.
    limits
        (lower, upper); unless given, ROOM times the most that the control of perfect tracking reaches, or half of the
        largest \\|u\\| without limits where that needs none.

    Raises
    ------
    InputError
        The loop cannot be simulated, or one period of the reference takes too many steps.
    """
    plant, omegas = design.loop_plant, design.reference_omegas
    asked, crest = "the reference", ""
    if reference is None:
        asked = "a reference of amplitude 1" + (" at each of its frequencies" if len(omegas) > 1 else "")
        crest = ", which begins at its crest" if any(omegas) else ""
        reference = Reference((1.0,) * len(omegas), omegas, (math.pi / 2,) * len(omegas), 0.0)
    until, period = _length(design, reference)
    times = np.linspace(0.0, until, SAMPLES)
    free = simulate(design_loop(design, reference, None), (-math.inf, math.inf), times)
    conditions = f", from rest under {asked}{crest}"
    if limits is None:
        needed = reference.required(plant).at_most
        steady = 0 < needed < math.inf
        limits = limit_pair(ROOM * needed if steady else float(np.abs(free.control).max()) / 2)
        whose = f"{ROOM:g} times what {asked} takes" if steady else f"half of what the loop asks for under {asked}"
        conditions = f", {whose}, from rest under that reference{crest}"
    require_within_region(plant, reference, limits)
    outcomes = {
        name: _outcome(design_loop(design, reference, name), limits, free, reference, period)
        for name in ("none", *design.anti_windup)
    }
    return Comparison(limits, conditions, until, outcomes)


def _length(design: Design, reference: Reference) -> tuple[float, float]:
    """How long to run, and what is called the last period, in seconds."""
    recovery = design.corrected.judgement.recovery_s
    period = span(design, reference)
    blocks = (plant_block(design.loop_plant), *design.controller_parts(), design.corrected.kind.one_plus)
    most = STEPS * STEP / fastest_root(*blocks)
    until = min(max(PERIODS * period, 3 * recovery), most, longest_run(design.loop_plant))
    if until < period:
        why = "the plant's unstable pole" if until < most else "the loop's fastest root"
        raise InputError(f"the period is {period:.6g} s; expected at most {until:.6g} s, to which {why} limits a run")
    return until, period


def _outcome(
    loop: SaturatedLoop, limits: tuple[float, float], free: Run, reference: Reference, period: float
) -> Outcome:
    times = free.time_s
    try:
        run = simulate(loop, limits, times)
    except DivergenceError:
        return Outcome(math.inf, math.inf, math.inf)
    control = run.control
    if len(run.events_s):
        more = finely(loop, run, reference)
        control = np.append(control, simulate(replace(loop, outputs={}), limits, more).control)
    off = np.abs(run.outputs["output"] - free.outputs["output"]) / reference.amplitude
    beyond = np.flatnonzero(off > BAND)
    end = float(times[beyond[-1]]) if len(beyond) else 0.0
    return Outcome(
        recovery_s=math.inf if end > times[-1] - period else end,
        last_error=float(off[times >= times[-1] - period].max()),
        largest_control=float(np.abs(control).max()) / max(-limits[0], limits[1]),
    )


def _percent(share: float) -> str:
    return f"{100 * share:.3g} %" if share >= 1e-5 else "less than 0.001 %"
