"""The H-infinity synthesis against closed forms, a second norm, and slycot's where that one works."""

from __future__ import annotations

import control
import numpy as np
import pytest

from design.block import Block, bound_block
from design.closed_loop import closed_loop_poles
from design.contract import Design
from design.frequency import peak
from design.mixed_sensitivity import mixed_sensitivity
from design.realization import realize
from identification.files import InputError

DECAY = 1e-3  # nearly (2.8) itself


def to_control(block: Block) -> control.StateSpace:
    system = realize(block)
    return control.ss(system.A, system.b[:, None], system.C, system.d[:, None])


def test_optimum_that_the_weights_at_dc_dictate() -> None:
    # G stable and minimum phase: S + T = 1 bounds the norm below by |W1 W2|/sqrt(|W1|^2 + |W2|^2) at every
    # frequency; here the bound peaks at omega = 0, where W1 = 10 and W2 = 8
    G, W1, W2 = Block(1.0, (), (-1.0, -3.0)), Block(1.0, (), (-0.1,)), Block(0.2, (-5.0, -8.0))
    found = mixed_sensitivity(G, W1, W2, DECAY)
    assert found.gamma_line_lower == pytest.approx(80 / np.hypot(10, 8), rel=0.02)
    assert found.gamma_lower <= 80 / np.hypot(10, 8) * (1 + 1e-3) <= found.gamma * (1 + 1e-3)


def test_unstable_plant_with_constant_weights() -> None:
    # one unstable pole p: T(p) = 1, so that with W1 = 0+ the optimum is |W2(p)|: T = W2(p)/W2 is all-pass in W2 T
    p = 2.0
    G, W2 = Block(1.0, (), (p,)), Block(0.5, (-4.0,))
    found = mixed_sensitivity(G, Block(1e-4, (), (-1.0,)), W2, DECAY)
    assert found.gamma_line_lower == pytest.approx(abs(complex(W2(p))), rel=0.01)


@pytest.mark.parametrize(
    ("G", "W1", "W2"),
    [
        (Block(1.0, (-4.0,), (-1.0, 2.0)), Block(1.0, (), (-0.1,)), Block(0.3, (-5.0,))),
        (Block(1.0, (-4.0, -5.0), (-1.0, -2.0)), Block(1.0, (), (-0.1,)), Block(0.3, (-5.0,), (-10.0,))),
        (Block(3.0, (1.0,), (-2.0, -0.5)), Block(0.5, (-2.0,), (-0.01,)), Block(0.1, (-3.0,))),
    ],
    ids=["unstable", "biproper", "nonminimum phase, biproper W1"],
)
def test_norm_agrees_with_the_hamiltonian_method(G: Block, W1: Block, W2: Block) -> None:
    found = mixed_sensitivity(G, W1, W2, DECAY)
    K, T = to_control(found.K), to_control(G)
    S = control.feedback(control.ss([], [], [], [[1.0]]), T * K)
    rows = control.append(to_control(W1), to_control(W2 * G)) * control.ss(*control.ssdata(control.append(S, K * S)))
    stacked = rows * control.ss([], [], [], [[1.0], [1.0]])
    second, _ = control.linfnorm(stacked)
    assert found.gamma == pytest.approx(second, rel=1e-4)
    assert found.gamma_lower <= found.gamma
    assert found.gamma_line_lower <= found.gamma_line <= 1.02 * found.gamma_line_lower
    assert max(pole.real for pole in found.closed_loop_poles) < -DECAY * (1 - 1e-3)


def test_slycot_does_no_better_than_the_lower_bound() -> None:
    # an ordinary problem, on which sb10ad works
    G, W1, W2 = Block(2.0, (), (-1.0, -2.0)), Block(0.5, (-3.0,), (-0.05,)), Block(0.05, (-10.0, -20.0))
    found = mixed_sensitivity(G, W1, W2, DECAY)
    # z = (W1 (r - y), W2 y), e = r - y, with W2 y = (W2 G) u realised jointly
    joint = realize(G, W2 * G)
    w1 = to_control(W1)
    n, m = len(joint.b), w1.nstates
    A = np.block([[joint.A, np.zeros((n, m))], [-w1.B @ joint.C[:1], w1.A]])
    B = np.block([[np.zeros((n, 1)), joint.b[:, None]], [w1.B, np.zeros((m, 1))]])
    C = np.block([[-w1.D @ joint.C[:1], w1.C], [joint.C[1:], np.zeros((1, m))], [-joint.C[:1], np.zeros((1, m))]])
    D = np.array([[w1.D.item(), 0.0], [0.0, joint.d[1]], [1.0, 0.0]])
    _, _, gamma, _ = control.hinfsyn(control.ss(A, B, C, D), 1, 1)
    assert found.gamma_lower <= gamma * 1.001
    assert found.gamma_line_lower == pytest.approx(gamma, rel=0.02)


def test_chapter_two_is_confirmed_by_its_own_closed_loop(delay_free_design: Design) -> None:
    hinf, blocks = delay_free_design.hinf, delay_free_design.blocks
    assert hinf is not None
    s = 1j * np.concatenate([np.geomspace(1.23e-4, 1e6, 200_001), np.linspace(1.01, 300, 300_001)])
    GK = blocks["G_A"](s) * blocks["K"](s)
    again = np.hypot(np.abs(hinf["W1"](s) / (1 + GK)), np.abs(hinf["W2"](s) * GK / (1 + GK))).max()
    assert again == pytest.approx(hinf["gamma"], rel=1e-6)
    assert hinf["gamma_lower"] < hinf["gamma"]
    assert hinf["gamma_line"] <= 1.0101 * 1.001 * hinf["gamma_line_lower"]
    poles = closed_loop_poles(blocks["G_A"], blocks["K"])
    assert max(pole.real for pole in poles) < -hinf["decay_rate"]


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
    assert value <= hinf["gamma"] * (1 + 1e-6)
    assert value < 1


def test_weights_that_do_not_fit_are_refused() -> None:
    G = Block(1.0, (), (-1.0,))
    with pytest.raises(InputError, match="biproper"):
        mixed_sensitivity(G, Block(1.0, (), (-1.0,)), Block(1.0), 0.1)
    with pytest.raises(InputError, match="left of"):
        mixed_sensitivity(G, Block(1.0, (), (-0.05,)), Block(1.0, (-5.0,)), 0.1)
    with pytest.raises(InputError, match="decay rate"):
        mixed_sensitivity(G, Block(1.0, (), (-1.0,)), Block(1.0, (-5.0,)), 0.0)
