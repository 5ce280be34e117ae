"""How long inputs of a size take, and how much memory, beside a bound of it: each command in a process of its own.

.venv/bin/python benchmarks/size_study.py --lines 1000000 --samples 10000000 --tests 500 --plants 50000 --rows 1000000
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
import zlib
from collections.abc import Callable, Iterator
from itertools import chain
from pathlib import Path
from struct import pack
from typing import NamedTuple

import numpy as np
from scipy.io import savemat
from scipy.signal import cont2discrete, lfilter

ROOT = Path(__file__).resolve().parents[1]
MEGABYTE = 1e6
LINES = 200  # of each of many tests
HORIZON_S, RATE_HZ = 1e4, 2000.0
IMPORTS = "from experiments.campaign import checkpoint, distributions, run_plants; import pyarrow.parquet"
CAMPAIGN = """
import sys, numpy as np
from pathlib import Path
from design.design_file import read_design
from experiments.campaign import run_campaign
from experiments.runs.references import sinusoid
folder, plants = Path(sys.argv[1]), int(sys.argv[2])

def made_up(_, chunks, scheduler):
    random = np.random.default_rng(1)
    for number, (first, last) in enumerate(chunks):
        count = 3 * (last - first)
        runs = ["none", "thesis", "corrected"] * (last - first)
        rows = {"plant": np.repeat(range(first, last), 3), "anti_windup": runs}
        names = ["distance", "peak_error", "steady_error", "recovery_s", *(f"number_{k}" for k in range(16))]
        rows |= dict(zip(names, random.uniform(size=(20, count)), strict=True))
        rows |= dict.fromkeys(("linear_stable", "diverged", "covered"), [False] * count)
        yield number, rows | {"guaranteed_sector": [0.0] * count}

run_campaign.spread = made_up
file, reference = folder / "design.json", sinusoid(amplitude=50.0, omega=1.5)
output = folder / "campaign.parquet"
run_campaign.run_campaign(read_design(file), file, plants, 1, reference, (-12.0, 12.0), 5, None, output, False)
"""


def write_lines(path: Path, count: int) -> None:
    """A frequency response of 5 to 200 Hz with 2 % noise."""
    random, frequency_hz = np.random.default_rng(1), np.linspace(5, 200, count)
    s = 2j * np.pi * frequency_hz
    response = (
        7 / s * (1 + 0.02 * s / 174 + (s / 174) ** 2) / (1 + 0.04 * s / 282 + (s / 282) ** 2) * np.exp(-0.008 * s)
    )
    response *= 1 + 0.02 * (random.normal(size=count) + 1j * random.normal(size=count))
    table = np.column_stack([frequency_hz, response.real, response.imag])
    np.savetxt(path, table, fmt="%.12g", delimiter=",", header="frequency_hz,real,imag", comments="")


def write_samples(path: Path, count: int) -> None:
    """A record of the same plant, its input held."""
    time_s = np.arange(count) * 2e-4
    share = np.clip(time_s / (0.9 * time_s[-1]), 0, 1)
    u = np.sin(2 * np.pi * 0.9 * time_s[-1] * (5 * share + 195 / 2 * share**2)) * (share < 1)
    denominator = np.polymul([1, 0], [1 / 282**2, 0.04 / 282, 1])
    b, a, _ = cont2discrete((7 * np.array([1 / 174**2, 0.02 / 174, 1]), denominator), 2e-4, "zoh")
    y = np.concatenate([np.zeros(40), lfilter(b.ravel(), a, u)[:-40]])
    y += 1e-3 * np.random.default_rng(1).normal(size=count)
    savemat(path, {"time_s": time_s[:, None], "input_held": u[:, None], "output": y[:, None]})


def write_tests(path: Path, count: int) -> None:
    """So many tests of LINES lines each, 2 % noise."""
    random, frequency_hz = np.random.default_rng(1), np.geomspace(5, 200, LINES)
    s = 2j * np.pi * frequency_hz
    noise = 0.02 * (random.normal(size=(count, LINES)) + 1j * random.normal(size=(count, LINES)))
    response = 7 / s / (1 + 0.04 * s / 282 + (s / 282) ** 2) * np.exp(-0.008 * s) * (1 + noise)
    tests = np.repeat(np.arange(count), LINES)
    table = np.column_stack([tests, np.tile(frequency_hz, count), response.real.ravel(), response.imag.ravel()])
    np.savetxt(path, table, fmt="%.12g", delimiter=",", header="test,frequency_hz,real,imag", comments="")


def write_pairs(path: Path, count: int) -> None:
    """Lines of which each stands twice, 1e-9 Hz apart."""
    once = np.linspace(5, 200, count // 2)
    s = 2j * np.pi * np.sort(np.concatenate([once, once + 1e-9]))
    table = np.column_stack([s.imag, (7 / s).real, (7 / s).imag])
    np.savetxt(path, table, fmt="%.17g", delimiter=",", header="omega,real,imag", comments="")


def write_bomb(path: Path, zeros: int) -> None:
    """A MAT file whose frequency_hz is that many zeros, compressed."""
    head = pack("<IIII", 6, 8, 6, 0) + pack("<IIii", 5, 8, zeros, 1) + pack("<II", 1, 12) + b"frequency_hz" + bytes(4)
    stream = zlib.compressobj(9)
    content = stream.compress(pack("<II", 14, len(head) + 8 + 8 * zeros) + head + pack("<II", 9, 8 * zeros))
    for first in range(0, zeros, 2**20):
        content += stream.compress(bytes(8 * min(2**20, zeros - first)))
    content += stream.flush()
    header = b"MATLAB 5.0 MAT-file".ljust(124) + pack("<H", 0x100) + b"IM"
    path.write_bytes(header + pack("<II", 15, len(content)) + content)


def measured(command: list[str]) -> tuple[float, float, int]:
    """CPU seconds, peak memory in MB and exit status of a command."""
    script = (
        "import resource, subprocess, sys; code = subprocess.call(sys.argv[1:], stdout=subprocess.DEVNULL); "
        "used = resource.getrusage(resource.RUSAGE_CHILDREN); "
        "print(used.ru_utime + used.ru_stime, used.ru_maxrss, code)"
    )
    run = subprocess.run([sys.executable, "-c", script, *command], cwd=ROOT, capture_output=True, text=True, check=True)
    seconds, peak, code = run.stdout.split()
    return float(seconds), int(peak) * 1024 / MEGABYTE, int(code)


class Case(NamedTuple):
    """A command, the status it ends with, the most CPU seconds and MB: so many, and bytes for each of size."""

    label: str
    size: int
    command: list[str]
    status: int
    longest_s: float
    megabytes: float
    bytes_each: float = 0.0

    def holds(self) -> bool:
        """Measure, print, and say whether the command took no more than it may."""
        seconds, peak, code = measured(self.command)
        most = self.megabytes + self.bytes_each * self.size / MEGABYTE
        formula = f"{self.megabytes:.0f} MB" + (f" + {self.bytes_each:g} B each" if self.bytes_each else "")
        numbers = f"{self.size:12d}{code:8d}{seconds:9.1f}{self.longest_s:9.0f}{peak:9.0f}{most:9.0f}"
        print(f"{self.label:32s}{numbers}  {formula}", flush=True)
        return code == self.status and seconds <= self.longest_s and peak <= most


def main() -> None:
    """Print a line for each input; exit with 1 where one took more than it may."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--lines", type=int, default=100_000, help="of a frequency response")
    parser.add_argument("--samples", type=int, default=1_000_000, help="of a record")
    parser.add_argument("--tests", type=int, default=50, help=f"of a set, {LINES} lines each")
    parser.add_argument("--plants", type=int, default=5_000, help="of a campaign, whose runs cost nothing")
    parser.add_argument("--rows", type=int, default=100_000, help=f"of a run of {HORIZON_S:g} s, and of a sampled one")
    parser.add_argument("--zeros", type=int, default=200_000_000, help="that a MAT file of a thousandth expands to")
    sizes = parser.parse_args()
    print(f"{'input':32s}{'size':>12s}{'status':>8s}{'CPU s':>9s}{'at most':>9s}{'peak MB':>9s}{'at most':>9s}")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        held = [case.holds() for case in chain(fits(folder, sizes), runs(folder, sizes))]
    sys.exit(int(not all(held)))


