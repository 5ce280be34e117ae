"""The bounds on the windup, put to the test: by hundreds of runs of a plain simulation, and by the engine."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

import numpy as np
import pytest

from design.anti_windup.kyp_certificate import Storage, certificate, proved_storage
from design.blocks.block import Block
from design.chapters_3_4.design_extended import design_extended
from design.design_file import Design
from experiments.campaign.draw_plants import PlantsWithin
from experiments.engine.simulate import simulate
from experiments.runs.design_loop import design_loop
from experiments.runs.guarantee import guarantee
from experiments.runs.references import Reference, sinusoid
from experiments.runs.sector_promise import judge_run, steady_control
from experiments.runs.verdict import Verdict
from experiments.runs.windup_bound import after_run_of_any_plant, before_run, with_states
from identification.model.additive_bound import AdditiveBound
from identification.model.model_file import IdentifiedModel
from identification.model.modes import Mode
from identification.model.plant import PlantModel
from tests.unit.test_sector_promise import CHAPTER_4, LIMIT_CYCLE

RUNS, STEPS, STEP = 300, 2500, 5e-3
KINDS = {
    "washout": Block(1.0, (0j,), (-3 + 0j,)),
    "lag": Block(1.0, (-1 + 0j,), (-6 + 0j,)),
    "notch": Block(1.0, (0j, -0.5 + 6j, -0.5 - 6j), (-1 + 0j, -7 + 0j, -7 + 0j)),
}
LIMITS = (-1.0, 1.6)


def plainly(storage: Storage, start: np.ndarray, linear: Callable[[int], np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """|u~| integrated up to each step, and V there, of runs u = v - C x, x' = A x + b u~, by Heun's rule."""

    def beyond(x: np.ndarray, v: np.ndarray) -> np.ndarray:
        u = v - x @ storage.C
        return np.asarray(u - np.clip(u, *LIMITS))

    x, total = start, np.zeros(len(start))
    totals, stored = [total], [storage.value(x)]
    for k in range(STEPS):
        v = linear(k)
        first = beyond(x, v)
        slope = x @ storage.A.T + np.outer(first, storage.b)
        ahead = x + STEP * slope
        second = beyond(ahead, v)
        x = x + STEP / 2 * (slope + ahead @ storage.A.T + np.outer(second, storage.b))
        total = total + STEP / 2 * (np.abs(first) + np.abs(second))
        totals.append(total)
        stored.append(storage.value(x))
    return np.array(totals), np.array(stored)


@pytest.mark.parametrize("name", KINDS)
def test_the_windup_is_bounded_from_any_state(name: str) -> None:
    """v jumps at random between what keeps delta from the limits."""
    storage, rng = proved_storage(KINDS[name], certificate(KINDS[name])), np.random.default_rng(1)
    start = rng.standard_normal((RUNS, len(storage.b))) * 10 ** rng.uniform(-1, 1, (RUNS, 1))
    delta = rng.uniform(0.05, 0.8, RUNS)
    low, high = LIMITS[0] + delta, LIMITS[1] - delta
    held = rng.integers(1, 400, RUNS)
    levels = rng.choice([0.0, 0.5, 1.0], (STEPS, RUNS))
    totals, stored = plainly(storage, start, lambda k: low + (high - low) * levels[k // held, np.arange(RUNS)])
    bound = stored[0] / (2 * delta)
    assert np.all(totals[-1] <= bound * 1.01 + 1e-6)
    assert (totals[-1] / bound).max() > 0.1
    # and from any later time on
    middle = STEPS // 4
    assert np.all(totals[-1] - totals[middle] <= stored[middle] / (2 * delta) * 1.01 + 1e-6)


def test_the_windup_of_a_washout_in_closed_form() -> None:
    """With u~ = x - delta, x' = -b delta it is (x0 - delta)^2/(2 b delta); V = x^2/b bounds it by x0^2/(2 b delta)."""
    storage, start, delta = proved_storage(KINDS["washout"], certificate(KINDS["washout"])), np.array([4.0, 7.0]), 0.3
    totals, stored = plainly(storage, start[:, None], lambda _: np.array([1.3, 1.3]))
    np.testing.assert_allclose(totals[-1], (start - delta) ** 2 / (6 * delta), rtol=1e-4)
    np.testing.assert_allclose(stored[0] / (2 * delta), start**2 / (6 * delta), rtol=1e-12)


