"""The mixed sensitivity synthesis against optima known in closed form, in print, or by another method."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest
from nehari import nehari_optimum
from scipy.linalg import eigh, solve_continuous_are

from design.blocks.block import Block, from_polynomial, polynomial
from design.design_file import Design
from design.hinf.mixed_sensitivity import Synthesis, infimum, mixed_sensitivity

Problem = tuple[Block, Block, Block]  # G, W1, W2


def synthesis(G: Block, W1: Block, W2: Block, decay_rate: float) -> Synthesis:
    """What is found, without the controller."""
    return mixed_sensitivity(G, W1, W2, decay_rate)[1]


def brackets(found: Synthesis, known: float, rel: float = 1e-9) -> None:
    """Known lies between what is proved and what is achieved, and these are as near as the synthesis promises."""
    assert found.gamma_lower <= known * (1 + rel)
    assert known <= found.gamma * (1 + rel)
    assert found.gamma <= 1.01 * found.gamma_lower


def test_weights_alone() -> None:
    """G stable and minimum phase: |W1 W2|/sqrt(|W1|^2 + |W2|^2) at omega = 0, where W1 = 10 and W2 = 8."""
    G, W1, W2 = Block(1.0, (), (-1.0, -3.0)), Block(1.0, (), (-0.1,)), Block(0.2, (-5.0, -8.0))
    brackets(synthesis(G, W1, W2, 0.0), 80 / np.hypot(10, 8))


# constant weights: the circle |T - T0| <= R is the same at every frequency


@pytest.mark.parametrize(
    "G",
    [Block(2.0, (-3.0,), (-1.0,)), Block(2.0, (-3.0, -1 + 2j, -1 - 2j), (-1.0, -0.1 + 4j, -0.1 - 4j))],
    ids=["first order", "resonant"],
)
@pytest.mark.parametrize(("w1", "w2"), [(0.6, 0.8), (3.0, 1.0), (1.0, 10.0)])
def test_constant_weights_minimum_phase(G: Block, w1: float, w2: float) -> None:
    """T constant is allowed, and S + T = 1 leaves w1 w2/sqrt(w1^2 + w2^2) at best."""
    _, found = mixed_sensitivity(G, Block(w1), Block(w2), 0.0)
    brackets(found, w1 * w2 / np.hypot(w1, w2))
    assert found.reason.startswith("S + T = 1 at ")


def test_constant_weights_unstable_pole() -> None:
    """T(p) = 1, so that the norm is w2 at least; T = 1 everywhere approaches it."""
    _, found = mixed_sensitivity(Block(2.0, (-3.0,), (2.0,)), Block(0.6), Block(0.8), 0.0)
    brackets(found, 0.8)
    assert found.reason == "T = 1 at the pole 2 of G costs 0.8"


def test_constant_weights_unstable_zero() -> None:
    """S(z) = 1, so that the norm is w1 at least; K = 0 reaches it."""
    _, found = mixed_sensitivity(Block(2.0, (3.0,), (-2.0,)), Block(0.6), Block(0.8), 0.0)
    brackets(found, 0.6)
    assert found.reason == "S = 1 at the zero 3 of G costs 0.6"


def pick_optimum(w1: float, w2: float, p: float, z: float) -> float:
    """Constant weights, T(p) = 1 and T(z) = 0: Pick's condition at two points, solved for gamma.

    (T - T0)/R with T0 = w1^2/(w1^2 + w2^2) is 1 at most and has the values (1 - T0)/R and -T0/R at p and z. Such a
    function exists when their pseudohyperbolic distance (1/R)/(1 + T0 (1 - T0)/R^2) is that of the points,
    rho = |p - z|/(p + z), at most, so that R^2 - R/rho + T0 (1 - T0) = 0 for the least R.
    """
    T0, rho = w1**2 / (w1**2 + w2**2), abs(p - z) / (p + z)
    R = (1 / rho + np.sqrt(1 / rho**2 - 4 * T0 * (1 - T0))) / 2
    return float(np.sqrt((w1**2 + w2**2) * R**2 + (w1 * w2) ** 2 / (w1**2 + w2**2)))


@pytest.mark.parametrize(("w1", "w2", "p", "z"), [(1.0, 1.0, 1.0, 4.0), (0.6, 0.8, 3.0, 1.0), (2.0, 0.5, 1.0, 1.5)])
def test_constant_weights_unstable_pole_and_zero(w1: float, w2: float, p: float, z: float) -> None:
    G, known = Block(2.0, (z,), (p,)), pick_optimum(w1, w2, p, z)
    _, found = mixed_sensitivity(G, Block(w1), Block(w2), 0.0)
    brackets(found, known)
    assert found.reason.startswith("no stable T meets the 2 interpolation conditions: a pivot of Pick's matrix is -")
    assert nehari_optimum(G, Block(w1), Block(w2), 2.0, 128) == pytest.approx(known, rel=1e-8)


# W2 next to nothing: minimum sensitivity


def test_minimum_sensitivity_with_a_pole_and_a_zero() -> None:
    """G. Zames and B. A. Francis, IEEE Trans. Autom. Control 28 (1983) 585-601: |W1(z)| |z + p|/|z - p|."""
    p, z = 1.0, 4.0
    W1 = Block(1.0, (-3.0,), (-0.1,))
    known = abs(complex(W1(z))) * (z + p) / (z - p)
    brackets(synthesis(Block(1.0, (z, -5.0), (p, -2.0)), W1, Block(1e-4), 0.0), known)


def test_minimum_sensitivity_with_two_zeros() -> None:
    """W1 S = W1 at both zeros: the Pick matrix (gamma^2 - W1(z_i) W1(z_j))/(z_i + z_j) turns singular."""
    zeros = np.array([1.0, 3.0])
    W1 = Block(1.0, (-3.0,), (-0.1,))
    values = W1(zeros).real
    C = 1 / np.add.outer(zeros, zeros)
    known = float(np.sqrt(eigh(np.outer(values, values) * C, C, eigvals_only=True)[-1]))
    assert known > 1.1 * values.max()
    brackets(synthesis(Block(1.0, (1.0, 3.0, -3.0), (-1.0, -2.0, -5.0)), W1, Block(1e-4), 0.0), known)


# normalised coprime factors


def coprime(G: Block) -> Problem:
    """G, 1/M and 1/(M G) with a stable 1/M of the magnitude sqrt(1 + |G|^2): [S/M; K S/M] is the problem's map."""
    numerator, denominator = polynomial(Block(G.gain, G.zeros)), polynomial(Block(1.0, G.poles))
    sign = (-1.0) ** np.arange(len(denominator))[::-1]
    squared = np.polyadd(
        np.polymul(denominator, denominator * sign), np.polymul(numerator, numerator * sign[-len(numerator) :])
    )
    zeros = tuple(root for root in from_polynomial(squared).zeros if root.real < 0)
    poles = tuple(complex(-abs(root.real), root.imag) for root in G.poles)
    return G, Block(1.0, zeros, poles), Block(1.0, zeros, poles) * G.inverse()


