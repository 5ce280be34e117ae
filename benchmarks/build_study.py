"""How long a user waits: each target of the Makefile and each first answer, its wall time, CPU time and peak memory.

.venv/bin/python -m benchmarks.build_study --times 5 --only help --against ../another_checkout

Each checkout is copied first, so that a module can be changed; with --against both are measured in turn, and a line
gives the ratio of this one to the other in the same turn. The commands are those of the Makefile, without the few
milliseconds of make. CPU time is that of all processes, on Linux also of those that outlive the one that began them;
the peak is that of the largest process. Both are nan where the command goes on after what is waited for.
"""

from __future__ import annotations

import argparse
import csv
import json
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
ROOMS = ("antiwindup", "identification", "design", "experiments", "paper_figures")
TESTS = 2  # that a refit is given
FIGURE = "fig_2_05"
QUANTITIES = ("wall_s", "cpu_s", "peak_mb")
# Prints the wall time until the command ends, or until a file is there, and then the CPU time and the peak.
MEASURE = """
import ctypes, json, os, resource, subprocess, sys, time
until, *command = sys.argv[1:]
if sys.platform == "linux":
    ctypes.CDLL(None).prctl(36, 1, 0, 0, 0)  # PR_SET_CHILD_SUBREAPER: processes that are left behind become ours
start = time.perf_counter()
process, seen = subprocess.Popen(command, stdout=subprocess.DEVNULL), None
while until and process.poll() is None and seen is None:
    seen = time.perf_counter() - start if os.path.exists(until) else None
    time.sleep(0.005)
status = process.wait()
wall = time.perf_counter() - start if seen is None else seen
try:
    while True:
        os.wait()
except ChildProcessError:
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
print(json.dumps([status, wall, used.ru_utime + used.ru_stime, used.ru_maxrss * 1024 / 1e6]))
"""


@dataclass(frozen=True)
class Wait:
    """What a user waits for.

    Parameters
    ----------
    name
        In the table.
    command
        What ``python -m`` runs in a checkout.
    variables
        What make hands over.
    before
        What is done to the checkout first, not measured.
    until
        The file that is waited for; the end of the command unless given.
    """

    name: str
    command: tuple[str, ...]
    variables: tuple[tuple[str, str], ...] = ()
    before: Callable[[Path], object] = lambda checkout: None
    until: str = ""


def waits() -> list[Wait]:
    """All that is measured, in an order in which each finds what it needs."""
    sweeps = sorted(path.relative_to(ROOT).as_posix() for path in (ROOT / "data/elevation").glob("*_frf.csv"))

    def build(name: str, goal: str, before: Callable[[Path], object], until: str = "") -> Wait:
        given, output = (sweeps[:TESTS], "mine") if goal == "refit" else (sweeps, "build")
        variables = (("ANTIWINDUP_SWEEPS", " ".join(given)), ("ANTIWINDUP_OUTPUT", output))
        return Wait(name, ("antiwindup.from_make", goal), variables, before, until)

    draw = ("paper_figures", "draw", FIGURE, "--results", "build/results", "--output", "build/figures")
    return [
        build("make figures, from clean", "figures", without("build")),
        build("make figures, nothing changed", "figures", without()),
        build("make figures, one figure changed", "figures", with_another_figure),
        build("make report, after make figures", "report", without("build/report", "build/claims.csv")),
        build("make refit, two tests", "refit", without("mine")),
        build("make refit, until its first page", "refit", without("mine"), "mine/summary.pdf"),
        Wait("a first figure", draw),
        *(Wait(f"{room} --help", (room, "--help")) for room in ROOMS),
        Wait("the tests of make test", ("pytest", "-q", "-n", "2", "--dist", "loadfile")),
    ]


def without(*paths: str) -> Callable[[Path], object]:
    """What removes files and folders of a checkout."""

    def remove(checkout: Path) -> None:
        for path in paths:
            shutil.rmtree(checkout / path, ignore_errors=True)
            if (checkout / path).is_file():
                (checkout / path).unlink()

    return remove


