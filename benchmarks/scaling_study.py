"""What more workers bring: weak scaling on a Dask cluster of this machine, and what the costs of a piece make of 100.

    .venv/bin/python benchmarks/scaling_study.py --workers 1 2

Everything here is SYNTHETIC, the runs of a design for the thesis's set ``implied``. One cluster after the other gets as
many pieces a worker, each in turn, ROUNDS times; the best round counts. A worker is a process with one thread. What
the scheduler, the workers and this process compute is CPU time, so that it means the same on a busy machine.
"""

from __future__ import annotations

import argparse
import json
import os
import pickle
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import psutil

from data.thesis import model_named
from design.chapters_3_4.design_extended import design_extended
from experiments.campaign.checkpoint import CHUNK, MOST_CHUNK, CampaignFile
from experiments.campaign.run_plants import Campaign, run_chunk
from experiments.runs.code_hash import environment
from experiments.runs.workers import _answer, spread
from experiments.thesis.printed_choices import thesis_reference

ROOT = Path(__file__).resolve().parents[1]
LIMIT, PERIODS = 12.0, 5
PIECES, ROUNDS = 3, 3  # a worker, and how often
EMPTY = 200  # pieces that do nothing
PATIENCE_S = 120.0
MODELLED = (1, 10, 100, 1000)  # workers


class Work(NamedTuple):
    """A function of an item, as many items as are asked for, what this process does with a result, and how many times
    more a piece of a large job holds than those measured."""

    function: Callable[[Any], Any]
    items: Callable[[int], list[Any]]
    keep: Callable[[Any, Any], None] = lambda _item, _result: None
    larger: int = 1


class Cluster(NamedTuple):
    """The address of a scheduler, its process, and those of its workers."""

    address: str
    scheduler: psutil.Process
    workers: list[psutil.Process]

    def cpu_s(self) -> tuple[float, float]:
        """Seconds that the scheduler and all workers have computed."""
        return _cpu_s([self.scheduler]), _cpu_s(self.workers)


def _cpu_s(processes: Sequence[psutil.Process]) -> float:
    return sum(sum(process.cpu_times()[:2]) for process in processes)


