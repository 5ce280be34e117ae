"""The H-infinity synthesis against closed forms, a second norm, and slycot's where that one works."""

from __future__ import annotations

import control
import numpy as np
import pytest
from scipy.linalg import block_diag, eigvals

import design.hinf.mixed_sensitivity as mixed_sensitivity_module
from design.blocks.block import Block, bound_block
from design.blocks.frequency_peak import peak
from design.blocks.state_space import realize
from design.design_file import Design
from design.hinf.central_controller import central_controller
from design.hinf.closed_loop_norm import closed_loop_poles
from design.hinf.mixed_sensitivity import mixed_sensitivity
from design.hinf.pick import Obstacle, Problem, SynthesisError, is_feasible
from identification.base.errors import InputError

PROBLEMS = {
    "unstable": (Block(1.0, (-4.0,), (-1.0, 2.0)), Block(1.0, (), (-0.1,)), Block(0.3, (-5.0,))),
    "biproper": (Block(1.0, (-4.0, -5.0), (-1.0, -2.0)), Block(1.0, (), (-0.1,)), Block(0.3, (-5.0,), (-10.0,))),
    "nonminimum phase, biproper W1": (
        Block(3.0, (1.0,), (-2.0, -0.5)),
        Block(0.5, (-2.0,), (-0.01,)),
        Block(0.1, (-3.0,)),
    ),
    "twice a pole": (Block(1.0, (-4.0,), (1.0, 1.0, -3.0)), Block(1.0, (), (-0.1,)), Block(0.3, (-5.0, -7.0))),
    "three times a pole": (Block(2.0, (-4.0, -5.0), (0.5, 0.5, 0.5)), Block(1.0, (), (-0.3,)), Block(0.1, (-3.0,))),
    "twice a zero": (Block(2.0, (6.0, 6.0), (-1.0, -2.0, -3.0)), Block(1.0, (), (-0.3,)), Block(0.1, (-3.0,))),
    "twice a pair of poles": (
        Block(1.0, (), (0.5 + 1j, 0.5 - 1j, 0.5 + 1j, 0.5 - 1j)),
        Block(1.0, (), (-0.3,)),
        Block(0.2, (-5.0,) * 4),
    ),
    "all biproper": (Block(2.0, (4.0,), (1.0,)), Block(0.5, (-2.0,), (-0.1,)), Block(0.8, (-1.0,), (-20.0,))),
}


def closed_loop(G: Block, W1: Block, W2: Block, K: Block) -> control.StateSpace:
    """r -> (W1 e, W2 y), e = r - y, in one state space, with no hidden copies of a factor."""
    g, k, w = realize(G, W2 * G), realize(K), realize(W1)
    C, d, through = g.C, g.d, 1 + g.d[0] * k.d[0]
    zero = np.zeros(len(w.b))
    e = -np.concatenate([C[0], d[0] * k.C[0], zero]) / through  # e = e x + r/through
    u = np.concatenate([np.zeros(len(g.b)), k.C[0], zero]) + k.d[0] * e
    b = np.concatenate([g.b * k.d[0], k.b, w.b]) / through
    A = block_diag(g.A, k.A, w.A) + np.vstack([np.outer(g.b, u), np.outer(k.b, e), np.outer(w.b, e)])
    first = np.concatenate([np.zeros(len(g.b) + len(k.b)), w.C[0]]) + w.d[0] * e
    second = np.concatenate([C[1], np.zeros(len(k.b) + len(w.b))]) + d[1] * u
    direct = np.array([[w.d[0]], [d[1] * k.d[0]]]) / through
    return control.ss(A, b[:, None], np.vstack([first, second]), direct)


def augmented_plant(G: Block, W1: Block, W2: Block) -> control.StateSpace:
    """(r, u) -> (W1 e, W2 y, e), for slycot."""
    g, w = realize(G, W2 * G), realize(W1)
    n, m = len(g.b), len(w.b)
    A = np.block([[g.A, np.zeros((n, m))], [-np.outer(w.b, g.C[0]), w.A]])
    B = np.block([[np.zeros((n, 1)), g.b[:, None]], [w.b[:, None], -g.d[0] * w.b[:, None]]])
    C = np.block([[-w.d[0] * g.C[:1], w.C], [g.C[1:], np.zeros((1, m))], [-g.C[:1], np.zeros((1, m))]])
    D = np.array([[w.d[0], -w.d[0] * g.d[0]], [0.0, g.d[1]], [1.0, -g.d[0]]])
    return control.ss(A, B, C, D)


def hamiltonian_norm(system: control.StateSpace) -> float:
    """The H-infinity norm by bisection: up to it, and no further, the Hamiltonian has eigenvalues on the axis."""
    A, B, C, D = (np.asarray(part) for part in (system.A, system.B, system.C, system.D))

    def below(gamma: float) -> bool:
        R = gamma**2 - float((D.T @ D).item())
        F = A + B @ D.T @ C / R
        values = eigvals(np.block([[F, B @ B.T / R], [-C.T @ (np.eye(2) + D @ D.T / R) @ C, -F.T]]))
        return bool(np.any(np.abs(values.real) < 1e-8 * np.abs(values)))

    low, high = np.linalg.norm(D) * (1 + 1e-9) + 1e-9, 1e3
    while high > (1 + 1e-7) * low:
        middle = np.sqrt(low * high)
        low, high = (middle, high) if below(middle) else (low, middle)
    return float(low)


