"""Large work in pieces, on this machine's cores or on a Dask cluster, a bounded number of pieces at a time."""

from __future__ import annotations

import logging
import math
import os
import time
from collections.abc import Callable, Generator, Iterable, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from functools import partial
from multiprocessing import get_all_start_methods, get_context, parent_process
from multiprocessing.context import BaseContext
from threading import Thread
from typing import Any, TypeVar

from experiments.runs.code_hash import environment
from identification.base import process
from identification.base.errors import InputError

Item = TypeVar("Item")
Result = TypeVar("Result")
Done = Generator[tuple[int, Result], None, None]

AHEAD = 2  # pieces a core that run or wait
PATIENCE_S = 5  # to reach a scheduler, and its first worker
RETRIES = 2
COUNTED_S = 1  # how often the cluster is asked for its cores, which costs as much as a piece does


class WorkersLostError(InputError):
    """The processes or the cluster that computed are gone; what is done is done."""


def spread(work: Callable[[Item], Result], items: Sequence[Item], scheduler: str | None = None) -> Done[Result]:
    """Do a piece of work for each item, on this machine or on a cluster, and yield the results as they come.

    Parameters
    ----------
    work
        A function that :mod:`pickle` takes, such as one of a module, or :func:`functools.partial` of it and of what all
        items share. It is sent with each item, so that it should be small.
    items
        Small, too; what they ask for takes a second or more.
    scheduler
        Address of a Dask cluster's, such as tcp://host:8786; None: one process for each core of this machine.

    Yields
    ------
    (int, result)
        The number of an item and the result, in any order. Close the generator to stop the work.

    Raises
    ------
    InputError
        ``work`` raises it, there is no such scheduler, or a worker has other code or packages than this process.
    WorkersLostError
        A process was killed, or the cluster gave up.

    Notes
    -----
    A result is the same to the last bit wherever it is computed, if the processors are of one type: each process has
    one thread of the matrix library, and the code and the packages are the same, or the worker refuses. No more than
    AHEAD items a core are held at a time. On a cluster what ran on a worker that dies runs again on another one, the
    workers may come and go, and Dask's own log is silenced meanwhile: what goes wrong is one sentence.
    """
    return _here(work, items) if scheduler is None else _on_cluster(work, items, scheduler)


def gathered(
    work: Callable[[Item], Result],
    items: Sequence[Item],
    scheduler: str | None = None,
    tick: Callable[[], object] = lambda: None,
) -> list[Result]:
    """The results of :func:`spread` in the order of the items; ``tick`` is called after each."""
    found: dict[int, Result] = {}
    for number, result in spread(work, items, scheduler):
        found[number] = result
        tick()
    return [found[number] for number in range(len(items))]


def _here(work: Callable[[Item], Result], items: Sequence[Item]) -> Done[Result]:
    if not items:
        return
    cores = min(os.cpu_count() or 1, len(items))
    waiting = enumerate(items)
    running: dict[Future[Result], int] = {}
    with ProcessPoolExecutor(cores, _starting_with(work), _begin) as pool:
        try:
            while True:
                for number, item in waiting:
                    with process.undisturbed, process.own_surroundings():
                        future = pool.submit(work, item)
                    running[future] = number
                    if len(running) >= AHEAD * cores:
                        break
                if not running:
                    return
                for done in wait(running, return_when=FIRST_COMPLETED).done:
                    yield running.pop(done), done.result()
        except BrokenProcessPool:
            raise WorkersLostError("a worker process was killed") from None
        except InputError:
            pool.shutdown(cancel_futures=True)  # a process that is itself a child would wait for its own for ever
            raise
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise


def _starting_with(work: Callable[..., Any]) -> BaseContext:
    """Processes are forked from one that has imported the module of ``work``, where the system can do that."""
    if "forkserver" not in get_all_start_methods():
        return get_context("spawn")
    context = get_context("forkserver")
    while isinstance(work, partial):
        work = work.func
    context.set_forkserver_preload([work.__module__])
    return context


def _on_cluster(work: Callable[[Item], Result], items: Sequence[Item], address: str) -> Done[Result]:
    logging.disable()
    try:
        yield from _run_on(address, partial(_answer, environment(), work), items)
    finally:
        logging.disable(logging.NOTSET)


def _answer(asked: dict[str, str], work: Callable[[Item], Result], item: Item) -> Result:
    """On a worker: do the work, if that gives the digits that the command itself would get."""
    own = environment()
    for name, there in asked.items():
        if own[name] != there:
            raise InputError(f"a worker has {name} {own[name][:12]} and the command {there[:12]}; expected the same")
    if os.environ.get("OPENBLAS_NUM_THREADS") != "1":
        raise InputError("a worker uses several threads of the matrix library; expected OPENBLAS_NUM_THREADS=1 there")
    return work(item)


def _run_on(address: str, work: Callable[[Item], Result], items: Iterable[Item]) -> Done[Result]:
    from distributed import CancelledError, Client, as_completed
    from distributed.scheduler import KilledWorker, NoValidWorkerError

    try:
        client = Client(address, timeout=PATIENCE_S, set_as_default=False)
    except (OSError, ValueError, TypeError, ImportError, TimeoutError) as error:
        said = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise InputError(f"--scheduler {address}: no Dask scheduler answers there ({said})") from None
    with client:
        try:
            client.wait_for_workers(1, timeout=PATIENCE_S)
        except TimeoutError:
            raise InputError(f"--scheduler {address}: the scheduler has no workers; expected one or more") from None
        waiting = enumerate(items)
        running: dict[Any, int] = {}
        done, counted_at_s = as_completed(loop=client.loop), -math.inf
        try:
            while True:
                if time.monotonic() > counted_at_s + COUNTED_S:
                    most, counted_at_s = AHEAD * max(sum(client.nthreads().values()), 1), time.monotonic()
                while len(running) < most and (following := next(waiting, None)) is not None:
                    future = client.submit(work, following[1], pure=False, retries=RETRIES)
                    running[future] = following[0]
                    done.add(future)
                if not running:
                    return
                future = next(done)
                yield running.pop(future), future.result()
        except (KilledWorker, NoValidWorkerError, CancelledError, OSError, TimeoutError) as error:
            said = str(error).splitlines()[0]
            raise WorkersLostError(f"--scheduler {address}: the cluster gave up ({said})") from None
        finally:
            if running and client.status == "running":
                client.cancel(list(running))


def _begin() -> None:
    """In a new process: leave Ctrl-C to the parent, and end with it, however it ends."""
    process.leave_signals_to_parent()
    parent = parent_process()
    assert parent is not None

    def follow() -> None:
        parent.join()
        os._exit(1)

    Thread(target=follow, daemon=True).start()
