"""One plant in other units of time, input and output: every answer must be the same after scaling."""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property
from typing import Any

import numpy as np

from benchmarks.referee.cases import Case, Finding, case_of
from benchmarks.referee.factors import Real
from design.auditing.audit_design import covered_delay
from design.design_file import Design
from design.stability.characteristic_roots import CharacteristicRoots, rightmost_roots
from design.stability.margins import Margins, delay_loop, margins_of, tracking_floor
from experiments.engine.simulate import simulate
from experiments.runs.design_loop import design_loop
from experiments.runs.references import Reference
from identification.base.errors import InputError
from identification.model.additive_bound import AdditiveBound
from identification.model.model_file import IdentifiedModel
from identification.model.modes import Mode
from identification.model.plant import PlantModel

SAME = 1e-6  # relative: every number is said to more digits than this, or to four, and searches end far below
RUN = 1e-8  # of the largest value: 1e-11 of each step's, and what the loop makes of it
TINY = 1e-12  # relative change of the limit, which says how much the loop makes of rounding
SAMPLES = 60
ROOTS = 5
MARGINS = ("gain_down", "gain_up", "phase_deg", "delay_least_s", "delay_greatest_s", "modulus", "T_peak", "W_a_C_S")


class Scaled(Case):
    """The case with time in other units (seconds times ``time``), and the output and input times ``y`` and ``u``."""

    @cached_property
    def units(self) -> tuple[float, float, float]:
        """Time over nine decades either way; the gain over fifteen."""
        random = self.random(17)
        time = float(10 ** random.uniform(-9, 9))
        y, u = (float(10 ** random.uniform(-7.5, 7.5)) for _ in range(2))
        return time, y, u

    @cached_property
    def model(self) -> IdentifiedModel:
        """The model of the case in these units."""
        time, y, u = self.units
        model = case_of(self.seed, self.index).model
        return IdentifiedModel(_plant(model.plant, time, y / u), _bound(model.additive_bound, time, y / u))

    @cached_property
    def options(self) -> dict[str, Any]:
        """The options of the case in these units."""
        time, options = self.units[0], dict(case_of(self.seed, self.index).options)
        powers = {"epsilon": -2, "a": -1, "inverse_epsilon": 1}
        for name, power in powers.items():
            if name in options:
                options[name] *= time**power  # type: ignore[operator]
        if "pairs" in options:
            options["pairs"] = [(e / time, f / time**2) for e, f in options["pairs"]]  # type: ignore[attr-defined]
        options["reference_omegas"] = [w / time for w in options["reference_omegas"]]  # type: ignore[attr-defined]
        return options


def check(case: Case) -> list[Finding]:
    """Design, margins, roots and one run of a case in its own units and in others."""
    other = Scaled(case.seed, case.index)
    designs: list[Design | str] = []
    for each in (case, other):
        try:
            designs.append(each.design)
        except InputError as error:
            designs.append(str(error))
    first, second = designs
    findings = [Finding("designed in both units", float(isinstance(first, str) != isinstance(second, str)), 0.5)]
    if isinstance(first, str) or isinstance(second, str):
        return findings
    time = other.units[0]
    return (
        findings + _audits(first, second, time) + _facts(first, second, time) + _runs(case, first, second, other.units)
    )


def _mode(mode: Mode, time: float) -> Mode:
    return Mode(mode.omega / time, mode.zeta)


def _shape(of: PlantModel | AdditiveBound, time: float) -> dict[str, Any]:
    shape: dict[str, Any] = {
        n: tuple(_mode(mode, time) for mode in getattr(of, n)) for n in ("zero_modes", "pole_modes")
    }
    return shape | {n: tuple(rate / time for rate in getattr(of, n)) for n in ("real_zeros", "real_poles")}


def _plant(plant: PlantModel, time: float, gain: float) -> PlantModel:
    return replace(plant, gain=plant.gain * gain / time, delay_s=plant.delay_s * time, **_shape(plant, time))


def _bound(bound: AdditiveBound, time: float, gain: float) -> AdditiveBound:
    return replace(bound, gain=bound.gain * gain, **_shape(bound, time))


def _apart(first: float, second: float, size: float = 0.0) -> float:
    if first == second or (np.isnan(first) and np.isnan(second)):
        return 0.0
    if not (np.isfinite(first) and np.isfinite(second)):
        return np.inf
    return abs(first - second) / max(abs(first), abs(second), size)


