"""The interpolation problem of the H-infinity stabiliser: its proofs against Nehari in 60 digits, and in any units."""

from __future__ import annotations

import dataclasses
import math
from functools import cache

import numpy as np
import pytest
from flint import acb, arb_poly, ctx
from nehari import nehari_excess

from design.blocks.ball import UndecidedError, decided, negative_pivot, polynomial_roots
from design.blocks.block import Block
from design.chapter_2.design_delay_free import stabiliser_problem
from design.hinf.closed_loop_norm import closed_loop_norm, closed_loop_poles
from design.hinf.mixed_sensitivity import Synthesis, mixed_sensitivity
from identification.base.digits import lower_end, upper_end
from identification.model.additive_bound import AdditiveBound
from identification.model.modes import Mode
from identification.model.plant import PlantModel

Case = tuple[PlantModel, AdditiveBound, tuple[float], float]  # plant, bound, reference in rad/s, epsilon


def random_case(seed: int) -> Case:
    """0 to 3 mode pairs, W_a of order 1 to 4, gains over twelve decades, time units over six."""
    rng = np.random.default_rng(seed)
    time, gain, pairs, order = 10 ** rng.uniform(-3, 3), 10 ** rng.uniform(-6, 6), rng.integers(0, 4), seed % 4 + 1

    def mode(omega: float) -> Mode:
        return Mode(float(omega), float(10 ** rng.uniform(-2.5, -0.5)))

    omegas = np.sort(10 ** rng.uniform(1.5, 3.5, 2 * pairs)) / time
    corners = 10 ** rng.uniform(1.5, 3.5, 5) / time
    reference = 10 ** rng.uniform(-0.7, 1.0) / time
    plant = PlantModel(
        float(gain / time),
        tuple(mode(omega) for omega in omegas[::2]),
        tuple(mode(omega) for omega in omegas[1::2]),
        0.0,
    )
    bound = AdditiveBound(
        float(gain * 10 ** rng.uniform(-4, -2)),
        tuple(mode(omega) for omega in corners[: (order - 1) // 2]),
        tuple(mode(omega) for omega in corners[2 : 2 + order // 2]),
        () if order % 2 else (float(corners[1]),),
        (float(corners[4]),) if order % 2 else (),
    )
    epsilon = float((reference * 10 ** rng.uniform(-3, -0.5)) ** 2)
    return plant, bound, (float(reference),), epsilon


def in_units(case: Case, time: float, gain: float) -> Case:
    """The same plant in another unit of time and of its output."""
    plant, bound, (omega,), epsilon = case

    def modes(old: tuple[Mode, ...]) -> tuple[Mode, ...]:
        return tuple(Mode(mode.omega / time, mode.zeta) for mode in old)

    def rates(old: tuple[float, ...]) -> tuple[float, ...]:
        return tuple(rate / time for rate in old)

    scaled = [
        dataclasses.replace(
            part,
            gain=part.gain * factor,
            zero_modes=modes(part.zero_modes),
            pole_modes=modes(part.pole_modes),
            real_zeros=rates(part.real_zeros),
            real_poles=rates(part.real_poles),
        )
        for part, factor in ((plant, gain / time), (bound, gain))
    ]
    return *scaled, (omega / time,), epsilon / time**2


@cache
def synthesise(case: Case) -> tuple[Block, Synthesis]:
    _, problem = stabiliser_problem(*case)
    return mixed_sensitivity(problem.G, problem.W1, problem.W2, problem.decay_rate)


def in_old_units(K: Block, case: Case, time: float, gain: float) -> Block:
    """K back from the units of :func:`in_units`; G_A = B/Lambda has B(0) = gain/time and a monic Lambda."""
    zeros, poles = (tuple(root * time for root in roots) for roots in (K.zeros, K.poles))
    degree = max(4, 2 * len(case[0].zero_modes))
    return Block(K.gain * time**K.relative_degree * time ** (degree - 1) * gain, zeros, poles)


@pytest.mark.parametrize("seed", [0, 1, 6, 7])
def test_what_is_proved_is_true(seed: int) -> None:
    """The lower bounds and the achieved norms; gamma_lower against Nehari's theorem in 60 digits.

    Of plants with 1, 0, 3 and 2 pairs of modes and a W_a of order 1, 2, 3 and 4.
    """
    _, problem = stabiliser_problem(*random_case(seed))
    K, found = mixed_sensitivity(problem.G, problem.W1, problem.W2, problem.decay_rate)
    assert nehari_excess(problem.W1, problem.W2, found.gamma_lower, 60) > 0
    assert nehari_excess(problem.W1, problem.W2, found.gamma_lower * (1 + 1.01e-4), 60) < 0
    assert found.gamma_line_lower <= found.gamma_line <= 1.01 * found.gamma_line_lower
    assert found.gamma_lower <= found.gamma
    assert max(pole.real for pole in closed_loop_poles(problem.G, K)) < -problem.decay_rate


@pytest.mark.parametrize(
    ("seed", "time", "gain"),
    [(0, 2.0**30, 1.0), (1, 2.0**-30, 2.0**50), (2, 1.0, 2.0**-50), (3, 2.0**30, 2.0**50)],
)
def test_powers_of_two_as_units_change_no_bit(seed: int, time: float, gain: float) -> None:
    case = random_case(seed)
    (old_K, old), (new_K, new) = synthesise(case), synthesise(in_units(case, time, gain))
    assert (new.gamma_lower, new.gamma, new.gamma_line_lower, new.gamma_line) == (
        old.gamma_lower,
        old.gamma,
        old.gamma_line_lower,
        old.gamma_line,
    )
    assert in_old_units(new_K, case, time, gain) == old_K


@pytest.mark.parametrize(
    ("seed", "time", "gain"),
    [
        *((0, 1e9, 1e-15), (1, 1e-9, 1e15), (2, 1.0, 1e-15), (3, 1e6, 3.0)),
    ],
)
def test_the_design_is_the_same_in_any_units(seed: int, time: float, gain: float) -> None:
    case = random_case(seed)
    (old_K, old), (new_K, new) = synthesise(case), synthesise(in_units(case, time, gain))
    for name in ("gamma_lower", "gamma", "gamma_line_lower", "gamma_line"):
        assert getattr(new, name) == pytest.approx(getattr(old, name), rel=1e-9)
    K = in_old_units(new_K, case, time, gain)
    assert K.gain == pytest.approx(old_K.gain, rel=1e-9)
    for there, here in ((K.zeros, old_K.zeros), (K.poles, old_K.poles)):
        assert len(there) == len(here)
        distances = np.abs(np.subtract.outer(np.array(there), np.array(here))).min(axis=0)
        assert np.all(distances <= 1e-9 * np.abs(here))


def test_an_infimum_that_rounding_misplaced() -> None:
    """Between 0.01489807 and 0.01489808 by Nehari's theorem in 60 and 120 digits; 0.0149032 is above it."""
    plant = PlantModel(
        0.18081472026110704,
        (
            Mode(125.74494070326546, 0.08621137327007937),
            Mode(757.5914072441781, 0.02435853805584332),
            Mode(1931.6566051513055, 0.1624018384779096),
        ),
        (
            Mode(285.22412709445877, 0.007162161331998486),
            Mode(1131.4251140432257, 0.036023725064313734),
            Mode(3338.1184394249476, 0.0036163358511111135),
        ),
        0.0442524828336852,
    )
    bound = AdditiveBound.printed_form(
        0.00015889051248297724, 92.07582172960379, 417.1357314232856, 0.025453737556454782
    )
    _, problem = stabiliser_problem(plant, bound, [math.tau / 13.390762610209944], 1e-4)
    _, found = mixed_sensitivity(problem.G, problem.W1, problem.W2, problem.decay_rate)
    assert 0.0148981 / (1 + 2e-4) < found.gamma_lower < 0.0148981
    assert nehari_excess(problem.W1, problem.W2, found.gamma_lower, 60) > 0
    assert nehari_excess(problem.W1, problem.W2, 0.0149032, 60) < 0


@pytest.mark.parametrize("period", [0.02, 0.020944, 0.021, 0.05, 1.0, 10.0])
def test_a_plant_far_faster_than_its_reference(period: float) -> None:
    """One real pole at 3e6 rad/s and W_a as far: eight decades between the slowest root and the fastest."""
    plant = PlantModel(3419.083098809311, (), (), 0.0, 1, (1709.6918018767112,), (3078760.8005179977,))
    bound = AdditiveBound.printed_form(0.3967886428549875, 595489.4621034386, 3078760.8005179977, 0.548136899856326)
    _, found = synthesise((plant, bound, (math.tau / period,), 1e-4))
    assert found.gamma_line <= 1.01 * found.gamma_line_lower


def test_the_bound_on_a_norm_holds_beside_narrow_peaks() -> None:
    """S = (s + 1)/(s + 2) under a weight with six resonances of equal height, 1e-6 of a decade wide."""
    poles = [complex(-1e-6 * omega, sign * omega) for omega in (1.0, 3.0, 9.0, 27.0, 81.0, 243.0) for sign in (1, -1)]
    zeros = [complex(-1e-3 * abs(pole), pole.imag) for pole in poles]
    G, W1, W2, K = Block(1.0, (), (-1.0,)), Block(1.0, tuple(zeros), tuple(poles)), Block(1e-3, (-1.0,)), Block(1.0)
    s = 1j * np.array([1.0, 3.0, 9.0, 27.0, 81.0, 243.0])
    peaks = np.hypot(np.abs(W1(s) * (s + 1) / (s + 2)), np.abs(W2(s) / (s + 2)))
    assert closed_loop_norm(G, W1, W2, K) == pytest.approx(peaks.max(), rel=1e-5)
    assert closed_loop_norm(G, W1, W2, K) >= peaks.max()


def test_roots_are_enclosed() -> None:
    with ctx.workprec(256):
        roots = polynomial_roots(arb_poly([-6, 11, -6, 1]) * arb_poly([5, 2, 1]))
        assert sorted(round(float(root.real)) for root in roots if root.imag == 0) == [1, 2, 3]
        assert all(any(root.contains(known) for root in roots) for known in (1, 2, 3, acb(-1, 2), acb(-1, -2)))
        with pytest.raises(UndecidedError):
            polynomial_roots(arb_poly([1, 2, 1]))


def test_what_no_precision_decides() -> None:
    tried: list[int] = []

    def never() -> None:
        tried.append(ctx.prec)
        raise UndecidedError

    assert decided(never) is None
    assert tried == sorted(set(tried))
    assert len(tried) > 1


def test_negative_pivots() -> None:
    def matrix(corner: float) -> list[list[acb]]:
        return [[acb(4), acb(0, 2)], [acb(0, -2), acb(corner)]]

    assert negative_pivot(matrix(1.5)) is None
    assert negative_pivot(matrix(0.5)) == pytest.approx(-1.0)
    with pytest.raises(UndecidedError):
        negative_pivot(matrix(1.0))


@pytest.mark.parametrize("value", [0.01490316, 1.0, 123456.7, 9.99999e-7])
def test_ends_are_rounded_outwards(value: float) -> None:
    for digits in (3, 6):
        low, high = (float(end(value, digits)) for end in (lower_end, upper_end))
        assert low <= value <= high
        assert high - low <= value * 10.0 ** (1 - digits)
    assert lower_end(0.7, 4) == upper_end(0.7, 4) == "0.7"
