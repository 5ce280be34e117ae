"""The referee of benchmarks/referee knows closed forms, sees faults, and finds none in a few cases of each kind."""

from __future__ import annotations

import math
from dataclasses import replace
from importlib import import_module

import numpy as np
import pytest

from benchmarks.referee import loop as loops
from benchmarks.referee import margins
from benchmarks.referee.__main__ import KINDS, main, referee, table
from benchmarks.referee.cases import Case, Finding
from benchmarks.referee.factors import Factors, Loop
from benchmarks.referee.nehari import optimum
from benchmarks.referee.roots import compare
from benchmarks.referee.winding import characteristic

SEED, FIRST, CASES = 5, 2, 2
"""A design of each chapter, between them every quantity; ``make referee`` judges hundreds."""


@pytest.mark.parametrize("kind", KINDS)
def test_cases_of_each_kind(kind: str) -> None:
    (tally,) = referee(SEED, CASES, [kind], FIRST)
    assert tally.cases == CASES
    assert sum(tally.refused.values()) < CASES / 2
    assert tally.findings
    assert not tally.fails, table([tally])


def delayed_integrator(gain: float, delay_s: float) -> Loop:
    """u = r - y with P = gain exp(-delay s)/s."""
    return Loop(Factors(gain, (), (0j,)), Factors(1.0), Factors(0.0), 0.0, delay_s)


@pytest.mark.parametrize(("gain", "delay_s"), [(2.0, 0.3), (1e-6, 1e5), (3e4, 1e-6)])
def test_winding_knows_the_delayed_integrator(gain: float, delay_s: float) -> None:
    """Pairs of roots cross at k = (pi/2 + 2 pi n)/(gain delay); the phase margin is pi/2 - gain delay."""
    loop = delayed_integrator(gain, delay_s)
    first = math.pi / 2 / (gain * delay_s)
    for n in range(3):
        crossing = first * (1 + 4 * n)
        assert characteristic(loop, crossing * (1 - 1e-6)).count() == 2 * n
        assert characteristic(loop, crossing * (1 + 1e-6)).count() == 2 * n + 2
    phase = math.pi / 2 - gain * delay_s
    counts = [characteristic(loop, np.exp(-1j * phase * share)).count() for share in (1 - 1e-6, 1 + 1e-6)]
    assert counts == [0, 1]
    assert characteristic(loop, 1.0, math.pi / 2 / gain * (1 + 1e-6)).count() == 2


def test_winding_knows_polynomials() -> None:
    """Roots on both sides of a line, multiple ones too, without a dead time."""
    random = np.random.default_rng(1)
    for _ in range(50):
        zeros = tuple(complex(zero) for zero in random.uniform(-5, 5, 3))
        loop = Loop(Factors(random.uniform(-30, 30), zeros, (-1 + 0j,) * 4), Factors(1.0), Factors(0.0), 0.0, 0.0)
        coefficients = np.polyadd(np.poly([-1.0] * 4), loop.plant.gain * np.poly(np.real(zeros)))
        roots, line = np.roots(coefficients), float(random.uniform(-3, 3))
        assert characteristic(loop).count(line) == np.sum(roots.real > line)


def test_a_hole_in_the_dead_times_is_no_margin() -> None:
    """The interval around the loop's own dead time ends where the first unstable one begins."""
    low, high = margins._interval(lambda delay: not 1.0 < delay < 2.0 and delay < 5.0, np.linspace(0, 10, 101), 3.0)
    assert (low, high) == pytest.approx((2.0, 5.0), rel=1e-9)


def test_roots_that_are_missing_or_elsewhere_are_seen() -> None:
    """Of (s + 1)^2 (s + 2)."""
    own = characteristic(Loop(Factors(0.0), Factors(1.0), Factors(-1e-30, (), (-1 + 0j, -1 + 0j, -2 + 0j)), 0.0, 0.0))
    fine = np.full(3, 1e-6)

    def beyond(roots: list[float]) -> set[str]:
        found = compare(own, np.array(roots, dtype=complex), fine[: len(roots)])
        return {finding.quantity for finding in found if finding.share > 1}

    assert beyond([-1.0, -1.0, -2.0]) == set()
    assert beyond([-1.0, -1.0]) == set()
    assert beyond([-1.0, -2.0]) == {"roots where they are said to be", "roots right of the last one"}
    assert beyond([-1.0, -1.0, -2.1]) == {"roots where they are said to be"}
    assert beyond([]) == {"a root is named"}


def test_runge_kutta_knows_the_delayed_integrator() -> None:
    """y' = K (1 - y(t - h)) is a polynomial on each piece; and the error that the two steps show is the true one."""
    K, h, step = 2.0, 0.3, 0.3 / 40
    system, delays = loops._assembled(delayed_integrator(K, h), None)
    one = loops.Reference((0.0,), (0.0,), (0.0,), 1.0)
    u, y = loops._run(system, delays, step, 120, one, math.inf)
    t = np.arange(121) * step
    late, later = np.maximum(t - h, 0), np.maximum(t - 2 * h, 0)
    np.testing.assert_allclose(y, K * late - K**2 * later**2 / 2, atol=1e-13)
    np.testing.assert_allclose(u, 1 - y, atol=1e-13)
    # saturated at 0.5, y rises at half the speed
    _, slow = loops._run(system, delays, step, 60, one, 0.5)
    np.testing.assert_allclose(slow[:80], K * 0.5 * late[:61][:80], atol=1e-13)


def test_a_run_that_is_off_is_seen() -> None:
    fine = np.sin(np.linspace(0, 3, 50))
    assert loops.compared("y", [fine] * 3, fine).share <= 1
    assert loops.compared("y", [fine] * 3, fine + 1e-7).share > 1
    late = np.concatenate([np.zeros(2), fine[2:]])
    assert loops.compared("y", [fine] * 3, late).disagreement == pytest.approx(1.0)
    assert loops.compared("y", [1.5 * fine, 1.1 * fine, fine], late).allowed == math.inf


def test_nehari_knows_what_can_be_said_by_hand() -> None:
    """T(1) = 1 at an unstable pole costs |W2(1)| = 2, and T = 2/(s + 1) no more; of constants pointwise is best."""
    unstable, W2 = Factors(1.0, (), (1 + 0j,)), Factors(1.0, (-1 + 0j,))
    assert optimum(unstable, Factors(1e-6, (), (-1 + 0j,)), W2, 1.0) == pytest.approx(2.0, rel=1e-6)
    stable = Factors(1.0, (-1 + 0j,), (-2 + 0j,))
    assert optimum(stable, Factors(3.0), Factors(4.0), 1.0) == pytest.approx(12 / 5, rel=1e-6)
    on_axis = Factors(1.0, (), (0j,))
    assert optimum(on_axis, Factors(1e-3, (), (-1 + 0j,)), W2, 1.0) == pytest.approx(1.0, rel=1e-6)


def test_the_command_says_what_is_beyond(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    module = import_module("benchmarks.referee.conditions")
    monkeypatch.setattr(module, "check", lambda case: [Finding("made up", 2.0 if case.index == 1 else 0.1, 1.0)])
    assert main(["--cases", "3", "--seed", "8", "--kinds", "conditions"]) == 1
    assert "8/1" in capsys.readouterr().out
    assert main(["--cases", "1", "--seed", "8", "--kinds", "conditions"]) == 0


def test_a_case_is_the_same_each_time_and_another_one_is_another() -> None:
    first, again, other = Case(3, 4), Case(3, 4), Case(3, 5)
    assert first.model == again.model
    assert first.options == again.options
    assert first.model != other.model
    assert replace(first, index=5) == other
