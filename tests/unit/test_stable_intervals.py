"""Intervals of stable gains, rotations and dead times against closed forms and roots counted by another route."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from design.auditing.as_text import audit_text
from design.auditing.audit_design import audit
from design.blocks.block import Block
from design.chapters_3_4.design_extended import design_extended
from design.design_file import Design
from design.stability import stable_intervals
from design.stability.characteristic_roots import rightmost_roots
from design.stability.delay_loop import DelayLoop
from design.stability.margins import Margins, delay_loop, margins_of
from design.stability.stable_intervals import Interval
from identification.base.errors import InputError
from identification.model.additive_bound import AdditiveBound
from identification.model.model_file import IdentifiedModel
from identification.model.modes import Mode
from identification.model.plant import PlantModel

ONE, NONE = Block(1.0), Block(0.0)
BOUND = AdditiveBound.printed_form(0.01, 2.0, 3.0, 0.5)


def three_frequencies(delay_s: float) -> Design:
    """1/s under three reference frequencies 1, 2, 3 rad/s and T_so with eight poles at -3."""
    plant = PlantModel(1.0, (), (), delay_s)
    return design_extended(IdentifiedModel(plant, BOUND), [1.0, 2.0, 3.0], 3.0, [(6.0, 9.0)] * 3)


def values(intervals: tuple[Interval, ...]) -> list[float]:
    return [end.value for each in intervals for end in each]


def unstable_roots(loop: DelayLoop, factor: complex = 1.0, delay_s: float | None = None) -> int:
    """Roots right of the axis by a winding number in steps of 1 rad at most, none of the tool's code.

    Along both signs of omega. The function is divided by a polynomial of its degree with all roots at -c.
    """
    h = loop.plant.delay_s if delay_s is None else delay_s
    P, K, T = loop.plant.without_delay(), loop.forward, loop.feedback
    zeros, poles = list((P * K).zeros), list((P * K).poles)
    denominator = poles + [pole for pole in T.poles if pole not in poles]
    for pole in set(T.poles):  # as often as in the one that has it more often
        more = T.poles.count(pole) - poles.count(pole)
        denominator += [pole] * max(0, more - (pole not in poles))
    c = max(1.0, *(abs(root) for root in denominator))

    def over(s: np.ndarray, roots: list[complex], cancelled: list[complex]) -> np.ndarray:
        left = list(denominator)
        for pole in cancelled:
            left.remove(pole)
        value, count = np.ones_like(s), len(denominator)
        for k in range(count):
            value = value * (s - left[k] if k < len(left) else 1) * (s - roots[k] if k < len(roots) else 1) / (s + c)
        return value

    def along(omega: np.ndarray) -> np.ndarray:
        s = 1j * omega
        f = over(s, [], []) - T.gain * over(s, list(T.zeros), list(T.poles)) * np.exp(-loop.delay_s * s)
        return np.asarray(f + factor * (P * K).gain * over(s, zeros, poles) * np.exp(-h * s))

    resonances = np.array([abs(root.imag) for root in (*zeros, *denominator)])
    fine = [at + abs(1e-3 * at + 1e-3) * np.linspace(-5, 5, 101) for at in np.unique(resonances)]
    step = 0.2 / max(h, loop.delay_s, 1e-3)
    grid = np.concatenate([np.geomspace(1e-7, 1e8, 8001) * c, np.arange(0, min(400 * c, 2e4 * step), step), *fine])
    omega = np.unique(np.abs(grid))
    omega = np.concatenate([-omega[::-1], omega])
    f = along(omega)
    for _ in range(40):
        steps = np.angle(f[1:] / f[:-1])
        wide = np.flatnonzero(np.abs(steps) > 1)
        if not len(wide):
            break
        middle = (omega[wide] + omega[wide + 1]) / 2
        omega, f = np.insert(omega, wide + 1, middle), np.insert(f, wide + 1, along(middle))
    assert not len(wide), "a root on the axis"
    turns = -(np.sum(steps)) / (2 * np.pi)
    assert abs(turns - round(turns)) < 1e-3
    return round(turns)


def expect_between(loop: DelayLoop, margins: Margins, samples: int, random: np.random.Generator) -> None:
    """Random gains, rotations and dead times are stable if and only if an interval holds them."""
    longest = 2 * max([loop.plant.delay_s, *(v for v in values(margins.delays_s) if np.isfinite(v))]) + 1e-3
    for intervals, drawn, count in (
        (margins.gains, np.exp(random.uniform(-4, 4, samples)), lambda k: unstable_roots(loop, k)),
        (
            margins.phases_deg,
            random.uniform(0, 180, samples),
            lambda p: unstable_roots(loop, np.exp(-1j * np.pi * p / 180)),
        ),
        (margins.delays_s, random.uniform(0, longest, samples), lambda h: unstable_roots(loop, 1.0, h)),
    ):
        ends = np.array(values(intervals))
        for value in drawn:
            if np.min(np.abs(ends - value) / value) > 1e-3:
                held = any(each.least.value < value < each.greatest.value for each in intervals)
                assert (count(float(value)) == 0) == held, (intervals, value)


# designs whose margins were once told wrong


def test_an_upper_gain_factor_above_ten_times_the_fastest_root() -> None:
    """Equal dead times cancel in T_so exp(-h s) - P K, but not in the loop of another gain."""
    design = three_frequencies(0.02)
    margins = margins_of(delay_loop(design, design.plant), BOUND)
    assert values(margins.gains) == pytest.approx([0.3745716, 4.0246622], rel=1e-7)
    assert margins.gain_up.omega == pytest.approx(87.11927, rel=1e-6)
    assert margins.modulus.value == pytest.approx(0.6940477, abs=5e-8)
    expect_between(delay_loop(design, design.plant), margins, 8, np.random.default_rng(1))


def test_a_hole_in_the_true_dead_times() -> None:
    design = three_frequencies(0.08)
    loop = delay_loop(design, design.plant)
    margins = margins_of(loop, BOUND)
    assert len(margins.delays_s) == 2
    assert margins.delays_listed_s == (0, np.inf)
    (none, short), (long, longest) = margins.delays_s
    assert none == (0, None)
    assert [short.value, long.value, longest.value] == pytest.approx([0.01556914, 0.05699903, 0.10443232], rel=1e-6)
    assert (margins.delay_least_s, margins.delay_greatest_s) == (long, longest)
    for delay_s, unstable in (
        (0.015, 0),
        (0.0161, 2),
        (0.02, 2),
        (0.03, 2),
        (0.04, 2),
        (0.05, 2),
        (0.0575, 0),
        (0.109, 2),
    ):
        assert unstable_roots(loop, 1.0, delay_s) == unstable
    expect_between(loop, margins, 8, np.random.default_rng(2))
    said = audit_text(design, audit(design), 1.0)
    assert (
        "true dead times                 0 to 15.57 ms (at 70.71 rad/s) and 57 ms (at 50.68 rad/s) to 104.4 ms" in said
    )


def test_a_design_with_close_frequencies() -> None:
    plant = PlantModel(0.330613, (Mode(6.511, 0.01199),), (Mode(4.641, 0.01122),), 0.00464677)
    design = design_extended(
        IdentifiedModel(plant, BOUND), [1.07321, 1.27896, 0.0], 10.33, [(3.988, 10.05), (14.276, 77.22)]
    )
    loop = delay_loop(design, plant)
    margins = margins_of(loop, BOUND)
    assert margins.gain_up.value == pytest.approx(9.42, abs=0.05)
    expect_between(loop, margins, 6, np.random.default_rng(3))


# closed forms


@pytest.mark.parametrize("gain", [0.02, 1.0, 1.3])
def test_an_integrator_with_dead_time_has_one_interval_each(gain: float) -> None:
    """K/s exp(-h s): factors to pi/(2 K h), whatever their size, rotations to pi/2 - K h, dead times to pi/(2 K)."""
    h = 0.3
    margins = margins_of(DelayLoop(Block(gain / h, (), (0.0,), h), ONE, NONE, 0.0), BOUND)
    assert values(margins.gains) == pytest.approx([0.0, np.pi / (2 * gain)], rel=1e-13)
    assert values(margins.phases_deg) == pytest.approx([0.0, np.degrees(np.pi / 2 - gain)], rel=1e-12)
    assert values(margins.delays_s) == pytest.approx([0.0, np.pi * h / (2 * gain)], rel=1e-13)
    assert margins.delays_listed_s == (0.0, np.inf)


def test_stable_bands_of_dead_times() -> None:
    """(s^2 + 2 z s + 1) y = -g y(t - h): the classic switches, |L| = 1 at two frequencies, in closed form."""
    z, g = 0.01, 0.2
    loop = DelayLoop(Block(g, (), Mode(1.0, z).roots, 0.0), ONE, NONE, 0.0)
    middle, half = 1 - 2 * z**2, np.sqrt((1 - 2 * z**2) ** 2 - 1 + g**2)
    ends = []
    for square, unstable in ((middle + half, 1), (middle - half, -1)):
        omega = np.sqrt(square)
        first = np.mod(np.pi + np.angle(1 / (1 - square + 2j * z * omega)), 2 * np.pi) / omega
        ends += [(first + 2 * np.pi * k / omega, unstable) for k in range(60)]
    number, expected = 0, [0.0]
    for value, change in sorted(ends):
        if number == 0 or number + change == 0:
            expected.append(value)
        number += change
    expected = expected[: 2 * (len(expected) // 2)]
    margins = margins_of(loop, BOUND)
    found = values(margins.delays_s)
    assert len(found) >= 6
    assert found == pytest.approx(expected[: len(found)], rel=1e-11)
    assert margins.delays_listed_s == (0.0, np.inf)
    later = [value for value in expected if value > found[-1] and value < 100]
    assert not later


def test_conditional_stability_has_two_intervals_of_gains() -> None:
    """Against the roots of polynomials, at every gain of a fine scale."""
    L = Block(60.0, (-0.05 + 1j, -0.05 - 1j), (0.0, -0.2 + 0.5j, -0.2 - 0.5j, -3.0, -4.0))
    loop = DelayLoop(L, ONE, NONE, 0.0)
    base = DelayLoop(L.scaled(1e-3), ONE, NONE, 0.0)
    n, d = np.real(np.poly(L.zeros)) * L.gain, np.real(np.poly(L.poles))

    def stable(k: float) -> bool:
        return bool(np.all(np.roots(np.polyadd(d, k * n)).real < 0))

    chosen = loop if stable(1.0) else base
    scale = 1.0 if chosen is loop else 1e-3
    margins = margins_of(chosen, BOUND)
    for k in np.geomspace(1.1e-3, 900, 400):
        held = any(each.least.value < k < each.greatest.value for each in margins.gains)
        assert held == stable(k * scale)


# random loops


def random_loop(random: np.random.Generator) -> DelayLoop:
    """A plant with up to two modes and dead time under an extended design, its model right or not quite."""
    rate = random.uniform(1.5, 8.0)  # a double pole of T_so for each frequency, and a, as fast as this
    h = float(random.choice([0.0, 0.03, 0.1, 0.3, 0.8]) / rate)
    count, number = random.choice([0, 0, 1, 2]), random.integers(1, 4)
    modes = [Mode(random.uniform(2.0, 60.0), random.choice([0.005, 0.05, 0.3])) for _ in range(2 * count)]
    plant = PlantModel(random.uniform(0.2, 5.0), tuple(modes[:count]), tuple(modes[count:]), h)
    design = design_extended(
        IdentifiedModel(plant, BOUND), [1.0, 2.0, 3.0][:number], rate, [(2 * rate, rate**2)] * number
    )
    moved, gain = random.choice([1.0] * 6 + [0.97, 1.04]), plant.gain * random.choice([1.0] * 6 + [1.1])
    return delay_loop(design, dataclasses.replace(plant, gain=gain, delay_s=float(moved) * h))


@pytest.mark.parametrize("seed", range(5))
def test_random_loops_are_stable_in_the_intervals_alone(seed: int) -> None:
    random = np.random.default_rng(seed)
    loop = random_loop(random)
    try:
        margins = margins_of(loop, BOUND)
    except InputError as error:
        assert "right half plane" in str(error)  # noqa: PT017
        assert unstable_roots(loop) > 0
        return
    expect_between(loop, margins, 12, random)
    ends = [end for each in margins.gains for end in each if end.omega is not None]
    for end in ends:
        s = 1j * end.omega
        L = loop.plant(s) * loop.forward(s) / (1 - loop.feedback(s) * np.exp(-loop.delay_s * s))
        assert end.value * complex(L) == pytest.approx(-1, abs=1e-6)


@pytest.mark.parametrize(("unit", "gain"), [(1e-9, 1e-15), (1e-4, 1e15), (1e5, 1e-15), (1e9, 1e15)])
def test_margins_do_not_depend_on_units(unit: float, gain: float) -> None:
    """The same loop with time in another unit and the plant's output in another."""
    design = three_frequencies(0.08)
    loop = delay_loop(design, design.plant)

    def other(block: Block, factor: float) -> Block:
        zeros, poles = (tuple(root / unit for root in roots) for roots in (block.zeros, block.poles))
        return Block(factor * block.gain * unit ** (-block.relative_degree), zeros, poles, block.delay_s * unit)

    moved = DelayLoop(
        other(loop.plant, gain), other(loop.forward, 1 / gain), other(loop.feedback, 1.0), loop.delay_s * unit
    )
    bound = AdditiveBound.printed_form(0.01 * gain, 2.0 / unit, 3.0 / unit, 0.5)
    here, there = margins_of(loop, BOUND), margins_of(moved, bound)
    assert values(there.gains) == pytest.approx(values(here.gains), rel=1e-9)
    assert values(there.phases_deg) == pytest.approx(values(here.phases_deg), rel=1e-9)
    assert np.array(values(there.delays_s)) / unit == pytest.approx(values(here.delays_s), rel=1e-9)
    for name in ("modulus", "T_peak", "W_a_C_S"):
        assert getattr(there, name).value == pytest.approx(getattr(here, name).value, rel=1e-11)
        assert getattr(there, name).omega * unit == pytest.approx(getattr(here, name).omega, rel=1e-4)


