"""How commands bear what happens to them: kill -9, a full disk, missing permissions, two at once.

    python -m benchmarks.faults --times 10 --seed 1

A row says for each fault and command how many of its ends were as they should be. The full disk is a file system of its
own and the permissions are root's to give up: both need root, and are left out for anybody else. The exit status is 1
if an end was wrong.
"""

from __future__ import annotations

import os
import random
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory

import click

ROOT = Path(__file__).resolve().parents[1]
SWEEPS = [str(ROOT / f"data/elevation/synthetic_test_{k}_frf.csv") for k in (1, 2, 3)]
REFERENCE = ["--amplitude", "50", "--phase", "1.5708", "--limit", "12"]
EXTENDED = ["--reference-omega", "1.5", "--a", "4", "--e", "2", "--f", "1"]
BUILD = [*SWEEPS, "--model", "implied", *(f"--only=fig_{name}" for name in ("2_01", "2_02", "2_12", "4_01", "a_03"))]

WRITERS = {
    "fit": ["identification", "fit", SWEEPS[0], "--modes", "2", "--output", "{folder}/m.json"],
    "extended": ["design", "extended", "implied", *EXTENDED, "--output", "{folder}/d.json"],
    "simulate": [
        *["experiments", "simulate", "{design}", *REFERENCE, "--anti-windup", "none", "--until", "30"],
        *["--sample-time", "0.001", "--output", "{folder}/r.csv"],
    ],
    "pid": ["experiments", "thesis", "pid", "--output", "{folder}"],
    "campaign": [
        *["experiments", "campaign", "{design}", *REFERENCE, "--plants", "40", "--seed", "1"],
        *["--output", "{folder}/c.parquet"],
    ],
    "draw": ["paper_figures", "draw", "fig_2_01", "--results", ".", "--output", "{folder}"],
    "figures": ["antiwindup", "figures", *BUILD, "--output", "{folder}"],
}  # fmt: skip
"""Commands that write, with {folder} for where."""


def command(name: str, folder: Path, design: Path) -> list[str]:
    return [sys.executable, "-m", *(word.format(folder=folder, design=design) for word in WRITERS[name])]


def files(folder: Path) -> dict[str, bytes]:
    return {
        path.relative_to(folder).as_posix(): path.read_bytes() for path in sorted(folder.rglob("*")) if path.is_file()
    }


def run(words: Sequence[str]) -> subprocess.CompletedProcess[str]:
    return subprocess.run(words, cwd=ROOT, capture_output=True, text=True, check=False, timeout=600)


def not_refused(done: subprocess.CompletedProcess[str]) -> list[str]:
    """What is wrong with the end of a command that should have refused in one sentence."""
    sentence = [line for line in done.stderr.splitlines() if not line.endswith("cannot be written to")]
    wrong = [] if done.returncode == 2 else [f"status {done.returncode}"]
    right = len(sentence) == 1 and sentence[0].startswith("Error: ") and not done.stdout
    return wrong + ([] if right else [f"said {done.stdout + done.stderr!r}"])


def killed(name: str, design: Path, chance: random.Random) -> list[str]:
    """Kill a command with kill -9 at a random time; the same command then makes what it would have made."""
    with TemporaryDirectory() as below:
        whole, broken = Path(below) / "whole" / "out", Path(below) / "broken" / "out"
        for folder in (whole, broken):
            folder.mkdir(parents=True)
        begun = time.monotonic()
        run(command(name, whole, design))
        took = time.monotonic() - begun
        process = subprocess.Popen(
            command(name, broken, design), cwd=ROOT, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
            start_new_session=True,
        )  # fmt: skip
        time.sleep(chance.uniform(0.0, 1.1 * took))
        process.send_signal(signal.SIGKILL)  # to the command alone: what it began must end by itself
        process.wait()
        until = time.monotonic() + 20
        while (left := left_of(process.pid)) and time.monotonic() < until:
            time.sleep(0.05)
        again = run(command(name, broken, design))
        wrong = [f"process {line} left" for line in left]
        wrong += [] if again.returncode == 0 else [f"then status {again.returncode}, {again.stderr!r}"]
        made, expected = files(broken), files(whole)
        differing = {each for each in {*made, *expected} if made.get(each) != expected.get(each)} - {"manifest.json"}
        return wrong + ([f"then other files: {sorted(differing)}"] if differing else [])


