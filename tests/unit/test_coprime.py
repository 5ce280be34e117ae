"""Theorem 2.1.1: the Bezout equation, every stabilising controller, and none that does not stabilise."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from design.blocks.block import Block, geometric_scale, plant_block
from design.design_file import Design
from design.stability.coprime import (
    CoprimeFactors,
    add,
    common_denominator,
    controller,
    coprime_factors,
    evaluate,
    parameter,
)
from identification.base.errors import InputError
from identification.model.model_file import IdentifiedModel

S = 1j * np.geomspace(1e-2, 3e3, 300) + 0.01
often = settings(max_examples=100, deadline=None, derandomize=True)

# distinct speeds, so that no pole is nearly a zero and no root multiple
SPEEDS = np.geomspace(1.0, 40.0, 14)


@st.composite
def roots(draw: st.DrawFn, speeds: list[float], count: int, unstable: bool) -> tuple[complex, ...]:
    found: list[complex] = []
    while len(found) < count:
        speed = speeds.pop()
        side = draw(st.sampled_from([-1.0, 1.0])) if unstable else -1.0
        if count - len(found) > 1 and draw(st.booleans()):
            zeta = draw(st.floats(0.05, 0.9))
            root = speed * complex(side * zeta, np.sqrt(1 - zeta**2))
            found += [root, root.conjugate()]
        else:
            found.append(complex(side * speed))
    return tuple(found)


@st.composite
def plants(draw: st.DrawFn) -> Block:
    """1 to 6 poles, one of them perhaps at 0, as many zeros or fewer, both on both sides of the axis."""
    speeds = draw(st.permutations(list(SPEEDS)))
    order = draw(st.integers(1, 6))
    poles = draw(roots(speeds, order, unstable=True))
    if draw(st.booleans()) and poles[-1].imag == 0:
        poles = (*poles[:-1], 0j)
    zeros = draw(roots(speeds, draw(st.integers(0, order)), unstable=True))
    gain = draw(st.sampled_from([-1.0, 1.0])) * draw(st.floats(0.2, 5.0))
    unit = np.prod([abs(root) or 1.0 for root in poles]) / np.prod([abs(root) for root in zeros])
    return Block(gain * float(unit), zeros, poles)


@st.composite
def stable_blocks(draw: st.DrawFn) -> Block:
    speeds = draw(st.permutations(list(0.9 * SPEEDS)))
    order = draw(st.integers(0, 3))
    poles = draw(roots(speeds, order, unstable=False))
    zeros = draw(roots(speeds, draw(st.integers(0, order)), unstable=True))
    unit = np.prod([abs(root) for root in poles]) / np.prod([abs(root) for root in zeros])
    return Block(draw(st.floats(-3.0, 3.0)) * float(unit), zeros, poles)


def factors_of(plant: Block) -> CoprimeFactors:
    """Closed-loop poles at about the speeds of the plant's own, well damped and distinct."""
    speeds = [abs(pole) or 1.3 for pole in plant.poles]
    spread = 1 + 0.07 * np.arange(len(speeds))
    chosen = tuple(complex(-speed * factor) for speed, factor in zip(speeds, spread, strict=True))
    observer = tuple(1.5 * root for root in chosen[1:])
    return coprime_factors(plant, chosen, observer)


def closed_loop_poles(plant: Block, C: Block) -> np.ndarray:
    """Roots of d d_C + n n_C, by numpy from the factors, nothing cancelled."""
    scale = geometric_scale(plant, C)
    n, d, n_C, d_C = (np.poly(np.array(r) / scale) for r in (plant.zeros, plant.poles, C.zeros, C.poles))
    gain = plant.gain * C.gain * scale ** -(plant.relative_degree + C.relative_degree)
    total = np.polyadd(np.polymul(d, d_C), gain * np.polymul(n, n_C))
    return np.asarray(np.roots(total.real) * scale)


@pytest.mark.parametrize("a", [0.7, 4.0, 30.0])
def test_example_of_section_2_1(a: float) -> None:
    factors = coprime_factors(Block(1.0, (), (a,)), (-a,))
    assert factors == CoprimeFactors(
        N_p=Block(1.0, (), (-a,)), D_p=Block(1.0, (a,), (-a,)), X=Block(2 * a), Y=Block(1.0)
    )
    Q = Block(3.0, (-5.0,), (-2.0, -7.0))
    expected = (2 * a + (S - a) / (S + a) * Q(S)) / (1 - Q(S) / (S + a))
    np.testing.assert_allclose(controller(factors, Q)(S), expected, rtol=1e-10)


@pytest.mark.parametrize("a", [0.5, 4.0, 30.0])
def test_integrator_of_chapter_3(a: float) -> None:
    """(3.7)-(3.8): 1/(s + a), s/(s + a), a and 1."""
    factors = coprime_factors(Block(1.0, (), (0.0,)), (-a,))
    assert factors == CoprimeFactors(N_p=Block(1.0, (), (-a,)), D_p=Block(1.0, (0.0,), (-a,)), X=Block(a), Y=Block(1.0))