@pytest.mark.parametrize("problem", PROBLEMS.values(), ids=PROBLEMS)
@pytest.mark.parametrize("decay_rate", [0.0, 1e-3])
def test_norm_agrees_with_the_hamiltonian_method(problem: tuple[Block, Block, Block], decay_rate: float) -> None:
    K, found = mixed_sensitivity(*problem, decay_rate)
    system = closed_loop(*problem, K)
    assert found.gamma == pytest.approx(hamiltonian_norm(system), rel=1e-5)  # of a peak at omega = 0 to the root of eps
    norm = control.linfnorm(system)[0]
    assert norm * (1 - 1e-10) <= found.gamma <= norm * (1 + 3e-9)
    assert found.gamma_lower <= found.gamma
    assert found.gamma_line_lower <= found.gamma_line <= 1.01 * found.gamma_line_lower
    poles, own = system.poles(), closed_loop_poles(problem[0], K)
    assert all(np.min(np.abs(poles - pole)) < 1e-5 * abs(pole) for pole in own)
    assert max(pole.real for pole in own) < -decay_rate * (1 - 1e-3)


def test_norm_of_chapter_two_agrees_with_the_hamiltonian_method(delay_free_design: Design) -> None:
    hinf, blocks = delay_free_design.hinf, delay_free_design.blocks
    assert hinf is not None
    system = closed_loop(blocks["G_A"], hinf.W1, hinf.W2, blocks["K"])
    assert hinf.gamma == pytest.approx(hamiltonian_norm(system), rel=1e-5)
    assert hinf.gamma == pytest.approx(control.linfnorm(system)[0], rel=1e-5)


def test_closed_loop_poles_with_an_algebraic_loop() -> None:
    # 1 + 6 (s + 2)(s + 4)/((s - 1)(s + 3)) = 0
    poles = closed_loop_poles(Block(2.0, (-2.0,), (1.0,)), Block(3.0, (-4.0,), (-3.0,)))
    np.testing.assert_allclose(np.sort_complex(poles), np.sort_complex(np.roots([7, 38, 45])), rtol=1e-12)
    with pytest.raises(InputError, match="expected a well-posed loop"):
        closed_loop_poles(Block(2.0, (-2.0,), (1.0,)), Block(-0.5, (-4.0,), (-3.0,)))


@pytest.mark.parametrize("problem", PROBLEMS.values(), ids=PROBLEMS)
def test_what_the_weights_alone_cost(problem: tuple[Block, Block, Block]) -> None:
    """|W1 W2|/sqrt(|W1|^2 + |W2|^2) at its highest, computed from the weights on a grid."""
    omega = np.geomspace(1e-4, 1e4, 100_001)
    first, second = np.abs(problem[1](1j * omega)), np.abs(problem[2](1j * omega))
    least = float(np.max(first * second / np.hypot(first, second)))
    below, above = (is_feasible(Problem(*problem, 0.0), factor * least) for factor in (0.999, 1.001))
    assert isinstance(below, Obstacle)
    assert below.reason.startswith("S + T = 1 at ")
    assert 0.999 * least <= below.gamma <= least * (1 + 1e-6)
    assert above is True or not above.reason.startswith("S + T = 1 at ")


def test_what_infinite_frequency_costs() -> None:
    _, found = mixed_sensitivity(Block(1.0, (-2.0,), (-1.0,)), Block(2.0, (-0.1,), (-1.0,)), Block(1.0), 0.0)
    assert found.gamma_lower == pytest.approx(2 / np.sqrt(5), rel=1e-4)
    assert found.reason == "S + T = 1 at infinite frequency costs 0.894427"


def test_a_test_that_decides_nothing_proves_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    problem = PROBLEMS["unstable"]
    _, found = mixed_sensitivity(*problem, 0.0)

    def blind(problem: Problem, gamma: float) -> Obstacle | bool:
        return gamma > 0.99 * found.gamma_lower and is_feasible(problem, gamma)

    monkeypatch.setattr(mixed_sensitivity_module, "is_feasible", blind)
    with pytest.raises(
        SynthesisError, match="rounding errors are too large to decide whether a controller reaches the norm 1"
    ):
        mixed_sensitivity(*problem, 0.0)
    monkeypatch.setattr(mixed_sensitivity_module, "is_feasible", lambda problem, gamma: Obstacle(gamma, "always"))
    with pytest.raises(SynthesisError, match="the infimum of the norm is beyond"):
        mixed_sensitivity(*problem, 0.0)