def left_of(session: int) -> list[str]:
    shown = subprocess.run(["ps", "-A", "-o", "sess=,stat=,pid=,args="], capture_output=True, text=True, check=True)
    rows = [line.split(maxsplit=3) for line in shown.stdout.splitlines()]
    return [" ".join(row[2:]) for row in rows if row[0] == str(session) and not row[1].startswith("Z")]


def on_a_full_disk(name: str, design: Path, chance: random.Random) -> list[str]:
    """Let a command write to a file system with room for a part of its files, or for none."""
    with TemporaryDirectory() as below, full(Path(below), chance.choice([0, 4, 20])) as folder:
        before = files(folder)
        done = run(command(name, folder, design))
        left = {
            each
            for each in {*files(folder)} - {*before}
            if name != "figures" or ".partial" in each or each.endswith(".lock")
        }
        if done.returncode == 0 and not left <= {".antiwindup.lock"}:
            return []  # there was room enough
        return not_refused(done) + ([f"left {sorted(left)}"] if left else [])


@contextmanager
def full(folder: Path, left_kib: int) -> Iterator[Path]:
    """A file system with so much room left."""
    subprocess.run(["mount", "-t", "tmpfs", "-o", "size=1m", "tmpfs", folder], check=True)
    try:
        (folder / "filling").write_bytes(bytes(1024 * (1024 - left_kib)))
        yield folder
    finally:
        subprocess.run(["umount", folder], check=True)


def without_permission(name: str, design: Path, chance: random.Random) -> list[str]:
    """Let a command, as one who has no power over permissions, write where it may not."""
    with TemporaryDirectory() as below:
        outer = Path(below) / "outer"
        folder = outer / "inner"
        folder.mkdir(parents=True)
        barred, mode = chance.choice([(outer, 0o000), (folder, 0o555), (folder, 0o000)])
        barred.chmod(mode)
        os.chmod(below, 0o755)  # noqa: PTH101
        drop = ["capsh", "--drop=cap_dac_override,cap_dac_read_search", "--", "-c", 'exec "$@"', "_"]
        done = run([*drop, *command(name, folder, design)])
        for each in (outer, folder):
            each.chmod(0o755)
        return not_refused(done) + ([f"left {sorted(files(folder))}"] if files(folder) else [])


def two_at_once(name: str, design: Path, chance: random.Random) -> list[str]:
    """Start a command twice, for two models or seeds and with one output; one refuses, the other's files are right."""
    with TemporaryDirectory() as below:
        folders = [Path(below) / each / "out" for each in ("first", "second", "both")]
        for folder in folders:
            folder.mkdir(parents=True)
        other = {"--model": "table", "--seed": "2"}
        first = command(name, folders[2], design)
        second = [other.get(before, word) for before, word in zip(["", *first], first, strict=False)]
        alone = [
            [word.replace(str(folders[2]), str(folder)) for word in words]
            for words, folder in zip((first, second), folders, strict=False)
        ]
        for words in alone:
            run(words)
        began = [subprocess.Popen(first, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)]
        time.sleep(chance.uniform(0.0, 2.0))
        began.append(subprocess.Popen(second, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True))
        said = [process.communicate()[1] for process in began]
        statuses = [process.returncode for process in began]
        expected = [files(folder) for folder in folders[:2]]
        for each in (*expected, made := files(folders[2])):
            each.pop("manifest.json", None)
        wrong = [] if 0 in statuses else ["neither was done"]
        for status, sentence in zip(statuses, said, strict=True):
            refused = status == 2 and " is writing it; wait" in sentence and len(sentence.splitlines()) == 1
            wrong += [] if status == 0 or refused else [f"status {status}, {sentence!r}"]
        return wrong + ([] if made in expected else ["a mixture"])


