"""What more workers bring: weak scaling on a Dask cluster of this machine, and what the costs of a piece make of 100.

    .venv/bin/python benchmarks/scaling_study.py --workers 1 2

Everything here is SYNTHETIC, the runs of a design for the thesis's set ``implied``. One cluster after the other gets as
many pieces a worker, each in turn, ROUNDS times; the best round counts. A worker is a process with one thread. What
the scheduler, the workers and this process compute is CPU time, so that it means the same on a busy machine.
"""

from __future__ import annotations

import argparse
import json
import math
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

import pandas as pd
import psutil

from data.thesis import model_named
from design.chapters_3_4.design_extended import design_extended
from experiments.campaign.checkpoint import CHUNK, MOST_CHUNK, CampaignFile
from experiments.campaign.run_plants import Campaign, run_chunk
from experiments.physical_limits.limits_tables import limit_table
from experiments.runs.batch import _each
from experiments.runs.code_hash import environment
from experiments.runs.compare_anti_windups import NAMES
from experiments.runs.workers import _answer, spread
from experiments.thesis.printed_choices import thesis_reference
from experiments.thesis.unprinted.chapter_4_conditions import Conditions, Point

ROOT = Path(__file__).resolve().parents[1]
LIMIT, PERIODS = 12.0, 5
PIECES, ROUNDS = 3, 3  # a worker, and how often
POINTS = 64  # of a piece of the search
EMPTY = 200  # pieces that do nothing
PATIENCE_S = 300.0
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
        said = ""
        while not said.rstrip().endswith("}") and time.monotonic() < deadline:  # the file is there before it is whole
            time.sleep(0.05)
            said = file.read_text(encoding="utf-8") if file.exists() else ""
        address = json.loads(said)["address"]
        _wait_for(address, workers)
        yield Cluster(address, processes[0], processes[1:])


def _wait_for(address: str, workers: int) -> None:
    from distributed import Client

    with Client(address, set_as_default=False) as client:
        client.wait_for_workers(workers, timeout=PATIENCE_S)


class Cost(NamedTuple):
    """Of a round: seconds on the clock; CPU seconds a piece of the workers, of the scheduler, and of this process while
    it waits and hands out; and its seconds on the clock, the disk's among them, with a result."""

    wall_s: float
    worker_s: float
    scheduler_s: float
    handed_s: float
    kept_s: float


def measured(work: Work, items: Sequence[Any], at: Cluster) -> Cost:
    """Do the work for all items."""
    wall, own, before, kept, keeping = time.perf_counter(), time.process_time(), at.cpu_s(), 0.0, 0.0
    for number, result in spread(work.function, items, at.address):
        begun, computed = time.perf_counter(), time.process_time()
        work.keep(items[number], result)
        kept, keeping = kept + time.perf_counter() - begun, keeping + time.process_time() - computed
    taken, after = time.perf_counter() - wall, at.cpu_s()
    handed = time.process_time() - own - keeping
    each = (after[1] - before[1], after[0] - before[0], handed, kept)
    return Cost(taken, *(seconds / len(items) for seconds in each))


def least(costs: Sequence[Cost]) -> Cost:
    """The least of each number."""
    return Cost(*map(min, zip(*costs, strict=True)))


def sent(work: Work, at: Cluster) -> tuple[int, int]:
    """Bytes of a piece as it is sent, and of its result, which is that of this process to the last bit."""
    (item,) = work.items(1)
    task = pickle.dumps((partial(_answer, environment(), work.function), item))
    ((_, result),) = spread(work.function, [item], at.address)
    if _digits(result) != _digits(work.function(item)):
        sys.exit("a worker's result is not that of this process")
    return len(task), len(pickle.dumps(result))


def _digits(result: Any) -> str:
    return repr(result.to_dict() if isinstance(result, pd.DataFrame) else result)


def campaign_work(folder: Path) -> Work:
    """Chunks of a campaign, whose results become parts of its file."""
    design = design_extended(model_named("implied"), [1.5], 4.0, [(2.0, 1.0)])
    (source := folder / "design.json").write_text(design.to_json(), encoding="utf-8")
    reference = thesis_reference("extended", (1.5,))
    campaign = Campaign(design, "of a study", 1, reference, (-LIMIT, LIMIT), PERIODS)
    file = CampaignFile(folder / "campaign.parquet", campaign, 10**6, source)
    chunks = [(first, first + CHUNK) for first in range(0, 10**5, CHUNK)]
    return Work(partial(run_chunk, campaign), lambda count: chunks[:count], file.keep, MOST_CHUNK // CHUNK)


def limits_work() -> Work:
    """Rows of the physical limits' table, a limit each."""
    design = design_extended(model_named("implied"), [1.5], 4.0, [(2.0, 1.0)])
    row = partial(limit_table, design, thesis_reference("extended", (1.5,)), NAMES, math.inf)
    return Work(
        row, lambda count: [((-limit, limit), False) for limit in (LIMIT + k % PIECES / 8 for k in range(count))]
    )


def search_work() -> Work:
    """Points of the search for what the thesis does not print."""
    condition = Conditions("implied", "exact")
    points = [Point((1.01 + k / 100) * condition.required, 0.0) for k in range(POINTS)]
    return Work(partial(_each, partial(Conditions.both, condition)), lambda count: [points] * count)


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--workers", type=int, nargs="+", default=[1, 2], help="of each cluster, the first 1")
    counts = parser.parse_args().workers
    with tempfile.TemporaryDirectory() as name, ExitStack() as opened:
        works = {"campaign": campaign_work(Path(name)), "limits": limits_work(), "search": search_work()}
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
    best = {count: least(costs) for count, costs in rounds.items()}
    one, at = best[min(best)], clusters[min(best)]
    print(f"\n{label}: {PIECES} pieces a worker")
    print(f"{'workers':>8s}{'wall s':>9s}{'efficiency':>12s}{'CPU s a piece':>15s}{'efficiency':>12s}")
    for count, cost in best.items():
        by_cpu = f"{cost.worker_s:15.3f}{one.worker_s / cost.worker_s:12.0%}"
        print(f"{count:8d}{cost.wall_s:9.2f}{one.wall_s / cost.wall_s:12.0%}{by_cpu}")
    task, result = sent(work, at)
    result *= work.larger
    # beside pieces that take long scheduler and command idle, which costs as well: these take no time
    empty = least([measured(Work(bytes, list), [b"x" * max(task, result)] * EMPTY, at) for _ in range(ROUNDS)])
    piece_s, here_s = one.worker_s * work.larger, empty.handed_s + one.kept_s
    of_each = f"{piece_s:.2f} s of a worker, {1e3 * empty.scheduler_s:.1f} ms of the scheduler"
    print(f"a piece of a large job: {of_each}, {1e3 * here_s:.1f} ms of the command; {task} B there, {result} B back")
    print(f"{'workers':>8s}{'pieces/s':>10s}{'efficiency':>12s}{'MB/s':>8s}  limited by")
    for workers in MODELLED:
        rates = {"workers": workers / piece_s, "scheduler": 1 / empty.scheduler_s, "command": 1 / here_s}
        limit = min(rates, key=lambda name: rates[name])
        rate = rates[limit]
        print(f"{workers:8d}{rate:10.1f}{rate * piece_s / workers:12.0%}{rate * (task + result) / 1e6:8.2f}  {limit}")


if __name__ == "__main__":
    main()
