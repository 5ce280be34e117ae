"""How far each slider of the page goes, from the design and from the state that the page begins with."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from design.anti_windup.corrected_compensator import SETTLED
from design.design_file import Design
from design.stability.margins import delay_loop, margins_of
from identification.base.errors import InputError
from paper_figures.explore.state import State

FOURFOLD = 4.0  # each way, for what has no natural end
BEYOND = 1.2  # times what the loop tolerates: so that it can be seen to fail
LEAST_GAIN, MOST_GAIN = 1.5, FOURFOLD  # each way, whatever the loop tolerates
MODES = (0.5, 1.5)  # of their frequencies
STEPS = 400  # from one end to the other, or some more


@dataclass(frozen=True)
class Range:
    """One slider.

    Parameters
    ----------
    name, index
        Which number of a state, see :attr:`paper_figures.explore.state.State.numbers`; index None: all of them, as the
        two ends of one slider.
    title
        With the unit.
    low, high, step
        In that unit.
    """

    name: str
    index: int | None
    title: str
    low: float
    high: float
    step: float

    def including(self, state: State) -> Range:
        """The slider that reaches as far as a state too."""
        values = state.numbers[self.name]
        values = values if self.index is None else values[self.index : self.index + 1]
        return replace(self, low=min(self.low, *values), high=max(self.high, *values))


def ranges(design: Design, state: State) -> list[Range]:
    """The sliders for a design, in the order of the page.

    Parameters
    ----------
    design
        The margins of its loop say how far gain and dead time of the true plant have to go.
    state
        What the page begins with: amplitudes, limits, a, frequencies and the recovery reach four times as far, and
        every slider includes it.
    """
    signals = design.signals
    found = [_range("limit", None, f"limits of {signals.input}", *_around_zero(*state.limits))]
    many, unit = len(state.amplitudes) > 1, f" [{signals.output_unit}]" if signals.output_unit else ""
    largest = FOURFOLD * max(map(abs, state.amplitudes)) or 1.0
    for index, omega in enumerate(state.choices.reference_omegas):
        of = f" {index + 1}" if many else ""
        found.append(_range("amplitude", index, f"reference amplitude{of}{unit}", 0.0, largest))
        if omega:
            title = f"reference frequency{of} [rad/s]"
            found.append(_range("phase", index, f"reference phase{of} [rad]", -math.pi, math.pi))
            found.append(_range("reference-omega", index, title, omega / FOURFOLD, omega * FOURFOLD))
    if 0.0 not in state.choices.reference_omegas:  # whose amplitude is a constant already
        found.append(_range("offset", 0, f"reference offset{unit}", -largest, largest))
    for a in state.numbers["a"]:
        found.append(_range("a", 0, "a, pole of the loop [rad/s]", a / FOURFOLD, a * FOURFOLD))
    recovery_s, fastest_s = state.choices.recovery_s, math.log(1 / SETTLED) / design.corrected.bandwidth
    title = "recovery of the anti-windup, at most [s]"
    found.append(_range("recovery", 0, title, max(recovery_s / FOURFOLD, fastest_s), recovery_s * FOURFOLD))
    least, most, late = _tolerated(design)
    found.append(_range("gain", 0, "true plant: gain / model's", least, most))
    if design.plant.zero_modes or design.plant.pole_modes:
        found.append(_range("mode-frequency", 0, "true plant: mode frequencies / model's", *MODES))
    found.append(_range("dead-time", 0, "true plant: dead time [s]", 0.0, late))
    return [each.including(state) for each in found]


def _range(name: str, index: int | None, title: str, low: float, high: float) -> Range:
    return Range(name, index, title, low, high, _rounded_up((high - low) / STEPS) / 2)


def _around_zero(low: float, high: float) -> tuple[float, float]:
    end = _rounded_up(FOURFOLD * max(abs(low), abs(high)))
    return -end, end


def _tolerated(design: Design) -> tuple[float, float, float]:
    """The ends of the true plant's gain, as factors, and of its dead time, in s."""
    own_s = design.loop_plant.delay_s
    try:
        margins = margins_of(delay_loop(design, design.loop_plant), design.additive_bound)
        down, up, late = margins.gain_down.value, margins.gain_up.value, margins.delay_greatest_s.value
    except InputError:
        down, up, late = 1.0, 1.0, math.inf
    least = max(min(down / BEYOND, 1 / LEAST_GAIN), 1 / MOST_GAIN)
    most = min(max(up * BEYOND, LEAST_GAIN), MOST_GAIN)
    ends = [2 * own_s, BEYOND * late if math.isfinite(late) else 0.0]
    return least, most, _rounded_up(max(ends) or design.corrected.judgement.recovery_s)


def _rounded_up(value: float) -> float:
    """The least of 1, 2 and 5 times a power of ten that is not below a positive number."""
    power = 10.0 ** math.floor(math.log10(value))
    return next(power * digit for digit in (1, 2, 5, 10) if power * digit >= value * (1 - 1e-12))
