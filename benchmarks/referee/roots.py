"""Characteristic roots: circles around those reported hold as many, and no other lies right of the last one."""

from __future__ import annotations

from dataclasses import replace

import mpmath
import numpy as np

from benchmarks.referee.cases import Case, Finding
from benchmarks.referee.factors import Complex, Factors, Real, loop_of
from benchmarks.referee.winding import OnTheLine, QuasiPolynomial, characteristic
from design.stability.characteristic_roots import rightmost_roots
from design.stability.margins import delay_loop
from identification.model.plant import PlantModel

NAMED = 5
DIGITS = 60
RADIUS = 4.0  # of a circle around a root, in units of the uncertainty that the project states


def check(case: Case) -> list[Finding]:
    """The five rightmost roots of the design's loop, and of its loop with another true gain and dead time."""
    design, random = case.design, case.random(12)
    plants: list[PlantModel | None] = [None]
    if random.random() < 0.5:
        plant = design.loop_plant
        delay_s = plant.delay_s * random.uniform(0.7, 1.4) if plant.delay_s else 0.01 * random.random() / case.rate
        plants.append(replace(plant, delay_s=delay_s, gain=plant.gain * random.uniform(0.5, 1.5)))
    findings = []
    for plant in plants:
        found = rightmost_roots(delay_loop(design, plant or design.loop_plant), NAMED)
        visible = ~found.hidden
        own = characteristic(loop_of(design, plant))
        findings += compare(own, found.roots[visible], found.uncertainty[visible])
    return findings


def compare(own: QuasiPolynomial, roots: Complex, uncertainty: Real) -> list[Finding]:
    """As many roots in each circle as are reported there, one reported at least, and none right of them unreported."""
    if not len(roots):
        return [Finding("a root is named", 1.0, 0.5)]
    findings, radii = [Finding("a root is named", 0.0, 0.5)], RADIUS * uncertainty + 1e-12 * np.abs(roots)
    with mpmath.workdps(DIGITS):
        for members in _clusters(roots, radii):
            centre = complex(np.mean(roots[members]))
            radius = float(np.max(np.abs(roots[members] - centre) + radii[members]))
            inside = _inside(own, centre, radius)
            findings.append(Finding("roots where they are said to be", float(abs(inside - len(members))), 0.5))
    last = float(np.min(roots.real))
    leftmost = roots.real <= last + 1e-6 * np.abs(roots)
    line = last - float(np.max(3 * radii[leftmost] + 2e-7 * np.abs(roots[leftmost])))
    try:
        missing = own.count(line) - len(roots)
    except OnTheLine:
        return [*findings, Finding("roots right of the last one", 0.0, np.inf)]
    return [*findings, Finding("roots right of the last one", float(abs(missing)), 0.5)]


def _clusters(roots: Complex, radii: Real) -> list[list[int]]:
    """Indices of roots whose circles touch, together."""
    left, found = list(range(len(roots))), []
    while left:
        members, fresh = [left.pop(0)], True
        while fresh:
            fresh = False
            for other in list(left):
                near = any(abs(roots[other] - roots[m]) <= 2 * (radii[other] + radii[m]) for m in members)
                if near:
                    members.append(other)
                    left.remove(other)
                    fresh = True
        found.append(members)
    return found


def _inside(own: QuasiPolynomial, centre: complex, radius: float) -> int:
    """The roots in a circle by the argument principle, in DIGITS digits, the steps halved until none turns far."""
    points = 64
    while True:
        values = [
            value(own, mpmath.mpc(centre) + radius * mpmath.expjpi(mpmath.mpf(2 * k) / points)) for k in range(points)
        ]
        turns = [float(mpmath.arg(values[(k + 1) % points] / values[k])) for k in range(points)]
        if max(np.abs(turns)) < 1.2 or points > 4000:
            return round(sum(turns) / (2 * np.pi))
        points *= 4


def value(own: QuasiPolynomial, s: mpmath.mpc) -> mpmath.mpc:
    """N(s) over its first term's size far out, in mpmath's precision."""
    total = mpmath.mpc(0)
    for gain, zeros, delay in zip(own.gains, own.zeros, own.delays, strict=True):
        total += mpmath.mpf(gain.real) * Factors(1.0, zeros)(s) * mpmath.exp(-mpmath.mpf(delay) * s)
    return total