@contextmanager
def cluster(workers: int) -> Iterator[Cluster]:
    """A scheduler and workers on the loopback interface, each a process of Dask's own commands."""
    dask = [sys.executable, "-m", "dask"]
    quiet: dict[str, Any] = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL, "cwd": ROOT}
    quiet["env"] = os.environ | {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
    with tempfile.TemporaryDirectory() as folder, ExitStack() as closing:
        file = Path(folder) / "scheduler.json"
        at = ["--scheduler-file", str(file), "--no-dashboard"]
        one = [*dask, "worker", "--nthreads", "1", "--no-nanny", "--local-directory", folder, *at]
        commands = [[*dask, "scheduler", "--host", "127.0.0.1", "--port", "0", *at], *[one] * workers]
        processes = []
        for command in commands:
            process = subprocess.Popen(command, **quiet)
            closing.callback(process.wait)
            closing.callback(process.kill)
            processes.append(psutil.Process(process.pid))
        deadline = time.monotonic() + PATIENCE_S
        while not file.exists() and time.monotonic() < deadline:
            time.sleep(0.05)
        address = json.loads(file.read_text(encoding="utf-8"))["address"]
        _wait_for(address, workers)
        yield Cluster(address, processes[0], processes[1:])


def _wait_for(address: str, workers: int) -> None:
    from distributed import Client

    with Client(address, set_as_default=False) as client:
        client.wait_for_workers(workers, timeout=PATIENCE_S)


class Cost(NamedTuple):
    """Of a round: seconds on the clock, and CPU seconds a piece of the workers, the scheduler and this process, whose
    waiting for the disk counts, too."""

    wall_s: float
    worker_s: float
    scheduler_s: float
    command_s: float


def measured(work: Work, items: Sequence[Any], at: Cluster) -> Cost:
    """Do the work for all items."""
    wall, own, (scheduler, workers) = time.perf_counter(), time.process_time(), at.cpu_s()
    waited = 0.0
    for number, result in spread(work.function, items, at.address):
        kept, computed = time.perf_counter(), time.process_time()
        work.keep(items[number], result)
        waited += time.perf_counter() - kept - (time.process_time() - computed)
    taken = time.perf_counter() - wall
    scheduler_end, workers_end = at.cpu_s()
    of_each = (workers_end - workers, scheduler_end - scheduler, time.process_time() - own + waited)
    return Cost(taken, *(seconds / len(items) for seconds in of_each))


def sent(work: Work, item: Any) -> tuple[int, int]:
    """Bytes of a piece as it is sent, and of its result."""
    task = pickle.dumps((partial(_answer, environment(), work.function), item))
    return len(task), len(pickle.dumps(work.function(item)))


def campaign_work(folder: Path) -> Work:
    """Chunks of a campaign, whose results become parts of its file."""
    design = design_extended(model_named("implied"), [1.5], 4.0, [(2.0, 1.0)])
    (source := folder / "design.json").write_text(design.to_json(), encoding="utf-8")
    reference = thesis_reference("extended", (1.5,))
    campaign = Campaign(design, "of a study", 1, reference, (-LIMIT, LIMIT), PERIODS)
    file = CampaignFile(folder / "campaign.parquet", campaign, 10**6, source)
    chunks = [(first, first + CHUNK) for first in range(0, 10**5, CHUNK)]
    return Work(partial(run_chunk, campaign), lambda count: chunks[:count], file.keep, MOST_CHUNK // CHUNK)


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--workers", type=int, nargs="+", default=[1, 2], help="of each cluster, the first 1")
    counts = parser.parse_args().workers
    with tempfile.TemporaryDirectory() as name, ExitStack() as opened:
        works = {"campaign": campaign_work(Path(name))}
        clusters = {count: opened.enter_context(cluster(count)) for count in counts}
        for label, work in works.items():
            study(label, work, clusters)


def study(label: str, work: Work, clusters: dict[int, Cluster]) -> None:
    """Weak scaling of one kind of work, and the model."""
    for count, at in clusters.items():  # every worker loads what it runs
        measured(work, work.items(2 * count), at)
    rounds: dict[int, list[Cost]] = {count: [] for count in clusters}
    for _ in range(ROUNDS):
        for count, at in clusters.items():
            rounds[count].append(measured(work, work.items(PIECES * count), at))
    best = {count: Cost(*map(min, zip(*costs, strict=True))) for count, costs in rounds.items()}
    one = best[min(best)]
    print(f"\n{label}: {PIECES} pieces a worker")
    print(f"{'workers':>8s}{'wall s':>9s}{'efficiency':>12s}{'CPU s a piece':>15s}{'here':>8s}")
    for count, cost in best.items():
        print(f"{count:8d}{cost.wall_s:9.2f}{one.wall_s / cost.wall_s:12.0%}{cost.worker_s:15.3f}{cost.command_s:8.4f}")
    task, result = sent(work, work.items(1)[0])
    result *= work.larger
    # beside pieces that take long a scheduler idles, which costs as well: these take no time
    empty = [b"x" * max(task, result)] * EMPTY
    scheduler_s = min(measured(Work(bytes, list), empty, clusters[min(best)]).scheduler_s for _ in range(ROUNDS))
    piece_s = one.worker_s * work.larger
    print(f"a piece of a large job: {piece_s:.2f} s of a worker, {1e3 * scheduler_s:.2f} ms of the scheduler,", end="")
    print(f" {1e3 * one.command_s:.2f} ms here; {task} bytes are sent, {result} come back")
    print(f"{'workers':>8s}{'pieces/s':>10s}{'efficiency':>12s}{'MB/s':>8s}  limited by")
    for workers in MODELLED:
        rates = {"workers": workers / piece_s, "scheduler": 1 / scheduler_s, "command": 1 / one.command_s}
        limit = min(rates, key=lambda name: rates[name])
        rate = rates[limit]
        share = rate * piece_s / workers
        print(f"{workers:8d}{rate:10.1f}{share:12.0%}{rate * (task + result) / 1e6:8.2f}  {limit}")


if __name__ == "__main__":
    main()