def lost_cluster(name: str, design: Path, chance: random.Random) -> list[str]:
    """Kill the scheduler of a campaign at a random time; the campaign says so and goes on later without it."""
    with TemporaryDirectory() as below:
        whole, folder = Path(below) / "whole", Path(below) / "out"
        for each in (whole, folder):
            each.mkdir()
        run(command(name, whole, design))
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            port = str(free.getsockname()[1])
        address, quiet = f"tcp://127.0.0.1:{port}", {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
        dask = [sys.executable, "-m", "dask"]
        here = ["--host", "127.0.0.1", "--no-dashboard"]
        cluster = [
            subprocess.Popen([*dask, "scheduler", *here, "--port", port], cwd=below, **quiet),
            subprocess.Popen([*dask, "worker", address, *here, "--nthreads", "1"], cwd=ROOT, **quiet),
        ]
        try:
            process = subprocess.Popen(
                [*command(name, folder, design), "--scheduler", address],
                cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
            )  # fmt: skip
            time.sleep(chance.uniform(4.0, 15.0))
            cluster[0].kill()
            said = process.communicate(timeout=120)[1]
        finally:
            for each in cluster:
                each.kill()
                each.wait()
        refused = process.returncode == 2 and len(said.splitlines()) == 1
        wrong = [] if refused or process.returncode == 0 else [f"status {process.returncode}, {said!r}"]
        again = run(command(name, folder, design))
        wrong += [] if again.returncode == 0 else [f"then status {again.returncode}, {again.stderr!r}"]
        return wrong + ([] if files(folder) == files(whole) else ["then another file"])


FAULTS: dict[str, tuple[Callable[[str, Path, random.Random], list[str]], Sequence[str]]] = {
    "kill -9": (killed, [*WRITERS]),
    "full disk": (on_a_full_disk, [*WRITERS]),
    "permissions": (without_permission, [*WRITERS]),
    "two at once": (two_at_once, ["campaign", "figures"]),
    "lost cluster": (lost_cluster, ["campaign"]),
}
OF_ROOT = ("full disk", "permissions")


@click.command()
@click.option("--times", default=5, show_default=True, help="How often each fault happens to each command.")
@click.option("--seed", default=1, show_default=True, help="Of the random times and places.")
@click.option("--only", type=click.Choice([*FAULTS]), multiple=True, help="Faults; all unless given.")
def main(times: int, seed: int, only: Sequence[str]) -> None:
    """Inject faults into the commands that write, and print how they end."""
    chance, failed = random.Random(seed), False
    click.echo(f"{'fault':14s}{'command':12s}{'right':>6s}{'wrong':>6s}")
    with TemporaryDirectory() as folder:
        design = Path(folder) / "design.json"
        run([sys.executable, "-m", "design", "extended", "implied", *EXTENDED, "--output", str(design)])
        os.chmod(folder, 0o755)  # noqa: PTH101
        for fault, (happens, names) in FAULTS.items():
            if only and fault not in only:
                continue
            if fault in OF_ROOT and os.geteuid() != 0:
                click.echo(f"{fault:14s}needs root, left out")
                continue
            for name in names:
                ends = [happens(name, design, chance) for _ in range(times)]
                wrong = [end for end in ends if end]
                click.echo(f"{fault:14s}{name:12s}{times - len(wrong):6d}{len(wrong):6d}")
                for end in wrong:
                    click.echo(f"    {'; '.join(end)}")
                failed = failed or bool(wrong)
    sys.exit(failed)


if __name__ == "__main__":
    main()
