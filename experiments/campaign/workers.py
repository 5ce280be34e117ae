"""The chunks of a campaign on this machine's cores or on a Dask cluster, a bounded number of them at a time."""

from __future__ import annotations

import logging
import os
from collections.abc import Generator, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from multiprocessing import get_context, parent_process
from threading import Thread
from typing import Any

from experiments.campaign.run_plants import Campaign, Columns, run_chunk
from identification.base import process
from identification.base.errors import InputError

Chunk = tuple[int, int]  # the first plant and the one after the last
Done = Generator[tuple[Chunk, Columns], None, None]

AHEAD = 2  # chunks a core that run or wait
PATIENCE_S = 5  # to reach a scheduler, and its first worker
RETRIES = 2
THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


def run_here(campaign: Campaign, chunks: Sequence[Chunk]) -> Done:
    """Run chunks in one process for each core, each with one thread; yield them as they are done.

    Parameters
    ----------
    campaign
        What they share.
    chunks
        Which ones, see :func:`experiments.campaign.run_plants.run_chunk`.

    Raises
    ------
    InputError
        A chunk cannot be run, or a process was killed.
    """
    cores = min(os.cpu_count() or 1, len(chunks))
    waiting = iter(chunks)
    running: dict[Future[Columns], Chunk] = {}
    with _one_thread(), ProcessPoolExecutor(cores, get_context("spawn"), _begin) as pool:
        try:
            while True:
                for chunk in waiting:
                    with process.undisturbed:
                        future = pool.submit(run_chunk, campaign, *chunk)
                    running[future] = chunk
                    if len(running) >= AHEAD * cores:
                        break
                if not running:
                    return
                for done in wait(running, return_when=FIRST_COMPLETED).done:
                    yield running.pop(done), done.result()
        except BrokenProcessPool:
            raise InputError(
                "a process that ran plants was killed; the same command goes on from what is done"
            ) from None
        except InputError:
            pool.shutdown(cancel_futures=True)  # a process that is itself a child would wait for its own for ever
            raise
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise


def run_on_cluster(campaign: Campaign, chunks: Sequence[Chunk], address: str) -> Done:
    """Run chunks on a Dask cluster; yield them as they are done.

    Parameters
    ----------
    campaign, chunks
        As of :func:`run_here`.
    address
        Of the scheduler, such as tcp://host:8786. Its workers need this package, in the same version.

    Raises
    ------
    InputError
        There is no scheduler, it has no workers, it goes away, or a chunk cannot be run.

    Notes
    -----
    What ran on a worker that dies runs again on another one. The cluster may grow and shrink. Dask's own log is
    silenced meanwhile: what goes wrong is one sentence.
    """
    logging.disable()
    try:
        yield from _run_on(address, campaign, chunks)
    finally:
        logging.disable(logging.NOTSET)


def _run_on(address: str, campaign: Campaign, chunks: Sequence[Chunk]) -> Done:
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
        waiting = iter(chunks)
        running: dict[Any, Chunk] = {}
        done = as_completed(loop=client.loop)
        try:
            while True:
                most = AHEAD * max(sum(client.nthreads().values()), 1)
                while len(running) < most and (chunk := next(waiting, None)) is not None:
                    future = client.submit(run_chunk, campaign, *chunk, pure=False, retries=RETRIES)
                    running[future] = chunk
                    done.add(future)
                if not running:
                    return
                future = next(done)
                yield running.pop(future), future.result()
        except (KilledWorker, NoValidWorkerError, CancelledError, OSError, TimeoutError) as error:
            said = str(error).splitlines()[0]
            raise InputError(
                f"--scheduler {address}: the cluster gave up ({said}); the same command goes on from what is done"
            ) from None
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


@contextmanager
def _one_thread() -> Iterator[None]:
    """Processes started now compute with one thread each: more would cost time, and change the last digits."""
    before = {name: os.environ.get(name) for name in THREADS}
    os.environ.update(dict.fromkeys(THREADS, "1"))
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value