def test_the_thesis_controller_is_one_of_them(extended_design: Design) -> None:
    """(4.2) is Theorem 2.1.1 for 1/s; and its Q comes back from C_0."""
    Q, C_0 = extended_design.blocks["Q"], extended_design.blocks["C0"]
    factors = coprime_factors(Block(1.0, (), (0.0,)), (-float(extended_design.free.a),))
    C = controller(factors, Q)
    np.testing.assert_allclose(C(S), C_0(S), rtol=1e-10)
    assert len(C.poles) == len(C_0.poles)
    found = parameter(factors, C_0)
    assert found.is_stable
    np.testing.assert_allclose(found(S), Q(S), rtol=1e-7)


def test_stable_plant_with_its_own_poles_is_its_own_factor() -> None:
    plant = Block(3.0, (2.0,), (-1.0, -2 + 5j, -2 - 5j))
    factors = coprime_factors(plant, plant.poles, (-3.0, -4.0))
    assert (factors.N_p, factors.D_p) == (plant, Block(1.0))
    assert factors.X.gain == 0
    np.testing.assert_allclose(factors.Y(S), 1.0, rtol=1e-12)
    Q = Block(1.0, (), (-6.0,))
    np.testing.assert_allclose(controller(factors, Q)(S), Q(S) / (1 - plant(S) * Q(S)), rtol=1e-9)


def test_the_thesis_plant_without_its_dead_time(implied: IdentifiedModel) -> None:
    """An integrator and modes up to 960 rad/s; the slow closed-loop pole takes the integrator's place."""
    plant = plant_block(implied.plant).without_delay()
    damped = tuple(complex(-0.3 * abs(pole), pole.imag) for pole in plant.poles if pole)
    factors = coprime_factors(plant, (-4.0, *damped), tuple(1.1 * root for root in damped))
    identity = factors.X(S) * factors.N_p(S) + factors.Y(S) * factors.D_p(S)
    np.testing.assert_allclose(identity, 1.0, rtol=0, atol=1e-11)
    C = controller(factors, Block(0.1, (), (-5.0,)))
    assert np.all(closed_loop_poles(plant, C).real < 0)


@often
@given(plant=plants())
def test_bezout_identity_of_random_plants(plant: Block) -> None:
    factors = factors_of(plant)
    for block in (factors.N_p, factors.D_p, factors.X, factors.Y):
        assert block.is_stable
        assert block.relative_degree >= 0
    s = np.concatenate([S, S.imag, 1j * S.imag, [0.0]])
    identity = factors.X(s) * factors.N_p(s) + factors.Y(s) * factors.D_p(s)
    np.testing.assert_allclose(identity, 1.0, rtol=0, atol=1e-8)
    np.testing.assert_allclose(factors.N_p(S) / factors.D_p(S), plant(S), rtol=1e-9)
    right = {root for root in factors.N_p.zeros if root.real >= 0}
    assert not right & {root for root in factors.D_p.zeros if root.real >= 0}
    for root in right:  # so that no common zero is near either
        assert abs(factors.Y(root) * factors.D_p(root) - 1) < 1e-8


@often
@given(plant=plants(), Q=stable_blocks())
def test_every_stable_parameter_stabilises(plant: Block, Q: Block) -> None:
    factors = factors_of(plant)
    C = controller(factors, Q)
    assert np.all(closed_loop_poles(plant, C).real < 0)
    np.testing.assert_allclose(
        C(S) * (factors.Y(S) - factors.N_p(S) * Q(S)), factors.X(S) + factors.D_p(S) * Q(S), rtol=1e-5, atol=1e-8
    )


@often
@given(plant=plants(), Q=stable_blocks())
def test_every_stabilising_controller_has_a_stable_parameter(plant: Block, Q: Block) -> None:
    """From another factorisation's controller, so that the parameter is not the one put in."""
    factors = factors_of(plant)
    other = coprime_factors(
        plant, tuple(1.3 * root for root in factors.N_p.poles), tuple(0.6 * root for root in factors.N_p.poles[1:])
    )
    C = controller(other, Q)
    found = parameter(factors, C)
    assert found.is_stable
    np.testing.assert_allclose(controller(factors, found)(S), C(S), rtol=1e-4)


@often
@given(plant=plants(), C=stable_blocks())
def test_a_parameter_is_stable_only_for_a_stabilising_controller(plant: Block, C: Block) -> None:
    factors = factors_of(plant)
    poles = closed_loop_poles(plant, C)
    assume(np.all(np.abs(poles.real) > 1e-6 * np.abs(poles)))  # else rounding says on which side they are
    assert parameter(factors, C).is_stable == bool(np.all(poles.real < 0))