def with_another_figure(checkout: Path) -> None:
    """Change the module that draws a figure."""
    with (checkout / f"paper_figures/thesis/figures/{FIGURE}.py").open("a", encoding="utf-8") as module:
        module.write("# changed\n")


def copied(checkout: Path, folder: Path) -> Path:
    """A copy of a checkout without what git ignores."""
    listing = ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"]
    names = subprocess.run(listing, cwd=checkout, capture_output=True, text=True, check=True).stdout.split("\0")
    for name in (name for name in names if (checkout / name).is_file()):
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(checkout / name, folder / name)
    return folder


def measured(wait: Wait, checkout: Path) -> tuple[float, ...]:
    """Seconds that pass, seconds of all processors, and the largest process in MB."""
    wait.before(checkout)
    command = [sys.executable, "-c", MEASURE, wait.until, sys.executable, "-m", *wait.command]
    of_make = {"PYTHONPATH": str(checkout), "OPENBLAS_NUM_THREADS": "1", **dict(wait.variables)}
    run = subprocess.run(command, cwd=checkout, env=os.environ | of_make, capture_output=True, text=True, check=False)
    status, *found = json.loads(run.stdout) if run.returncode == 0 else [run.returncode]
    if status != 0:
        sys.exit(f"{wait.name} ended with status {status} in {checkout}:\n{run.stderr}")
    return (found[0], np.nan, np.nan) if wait.until else tuple(found)


def main() -> None:
    """Print a line for each wait and checkout, and write the table as CSV."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--times", type=int, default=5, help="how often each is measured")
    parser.add_argument(
        "--only", default="", help="those whose name holds this; the tests, which take minutes, if asked"
    )
    parser.add_argument("--against", type=Path, help="another checkout, measured in turn with this one")
    parser.add_argument("--output", type=Path, help="existing folder for build.csv")
    asked = parser.parse_args()
    checkouts = {"this": ROOT, **({str(asked.against.name): asked.against} if asked.against else {})}
    if asked.output is not None and not asked.output.is_dir():
        parser.error(f"--output {asked.output}: is no folder; expected an existing one")
    selected = [wait for wait in waits() if asked.only in wait.name and (asked.only or wait.command[0] != "pytest")]
    if not selected:
        parser.error(
            f"--only {asked.only}: is in no name; expected a part of one of {', '.join(w.name for w in waits())}"
        )
    rows = []
    with tempfile.TemporaryDirectory() as name:
        copies = {label: copied(path, Path(name) / f"{k}") for k, (label, path) in enumerate(checkouts.items())}
        for copy in copies.values() if any("--help" not in wait.command for wait in selected) else ():
            measured(waits()[0], copy)  # compiled code gets warm, and each finds what it needs
        print(f"{'wait':34s}{'checkout':>10s}" + "".join(f"{each:>9s}{'quartiles':>18s}" for each in QUANTITIES))
        for wait in selected:
            turns = np.array([[measured(wait, copy) for copy in copies.values()] for _ in range(asked.times)])
            found = {label: turns[:, number] for number, label in enumerate(copies)}
            if asked.against:
                found["ratio"] = turns[:, 0] / turns[:, 1]
            for label, each in found.items():
                parts = np.percentile(each, (50, 25, 75), axis=0).T
                rows.append([wait.name, label, *parts.ravel()])
                said = (f"{middle:9.2f}{f'{low:.2f} ... {high:.2f}':>18s}" for middle, low, high in parts)
                print(f"{wait.name:34s}{label:>10s}" + "".join(said), flush=True)
    if asked.output:
        heads = [f"{quantity} {part}" for quantity in QUANTITIES for part in ("median", "lower", "upper")]
        with (asked.output / "build.csv").open("w", encoding="utf-8", newline="") as file:
            csv.writer(file).writerows([["wait", "checkout", *heads], *rows])


if __name__ == "__main__":
    main()