# a Smith predictor's roots


@pytest.mark.parametrize(("count", "delay_s"), [(1, 100.0), (7, 0.02), (9, 0.02), (8, 100.0)])
def test_the_roots_of_a_smith_predictor_are_those_given(count: int, delay_s: float) -> None:
    plant = PlantModel(7.1, (Mode(120.0, 0.02),), (Mode(200.0, 0.03),), delay_s)
    frequencies = [1.5] if count == 1 else [1.0 + 0.3 * k for k in range(count)]
    design = design_extended(IdentifiedModel(plant, BOUND), frequencies, 4.0, [(2.0, 1.0)] * count)
    found = rightmost_roots(delay_loop(design, plant), 5)
    moved = found.roots[~found.hidden]
    assert sorted(moved.real) == [-4.0] * 2 + [-1.0] * (2 * count)
    assert not np.any(moved.imag)


def test_a_long_dead_time_is_told_in_digits_that_show_its_margin() -> None:
    plant = PlantModel(7.105, (Mode(120.0, 0.02),), (Mode(200.0, 0.03),), 10.0)
    design = design_extended(IdentifiedModel(plant, BOUND), [1.5], 4.0, [(2.0, 1.0)])
    said = audit_text(design, audit(design), 1.0)
    assert "rightmost characteristic roots  -1 (2 times), -4 (2 times)\n" in said
    assert (
        "true dead times                 9.99032 s (at 46.85 rad/s) to 10.0097 s (at 46.49 rad/s); those above " in said
    )
    assert "1e+04" not in said


def test_crossings_and_counts_that_disagree_are_an_error(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(stable_intervals, "roots_right_of", lambda *_: 2)
    with pytest.raises(InputError, match="the argument principle counts 2 unstable roots, the crossings"):
        margins_of(DelayLoop(Block(1.0, (), (0.0,), 0.1), ONE, NONE, 0.0), BOUND)