def coprime_optimum(A: np.ndarray, b: np.ndarray, c: np.ndarray) -> float:
    """sqrt(1 + rho(X Z)), G strictly proper: K. Glover and D. McFarlane, IEEE Trans. Autom. Control 34 (1989) 821."""
    X = solve_continuous_are(A, b, c.T @ c, np.eye(1))
    Z = solve_continuous_are(A.T, c.T, b @ b.T, np.eye(1))
    return float(np.sqrt(1 + np.abs(np.linalg.eigvals(X @ Z)).max()))


@pytest.mark.parametrize(("p", "known"), [(-1.0, np.sqrt(4 - 2 * np.sqrt(2))), (1.0, np.sqrt(4 + 2 * np.sqrt(2)))])
def test_normalised_coprime_factors_of_first_order(p: float, known: float) -> None:
    """G = 1/(s - p): X = Z = p + sqrt(p^2 + 1), gamma^2 = 1 + X^2."""
    assert coprime_optimum(np.array([[p]]), np.eye(1), np.eye(1)) == pytest.approx(known, rel=1e-12)
    brackets(synthesis(*coprime(Block(1.0, (), (p,))), 0.0), known)


@pytest.mark.parametrize("zeta", [0.01, -0.01, 0.7])
def test_normalised_coprime_factors_of_second_order(zeta: float) -> None:
    """G = 5/(s^2 + 2 zeta 3 s + 9), lightly damped, as lightly undamped, and well damped."""
    A, b, c = np.array([[0.0, 1.0], [-9.0, -6 * zeta]]), np.array([[0.0], [5.0]]), np.array([[1.0, 0.0]])
    roots = tuple(complex(root) for root in np.linalg.eigvals(A))
    brackets(synthesis(*coprime(Block(5.0, (), roots)), 0.0), coprime_optimum(A, b, c))


# in print

PLANT = Block(200 / (10 * 0.05**2), (), (-0.1, -20.0, -20.0))