def _answers(design: Design) -> tuple[Margins | None, CharacteristicRoots | None, float, float]:
    """Margins and roots, or None where they are refused; the covered dead time and |W_a/P| at the reference."""
    plant, bound = design.loop_plant, design.additive_bound
    loop, found = delay_loop(design, plant), []
    for compute in (lambda: margins_of(loop, bound), lambda: rightmost_roots(loop, ROOTS)):
        try:
            found.append(compute())
        except InputError:
            found.append(None)
    floor = tracking_floor(plant, bound, design.reference_omegas)
    return found[0], found[1], covered_delay(plant, bound), floor


def _audits(first: Design, second: Design, time: float) -> list[Finding]:
    (margins, roots, covered, floor), (margins_2, roots_2, covered_2, floor_2) = _answers(first), _answers(second)
    findings = [
        Finding("margins in both units", float((margins is None) != (margins_2 is None)), 0.5),
        Finding("roots in both units", float((roots is None) != (roots_2 is None)), 0.5),
        Finding("covered dead time", _apart(covered, covered_2 / time), SAME),
        Finding("|W_a/P|", _apart(floor, floor_2), SAME),
    ]
    if margins is not None and margins_2 is not None:
        for name in MARGINS:
            power = 1 if name.startswith("delay") else 0
            a, b = getattr(margins, name).value, getattr(margins_2, name).value / time**power
            findings.append(Finding(name, _apart(a, b), SAME))
    if roots is not None and roots_2 is not None:
        findings.append(Finding("as many roots", float(len(roots.roots) != len(roots_2.roots)), 0.5))
        if len(roots.roots) == len(roots_2.roots) > 0:
            unsure = max(roots.uncertainty.max(), roots_2.uncertainty.max() * time)
            size = float(np.abs(roots.roots).max())
            nearest = np.abs(np.subtract.outer(roots.roots, roots_2.roots * time)).min(axis=1)
            findings.append(Finding("roots", float(nearest.max()) / size, SAME + 10 * float(unsure) / size))
    return findings


def _facts(first: Design, second: Design, time: float) -> list[Finding]:
    findings = []
    for name in first.anti_windup:
        a, b = (each.anti_windup[name].judgement for each in (first, second))
        scale = first.additive_bound.gain / second.additive_bound.gain  # f has the unit of W_a
        findings.append(Finding(f"f ({name})", _apart(a.f, b.f * scale), SAME))
        sectors = [1 / each.popov_sector if each.popov_sector else 0.0 for each in (a, b)]
        findings.append(Finding(f"sector ({name})", _apart(*sectors, size=1e-3), SAME))
        findings.append(Finding(f"recovery ({name})", _apart(a.recovery_s, b.recovery_s / time), SAME))
    if first.hinf is not None and second.hinf is not None:
        for name in ("gamma", "gamma_lower", "gamma_line", "gamma_line_lower"):
            found = (getattr(hinf, name) for hinf in (first.hinf, second.hinf))
            findings.append(Finding(name, _apart(*found), 3e-4))  # the bisection's 1e-4
    return findings


def _runs(case: Case, first: Design, second: Design, units: tuple[float, float, float]) -> list[Finding]:
    """u and y of one run; the designs may differ a little, so that the first one's blocks are scaled by hand."""
    time, y, u = units
    reference, limit = case.reference, case.limit
    other = Reference(
        tuple(a * y for a in reference.amplitudes),
        second.reference_omegas,
        reference.phases_rad,
        reference.offset * y,
    )
    period = 2 * np.pi / min([omega for omega in first.reference_omegas if omega > 0], default=case.slow)
    at = np.linspace(0, 0.5 * period, SAMPLES)
    loops = design_loop(first, reference, None), design_loop(second, other, None)
    one, near, two = (
        simulate(loop, (-top, top), times)
        for loop, top, times in (
            (loops[0], limit, at), (loops[0], limit * (1 + TINY), at), (loops[1], limit * u, at * time),
        )
    )  # fmt: skip
    pairs: dict[str, tuple[Real, Real, Real]] = {
        "u": (one.control, near.control, two.control / u),
        "y": (one.outputs["output"], near.outputs["output"], two.outputs["output"] / y),
    }
    findings = []
    for name, (a, b, c) in pairs.items():
        size = float(np.abs(a).max()) or 1.0
        allowed = RUN + 1e3 * float(np.abs(a - b).max()) / size
        if first.kind == "delay-free":
            allowed += 1e-2  # two H-infinity controllers, each within 1 % of the optimum
        findings.append(Finding(f"{name} of a run", float(np.abs(a - c).max()) / size, allowed))
    return findings
