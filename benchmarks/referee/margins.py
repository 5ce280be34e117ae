"""Margins by winding numbers: the factors, rotations and true dead times for which a loop is stable, holes included."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np

from benchmarks.referee.cases import Case, Finding
from benchmarks.referee.factors import Loop, Real, loop_of, of_bound
from benchmarks.referee.peaks import supremum
from benchmarks.referee.winding import OnTheLine, around, characteristic, trail
from design.stability.margins import Margins, delay_loop, margins_of
from identification.base.errors import InputError
from identification.model.plant import PlantModel

GAINS = 1e3  # the largest factor that the project looks for
EDGE = 1e-7  # relative: the bisections here end there, those of the project are finer
PEAK = 1e-6  # relative: to this the project bounds what a peak may miss beyond the frequencies it looks at
ENDS = 12  # of a list of intervals, evenly among them, of which both sides are counted
NEAR = 1e-6  # relative distance from an end at which both sides are counted
POINTS = 32  # of a search; a hole narrower than their distance that the project does not report is not seen

Stable = Callable[[float], bool]


def check(case: Case) -> list[Finding]:
    """Margins of a design's own loop; of a delay-free design also of its loop with the dead time."""
    design = case.design
    plants: list[PlantModel | None] = [None]
    if design.kind == "delay-free" and design.plant.delay_s:
        plants.append(design.plant)
    findings = []
    for plant in plants:
        loop = loop_of(design, plant)
        unstable = characteristic(loop).count()
        try:
            found = margins_of(delay_loop(design, plant or design.loop_plant), design.additive_bound)
        except InputError:
            if not unstable:
                raise
            findings.append(Finding("unstable loop refused", 0.0, 0.5))
            continue
        findings.append(Finding("unstable roots", float(unstable), 0.5))
        findings += _compare(case, loop, found)
    return findings


def _compare(case: Case, loop: Loop, found: Margins) -> list[Finding]:
    gains = np.geomspace(1 / GAINS, GAINS, 2 * POINTS + 1)

    @cache
    def with_gain(gain: float) -> bool:
        return not characteristic(loop, gain).count()

    @cache
    def turned(degrees: float) -> bool:
        return not characteristic(loop, np.exp(-1j * np.radians(degrees))).count()

    down, up = _interval(with_gain, gains, 1.0)
    findings = [
        Finding("gain down", _apart(found.gain_down.value, 0.0 if down == gains[0] else down), EDGE),
        Finding("gain up", _apart(found.gain_up.value, math.inf if up == gains[-1] else up), EDGE),
    ]
    degrees = np.linspace(0.0, 180.0, POINTS + 1)
    _, phase = _interval(turned, degrees, 0.0)
    phase = math.inf if phase == 180.0 else phase
    findings.append(Finding("phase margin", _apart(found.phase_deg.value, phase), EDGE))
    findings += _holes("gain factors", found.gains, with_gain, gains)
    findings += _holes("phases", found.phases_deg, turned, degrees[1:-1])
    findings += _delays(case, loop, found)

    omega = trail(loop)
    W_a = of_bound(case.model.additive_bound)
    wide = np.union1d(omega, around(W_a.zeros + W_a.poles, 1.0))
    peaks = {
        "modulus margin": (1 / found.modulus.value, lambda at: np.abs(loop.responses(at)[0]), omega),
        "||T||": (found.T_peak.value, lambda at: np.abs(loop.responses(at)[1]), omega),
        "||W_a C S||": (found.W_a_C_S.value, lambda at: np.abs(loop.responses(at)[2] * W_a(1j * at)), wide),
    }
    return findings + [
        Finding(name, abs(value / supremum(function, points)[0] - 1), PEAK)
        for name, (value, function, points) in peaks.items()
    ]


def _delays(case: Case, loop: Loop, found: Margins) -> list[Finding]:
    """The true dead times around the loop's own, and points of our own between the ends that the project gives."""
    own = loop.true_delay_s
    ends = [found.delay_least_s.value, found.delay_greatest_s.value]
    most = 3 * ends[1] if math.isfinite(ends[1]) else 100 / case.slow
    random = case.random(11)
    tried = np.unique(np.concatenate([np.linspace(0.0, most, 2 * POINTS), random.uniform(0.0, own, POINTS), [own]]))

    @cache
    def late(delay_s: float) -> bool:
        return not characteristic(loop, 1.0, delay_s).count()

    low, high = _interval(late, tried, own)
    scale = max(high, own)
    return [
        *_holes("true dead times", found.delays_s, late, tried[1:]),
        Finding("least dead time", abs(ends[0] - low) / scale, EDGE),
        Finding("greatest dead time", _apart(ends[1], math.inf if high == tried[-1] else high), EDGE),
    ]


def _holes(name: str, intervals: Any, stable: Stable, points: Real) -> list[Finding]:
    """At how many points the reported intervals say the wrong thing: ours, and close to both sides of every end."""
    if not intervals:
        return []
    ends = np.array([end.value for interval in intervals for end in (interval.least, interval.greatest)])
    ends = ends[np.isfinite(ends) & (ends > points[0]) & (ends < points[-1])]
    looked_at = ends[:: 1 + len(ends) // ENDS]
    wrong = 0
    for point in np.unique(np.concatenate([points, *(looked_at * (1 + side * NEAR) for side in (-1, 1))])):
        if np.any(np.abs(ends - point) < NEAR / 2 * point):  # of two ends next to each other
            continue
        said = any(interval.least.value <= point <= interval.greatest.value for interval in intervals)
        wrong += said != _holds(stable, float(point))
    return [Finding(f"{name}: points that are said wrong", float(wrong), 0.5)]


def _interval(stable: Stable, points: Real, own: float) -> tuple[float, float]:
    """The ends of the interval around ``own`` in which the loop is stable, by bisection between the points."""
    at = int(np.argmin(np.abs(points - own)))
    ends = []
    for steps in (range(at, -1, -1), range(at, len(points))):
        inside = points[at]
        for k in steps:
            if not _holds(stable, float(points[k])):
                outside = points[k]
                while abs(outside - inside) > 1e-10 * max(abs(outside), abs(inside)):
                    middle = (inside + outside) / 2
                    if _holds(stable, float(middle)):
                        inside = middle
                    else:
                        outside = middle
                break
            inside = points[k]
        ends.append(float(inside))
    return ends[0], ends[1]


def _holds(stable: Stable, at: float) -> bool:
    """Whether the loop is stable; where a root lies on the axis as far as can be seen, it is not."""
    try:
        return stable(at)
    except OnTheLine:
        return False


def _apart(first: float, second: float) -> float:
    """The relative difference of two numbers, one of which may have no finite value: then the other must not either."""
    if first == second:
        return 0.0
    if not (math.isfinite(first) and math.isfinite(second)) or min(first, second) <= 0:
        return math.inf
    return abs(math.log(first / second))
