"""Every anti-windup of a design beside none, in one run each: whether it does harm."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from design.design_file import Design
from experiments.engine.simulate import DivergenceError, limit_pair
from experiments.runs.references import Reference
from experiments.runs.simulate_design import SAMPLES, simulate_design

ROOM = 1.2
"""Limits over what the reference needs, unless limits are given."""
BAND = 0.01  # of the reference's amplitude: nearer to the loop without limits a run has recovered
PERIODS = 10  # of the slowest sinusoid, or recovery times of a constant
SAME = 1e-3  # by which one run must be worse than another, of it


@dataclass(frozen=True)
class Outcome:
    """What one run did.

    Parameters
    ----------
    recovery_s
        The last time at which y is farther than :data:`BAND` of the amplitude from the run without limits; infinite
        where it still is at the end, or the run diverges.
    last_error
        The largest distance of y from it in the last period, over the amplitude.
    largest_control
        The largest \\|u\\| over the larger limit.
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
    outcomes
        ``none`` first, then every anti-windup of the design.
    """

    limits: tuple[float, float]
    outcomes: dict[str, Outcome]

    def is_worse(self, name: str) -> bool:
        """Whether a run recovers later than without anti-windup, or is farther off in the last period."""
        own, none = self.outcomes[name], self.outcomes["none"]
        later = own.recovery_s > none.recovery_s * (1 + SAME)
        return later or own.last_error > none.last_error * (1 + SAME) + BAND * SAME

    def __str__(self) -> str:
        """A sentence for each anti-windup, those that are worse than none first."""
        names = sorted((name for name in self.outcomes if name != "none"), key=lambda name: not self.is_worse(name))
        return "\n".join(self._sentence(name) for name in names)

    def _sentence(self, name: str) -> str:
        own, none = self.outcomes[name], self.outcomes["none"]
        times = [_seconds(each.recovery_s) for each in (own, none)]
        errors = [_percent(each.last_error) for each in (own, none)]
        low, high = self.limits
        limits = f"+-{high:.4g}" if low == -high else f"{low:.4g} to {high:.4g}"
        worse = "WORSE" if self.is_worse(name) else "no worse"
        return (
            f"{name} is {worse} than no anti-windup under the limits {limits}: it recovers {times[0]} "
            f"(none {times[1]}), "
            f"is {errors[0]} off in the last period (none {errors[1]}), "
            f"and |u| reaches {own.largest_control:.3g} times the limit (none {none.largest_control:.3g})"
        )


def against_none(
    design: Design, reference: Reference | None = None, limits: tuple[float, float] | None = None
) -> Comparison:
    """Run a design with none and with each of its anti-windups.

    Parameters
    ----------
    design
        Of either kind.
    reference
        r(t); unless given, sinusoids of amplitude 1 at the frequencies of the design.
    limits
        (lower, upper); unless given, ROOM times the most that the control of perfect tracking reaches, or half of the
        largest \\|u\\| without limits where that needs none.

    Raises
    ------
    InputError
        The loop without limits cannot be simulated.
    """
    if reference is None:
        omegas = design.reference_omegas
        reference = Reference((1.0,) * len(omegas), omegas, tuple(0.0 if w else math.pi / 2 for w in omegas), 0.0)
    recovery = design.corrected.judgement.recovery_s
    period = reference.period_s if math.isfinite(reference.period_s) else recovery
    until = max(PERIODS * period, 3 * recovery)
    free = simulate_design(design, math.inf, reference, None, until_s=until)
    if limits is None:
        needed = reference.required(design.loop_plant).at_most
        limits = limit_pair(ROOM * needed if 0 < needed < math.inf else float(np.abs(free.control).max()) / 2)
    last = free.time_s >= until - period
    outcomes = {}
    for name in ("none", *design.anti_windup):
        try:
            run = simulate_design(design, limits, reference, name, until_s=until, samples=SAMPLES)
        except DivergenceError:
            outcomes[name] = Outcome(math.inf, math.inf, math.inf)
            continue
        off = np.abs(run.outputs["output"] - free.outputs["output"]) / reference.amplitude
        beyond = np.flatnonzero(off > BAND)
        end = float(run.time_s[beyond[-1]]) if len(beyond) else 0.0
        outcomes[name] = Outcome(
            recovery_s=math.inf if end == until else end,
            last_error=float(off[last].max()),
            largest_control=float(np.abs(run.control).max()) / max(-limits[0], limits[1]),
        )
    return Comparison(limits, outcomes)


def _percent(share: float) -> str:
    return f"{100 * share:.3g} %" if share >= 1e-5 else "less than 0.001 %"


def _seconds(time_s: float) -> str:
    if time_s == 0:
        return "at once"
    return f"after {time_s:.3g} s" if math.isfinite(time_s) else "never"