@pytest.mark.parametrize("name", KINDS)
def test_the_bound_before_the_run_holds(name: str) -> None:
    """From rest, and from a state; v makes excursions of any size until 6 s and keeps within the limits afterwards."""
    storage, rng = proved_storage(KINDS[name], certificate(KINDS[name])), np.random.default_rng(2)
    runs, time_s = 80, STEP * np.arange(STEPS + 1)
    start = rng.standard_normal((runs, len(storage.b))) * rng.choice([0.0, 1.0], (runs, 1))
    size, omega = 10 ** rng.uniform(-0.5, 1.2, runs), 10 ** rng.uniform(-0.5, 1.0, runs)
    v = np.where(time_s[:, None] < 6, 1.0, 0.05) * size * np.sin(np.outer(time_s, omega) + rng.uniform(0, 6, runs))
    totals, _ = plainly(storage, start, lambda k: v[k])
    v[-1] = v[-2]
    largest = 0.0
    for k in range(runs):
        stored = float(storage.value(start[k : k + 1])[0])
        found = before_run(storage, time_s, v[:, k], np.zeros(1), LIMITS, stored)
        assert found is not None
        at = int(np.searchsorted(time_s, found.from_s))
        assert np.all(v[at:, k] >= LIMITS[0] + found.distance - 1e-12)
        assert np.all(v[at:, k] <= LIMITS[1] - found.distance + 1e-12)
        was = totals[-1, k] - totals[at, k]
        assert was <= found.most * 1.01 + 1e-6
        largest = max(largest, was / found.most if found.most > 1e-9 else 0.0)
    assert largest > 1e-3


def test_without_an_end_of_v_beyond_the_limits_there_is_no_bound() -> None:
    storage, time_s = proved_storage(KINDS["lag"], certificate(KINDS["lag"])), np.linspace(0.0, 1.0, 11)
    assert before_run(storage, time_s, 3 * time_s, np.zeros(1), LIMITS) is None
    assert before_run(storage, time_s, 0 * time_s, np.array([0.0, 1.7]), LIMITS) is None
    never = before_run(storage, time_s, 0 * time_s, np.zeros(1), LIMITS)
    assert never is not None
    assert (never.from_s, never.distance, never.most) == (0.0, 1.0, 0.0)


def judged(
    design: Design, limit: float, reference: Reference, until_s: float, plant: PlantModel | None = None
) -> Verdict:
    kind = design.compensator("corrected")
    loop = design_loop(design, reference, kind, plant)
    run = simulate(loop, (-limit, limit), np.linspace(0.0, until_s, 101))
    given = guarantee(design, kind, plant)
    return judge_run(given, loop, (-limit, limit), run, reference, plant or design.loop_plant)


@pytest.mark.parametrize("limit", [11.0, 12.0, 20.0, 45.0])
def test_the_engine_keeps_the_bounds(extended_design: Design, limit: float) -> None:
    found = judged(extended_design, limit, CHAPTER_4, 12.0)
    assert found.guarantee.sector == 1
    windup = found.windup
    assert windup is not None
    assert windup.bound is not None
    assert windup.stored is not None
    assert windup.was <= windup.stored <= windup.bound.most
    assert windup.bound.distance <= limit - max(found.steady)
    kind = extended_design.compensator("corrected")
    time_s = np.linspace(0.0, 12.0, 120001)
    run = simulate(design_loop(extended_design, CHAPTER_4, kind), (-limit, limit), time_s)
    late, beyond = time_s >= windup.bound.from_s, np.abs(run.control - run.saturated_control)
    assert np.trapezoid(beyond[late], time_s[late]) == pytest.approx(windup.was, rel=1e-2, abs=1e-4)
    assert np.all(np.abs(run.outputs["v"][late]) <= limit - windup.bound.distance * (1 - 1e-3))


