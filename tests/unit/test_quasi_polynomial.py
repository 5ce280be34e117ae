"""Characteristic roots with exact dead times against closed forms, Pade approximants and the argument principle."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable

import control
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.linalg import block_diag
from scipy.special import lambertw

from design.blocks.block import Block, plant_block
from design.blocks.state_space import realize
from design.design_file import Design
from design.stability import axis
from design.stability.characteristic_roots import _discretised_roots, closing_omega, rightmost_roots, roots_right_of
from design.stability.delay_loop import DelayLoop
from identification.base.errors import InputError

some = settings(max_examples=25, deadline=None, derandomize=True)
ONE, NONE = Block(1.0), Block(0.0)


def scalar_loop(a: float, b: float, h: float) -> DelayLoop:
    """x' = a x + b x(t - h)."""
    return DelayLoop(Block(-b, (), (a,), h), ONE, NONE, 0.0)


def lambert_roots(a: float, b: float, h: float, count: int) -> np.ndarray:
    """s = a + W_k(b h exp(-a h))/h, by decreasing real part."""
    k = np.arange(-count, count + 1)
    found = a + lambertw(b * h * np.exp(-a * h), k) / h
    return np.asarray(found[np.argsort(-found.real)][:count])


def thesis_loop(design: Design, delay_factor: float = 1.0, gain_factor: float = 1.0) -> DelayLoop:
    forward, feedback = design.controller_parts()
    nominal = plant_block(design.plant)
    plant = Block(gain_factor * nominal.gain, nominal.zeros, nominal.poles, delay_factor * nominal.delay_s)
    return DelayLoop(plant, forward, feedback, nominal.delay_s)


def characteristic(loop: DelayLoop, s: np.ndarray) -> np.ndarray:
    """1 - feedback exp(-delay_s s) + P forward, from the blocks as they are."""
    return np.asarray(1 - loop.feedback(s) * np.exp(-loop.delay_s * s) + loop.plant(s) * loop.forward(s))


def turns_around(loop: DelayLoop, left: float, right: float, top: float, step: float) -> int:
    """Zeros less poles of the characteristic function inside a rectangle, on a mesh of its edge of this step."""
    up, across = np.linspace(-top, top, 2 * int(top / step)), np.linspace(left, right, 20_001)
    edge = np.concatenate([across - 1j * top, right + 1j * up, across[::-1] + 1j * top, left + 1j * up[::-1]])
    values = characteristic(loop, edge)
    steps = np.angle(values[1:] / values[:-1])
    assert np.abs(steps).max() < 2
    return round(float(np.sum(steps)) / (2 * np.pi))


def by_parts(roots: Iterable[complex]) -> list[complex]:
    return sorted(roots, key=lambda root: (root.real, root.imag))


def distance_to(expected: np.ndarray, found: np.ndarray) -> np.ndarray:
    """Distance of each expected root from the nearest found one, relative to its modulus."""
    return np.abs(np.subtract.outer(expected, found)).min(axis=1) / np.abs(expected)


@pytest.mark.parametrize("h", [0.01, 0.7, 30.0])
@pytest.mark.parametrize(("a", "b"), [(0.5, -2.0), (-1.0, 0.8), (-3.0, -4.0), (0.0, -1.0), (2.0, 1.0)])
def test_scalar_equation_is_lamberts_function(a: float, b: float, h: float) -> None:
    found = rightmost_roots(scalar_loop(a / h, b / h, h), 9)
    expected = lambert_roots(a / h, b / h, h, len(found.roots))
    assert len(found.roots) >= 9
    assert not np.any(found.hidden)
    assert distance_to(expected, found.roots).max() < 1e-13
    assert np.all(np.diff(found.roots.real) <= 1e-13 / h)
    for line in (-2.0, 0.0, 0.6):
        assert roots_right_of(scalar_loop(a / h, b / h, h), line / h) == np.sum(
            lambert_roots(a / h, b / h, h, 60).real > line / h
        )