def performance(M: float, A: float) -> Block:
    """(s/M + 10)/(s + 10 A)."""
    return Block(1 / M, (-10 * M,), (-10 * A,))


def test_skogestad_and_postlethwaite() -> None:
    """Multivariable Feedback Control, 2nd ed., Wiley 2005, Example 2.17, first design: 1.37. KS is W2 T with W2 = 1/G.

    python-control's mixsyn finds 1.36593 for the same S/KS problem.
    """
    _, found = mixed_sensitivity(PLANT, performance(1.5, 1e-4), PLANT.inverse(), 0.0)
    assert found.gamma_lower <= 1.375
    assert found.gamma >= 1.365
    brackets(found, 1.36593, rel=1e-5)


# by Nehari's theorem

SECOND = performance(np.sqrt(1.5), 1e-2)
TRACKING = Block(3.0, (-2.0, -5.0), (2j, -2j)), Block(20.0, (), (-0.8 + 2j, -0.8 - 2j)), Block(0.2, (-4.0,), (-60.0,))


@pytest.mark.parametrize(
    ("problem", "decay_rate", "a", "points"),
    [
        ((PLANT, performance(1.5, 1e-4), PLANT.inverse()), 0.0, 0.5, 2**15),
        ((PLANT, SECOND * SECOND, PLANT.inverse()), 0.0, 10.0, 2**12),
        ((Block(1.0, (-4.0,), (-1.0, 2.0)), Block(1.0, (), (-0.1,)), Block(0.3, (-5.0,))), 0.0, 1.0, 2**10),
        ((Block(3.0, (1.0,), (-2.0, 0.5)), Block(0.5, (-2.0,), (-0.01,)), Block(0.1, (-3.0,))), 0.0, 1.0, 2**12),
        (TRACKING, 0.4, 5.0, 2**10),
    ],
    ids=["Skogestad 1", "Skogestad 2", "unstable", "unstable, nonminimum phase", "tracking"],
)
def test_against_nehari(problem: Problem, decay_rate: float, a: float, points: int) -> None:
    """The optimum on the line by Hankel norms; twice the points change nothing."""
    agrees_with_nehari(synthesis(*problem, decay_rate), problem, a, points)


def test_chapter_two_against_nehari(delay_free_design: Design) -> None:
    hinf = delay_free_design.hinf
    assert hinf is not None
    problem = delay_free_design.blocks["G_A"], hinf.W1, hinf.W2
    agrees_with_nehari(synthesis(*problem, hinf.decay_rate), problem, 60.0, 2**13)


def agrees_with_nehari(found: Synthesis, problem: Sequence[Block], a: float, points: int) -> None:
    moved = [block.shifted(-found.decay_rate) for block in problem]
    coarse, known = (nehari_optimum(*moved, a, count) for count in (points, 2 * points))
    assert coarse == pytest.approx(known, rel=1e-7)
    assert found.gamma_line_lower <= known * (1 + 1e-7)
    assert known <= 1.0002 * found.gamma_line_lower
    assert known <= found.gamma_line <= 1.01 * found.gamma_line_lower


# poles on the axis


@pytest.mark.parametrize("G", [Block(2.0, (3.0,), (0.0,)), Block(2.0, (-3.0, -5.0), (2j, -2j))], ids=["0", "2j"])
def test_infimum_with_poles_on_the_axis(G: Block) -> None:
    """T = 1 at these poles, so that the norm is w2 at least; single points of the axis cost no more than that."""
    found = infimum(G, Block(0.6), Block(0.8), 0.3)
    assert found.lower == pytest.approx(0.8, rel=1e-12)
    assert found.lower * (1 - 1e-9) <= found.upper <= 1.01 * found.lower
    assert found.reason.startswith("T = 1 at the pole ")


def test_infimum_without_poles_on_the_axis() -> None:
    problem = coprime(Block(1.0, (), (-1.0,)))
    found = infimum(*problem, 0.3)
    assert found.decay_rate == 0
    assert found.lower <= np.sqrt(4 - 2 * np.sqrt(2)) <= found.upper <= 1.001 * found.lower


def test_infimum_of_chapter_two(delay_free_design: Design) -> None:
    hinf = delay_free_design.hinf
    assert hinf is not None
    found = infimum(delay_free_design.blocks["G_A"], hinf.W1, hinf.W2, hinf.decay_rate)
    assert hinf.gamma_lower <= found.lower < found.upper <= 1.01 * found.lower
    assert found.upper < hinf.gamma
    assert found.decay_rate < hinf.decay_rate
