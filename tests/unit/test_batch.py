"""Many loops in one call: the same numbers as one by one, in order, with no more held than is in flight."""

from __future__ import annotations

import itertools
import pickle
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from design.design_file import Design
from experiments.engine.simulate import DivergenceError, simulate
from experiments.runs import batch
from experiments.runs.batch import IN_FLIGHT, simulate_many
from experiments.runs.design_loop import design_loop
from experiments.runs.references import SampledReference, sinusoid
from identification.base.errors import InputError
from identification.model.plant import PlantModel

REFERENCES = [sinusoid(50.0, 1.5, 0.2, 0.0), SampledReference(np.array([0.0, 0.4]), np.array([0.0, 20.0]))]
TIMES = np.linspace(0.0, 0.6, 61)


def other_plants(design: Design, count: int) -> list[PlantModel]:
    plant = design.plant
    return [
        replace(plant, gain=plant.gain * (1 + 0.02 * k), delay_s=plant.delay_s * (1 + 0.03 * k)) for k in range(count)
    ]


@pytest.mark.parametrize("workers", [1, 2, 5])
def test_a_batch_is_its_runs_one_by_one(extended_design: Design, workers: int) -> None:
    plants, limits = other_plants(extended_design, 3), [9.0, (-7.0, 15.0)]
    kinds = {"none": None, "corrected": extended_design.compensator("corrected")}
    found = list(simulate_many(extended_design, plants, REFERENCES, kinds, limits, TIMES, workers))
    expected = list(itertools.product(plants, REFERENCES, kinds, limits))
    assert len(found) == len(expected) == 24
    for (case, run), (plant, reference, kind, limit) in zip(found, expected, strict=True):
        assert case.plant is plant
        assert case.reference is reference
        assert (case.anti_windup, case.limit) == (kind, limit)
        pair = limit if isinstance(limit, tuple) else (-limit, limit)
        single = simulate(design_loop(extended_design, reference, kinds[kind], plant), pair, TIMES)
        assert not isinstance(run, InputError)
        np.testing.assert_array_equal(run.control, single.control)
        np.testing.assert_array_equal(run.events_s, single.events_s)
        for name, values in single.outputs.items():
            np.testing.assert_array_equal(run.outputs[name], values)


def test_no_more_is_taken_than_is_in_flight(extended_design: Design) -> None:
    taken = 0

    def endless() -> Iterator[PlantModel]:
        nonlocal taken
        while True:
            taken += 1
            yield extended_design.plant

    runs = simulate_many(extended_design, endless(), REFERENCES[:1], {"none": None}, [12.0], TIMES, workers=2)
    assert taken == 0
    for done in range(1, 30):
        next(runs)
        assert taken <= done + 2 * IN_FLIGHT
    runs.close()  # type: ignore[attr-defined]


def test_a_loop_that_diverges_or_is_refused_is_a_result(extended_design: Design) -> None:
    # ten times the dead time is beyond the loop's margin; 40 is no limit for long
    slow = replace(extended_design.plant, delay_s=30 * extended_design.plant.delay_s)
    last = replace(extended_design.plant.pole_modes[-1], omega=1e6)  # asks for 1e8 steps
    never = replace(extended_design.plant, pole_modes=(*extended_design.plant.pole_modes[:-1], last))
    plants = [extended_design.plant, slow, never, extended_design.plant]
    runs = simulate_many(extended_design, plants, REFERENCES[:1], {"none": None}, [np.inf], np.array([0.0, 400.0]))
    first, second, third, fourth = (run for _, run in runs)
    assert isinstance(second, DivergenceError)
    assert isinstance(third, InputError)
    assert "steps" in str(third)
    assert not isinstance(first, InputError)
    assert not isinstance(fourth, InputError)


@pytest.mark.parametrize(
    ("limits", "workers", "message"), [([12.0, 0.0], 1, "limit is 0"), ([12.0], 0, "workers is 0")]
)
def test_bad_arguments_are_refused_at_once(
    extended_design: Design, limits: list[float], workers: int, message: str
) -> None:
    with pytest.raises(InputError, match=message):
        simulate_many(extended_design, [], REFERENCES, {"none": None}, limits, TIMES, workers)


def test_a_cluster_gets_few_pieces_and_gives_the_results_in_order(monkeypatch: pytest.MonkeyPatch) -> None:
    pieces: list[int] = []

    def sent(
        work: Callable[[Any], Any], items: Sequence[Any], scheduler: str, tick: Callable[[], object]
    ) -> list[object]:
        pieces.append(len(items))
        there, received = pickle.loads(pickle.dumps((work, items)))
        return [there(item) for item in received]

    monkeypatch.setattr(batch, "gathered", sent)
    for count in (0, 1, 128, 1000):
        assert batch.on_cluster(abs, [-k for k in range(count)], "tcp://there:8786") == list(range(count))
    assert pieces == [0, 1, 128, 125]
