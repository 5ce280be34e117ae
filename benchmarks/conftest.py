"""Puts the ratio against the peer beside each benchmark's times."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable

import pytest


@pytest.fixture
def against(benchmark) -> Callable[..., object]:  # type: ignore[no-untyped-def]
    """Benchmark ``ours`` and record how many times longer ``peer`` takes in the same run (medians)."""

    def measure(ours: Callable[[], object], peer: Callable[[], object], rounds: int = 3) -> object:
        ours()
        times = []
        for _ in range(rounds):
            start = time.perf_counter()
            peer()
            times.append(time.perf_counter() - start)
        result = benchmark.pedantic(ours, rounds=10, iterations=1)
        median = benchmark.stats.stats.median
        benchmark.extra_info["peer_median_s"] = statistics.median(times)
        benchmark.extra_info["peer_over_ours"] = statistics.median(times) / median
        ratio = statistics.median(times) / median
        print(f"\n{benchmark.name}: ours {median:.4g} s, peer {statistics.median(times):.4g} s, peer/ours {ratio:.4g}")
        return result

    return measure
