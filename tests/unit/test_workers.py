"""The door for large work: the results in order, one sentence for what goes wrong, no answer of other code."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import psutil
import pytest

from experiments.engine.simulate import limit_pair
from experiments.runs.code_hash import environment
from experiments.runs.workers import WorkersLostError, _answer, gathered
from identification.base.errors import InputError


def test_results_come_in_the_order_of_the_items() -> None:
    done: list[None] = []
    items = [float(number) for number in range(1, 20)]
    assert gathered(limit_pair, items, tick=lambda: done.append(None)) == [(-item, item) for item in items]
    assert len(done) == len(items)
    assert gathered(limit_pair, []) == []


def test_what_the_work_refuses_is_said() -> None:
    with pytest.raises(InputError, match="the saturation limit is -1"):
        gathered(limit_pair, [1.0, -1.0])


def test_a_process_that_is_killed_is_said() -> None:
    with pytest.raises(WorkersLostError, match="a worker process was killed"):
        gathered(os._exit, [1])


def test_nothing_is_imported_from_the_folder_that_a_command_runs_in(tmp_path: Path) -> None:
    """A folder named as a room of ours made the processes wait for ever; a file named as a package was run."""
    (tmp_path / "experiments").mkdir()
    (tmp_path / "numpy.py").write_text("raise SystemExit")
    code = (
        "from experiments.engine.simulate import limit_pair; from experiments.runs.workers import gathered;"
        "print(gathered(limit_pair, [2.0]))"
    )
    done = subprocess.run([sys.executable, "-P", "-c", code], cwd=tmp_path, capture_output=True, text=True, timeout=60)
    assert (done.returncode, done.stdout) == (0, "[(-2.0, 2.0)]\n"), done.stderr


def test_no_process_outlives_a_command_that_is_killed() -> None:
    code = (
        "import time; from experiments.runs.workers import spread; work = spread(time.sleep, [0.0] + 9 * [60.0]);"
        "next(work); print('begun', flush=True); next(work)"
    )
    with subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE) as command:
        assert command.stdout is not None
        assert command.stdout.readline() == b"begun\n"
        workers = psutil.Process(command.pid).children(recursive=True)
        command.kill()
    assert workers
    left = psutil.wait_procs(workers, timeout=2)[1]
    assert {process.status() for process in left} <= {psutil.STATUS_ZOMBIE}  # which nobody has taken note of


@pytest.mark.parametrize("name", ["code", "numpy"])
def test_a_worker_of_other_code_or_packages_refuses(name: str) -> None:
    with pytest.raises(InputError, match=f"a worker has {name} .* and the command other; expected the same"):
        _answer(environment() | {name: "other"}, limit_pair, 1.0)


def test_a_worker_with_several_threads_refuses(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("OPENBLAS_NUM_THREADS", "1")
    assert _answer(environment(), limit_pair, 1.0) == (-1.0, 1.0)
    monkeypatch.delenv("OPENBLAS_NUM_THREADS")
    with pytest.raises(InputError, match="expected OPENBLAS_NUM_THREADS=1"):
        _answer(environment(), limit_pair, 1.0)
