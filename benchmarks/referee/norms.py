"""Norms, the H-infinity optimum and Popov's sector of a design, each by its own dense refinement or by Nehari."""

from __future__ import annotations

import math

import numpy as np
from scipy.optimize import linprog

from benchmarks.referee.cases import Case, Finding
from benchmarks.referee.factors import Factors, Loop, Real, of_block, of_bound
from benchmarks.referee.nehari import optimum
from benchmarks.referee.peaks import supremum
from benchmarks.referee.winding import around, characteristic
from design.anti_windup.judge import Compensator
from design.design_file import Design
from design.hinf.mixed_sensitivity import Synthesis

PEAK = 1e-6  # relative: the project's peaks are refined to rounding, ours to better than this
SECTOR = 5e-5  # of 1/k: half a unit of the last of four digits, as the audit prints it
PROVED = 1e-6  # relative: what is said to be proved may be off by rounding alone
NEAR_OPTIMAL = 0.01  # gamma_line is at most 1 % above gamma_line_lower


def check(case: Case) -> list[Finding]:
    """f and the sector of every compensator, and what a delay-free design says of its stabiliser."""
    design = case.design
    findings = [each for of in design.anti_windup.values() for each in _compensator(case, of)]
    return findings + (_stabiliser(design, design.hinf) if design.hinf is not None else [])


def _compensator(case: Case, of: Compensator) -> list[Finding]:
    W_a = of_bound(case.model.additive_bound)
    one_plus, theta = of_block(of.kind.one_plus), of_block(of.kind.theta1_tilde)
    product = W_a * one_plus
    f, _ = supremum(lambda at: np.abs(product(1j * at)), around(product.zeros + product.poles, 1.0))
    sector = of.judgement.popov_sector
    claimed, own = 0.0 if sector is None else 1 / sector, _inverse_sector(theta)
    return [
        Finding("f", abs(of.judgement.f / f - 1), PEAK),
        Finding("Popov sector", abs(claimed - own) / max(own, claimed, 1e-3), SECTOR),
    ]


def _inverse_sector(theta: Factors) -> float:
    """1/k: the least over m >= 0 of the largest -Re (1 + j m omega) theta1~(j omega), by linear programs with cuts."""
    speed = min(abs(pole) for pole in theta.poles)
    omega = np.concatenate([[0.0], around(theta.zeros + theta.poles, 1.0)])
    scale = float(np.abs(theta(1j * omega)).max())

    def lines(at: Real) -> tuple[Real, Real]:
        value = theta(1j * at) / scale
        return value.real, -at * value.imag / speed  # in units of m speed

    cuts = omega
    top = math.inf
    for _ in range(12):
        real, slope = lines(cuts)
        # height t and multiplier m: t - m slope <= real; t <= 0, which omega -> infinity asks for
        rows = np.column_stack([np.ones(len(cuts)), -slope])
        size = np.maximum(1.0, np.abs(slope))
        solved = linprog(
            [-1.0, 0.0], rows / size[:, None], real / size, bounds=[(None, 0.0), (0.0, None)], method="highs"
        )
        t, m = solved.x

        def left(at: Real, m: float = m) -> Real:
            real, slope = lines(at)
            return -(real + m * slope)

        worst, where = supremum(left, omega[1:])
        top = min(top, max(worst, float(left(np.array([0.0]))[0]), 0.0))
        if worst <= -t + 1e-12:
            break
        cuts = np.append(cuts, where * np.array([1 - 1e-9, 1.0, 1 + 1e-9]))
    return top * scale


def _stabiliser(design: Design, hinf: Synthesis) -> list[Finding]:
    """Norms on the axis and on the line, the decay rate, and the lower bounds beside the optimum by Nehari."""
    G, K = of_block(design.blocks["G_A"]), of_block(design.blocks["K"])
    W1, W2 = of_block(hinf.W1), of_block(hinf.W2)
    rate = hinf.decay_rate
    loop = Loop(G, K, Factors(0.0), 0.0, 0.0)
    right = characteristic(loop).count(-rate * (1 - 2e-3))
    findings = [Finding("poles right of -decay_rate", float(right), 0.5)]
    for name, shift in (("gamma", 0.0), ("gamma_line", -rate)):
        parts = [each.moved(shift) for each in (G, K, W1, W2)]
        norm = _norm(*parts)
        reached, lower = (getattr(hinf, f"{name}{end}") for end in ("", "_lower"))
        best = optimum(parts[0], parts[2], parts[3], lower)
        findings += [
            Finding(name, abs(reached / norm - 1), PEAK),
            Finding(f"{name}_lower proved", max(0.0, lower / best - 1), PROVED),
            Finding(f"{name} no less than the optimum", max(0.0, best / norm - 1), PROVED),
        ]
    above = hinf.gamma_line / hinf.gamma_line_lower - 1
    findings.append(Finding("gamma_line over gamma_line_lower", above, NEAR_OPTIMAL))
    return findings


def _norm(G: Factors, K: Factors, W1: Factors, W2: Factors) -> float:
    loop, weighted = Loop(G, K, Factors(0.0), 0.0, 0.0), (W2 * G).reduced()
    points = np.zeros(200_000)
    characteristic(loop).count(0.0, points)
    omega = np.union1d(
        points[points > 0], around(G.poles + K.poles + K.zeros + W1.poles + weighted.zeros + weighted.poles, 1.0)
    )

    def magnitude(at: Real) -> Real:
        with np.errstate(all="ignore"):
            S, _, KS = loop.responses(at)
            return np.nan_to_num(np.hypot(np.abs(W1(1j * at) * S), np.abs(weighted(1j * at) * KS)), nan=0.0)

    return supremum(magnitude, omega)[0]