def fits(folder: Path, sizes: argparse.Namespace) -> Iterator[Case]:
    """Files that are fitted; each is there while its case is."""
    inputs: tuple[tuple[str, str, Callable[[Path, int], None], int, int, float, float, float], ...] = (
        ("frequency response, lines", "lines.csv", write_lines, sizes.lines, 0, 60.0, 300.0, 250.0),
        ("lines read twice", "pairs.csv", write_pairs, 1000, 0, 30.0, 300.0, 0.0),
        (f"tests of {LINES} lines", "tests.csv", write_tests, sizes.tests, 0, 60.0, 200.0, 2e5),
        ("record, samples", "record.mat", write_samples, sizes.samples, 0, 120.0, 300.0, 250.0),
        ("compressed zeros, refused", "zeros.mat", write_bomb, sizes.zeros, 2, 10.0, 600.0, 0.0),
    )
    for label, file, write, size, status, longest_s, megabytes, bytes_each in inputs:
        write(folder / file, size)
        command = ["-m", "identification", "fit", str(folder / file), "--output", str(folder / "model.json")]
        yield Case(label, size, [sys.executable, *command], status, longest_s, megabytes, bytes_each)
        (folder / file).unlink()


def runs(folder: Path, sizes: argparse.Namespace) -> Iterator[Case]:
    """What is done with a design: a campaign, a long run, and one on a computer."""
    python, design, output = sys.executable, str(folder / "design.json"), str(folder / "run.csv")
    options = ["--reference-omega", "1.5", "--a", "4", "--e", "2", "--f", "1"]
    measured([python, "-m", "design", "extended", "implied", *options, "--output", design])
    bare = measured([python, "-c", IMPORTS])[1]
    campaign = [python, "-c", CAMPAIGN, str(folder), str(sizes.plants)]
    yield Case("campaign, plants (runs made up)", sizes.plants, campaign, 0, 600.0, bare + 100.0)
    asked = ["--amplitude", "50", "--limit", "12", "--anti-windup", "corrected", "--output", output]
    step = ["--until", str(HORIZON_S), "--sample-time", str(HORIZON_S / sizes.rows)]
    command = [python, "-m", "experiments", "simulate", design, *asked, *step]
    yield Case(f"run of {HORIZON_S:g} s, rows", sizes.rows, command, 0, 60.0, 350.0, 250.0)
    step = ["--until", str(sizes.rows / RATE_HZ), "--rate", str(RATE_HZ)]
    command = [python, "-m", "experiments", "sampled", design, *asked, *step]
    yield Case(f"run on a computer, {RATE_HZ:g} Hz, rows", sizes.rows, command, 0, 60.0, 350.0, 250.0)


if __name__ == "__main__":
    main()
