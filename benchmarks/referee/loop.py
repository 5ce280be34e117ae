"""Saturated runs: u and y of the project beside a Runge-Kutta integration that knows its own error."""

from __future__ import annotations

import math
import tempfile
from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.referee.cases import Case, Finding
from benchmarks.referee.factors import Factors, Loop, Real, loop_of, of_block
from benchmarks.referee.realised import realised
from benchmarks.referee.runge_kutta import run
from design.anti_windup.compensator import AntiWindup
from experiments.engine.simulate import simulate
from experiments.runs.design_loop import design_loop
from experiments.runs.reference_file import read_reference
from experiments.runs.references import Reference, SampledReference
from identification.base.errors import InputError
from identification.model.plant import PlantModel

MOST_STEPS = 25_000  # of the coarsest of the three runs
FINENESS = 0.08  # of its step times the fastest eigenvalue
CLAIMED = 1e-9  # of the largest value so far; docs/explanation/closed_loop.md claims better
SAFETY = 16.0  # times the finest run's error as the others show it at order 2: many kinks may cancel in them
HOPELESS = 1e-3  # of the largest value: from where the steps differ by more on, nothing is compared


def check(case: Case) -> list[Finding]:
    """One run of the case from rest: one of the anti-windups, one of the references, the model or another plant."""
    design, random = case.design, case.random(13)
    name = str(random.choice(["none", "thesis", "corrected"], p=[0.3, 0.2, 0.5]))
    kind = None if name == "none" else design.compensator(name)
    plant = another(design.loop_plant, random) if random.random() < 0.3 else None
    reference: Reference | SampledReference = case.reference
    design_loop(design, reference, kind, plant)  # refused before anything is integrated here
    loop = loop_of(design, plant)
    system, delays = _assembled(loop, kind)
    step = _step(system, delays)
    period = (
        2 * math.pi / max(min([omega for omega in design.reference_omegas if omega > 0], default=case.slow), 1e-300)
    )
    steps = int(min(MOST_STEPS, max(1.5 * period, 3 * loop.delay_s) / step))
    if random.random() < 0.3:
        reference = _file(random, case.reference.amplitude or 1.0, steps * step)
    runs = [_run(system, delays, step / parts, steps * parts, reference, case.limit) for parts in (1, 2, 4)]
    at = np.unique(np.concatenate([np.arange(min(12, steps)), np.linspace(0, steps, 200).astype(int)]))
    time_s = at * step
    found = simulate(design_loop(design, reference, kind, plant), (-case.limit, case.limit), time_s)
    findings = []
    for which, (signal, theirs) in enumerate((("u", found.control), ("y", found.outputs["output"]))):
        own = [run[which][::parts][at] for run, parts in zip(runs, (1, 2, 4), strict=True)]
        findings.append(compared(f"{signal} ({name})", own, theirs))
    return findings


def compared(quantity: str, own: Sequence[Real], theirs: Real) -> Finding:
    """The worst of all samples; the allowance is that of its time, or infinite if no sample could be decided.

    ``own`` are the runs with the steps h, h/2 and h/4. The last one's error is of order 4 but for kinks; each leaves
    h^2 times a factor that depends on where in a step it falls, so that one difference of two runs may be small by
    chance.
    """
    coarse, middle, fine = own
    size = np.maximum.accumulate(np.abs(fine))
    error = SAFETY * np.maximum.accumulate(np.maximum(np.abs(fine - coarse) / 16, np.abs(fine - middle) / 4))
    known = np.isfinite(error) & np.isfinite(size)
    largest = float(np.max(size[known], initial=0.0))
    known &= (error <= HOPELESS * size) | (error <= 1e-10 * largest)
    decided = int(np.argmin(known)) if not known.all() else len(known)
    if decided < 2:
        return Finding(quantity, 0.0, math.inf)
    size, largest = size[:decided], float(size[decided - 1])
    allowed = np.maximum(np.maximum(CLAIMED * size, 1e-10 * largest), error[:decided]) + 1e-300
    apart = np.abs(theirs[:decided] - fine[:decided])
    worst = int(np.argmax(apart / allowed))
    scale = size[worst] or largest or 1.0
    return Finding(quantity, float(apart[worst] / scale), float(allowed[worst] / scale))


def another(plant: PlantModel, random: np.random.Generator) -> PlantModel:
    """A true plant with other modes, and where the model has a dead time, another one."""
    moved = {
        name: tuple(replace(mode, omega=mode.omega * random.uniform(0.9, 1.1)) for mode in getattr(plant, name))
        for name in ("zero_modes", "pole_modes")
    }
    delay_s = plant.delay_s * random.uniform(0.6, 1.3)
    return replace(plant, **moved, gain=plant.gain * random.uniform(0.8, 1.2), delay_s=delay_s)  # type: ignore[arg-type]


