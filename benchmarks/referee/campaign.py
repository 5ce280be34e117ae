"""Plants drawn within W_a: how far they are from the model at most, and whether their linear loops are stable."""

from __future__ import annotations

import numpy as np

from benchmarks.referee.cases import Case, Finding
from benchmarks.referee.factors import Real, loop_of, of_bound, of_plant
from benchmarks.referee.peaks import supremum
from benchmarks.referee.winding import OnTheLine, around, characteristic
from experiments.campaign.draw_plants import PlantsWithin
from experiments.campaign.linear_stability import PerturbedLoop
from identification.base.errors import InputError
from identification.model.additive_bound import AdditiveBound
from identification.model.plant import PlantModel

PLANTS = 4
WITHIN = 1e-6  # |P_true - P|/|W_a| is said to be at most 1: what rounding and our own refinement leave


def check(case: Case) -> list[Finding]:
    """A few plants of one case."""
    design = case.design
    model, bound = design.loop_plant, design.additive_bound
    plants = PlantsWithin(model, bound)
    try:
        judge: PerturbedLoop | None = PerturbedLoop(design)
    except InputError:  # its own loop is not stable, which "margins" compares
        judge = None
    findings = []
    for index in range(PLANTS):
        true = plants.draw(case.seed, PLANTS * case.index + index)
        most = farthest(true.plant, model, bound)
        findings.append(Finding("|P_true - P|/|W_a| beyond 1", max(0.0, most - 1), WITHIN))
        findings.append(Finding("distance said too small", max(0.0, most - true.distance), 0.01))
        if judge is None:
            continue
        try:
            own = characteristic(loop_of(design, true.plant)).count()
        except OnTheLine:
            continue
        findings.append(Finding("unstable roots", float(abs(judge.unstable_roots(true.plant) - own)), 0.5))
    return findings


def farthest(true: PlantModel, model: PlantModel, bound: AdditiveBound) -> float:
    """The largest |P_true - P|/|W_a| over all frequencies."""
    P_true, P, W_a = of_plant(true), of_plant(model), of_bound(bound)
    later = true.delay_s - model.delay_s

    def share(at: Real) -> Real:
        s = 1j * at
        # to common factors: near s = 0 the two integrators cancel
        return np.asarray(np.abs(P(s)) * np.abs(P_true(s) / P(s) * np.exp(-later * s) - 1) / np.abs(W_a(s)))

    roots = tuple(root for of in (P_true, P, W_a) for root in of.zeros + of.poles)
    omega = around(roots, 1.0)
    omega = omega[omega >= 1e-3 * min(abs(root) for root in roots if root != 0)]  # below, rounding over omega
    if later:
        omega = np.union1d(omega, np.arange(1, 4001) * 0.05 / abs(later))
    most, _ = supremum(share, omega)
    if later and P.excess == W_a.excess:  # as omega grows the two may be opposite
        most = max(most, (abs(P_true.gain) + abs(P.gain)) / abs(W_a.gain))
    return most