def test_a_gamma_that_is_the_infimum_itself_is_stepped_over() -> None:
    """|W1(z)| = 1 = the first gamma tried: no precision decides it."""
    problem = Block(2.0, (3.0,), (-2.0,)), Block(1.0), Block(0.8)
    assert is_feasible(Problem(*problem, 0.0), 1.0) is False
    _, found = mixed_sensitivity(*problem, 0.0)
    assert 1 - 1e-4 <= found.gamma_lower <= 1 <= found.gamma <= 1.01


@pytest.mark.parametrize(
    ("factor", "message"),
    [(1.02, "rounded to doubles, has the norm"), (0.1, "rounded to doubles, has a closed-loop pole with Re s = ")],
)
def test_a_wrong_controller_is_found_out(monkeypatch: pytest.MonkeyPatch, factor: float, message: str) -> None:
    def wrong(problem: Problem, gamma: float) -> Block:
        K = central_controller(problem, gamma)
        assert K is not None
        return K.scaled(factor)

    monkeypatch.setattr(mixed_sensitivity_module, "central_controller", wrong)
    with pytest.raises(SynthesisError, match=message):
        mixed_sensitivity(*PROBLEMS["unstable"], 0.0)


@pytest.mark.parametrize("problem", PROBLEMS.values(), ids=PROBLEMS)
def test_slycot_finds_the_same_optimum(problem: tuple[Block, Block, Block]) -> None:
    # ordinary problems, on which sb10ad works
    _, found = mixed_sensitivity(*problem, 0.0)
    _, _, gamma, _ = control.hinfsyn(augmented_plant(*problem), 1, 1)
    assert found.gamma_lower <= gamma <= 1.0002 * found.gamma_lower


def test_chapter_two_is_confirmed_by_its_own_closed_loop(delay_free_design: Design) -> None:
    hinf, blocks = delay_free_design.hinf, delay_free_design.blocks
    assert hinf is not None
    s = 1j * np.concatenate([np.geomspace(1.23e-4, 1e6, 200_001), np.linspace(1.01, 300, 300_001)])
    GK = blocks["G_A"](s) * blocks["K"](s)
    again = np.hypot(np.abs(hinf.W1(s) / (1 + GK)), np.abs(hinf.W2(s) * GK / (1 + GK))).max()
    assert again == pytest.approx(hinf.gamma, rel=1e-6)
    assert hinf.gamma_lower < hinf.gamma
    assert hinf.gamma_line <= 1.01 * hinf.gamma_line_lower
    poles = closed_loop_poles(blocks["G_A"], blocks["K"])
    assert max(pole.real for pole in poles) < -hinf.decay_rate


def test_second_weight_is_the_additive_bound_on_control_sensitivity(delay_free_design: Design) -> None:
    # Remark 1: W2 = W_a/G, so that W2 T = W_a C S; robust stability is its norm below 1
    hinf, blocks = delay_free_design.hinf, delay_free_design.blocks
    assert hinf is not None
    W_a, L = bound_block(delay_free_design.additive_bound), blocks["G_A"] * blocks["K"]
    G = blocks["F1"]

    def robust(omega: np.ndarray) -> np.ndarray:
        s = 1j * omega
        return np.abs(W_a(s) * L(s) / G(s) / (1 + L(s)))

    value, _ = peak(robust, L.zeros + L.poles + W_a.poles + closed_loop_poles(blocks["G_A"], blocks["K"]))
    assert value <= hinf.gamma * (1 + 1e-6)
    assert value < 1


def test_weights_that_do_not_fit_are_refused() -> None:
    G, W1, W2 = Block(1.0, (), (-1.0,)), Block(1.0, (), (-1.0,)), Block(1.0, (-5.0,))
    for problem, decay_rate, message in [
        ((G, W1, Block(1.0)), 0.1, "biproper"),
        ((G, Block(1.0, (-1.0,)), W2), 0.1, "proper W1"),
        ((G, Block(1.0, (), (-0.05,)), W2), 0.1, "expected Re s < -0.1"),
        ((G, Block(1.0, (), (0.0,)), W2), 0.0, "expected Re s < 0,"),
        ((G, W1, W2), -0.1, "the decay rate is -0.1"),
        ((G, W1, W2), np.nan, "the decay rate is nan"),
        ((Block(1.0, (), (2j, -2j)), W1, Block(1.0, (-5.0, -5.0))), 0.0, "a pole with Re s = 0,"),
        ((G, W1, W2), 1.0, "a pole with Re s = -1,"),
        ((Block(1.0, (), (-1.0,), 0.1), W1, W2), 0.1, "without dead time"),
        ((G, Block(0.0), W2), 0.1, "expected none zero, and a pole of G or W1"),
        ((Block(2.0), Block(1.0), Block(1.0)), 0.0, "neither G nor W1 has a pole"),
    ]:
        with pytest.raises(InputError, match=message):
            mixed_sensitivity(*problem, decay_rate)


def test_controllers_that_doubles_cannot_hold_are_refused() -> None:
    G = Block(1.0, (), tuple(range(1, 17)))
    with pytest.raises(SynthesisError, match="rounded to doubles, has the norm"):
        mixed_sensitivity(G, Block(1.0, (), (-1.0,)), Block(1.0, (-5.0,) * 16), 0.0)
