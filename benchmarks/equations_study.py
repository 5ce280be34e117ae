"""Whether each test of data/thesis/equations.csv really executes the function that stands beside it.

    .venv/bin/python benchmarks/equations_study.py
    .venv/bin/python benchmarks/equations_study.py --label "(2.18)" --label "Lemma 2"

Every test runs once, alone in a fresh process, two processes at a time, under a profiler that sees each call of a
Python function. Of a class it wants a call of one of its own methods: of __call__ where it has one. Exit status 1, and
a table of the rows, where a test fails or does not execute a function. Compiled functions cannot be seen. It takes
one to three minutes on two cores.
"""

from __future__ import annotations

import argparse
import inspect
import json
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from types import CodeType, FrameType
from typing import Any

import pandas as pd
import pytest
from tqdm import tqdm

from experiments.thesis.claims.equations_page import named_object, read_equations

ROOT = Path(__file__).resolve().parents[1]
PROCESSES = 2
MARK = "executed: "


def codes(name: str) -> set[CodeType]:
    """The code objects of which one must run for a function, property or class to count as executed."""
    thing = named_object(name)
    if inspect.isclass(thing):
        own = vars(thing)
        members = [own["__call__"]] if "__call__" in own else list(own.values())
        written = [member.fget if isinstance(member, property) else member for member in members]
        file = inspect.getfile(thing)  # what dataclass writes has none
        return {f.__code__ for f in written if inspect.isfunction(f) and f.__code__.co_filename == file}
    function = inspect.unwrap(thing.fget if isinstance(thing, property) else thing)
    return {function.__code__}


class Watch:
    """A plugin of pytest: which of the named functions ran while the tests were set up and called."""

    def __init__(self, names: list[str]) -> None:
        self.wanted = {code: name for name in names for code in codes(name)}
        self.executed: set[str] = set()

    def seen(self, frame: FrameType, event: str, argument: Any) -> None:
        """What sys.setprofile calls."""
        if event == "call" and frame.f_code in self.wanted:
            self.executed.add(self.wanted[frame.f_code])

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_protocol(self) -> Iterator[Any]:
        """Watch set-up, call and tear-down, in every thread."""
        threading.setprofile(self.seen)
        sys.setprofile(self.seen)
        try:
            return (yield)
        finally:
            sys.setprofile(None)
            threading.setprofile(None)


def run_here(test: str, functions: list[str]) -> int:
    """Run one test in this process; print what it executed and return pytest's exit status."""
    watch = Watch(functions)
    status = pytest.main([test, "-q", "--no-header", "-p", "no:cacheprovider"], plugins=[watch])
    print(MARK + json.dumps(sorted(watch.executed)))
    return int(status)


def run_alone(test: str, functions: list[str]) -> tuple[set[str], float, str]:
    """What one test executed in a fresh process, its time in seconds, and what it wrote if it failed."""
    began = time.perf_counter()
    command = [sys.executable, str(Path(__file__).resolve()), "--test", test, *functions]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    lines = [line for line in done.stdout.splitlines() if line.startswith(MARK)]
    executed = set(json.loads(lines[-1].removeprefix(MARK))) if lines else set()
    wrong = "" if done.returncode == 0 else (done.stdout + done.stderr)[-2000:]
    return executed, time.perf_counter() - began, wrong


def study(table: pd.DataFrame) -> tuple[pd.DataFrame, dict[str, str]]:
    """The table with ``executed`` and ``seconds`` of its test, and what the tests that failed wrote."""
    groups = {str(test): sorted(set(rows["function"])) for test, rows in table.groupby("test", sort=False)}
    with ThreadPoolExecutor(PROCESSES) as pool:
        runs = pool.map(run_alone, groups, groups.values())
        found = dict(zip(groups, tqdm(runs, total=len(groups), unit="test"), strict=True))
    executed = [function in found[test][0] for function, test in table[["function", "test"]].itertuples(index=False)]
    seconds = [found[test][1] for test in table["test"]]
    return table.assign(executed=executed, seconds=seconds), {test: run[2] for test, run in found.items() if run[2]}


def main() -> int:
    """Read the arguments, run, print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--label", action="append", help="only these rows")
    parser.add_argument("--test", nargs="+", metavar=("TEST", "FUNCTION"), help="run one test here, as the study does")
    arguments = parser.parse_args()
    if arguments.test:
        return run_here(arguments.test[0], arguments.test[1:])
    table = read_equations()
    if arguments.label:
        table = table[table["label"].isin(arguments.label)]
        if table.empty:
            parser.error(f"no row has the label {' or '.join(arguments.label)}")
    began = time.perf_counter()
    rows, failed = study(table)
    missed = rows[~rows["executed"] | rows["test"].isin(list(failed))]
    for test, text in failed.items():
        print(f"{test} failed:\n{text}\n")
    if len(missed):
        print(missed[["label", "function", "test", "executed"]].to_string(index=False))
    print(
        f"{len(rows)} rows, {rows['test'].nunique()} tests, {len(failed)} failed; "
        f"{int((~rows['executed']).sum())} rows whose test does not execute the function; "
        f"{time.perf_counter() - began:.0f} s"
    )
    slowest = rows.drop_duplicates("test").nlargest(3, "seconds")[["seconds", "test"]]
    print("slowest:", "; ".join(f"{test} {seconds:.0f} s" for seconds, test in slowest.itertuples(index=False)))
    return 1 if len(missed) else 0


if __name__ == "__main__":
    sys.exit(main())