def test_double_root_is_known_to_the_square_root_of_rounding() -> None:
    """x' = b x(t - h) with b h = -1/e: both real roots meet at -1/h."""
    h = 0.4
    found = rightmost_roots(scalar_loop(0.0, -np.exp(-1.0) / h, h), 2)
    double = found.roots[:2]
    assert np.all(np.abs(double + 1 / h) < 1e-7 / h)
    assert np.all(found.uncertainty[:2] < 1e-6 / h)
    assert np.all(found.uncertainty[:2] > np.abs(double + 1 / h))
    simple = rightmost_roots(scalar_loop(0.0, -1.0 / h, h), 2)
    assert np.all(simple.uncertainty < 1e-13 / h)


def test_integrator_loses_stability_at_half_pi() -> None:
    h = 0.05
    for factor, count in ((0.999, 0), (1.001, 2), (4.999, 2), (5.001, 4)):
        assert roots_right_of(scalar_loop(0.0, -factor * np.pi / 2 / h, h), 0.0) == count
    on_axis = scalar_loop(0.0, -np.pi / 2 / h, h)
    with pytest.raises(InputError, match="a root lies on the line"):
        roots_right_of(on_axis, 0.0)
    np.testing.assert_allclose(rightmost_roots(on_axis, 2).roots[:2].real, 0.0, atol=1e-13 / h)


@pytest.mark.parametrize("p", [-0.5, 0.0, 2.0])
def test_scalar_smith_predictor(p: float) -> None:
    """P_0 = 1/(s + p), C_0 = k: one root at -(p + k) with the model's dead time, whatever it is."""
    k, h = 3.0, 0.4
    forward, feedback = Block(k, (-p,), (-(p + k),)), Block(k, (), (-(p + k),))
    exact = DelayLoop(Block(1.0, (), (-p,), h), forward, feedback, h)
    found = rightmost_roots(exact, 3)
    np.testing.assert_allclose(np.sort(found.roots.real), sorted([-(p + k), -(p + k), -p]), rtol=1e-12)
    assert sorted(found.roots[found.hidden].real) == sorted([-(p + k), -p])
    assert roots_right_of(exact, -(p + k) - 0.01) == 1

    late = dataclasses.replace(exact, plant=Block(1.0, (), (-p,), 1.7 * h))
    moved = rightmost_roots(late, 8)
    s = moved.roots[~moved.hidden]
    residual = s + p + k - k * np.exp(-h * s) + k * np.exp(-1.7 * h * s)
    magnitude = np.abs(s + p + k) + k * np.abs(np.exp(-h * s)) + k * np.abs(np.exp(-1.7 * h * s))
    assert np.max(np.abs(residual) / magnitude) < 1e-14


def test_extended_design_on_its_own_model_has_finitely_many_roots(extended_design: Design) -> None:
    """The poles of T_so, and hidden: those again, and the poles and zeros of the plant."""
    loop = thesis_loop(extended_design)
    plant, T_so = loop.plant, extended_design.blocks["T_so"]
    found = rightmost_roots(loop, 50)
    moved = found.roots[~found.hidden]
    assert len(moved) == len(T_so.poles)
    assert by_parts(moved) == by_parts(T_so.poles)
    assert found.line == -np.inf
    assert by_parts(found.roots[found.hidden]) == by_parts((*plant.poles, *plant.zeros, *T_so.poles))
    assert roots_right_of(loop, -1 + 1e-4) == 0
    assert roots_right_of(loop, -1 - 1e-4) == 2
    assert roots_right_of(loop, -100.0) == 4


def test_delay_free_design_hides_the_plants_poles(delay_free_design: Design) -> None:
    loop = thesis_loop(delay_free_design, delay_factor=0.0)
    found = rightmost_roots(loop, 30)
    assert found.roots[0] == 0
    assert found.hidden[0]
    assert by_parts(found.roots[found.hidden]) == by_parts(loop.plant.poles)
    P, C = realize(loop.plant), realize(loop.forward)
    A = block_diag(P.A, C.A)
    n = len(P.b)
    A[:n] += np.outer(P.b, np.r_[-C.d[0] * P.C[0], C.C[0]])
    A[n:, :n] -= np.outer(C.b, P.C[0])
    poles = np.linalg.eigvals(A / 30) * 30
    assert len(found.roots) == len(poles)
    moved = found.roots[~found.hidden]
    slow = moved[np.abs(moved) < 100]  # the fast ones nearly cancel the plant's: ill-conditioned for the eigenvalues
    assert len(slow) >= 3
    assert distance_to(slow, poles).max() < 1e-7


