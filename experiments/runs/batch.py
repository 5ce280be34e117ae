"""Many closed loops in one call: every plant with every reference, anti-windup and limit, on all cores."""

from __future__ import annotations

import itertools
import os
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from functools import cache, partial
from typing import Any, NamedTuple, TypeVar

import numpy as np
from tqdm import tqdm

from design.design_file import Asked, Design
from experiments.engine.ready_loop import ReadyLoop, ready_loop
from experiments.engine.simulate import Run, limit_pair, simulate_watched
from experiments.engine.watched import STOP, watch
from experiments.runs.design_loop import Controller, plant_loop, realized_controller
from experiments.runs.references import Reference, SampledReference
from experiments.runs.workers import gathered
from identification.base.errors import InputError
from identification.model.plant import PlantModel

IN_FLIGHT = 4  # runs a worker
PIECES = 128  # sent to a cluster

Item = TypeVar("Item")
Result = TypeVar("Result")
Tick = Callable[[], object]
Each = Callable[[Callable[[Any], Any], Sequence[Any]], list[Any]]
"""Of a function and items, the results in the order of the items, wherever they are computed."""


class Case(NamedTuple):
    """What was run: the true plant, the reference, the anti-windup's name, and the limit, a number or a pair."""

    plant: PlantModel
    reference: Reference | SampledReference
    anti_windup: str
    limit: float | tuple[float, float]


def simulate_many(
    design: Design,
    plants: Iterable[PlantModel],
    references: Sequence[Reference | SampledReference],
    anti_windups: Mapping[str, Asked],
    limits: Sequence[float | tuple[float, float]],
    time_s: np.ndarray,
    workers: int | None = None,
) -> Iterator[tuple[Case, Run | InputError]]:
    """Simulate a design around every plant with every reference, anti-windup and limit, from rest.

    Parameters
    ----------
    design, time_s
        As for :func:`experiments.runs.design_loop.design_loop` and :func:`experiments.engine.simulate.simulate`.
    plants
        The true plants; may be a generator, from which no more is taken than is run.
    references, anti_windups, limits
        r(t); name -> theta1~, None for no anti-windup; of the actuator, each (lower, upper) or one number for +- that.
    workers
        Threads; as many as there are cores unless given.

    Yields
    ------
    (Case, Run or InputError)
        In the order of ``itertools.product(plants, references, anti_windups, limits)``, as they are done; a loop that
        diverges or is refused gives the error that :func:`experiments.engine.simulate.simulate` raises. No more than
        :data:`IN_FLIGHT` runs a worker are held at a time. On a terminal a bar counts them.

    Raises
    ------
    InputError
        Limits that :func:`experiments.engine.simulate.limit_pair` refuses, or fewer workers than one.

    Notes
    -----
    The integration runs without Python's lock. What is left under it is a tenth of a run, so that threads serve up to
    some eight cores; a campaign (:mod:`experiments.campaign.run_plants`) runs in processes, or on a cluster.
    """
    references, limits = tuple(references), tuple(limits)
    for limit in limits:
        limit_pair(limit)
    count = os.cpu_count() or 1 if workers is None else workers
    if count < 1:
        raise InputError(f"the number of workers is {count}; expected 1 or more")
    controllers = {name: realized_controller(design, kind) for name, kind in anti_windups.items()}
    return _streamed(_cases(plants, references, controllers, limits), time_s, count)


def _cases(
    plants: Iterable[PlantModel],
    references: Sequence[Reference | SampledReference],
    controllers: Mapping[str, Controller],
    limits: Sequence[float | tuple[float, float]],
) -> Iterator[tuple[Case, Callable[[], ReadyLoop]]]:
    """Each case with what makes its loop, which is made once for all limits."""
    for plant in plants:
        for reference, (name, controller) in itertools.product(references, controllers.items()):
            loop = cache(partial(_ready, controller, plant, reference))
            for limit in limits:
                yield Case(plant, reference, name, limit), loop


def _ready(controller: Controller, plant: PlantModel, reference: Reference | SampledReference) -> ReadyLoop:
    return ready_loop(plant_loop(controller, plant, reference))


def _streamed(
    cases: Iterator[tuple[Case, Callable[[], ReadyLoop]]], time_s: np.ndarray, workers: int
) -> Iterator[tuple[Case, Run | InputError]]:
    state = watch()

    def run(case: Case, loop: Callable[[], ReadyLoop]) -> Run | InputError:
        try:
            return simulate_watched(loop(), limit_pair(case.limit), time_s, state)
        except InputError as error:
            return error

    ahead: deque[tuple[Case, Future[Run | InputError]]] = deque()
    with ThreadPoolExecutor(workers) as pool, tqdm(desc="runs", unit="", disable=None, leave=False) as bar:
        try:
            while True:
                ahead.extend(
                    (case, pool.submit(run, case, loop))
                    for case, loop in itertools.islice(cases, IN_FLIGHT * workers - len(ahead))
                )
                if not ahead:
                    return
                case, future = ahead.popleft()
                yield case, future.result()
                bar.update()
        finally:  # whoever stops taking results stops the runs
            state[STOP] = 1.0
            pool.shutdown(wait=False, cancel_futures=True)


def threaded(work: Callable[[Item], Result], items: Iterable[Item], tick: Tick = lambda: None) -> list[Result]:
    """The results of ``work`` in the order of the items, by as many threads as there are cores; ticks for each."""

    def counted(item: Item) -> Result:
        result = work(item)
        tick()
        return result

    with ThreadPoolExecutor(os.cpu_count() or 1) as pool:
        return list(pool.map(counted, items))


def on_cluster(
    work: Callable[[Item], Result], items: Sequence[Item], scheduler: str, tick: Tick = lambda: None
) -> list[Result]:
    """The same on the Dask cluster of a scheduler, see :func:`experiments.runs.workers.spread`, in PIECES at most."""
    size = max(1, -(-len(items) // PIECES))
    pieces = [items[first : first + size] for first in range(0, len(items), size)]
    return [result for part in gathered(partial(_each, work), pieces, scheduler, tick) for result in part]


def _each(work: Callable[[Item], Result], items: Sequence[Item]) -> list[Result]:
    return [work(item) for item in items]
