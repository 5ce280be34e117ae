"""How long a run has to last until it has settled."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from design.blocks.block import plant_block
from design.design_file import Design
from experiments.engine.simulate import Run, simulate
from experiments.runs.compare_anti_windups import NAMES, SETTLED, loops, run_all
from experiments.runs.compare_anti_windups import span as loop_span
from experiments.runs.references import Reference, SampledReference
from experiments.runs.region import longest_run
from experiments.runs.steady_control import steady_constant
from identification.model.plant import PlantModel

PERIODS, MOST_PERIODS = 5, 200
REST = 1e-8  # of a mode is left once a loop counts as settled, or 1e-4 of several with one rate
TIMES = 64  # the loop's own span, or its usual periods: no more is waited for the plant, or for the limits
SAMPLES = 100  # a span
LEFT = 0.01  # of the plant's slowest mode, after the span of a constant


def span(design: Design, reference: Reference | SampledReference) -> float:
    """What counts as a period, in seconds.

    It is the period of the slowest sinusoid, and a fifth of the time of samples. Of a constant or a ramp it is the time
    in which the loop recovers twice and the plant's slowest stable mode falls to 1 %, which the anti-windup may leave
    in the output; the latter counts up to 64 times the former.
    """
    if isinstance(reference, SampledReference):
        if reference.time_s[-1] > 0:
            return float(reference.time_s[-1]) / PERIODS
        reference = Reference((0.0,), (0.0,), (math.pi / 2,), float(reference.values[-1]))
    own = loop_span(design, reference)
    if math.isfinite(reference.period_s):
        return own
    slowest = min((-pole.real for pole in plant_block(design.loop_plant).poles if pole.real < 0), default=math.inf)
    return min(max(own, math.log(1 / LEFT) / slowest), TIMES * own)


def scale(reference: Reference | SampledReference, span_s: float) -> float:
    """What bands are a share of: the reference's amplitude; where that is 0, its size and how far a ramp goes."""
    if reference.amplitude:
        return reference.amplitude
    if isinstance(reference, SampledReference):
        return float(np.abs(reference.values).max())
    return abs(reference.offset) + abs(reference.slope) * span_s


def required(plant: PlantModel, reference: Reference | SampledReference) -> float:
    """The most that the control which follows the reference reaches; of samples, that of their end."""
    if isinstance(reference, SampledReference):
        return abs(steady_constant(plant, float(reference.values[-1]), 0.0))
    return reference.required(plant).value


def settled_periods(
    design: Design,
    reference: Reference | SampledReference,
    limits: tuple[float, float],
    rate_limit: float = math.inf,
    names: Sequence[str] = ("none", NAMES[-1]),
) -> tuple[int, frozenset[str]]:
    """How many of :func:`span` runs from rest have to last, and which of them have not settled then.

    Parameters
    ----------
    design, reference, limits, rate_limit, names
        Of the runs, see :func:`experiments.runs.compare_anti_windups.run_all`; the limits are (lower, upper).

    Returns
    -------
    int, frozenset
        Samples last as long as they do. Else it is five, or as many as the loop takes to settle and one more; where the
        limits hold the control that follows the reference, it is doubled, up to 64 times, until every run has settled.
        One has where all through its last span it is within 1 % of :func:`scale` of the loop without limits; or where
        it cycles: its error moves by more, and its extremes are those of the span that ends half way.
    """
    if isinstance(reference, SampledReference) and reference.time_s[-1] > 0:
        return PERIODS, frozenset()
    span_s = span(design, reference)
    usual = count = _usual(design, reference, span_s)
    if not _suffice(design, reference, limits):
        return usual, frozenset()
    every, band = loops(design, reference, names), SETTLED * scale(reference, span_s)
    longest = longest_run(design.loop_plant)
    while True:
        until = min(count * span_s, longest)
        time_s = np.linspace(0.0, until, count * SAMPLES + 1)
        free = simulate(next(iter(every.values())), (-math.inf, math.inf), time_s)
        runs = run_all(every, limits, time_s, rate_limit)
        left = frozenset(name for name, run in runs.items() if not _has_settled(run, free, span_s, band))
        if not left or 2 * count > max(TIMES * PERIODS, usual) or 2 * count * span_s > longest:
            return count, left
        count *= 2


def campaign_periods(
    design: Design, reference: Reference, limits: tuple[float, float], rate_limit: float = math.inf
) -> int:
    """For plants beside the model: :func:`settled_periods`, and a half more where the limits make these longer."""
    count, _ = settled_periods(design, reference, limits, rate_limit)
    return count if count == _usual(design, reference, span(design, reference)) else math.ceil(1.5 * count)


def _usual(design: Design, reference: Reference | SampledReference, span_s: float) -> int:
    """Five, or as many as the loop takes to settle, in its own spans, and one of these more."""
    if isinstance(reference, SampledReference):
        return PERIODS
    own = loop_span(design, reference)
    poles = design.blocks["T_so"].poles if design.hinf is None else ()
    slowest = min((-pole.real for pole in poles), default=math.inf) if design.hinf is None else design.hinf.decay_rate
    periods = min(max(PERIODS, math.ceil(math.log(1 / REST) / slowest / own) + 1), MOST_PERIODS)
    return min(max(PERIODS, math.ceil(periods * own / span_s)), MOST_PERIODS)


def _suffice(design: Design, reference: Reference | SampledReference, limits: tuple[float, float]) -> bool:
    low, high = limits
    if isinstance(reference, SampledReference):
        return low < steady_constant(design.loop_plant, float(reference.values[-1]), 0.0) < high
    if math.isinf(high - low):
        return reference.required(design.loop_plant).value < min(-low, high)
    return reference.required(design.loop_plant, (low + high) / 2).value < (high - low) / 2


def _has_settled(run: Run, free: Run, span_s: float, band: float) -> bool:
    """Whether it is with the loop without limits, or in a cycle; one that diverges has nothing to settle."""
    error, time_s = run.outputs["error"], run.time_s
    last = time_s >= time_s[-1] - span_s
    if not np.isfinite(error[-1]) or np.abs(error - free.outputs["error"])[last].max() <= band:
        return True
    half = time_s[-1] / 2
    before = error[(time_s <= half) & (time_s >= half - span_s)]
    high, low = error[last].max(), error[last].min()
    is_same = max(abs(high - before.max()), abs(low - before.min())) <= band
    return bool(is_same and high - low > band)  # what hardly moves, far away, is still on its way