def test_sum_of_blocks_is_over_the_least_common_denominator() -> None:
    first, second = Block(2.0, (-1.0,), (-3.0, -3.0, -4.0)), Block(-5.0, (), (-3.0, -7.0))
    assert sorted(root.real for root in common_denominator(first, second).zeros) == [-7.0, -4.0, -3.0, -3.0]
    total = add(first, second)
    assert len(total.poles) == 4
    np.testing.assert_allclose(total(S), first(S) + second(S), rtol=1e-10)
    assert add(first, first.scaled(-1.0)).gain == 0
    # the leading coefficients cancel: relative degree 2, not 1
    assert add(Block(1.0, (), (-1.0,)), Block(-1.0, (), (-2.0,))).relative_degree == 2


def test_value_and_derivative_of_a_sum() -> None:
    terms = (Block(2.0, (-1.0, 3.0), (-5.0,), 0.02), Block(-1.5, (), (-2 + 9j, -2 - 9j), 0.3), Block(0.7, (2.0,)))
    value, slope, magnitude = evaluate(terms, S)
    np.testing.assert_allclose(value, sum(term(S) for term in terms), rtol=1e-12)
    np.testing.assert_allclose(magnitude, sum(np.abs(term(S)) for term in terms), rtol=1e-12)
    step = 1e-5 * (1 + np.abs(S))
    difference = (evaluate(terms, S + step)[0] - evaluate(terms, S - step)[0]) / (2 * step)
    np.testing.assert_allclose(slope, difference, rtol=1e-6)
    on_a_root = evaluate((Block(4.0, (-1.0, -1.0 + 0j)), Block(3.0, (-1.0,))), -1.0)
    assert (on_a_root[0], on_a_root[1]) == (0.0, 3.0)


@pytest.mark.parametrize(
    ("plant", "sentence"),
    [
        (Block(0.0, (), (-1.0,)), "gain other than 0"),
        (Block(2.0), "a pole or more"),
        (Block(1.0, (), (-1.0,), 0.1), "dead time 0.1 s"),
        (Block(1.0, (-2.0, -3.0), (-1.0,)), "2 zeros, 1 poles"),
        (Block(1.0, (3.0,), (-1.0, 3.0)), "also its zero"),
        (Block(1.0, (3.0 + 1e-12,), (-1.0, 3.0)), "nearly its zero"),
    ],
)
def test_plants_without_coprime_factors_are_refused(plant: Block, sentence: str) -> None:
    count = len(plant.poles)
    with pytest.raises(InputError, match=sentence):
        coprime_factors(plant, (-5.0,) * count, (-6.0,) * (count - 1))


def test_a_plant_too_hard_for_the_arithmetic_is_refused() -> None:
    """A fast unstable pair behind slow lags: X N_p and Y D_p are 1e8 large between, and their sum is 1."""
    slow = (0.0, -0.2 + 0.77j, -0.2 - 0.77j, -1.26)
    plant = Block(-3.2e4, (), (*slow, 175 + 97j, 175 - 97j))
    roots = tuple(-(abs(root) or 1.3) * (1 + 0.07 * k) for k, root in enumerate(plant.poles))
    with pytest.raises(InputError, match="differs from 1"):
        coprime_factors(plant, roots, tuple(1.5 * root for root in roots[1:]))


@pytest.mark.parametrize(
    ("chosen", "observer", "sentence"),
    [
        ((-1.0,), (-2.0,), "needs 2 and 1"),
        ((-1.0, -2.0), (), "needs 2 and 1"),
        ((-1.0, 0.5), (-2.0,), r"root 0.5\+0j is not stable"),
        ((-1.0, -2.0), (0.0,), "is not stable"),
    ],
)
def test_roots_that_cannot_be_closed_loop_poles_are_refused(
    chosen: tuple[complex, ...], observer: tuple[complex, ...], sentence: str
) -> None:
    with pytest.raises(InputError, match=sentence):
        coprime_factors(Block(1.0, (), (0.0, 2.0)), chosen, observer)


@pytest.mark.parametrize(
    ("Q", "sentence"),
    [
        (Block(1.0, (), (1.0,)), "expected stable poles"),
        (Block(1.0, (), (0.0,)), "expected stable poles"),
        (Block(1.0, (-1.0,)), "no more zeros than poles"),
        (Block(1.0, (), (-1.0,), 0.1), "dead time 0.1 s"),
    ],
)
def test_parameters_outside_the_theorem_are_refused(Q: Block, sentence: str) -> None:
    factors = coprime_factors(Block(1.0, (), (2.0,)), (-3.0,))
    with pytest.raises(InputError, match=sentence):
        controller(factors, Q)


def test_a_vanishing_denominator_is_refused() -> None:
    factors = coprime_factors(Block(2.0, (-3.0,), (1.0,)), (-4.0,))
    Y_over_N = factors.Y * factors.N_p.inverse()
    with pytest.raises(InputError, match="vanishes"):
        controller(factors, Y_over_N)
    with pytest.raises(InputError, match="improper"):  # zero at infinity only
        controller(factors, add(Y_over_N, Block(1.0, (), (-5.0,))))
    with pytest.raises(InputError, match="well posed"):
        parameter(factors, (factors.D_p * factors.N_p.inverse()).scaled(-1.0))
    with pytest.raises(InputError, match="dead time"):
        parameter(factors, Block(1.0, (), (), 0.1))