@pytest.mark.parametrize("factor", [0.5, 1.2, 4.0])
def test_pade_approximants_tend_to_the_roots_of_a_mismatch(extended_design: Design, factor: float) -> None:
    loop = thesis_loop(extended_design, factor, 1.3)
    found = rightmost_roots(loop, 4)
    expected = found.roots[~found.hidden][:4]

    def delayed(block: Block, delay_s: float) -> control.StateSpace:
        system = realize(block)
        rational = control.ss(system.A / 30, system.b[:, None] / 30, system.C, system.d[:, None])
        return rational * control.tf2ss(*control.pade(30 * delay_s, 7))

    inner = delayed(loop.open_loop, loop.plant.delay_s) - delayed(loop.feedback, loop.delay_s)
    poles = 30 * control.feedback(control.ss([], [], [], [[1.0]]), inner).poles()
    # the double roots of the nominal loop, split by the mismatch, are still ill-conditioned for the eigenvalues
    assert distance_to(expected, poles).max() < 1e-6


@pytest.mark.parametrize("which", ["extended_design", "delay_free_design"])
@some
@given(delay=st.floats(0.05, 6.0), gain=st.floats(0.1, 5.0))
def test_roots_are_all_and_are_roots(request: pytest.FixtureRequest, which: str, delay: float, gain: float) -> None:
    loop = thesis_loop(request.getfixturevalue(which), delay, gain)
    found = rightmost_roots(loop, 10)
    s = found.roots[~found.hidden]
    poles = np.array(loop.plant.poles + loop.forward.poles + loop.feedback.poles)
    clear = s[np.abs(np.subtract.outer(s, poles)).min(axis=1) > 1e-4 * np.abs(s)]  # nearer ones nearly cancel
    terms = (
        1 + 0 * clear,
        loop.feedback(clear) * np.exp(-loop.delay_s * clear),
        loop.plant(clear) * loop.forward(clear),
    )
    assert len(clear) > 0
    assert np.max(np.abs(characteristic(loop, clear)) / np.sum(np.abs(terms), axis=0)) < 1e-10

    # complete right of the line in the widest gap between real parts of roots and poles
    real = np.unique(np.concatenate([s.real, poles.real[poles.real > s.real.min()]]))
    widest = int(np.argmax(np.diff(real)))
    line, gap = float(real[widest] + real[widest + 1]) / 2, float(real[widest + 1] - real[widest])
    number = int(np.sum(s.real > line))
    assert roots_right_of(loop, line) == number
    cancelled = int(np.sum(np.array(loop.hidden).real > line))
    top = closing_omega(loop, line, 1.0, 0.1)
    expected = number + cancelled - int(np.sum(poles.real > line))
    assert turns_around(loop, line, top, top, min(gap / 4, 0.2 / loop.plant.delay_s)) == expected


@pytest.mark.parametrize("factor", [0.4, 1.0, 2.0])
def test_discretisation_converges_faster_than_any_power(extended_design: Design, factor: float) -> None:
    """Also where plant and controller have the same dead time and share a delay line."""
    loop = thesis_loop(extended_design, factor, 3.0)
    found = rightmost_roots(loop, 6)
    roots = found.roots[~found.hidden]
    errors = np.array([distance_to(roots, _discretised_roots(loop, order)).max() for order in (4, 8, 12, 16)])
    assert np.all(np.diff(errors[:-1] / errors[1:]) > 0)
    assert errors[-1] < 1e-8


def test_long_dead_times() -> None:
    """A resonance that turns hundreds of times within the dead time, and a chain of roots along the axis."""
    plant = Block(2e3, (), (-0.05, -2 + 300j, -2 - 300j), 1.0)
    loop = DelayLoop(plant, ONE, NONE, 0.0)
    found = rightmost_roots(loop, 30)
    assert roots_right_of(loop, 0.0) == int(np.sum(found.roots.real > 0))
    s = found.roots
    assert np.max(np.abs(characteristic(loop, s)) / (1 + np.abs(plant(s)))) < 1e-9