def _assembled(loop: Loop, kind: AntiWindup | None) -> tuple[dict[str, Any], Real]:
    """The matrices of :mod:`benchmarks.referee.runge_kutta`, and the delays of y, y_d and [T_so v]; 0 is folded in.

    v = forward (r - y - y_d) + [feedback v], u = v - theta1~ u~, y = [P u_m], y_d = [P (1 + theta1~) u~], u~ = u - u_m.
    """
    none = Factors(0.0)
    theta = none if kind is None else of_block(kind.theta1_tilde)
    theta2 = none if kind is None else (loop.model * of_block(kind.one_plus)).reduced()
    parts = [realised(each) for each in (loop.plant, loop.forward, loop.feedback, theta, theta2)]
    ends = np.cumsum([0, *(len(part[1]) for part in parts)])
    n = int(ends[-1])
    places = [slice(int(a), int(b)) for a, b in pairwise(ends)]
    A = np.zeros((n, n))
    for place, part in zip(places, parts, strict=True):
        A[place, place] = part[0]

    def row(k: int) -> Real:
        full = np.zeros(n)
        full[places[k]] = parts[k][2]
        return full

    def drive(k: int) -> Real:
        full = np.zeros(n)
        full[places[k]] = parts[k][1]
        return full

    through = parts[1][3]
    e_w = np.array([-1.0, -1.0, 0.0])
    v_x, v_w, v_r = row(1), through * e_w + np.array([0.0, 0.0, 1.0]), through
    u_x = v_x - row(3)
    drives_tilde = drive(3) + drive(4)
    A += np.outer(drive(2), v_x) + np.outer(drives_tilde, u_x)
    D = np.outer(drive(1), e_w) + np.outer(drive(2), v_w) + np.outer(drives_tilde, v_w)
    R = drive(1) + drive(2) * v_r + drives_tilde * v_r
    B, C, E, F = drive(0) - drives_tilde, u_x, v_w, v_r
    Z = np.stack([row(0), row(4), row(2)])
    delays = np.array([loop.true_delay_s, loop.delay_s, loop.delay_s])
    read = np.append(row(0), 0.0) if delays[0] == 0 else np.append(np.zeros(n), 1.0)
    at_once = delays == 0
    A, C = A + D[:, at_once] @ Z[at_once], C + E[at_once] @ Z[at_once]
    late = ~at_once
    system = {"A": A, "B": B, "D": D[:, late], "R": R, "C": C, "E": E[late], "F": float(F), "Z": Z[late], "read": read}
    return {name: np.ascontiguousarray(m) if name != "F" else m for name, m in system.items()}, delays[late]


def _step(system: dict[str, Any], delays: Real) -> float:
    """A step that resolves the fastest eigenvalue, saturated or not, and divides the controller's dead time."""
    A, B, C = system["A"], system["B"], system["C"]
    fastest = max(float(np.abs(np.linalg.eigvals(matrix)).max()) for matrix in (A, A + np.outer(B, C)))
    step = FINENESS / fastest
    if not len(delays):
        return step
    divided = delays[-1] / math.ceil(delays[-1] / step)
    return float(divided if delays.min() >= divided else delays.min())


def _run(
    system: dict[str, Any], delays: Real, step: float, steps: int, reference: Reference | SampledReference, limit: float
) -> tuple[Real, Real]:
    time_s = np.arange(2 * steps + 1) * (step / 2)
    if isinstance(reference, Reference):
        parts = zip(reference.amplitudes, reference.omegas, reference.phases_rad, strict=True)
        r = reference.offset + reference.slope * time_s + sum(a * np.sin(w * time_s + p) for a, w, p in parts)
    else:
        r = np.interp(time_s, reference.time_s, reference.values)
    names = ("A", "B", "D", "R", "C", "E", "F", "Z")
    u, y = run(*(system[name] for name in names), delays, step, r, -limit, limit, system["read"])
    return u, y


def _file(random: np.random.Generator, size: float, span: float) -> SampledReference:
    """Straight lines between 5 to 30 knots from t = 0 on, through a file as the command line reads it."""
    count = int(random.integers(5, 31))
    time_s = np.concatenate([[0.0], np.sort(random.uniform(0.0, span, count - 1))])
    values = size * random.uniform(-1, 1, count)
    if random.random() < 0.5:
        values[0] = 0.0
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "reference.csv"
        rows = "\n".join(f"{t!r},{v!r}" for t, v in zip(time_s.tolist(), values.tolist(), strict=True))
        path.write_text(f"time_s,reference\n{rows}\n", encoding="utf-8")
        read = read_reference(path)
    if not (np.array_equal(read.time_s, time_s) and np.array_equal(read.values, values)):
        raise InputError("a reference is read from its file with other numbers")
    return read
