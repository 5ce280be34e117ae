"""The interpolation conditions and identities of a finished design, in sixty digits from the numbers in its file."""

from __future__ import annotations

from typing import Any

import mpmath
import numpy as np

from benchmarks.referee.cases import Case, Finding
from benchmarks.referee.factors import Factors, of_block, of_plant
from design.design_file import Design

DIGITS = 60
FOLLOWED = (
    1e-9  # of the reference: what it may leave as an error for ever; runs are said to be exact to 1e-9 and better
)
SAME = 1e-8  # relative: two blocks that are one function; their roots are found from polynomials in doubles
EXACT = 1e-14  # relative: numbers that are copied, not computed

mp = mpmath.mp


def check(case: Case) -> list[Finding]:
    """All conditions of either kind of design, and of the compensators that it carries."""
    design = case.design
    blocks = {name: of_block(block) for name, block in design.blocks.items()}
    random = case.random(14)
    with mpmath.workdps(DIGITS):
        points = _points(random, case.slow, case.rate)
        kind = _extended if design.kind == "extended" else _delay_free
        return kind(case, blocks, points) + _compensators(design, blocks, points)


def _points(random: np.random.Generator, slow: float, rate: float) -> list[mpmath.mpc]:
    """Twenty points right of the axis over all scales of the design."""
    sizes = np.geomspace(0.3 * slow, 30 * rate, 20)
    angles = random.uniform(-1.2, 1.2, 20)
    return [mp.mpc(complex(size * np.exp(1j * angle))) for size, angle in zip(sizes, angles, strict=True)]


def _apart(first: Any, second: Any, points: list[mpmath.mpc]) -> float:
    """The largest relative difference of two functions."""
    return float(max(abs(first(s) / second(s) - 1) for s in points))


def _extended(case: Case, blocks: dict[str, Factors], points: list[mpmath.mpc]) -> list[Finding]:
    design = case.design
    a, h = mp.mpf(design.free.a), mp.mpf(design.plant.delay_s)
    T_so, C_0, Q, K = (blocks[name] for name in ("T_so", "C0", "Q", "K"))
    P = of_plant(design.plant)

    def T(s: mpmath.mpc) -> Any:
        return T_so(mp.mpc(s)) * mp.exp(-h * s)

    left = [abs(T(mp.mpc(0, omega)) - 1) for omega in design.reference_omegas]
    flat = abs(mp.diff(T, mp.mpc(0), h=mp.mpf(10) ** -25 / a)) * a
    stable = all(pole.real < 0 for name in ("T_so", "Q", "K0", "K") for pole in blocks[name].poles)
    findings = [
        Finding("T(j omega) = 1", float(max(left)), FOLLOWED),
        Finding("T(0) = 1", float(abs(T(mp.mpc(0)) - 1)), FOLLOWED),
        Finding("T'(0) = 0, times 1/a", float(flat), FOLLOWED),
        Finding("T_so, Q, K_0, K stable", float(not stable), 0.5),
        Finding(
            "C_0/s = T_so/(1 - T_so)", _apart(lambda s: C_0(s) / s, lambda s: T_so(s) / (1 - T_so(s)), points), SAME
        ),
        Finding("Q of (4.2)", _apart(Q, lambda s: ((s + a) ** 2 * T_so(s) - a * (s + a)) / s, points), SAME),
    ]
    epsilon = mp.mpf(design.free.inverse_epsilon)
    findings.append(
        Finding("K of (3.29)", _apart(K, lambda s: T_so(s) / (P(s) * (1 + epsilon * s) ** 2), points), SAME)
    )
    if not epsilon:

        def C_s(s: mpmath.mpc) -> Any:
            return C_0(s) / (P(s) * s) / (1 + C_0(s) * (1 - mp.exp(-h * s)) / s)

        # both are quotients by 1 - T, which vanishes twice at s = 0: what rounding leaves there is divided by it
        apart = max(abs(K(s) / (1 - T(s)) / C_s(s) - 1) * min(1, abs(1 - T(s))) for s in points)
        findings.append(Finding("C_aw = C_s", float(apart), SAME))
    return findings


def _delay_free(case: Case, blocks: dict[str, Factors], points: list[mpmath.mpc]) -> list[Finding]:
    design = case.design
    omega, slow = design.reference_omegas[0], float(np.sqrt(design.parameters.epsilon))
    P = of_plant(design.plant)
    Lambda, G_A = blocks["Lambda"], blocks["G_A"]
    missed = max(
        min(abs(root - 1j * of) for root in roots) / of for of in (omega, slow) for roots in (Lambda.zeros, G_A.poles)
    )
    size = mp.fprod([-mp.mpc(pole) for pole in P.poles if pole != 0])

    def A(s: mpmath.mpc) -> Any:
        return mp.fprod([s - mp.mpc(pole) for pole in P.poles]) / size

    off = [abs(1 + blocks["F1"](s) * blocks["F2"](s) - Lambda(s) / A(s)) / (1 + abs(Lambda(s) / A(s))) for s in points]
    theta = blocks["theta1_tilde"]
    G_A_apart = _apart(G_A, lambda s: P(s) * A(s) / Lambda(s), points)
    theta1_apart = _apart(blocks["theta1"], lambda s: theta(s) * Lambda(s) / A(s), points)
    return [
        Finding("Lambda and G_A have the reference's poles", float(missed), EXACT),
        Finding("K strictly proper, as W1 is", float(blocks["K"].excess < 1), 0.5),
        Finding("F1 F2 = Lambda/A - 1", float(max(off)), SAME),
        Finding("G_A = P A/Lambda", G_A_apart, SAME),
        Finding("theta1 = theta1~ (1 + F)", theta1_apart, SAME),
    ]


def _compensators(design: Design, blocks: dict[str, Factors], points: list[mpmath.mpc]) -> list[Finding]:
    P, findings = of_plant(design.plant), []
    for name in ("thesis", "corrected"):
        kind = design.compensator(name)
        theta, one_plus = of_block(kind.theta1_tilde), of_block(kind.one_plus)
        sizes = [abs(one_plus(s) - 1 - theta(s)) / (1 + abs(theta(s))) for s in points]
        findings.append(Finding("1 + theta1~ is 1 plus theta1~", float(max(sizes)), SAME))
        stable = all(pole.real < 0 for pole in (*theta.poles, *one_plus.poles))
        findings.append(Finding("theta1~ stable", float(not stable), 0.5))
        if name == "thesis":
            apart = max(abs(blocks["theta2"](s) / (P(s) * one_plus(s)) - 1) for s in points)
            findings.append(Finding("theta2 = P (1 + theta1~)", float(apart), SAME))
        else:
            findings.append(Finding("corrected: 1 + theta1~(0) = 0", float(abs(one_plus(mp.mpc(0)))), EXACT))
            findings.append(Finding("corrected: theta1~(0) = -1", float(abs(theta(mp.mpc(0)) + 1)), FOLLOWED))
    return findings