def test_the_states_of_the_storage_are_driven_by_what_is_left_out(extended_design: Design) -> None:
    """C x = theta1~ u~ = v - u."""
    kind, certified = extended_design.compensator("corrected"), extended_design.corrected.certificate
    assert certified is not None
    storage = proved_storage(kind.one_plus, certified)
    loop = with_states(design_loop(extended_design, CHAPTER_4, kind), storage)
    run = simulate(loop, (-12.0, 12.0), np.linspace(0.0, 2.0, 2001))
    x = np.stack([run.outputs[f"x{k}"] for k in range(3)], axis=1)
    np.testing.assert_allclose(x @ storage.C, run.outputs["v"] - run.control, atol=1e-7 * np.abs(run.control).max())


def test_every_plant_within_the_bound_keeps_its_own(implied: IdentifiedModel) -> None:
    """The windup of four true plants within W_a ends too, and the bound from their own signals holds."""
    design = design_extended(implied, [1.5], 4.0, [(2.0, 1.0)], robust_level=0.4, guarantee="robust")
    kind, plants, limit = design.compensator("corrected"), PlantsWithin(design.loop_plant, design.additive_bound), 14.0
    time_s = np.linspace(0.0, 6.0, 30001)
    for index in range(4):
        true = plants.draw(7, index).plant
        loop = dataclasses.replace(design_loop(design, CHAPTER_4, kind, true), outputs={})
        control, linear = (simulate(loop, (-size, size), time_s).control for size in (limit, np.inf))
        steady = steady_control(CHAPTER_4, true, time_s)
        beyond = np.abs(control - np.clip(control, -limit, limit))
        found = after_run_of_any_plant(time_s, linear, steady, control, (-limit, limit))
        assert found is not None
        late = time_s >= found.from_s
        assert np.trapezoid(beyond[late], time_s[late]) <= found.most * 1.001 + 1e-9
        assert not beyond[-2000:].any()
    found_run = judged(design, limit, CHAPTER_4, 6.0, true)
    assert found_run.guarantee.any_plant
    assert found_run.windup is not None
    assert found_run.windup.stored is None
    assert str(found_run).startswith("Guaranteed whatever the control: from t = ")


@pytest.mark.parametrize("omega", [0.0, 1.5])
def test_a_plant_without_integrator(implied: IdentifiedModel, omega: float) -> None:
    """A constant takes a control too; beyond the limits nothing is promised, however large the sector is."""
    plant = PlantModel(2.0, (), (Mode(30.0, 0.1),), 0.01, integrators=0, real_poles=(4.0,))
    bound = AdditiveBound.printed_form(0.01, 5.0, 40.0, 0.1)
    design = design_extended(dataclasses.replace(implied, plant=plant, additive_bound=bound), [omega])
    reference = sinusoid(1.0, omega, np.pi / 2, 0.0)
    within, beyond = (judged(design, limit, reference, 6.0) for limit in (0.7, 0.3))
    assert within.guarantee.sector >= 1
    assert within.windup is not None
    assert within.windup.stored is not None
    assert within.windup.bound is not None
    assert within.windup.was <= within.windup.stored <= within.windup.bound.most
    assert not beyond.covered
    assert "NOT covered by its guarantee: the reference takes a control of 0.5" in str(beyond)


def test_what_left_its_sector_for_a_limit_cycle_settles() -> None:
    """The design of tests/unit/test_sector_promise.py with the default guarantee."""
    design = design_extended(LIMIT_CYCLE, reference_omegas=[0.0], a=20.0, pairs=[])
    step = sinusoid(1.0, 0.0, np.pi / 2, 0.0)
    found = judged(design, 5.0, step, 3.0)
    assert found.largest_control > 5.0
    assert str(found).startswith("Guaranteed whatever the control: from t = 0.")
    kind = design.compensator("corrected")
    run = simulate(design_loop(design, step, kind), (-5.0, 5.0), np.linspace(0.0, 3.0, 301))
    assert np.abs(run.outputs["error"][run.time_s > 1.0]).max() < 0.01
    assert run.events_s.max() < 1.0
