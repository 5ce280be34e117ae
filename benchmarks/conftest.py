"""Puts each benchmark's ratio to its peer beside its time, and all of them into one table at the end."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable
from typing import Any

import pytest

ROUNDS = 30
"""Of ours: enough for quartiles, which show the noise of the machine."""

Against = Callable[..., None]


@pytest.fixture
def against(benchmark: Any) -> Against:
    """Benchmark ``ours`` and record how many times longer ``peer`` takes in the same run (medians).

    The callable takes ``ours``, ``peer``, how many ``rounds`` the peer gets, how many times ours is run
    (``our_rounds``), and ``error``, which makes a sentence of what ours and the peer return.
    """

    def measure(
        ours: Callable[[], Any],
        peer: Callable[[], Any],
        rounds: int = 3,
        our_rounds: int = ROUNDS,
        error: Callable[[Any, Any], str] | None = None,
    ) -> None:
        ours()
        times, found = [], None
        for _ in range(rounds):
            start = time.perf_counter()
            found = peer()
            times.append(time.perf_counter() - start)
        result = benchmark.pedantic(ours, rounds=our_rounds, iterations=1)
        benchmark.extra_info["peer_s"] = [min(times), statistics.median(times), max(times)]
        benchmark.extra_info["peer_over_ours"] = statistics.median(times) / benchmark.stats.stats.median
        benchmark.extra_info["said"] = error(result, found) if error else ""
        print("\n" + "  ".join(_cells(benchmark)))

    return measure


def _cells(benchmark: Any) -> list[str]:
    """Name, ours median [quartiles], peer median [extremes], ratio and what is to be said of the errors."""
    stats = benchmark.stats.stats if hasattr(benchmark.stats, "stats") else benchmark.stats
    cells = [benchmark.name, f"{_time(stats.median)} [{_time(stats.q1)}, {_time(stats.q3)}]"]
    info = benchmark.extra_info
    if "peer_s" not in info:
        return [*cells, "", "", ""]
    least, median, most = (_time(value) for value in info["peer_s"])
    return [*cells, f"{median} [{least}, {most}]", f"{info['peer_over_ours']:.3g}", info["said"]]


def _time(seconds: float) -> str:
    return f"{1e3 * seconds:.3g} ms" if seconds < 1 else f"{seconds:.3g} s"


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter, config: pytest.Config) -> None:
    """Print the table of all ratios of this run."""
    session = getattr(config, "_benchmarksession", None)
    if session is None or not session.benchmarks:
        return
    head = ["benchmark", "ours: median [quartiles]", "peer: median [extremes]", "peer/ours", "errors"]
    rows = [head, *(_cells(benchmark) for benchmark in session.benchmarks)]
    widths = [max(len(row[column]) for row in rows) for column in range(len(head) - 1)]
    terminalreporter.section("ours against the peers, same run")
    for row in rows:
        parts = [cell.ljust(width) for cell, width in zip(row, [*widths, 0], strict=True)]
        terminalreporter.write_line("  ".join(parts).rstrip())
