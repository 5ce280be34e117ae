"""Every command that is told to end does so at once, in one line, and leaves nothing behind."""

from __future__ import annotations

import random
import signal
import subprocess
import sys
import threading
import time
from itertools import cycle
from pathlib import Path

import numpy as np
import pytest

from benchmarks.interrupts import COMMANDS, SIGNALS, inputs, interrupted
from design.design_file import Design
from experiments.engine.simulate import simulate
from experiments.engine.watched import watched
from experiments.runs.batch import simulate_many
from experiments.runs.design_loop import design_loop
from experiments.runs.references import sinusoid

ROOT = Path(__file__).resolve().parents[2]
LATEST_S = 0.8
PATIENCE_S = 5.0  # on a busy machine


@pytest.fixture(scope="module")
def given(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    return inputs(tmp_path_factory.mktemp("inputs"))


@pytest.mark.parametrize(("command", "name"), list(zip(COMMANDS, cycle(SIGNALS), strict=False)))
def test_a_signal_ends_a_command(command: str, name: str, given: dict[str, str]) -> None:
    """Each by one of the signals, whose handlers are the same of all; ``make faults`` sends each all of them."""
    after_s = LATEST_S * random.Random(f"{command} {name}").random() ** 2  # many while it imports
    end = interrupted(command, given, name, after_s)
    assert end.wrong == []
    assert end.seconds < PATIENCE_S


def test_every_command_is_among_them() -> None:
    """But for those of a second or less, and those that run what another one does."""
    from design.__main__ import main as design
    from experiments.__main__ import main as experiments
    from identification.__main__ import main as identification
    from paper_figures.__main__ import main as paper_figures

    brief = {"anti-windup", "campaign-tables", "thesis"}
    groups = (identification, design, experiments, paper_figures)
    assert {name for group in groups for name in group.commands} - brief <= set(COMMANDS)


def test_what_is_ignored_stays_ignored() -> None:
    code = "import signal; signal.signal(signal.SIGHUP, signal.SIG_IGN); from identification.base import process;"
    code += "process.begin(); print(signal.getsignal(signal.SIGHUP) == signal.SIG_IGN, signal.getsignal(signal.SIGINT))"
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True)
    assert done.stdout.startswith("True <function end")


def long_run(design: Design) -> tuple[object, tuple[float, float], np.ndarray]:
    reference = sinusoid(50.0, 1.5, 0.0, 0.0)
    return design_loop(design, reference, "thesis"), (-9.0, 9.0), np.array([0.0, 2e4])


def interrupt_soon() -> float:
    """Interrupt the first thread as Ctrl-C does, in a while; the time when."""
    first = threading.main_thread().ident
    assert first is not None
    threading.Timer(0.3, signal.pthread_kill, (first, signal.SIGINT)).start()
    return time.monotonic() + 0.3


def test_ctrl_c_stops_a_run(extended_design: Design) -> None:
    """In a notebook; uninterrupted it would take half a minute."""
    simulate(*long_run(extended_design)[:2], np.array([0.0, 0.1]))  # type: ignore[arg-type]  # compiled now
    before = threading.active_count()
    at = interrupt_soon()
    with pytest.raises(KeyboardInterrupt):
        simulate(*long_run(extended_design))  # type: ignore[arg-type]
    assert time.monotonic() - at < PATIENCE_S
    while threading.active_count() > before and time.monotonic() - at < PATIENCE_S:
        time.sleep(0.01)
    assert threading.active_count() <= before


def test_ctrl_c_stops_many_runs(extended_design: Design) -> None:
    runs = simulate_many(
        extended_design,
        [extended_design.loop_plant],
        [sinusoid(50.0, 1.5, 0.0, 0.0)],
        {"thesis": "thesis"},
        [9.0, 9.5, 10.0],
        np.array([0.0, 2e4]),
        workers=1,
    )
    at = interrupt_soon()
    with pytest.raises(KeyboardInterrupt):
        list(runs)
    assert time.monotonic() - at < PATIENCE_S


def test_a_watch_stops_a_loop_and_tells_how_far_it_is() -> None:
    def loop(state: np.ndarray) -> float:
        for state[1] in (1.0, 2.0, 3.0):
            time.sleep(0.25)
        return 4.0

    ticks: list[float] = []
    assert watched(loop, ticks.append) == 4.0
    assert ticks
    assert sum(ticks) <= 3.0


def test_numpy_raises_in_a_watched_loop_what_it_raises_here() -> None:
    with np.errstate(over="raise"), pytest.raises(FloatingPointError):
        watched(lambda _: np.float64(1e300) * np.float64(1e300))