def hidden_mode(loop: DelayLoop) -> tuple[np.ndarray, ...]:
    """Left and right null vectors at s = 0 of the loop as drawn, and the input vectors of P, C's e and T_so."""
    P, K, T = realize(loop.plant), realize(loop.forward), realize(loop.feedback)
    n, m = len(P.b), len(K.b)
    at = np.zeros((3, n + m + len(T.b)))
    at[0, :n], at[1, n : n + m], at[2, n + m :] = P.b, K.b, T.b
    y, K_out, T_out = np.zeros((3, at.shape[1]))
    y[:n], K_out[n : n + m], T_out[n + m :] = P.C[0], K.C[0], T.C[0]
    u = K_out - K.d[0] * y + T_out
    matrix = block_diag(P.A, K.A, T.A) + np.outer(at[0] + at[2], u) - np.outer(at[1], y)
    left, sizes, right = np.linalg.svd(matrix)
    assert sizes[-1] < 1e-12 < sizes[-2]
    return left[:, -1], right[-1], at[0], at[1] + K.d[0] * (at[0] + at[2]), at[2], y, u


def test_hidden_root_at_zero_of_the_extended_design(extended_design: Design) -> None:
    """It shows in y, is driven by neither reference nor plant input, but by the controller's inner loop."""
    left, right, plant_input, error, inner, y, u = hidden_mode(thesis_loop(extended_design))
    assert abs(y @ right) > 1e-3
    assert abs(u @ right) < 1e-12
    for quiet in (plant_input, error):
        assert abs(left @ quiet) < 1e-12 * np.linalg.norm(quiet)
    assert abs(left @ inner) > 1e-3 * np.linalg.norm(inner)


def test_input_disturbance_sees_zero_in_chapter_2_alone(extended_design: Design, delay_free_design: Design) -> None:
    s = np.array([1e-4, 1e-5])
    for design, ratio in ((extended_design, 0.1), (delay_free_design, 10.0)):
        loop = thesis_loop(design)
        P_S = loop.plant(s) * (1 - loop.feedback(s) * np.exp(-loop.delay_s * s)) / characteristic(loop, s)
        assert abs(P_S[1] / P_S[0]) == pytest.approx(ratio, rel=2e-2)


@pytest.mark.parametrize(
    ("plant", "forward", "feedback", "delay", "sentence"),
    [
        (Block(1.0, (), (0.0,), 0.1), Block(1.0, (), (), 0.1), NONE, 0.0, "dead times 0.1 s and 0 s"),
        (Block(1.0, (), (0.0,), 0.1), ONE, Block(1.0, (), (-1.0,), 0.2), 0.0, "dead times 0 s and 0.2 s"),
        (Block(1.0, (), (0.0,), 0.1), ONE, NONE, -0.1, "the controller has -0.1 s"),
        (Block(1.0, (), (0.0,), 0.1), ONE, NONE, float("nan"), "the controller has nan s"),
        (Block(1.0, (), (0.0, -1.0), 0.1), Block(1.0, (-2.0,)), NONE, 0.0, "forward has 1 zeros and 0 poles"),
        (Block(1.0, (-1.0,), (0.0,), 0.1), ONE, NONE, 0.0, "the plant times forward has 1 zeros and 1 poles"),
        (Block(1.0, (), (0.0,), 0.1), ONE, Block(0.5), 0.1, "feedback has 0 zeros and 0 poles"),
    ],
)
def test_loops_of_another_kind_are_refused(
    plant: Block, forward: Block, feedback: Block, delay: float, sentence: str
) -> None:
    with pytest.raises(InputError, match=sentence):
        DelayLoop(plant, forward, feedback, delay)


def test_impossible_requests_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(axis, "CELLS", 20_000)
    with pytest.raises(InputError, match="the number of roots is 0"):
        rightmost_roots(scalar_loop(0.0, -1.0, 0.1), 0)
    with pytest.raises(InputError, match="the loop needs more than"):
        roots_right_of(scalar_loop(0.0, -1.0, 1.0), -20.0)
    with pytest.raises(InputError, match="shorter dead times"):
        rightmost_roots(DelayLoop(Block(3e8, (), (-0.05, -2 + 3000j, -2 - 3000j), 5.0), ONE, NONE, 0.0), 60)
