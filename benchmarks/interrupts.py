"""How commands end that are interrupted: each is started --times times and sent a signal at a random time.

    python -m benchmarks.interrupts --times 50 --seed 1

A row says for each command and signal how many of its ends were as they should be: status 128 and the signal's number,
one line, no traceback, all of its files or none but what a campaign keeps, no process left; and how long after the
signal the slowest came. The last column counts the commands that were done before. The exit status is 1 if an end was
wrong.
"""

from __future__ import annotations

import os
import random
import re
import signal
import subprocess
import sys
import time
from collections.abc import Mapping
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

import click

ROOT = Path(__file__).resolve().parents[1]
SIGNALS = {"SIGINT": 130, "SIGTERM": 143, "SIGHUP": 129}
GRACE_S = 3.0  # for processes that were begun to be gone
SWEEPS = [str(ROOT / f"data/elevation/synthetic_test_{k}_frf.csv") for k in (1, 2, 3)]
REFERENCE = ["--amplitude", "50", "--phase", "1.5708"]
RUN = ["{extended}", "--limit", "9", "--anti-windup", "thesis", *REFERENCE]
EXTENDED = ["--reference-omega", "1.5", "--a", "4", "--e", "2", "--f", "1"]

COMMANDS = {
    "fit": ["identification", "fit", *SWEEPS, "--output", "{folder}/m.json", "--responses", "{folder}/r.npz"],
    "extended": ["design", "extended", "implied", *EXTENDED, "--output", "{folder}/d.json"],
    "delay-free": [
        *["design", "delay-free", "implied", "--reference-hz", "0.25"],
        *["--epsilon", "1e-4", "--output", "{folder}/d.json"],
    ],
    "audit": ["design", "audit", "{extended}"],
    "new": ["antiwindup", "new", "{folder}/axis.toml"],
    "axis": ["experiments", "axis", "implied", "--reference-hz", "0.5", "--output", "{folder}"],
    "simulate": [
        *["experiments", "simulate", *RUN, "--until", "9000", "--sample-time", "0.01", "--output", "{folder}/r.csv"],
    ],
    "sampled": [
        *["experiments", "sampled", *RUN, "--until", "500", "--rate", "10000", "--method", "tustin"],
        *["--output", "{folder}/r.csv"],
    ],
    "campaign": [
        *["experiments", "campaign", "{extended}", "--plants", "300", "--seed", "1", "--limit", "12", *REFERENCE],
        *["--output", "{folder}/c.parquet"],
    ],
    "limits": ["experiments", "limits", "{extended}", "--limit", "12", *REFERENCE, "--output", "{folder}"],
    "compare": ["experiments", "compare", "{extended}", "--limit", "12", *REFERENCE, "--output", "{folder}"],
    "tracking": ["experiments", "tracking", "{extended}", "--limit", "12", *REFERENCE, "--output", "{folder}"],
    "rates": ["experiments", "rates", "{extended}", "--limit", "12", *REFERENCE, "--output", "{folder}"],
    "interpolation": ["experiments", "thesis", "interpolation", "{extended}", "--output", "{folder}"],
    "claims": ["experiments", "thesis", "claims", "--output", "{folder}", "--page", "{folder}/claims.md"],
    "draw": ["paper_figures", "draw", "fig_2_06", "--results", "{folder}", "--output", "{folder}"],
    "bode": ["paper_figures", "bode", "{model}", *SWEEPS, "--output", "{folder}"],
    "summary": ["paper_figures", "summary", "{model}", *SWEEPS, "--build", "{folder}"],
    "report": ["paper_figures", "report", "implied", *SWEEPS, "--build", "{folder}"],
    "export": [
        *["antiwindup", "export", "{extended}", "--to", "c", "--rate", "2000", "--limit", "12", "--output", "{folder}"],
    ],
    "check": [
        *["antiwindup", "check", "{model}", *SWEEPS, "--against", "{extended}"],
        *["--junit", "{folder}/c.xml", "--markdown", "{folder}/c.md"],
    ],
    "explore": ["antiwindup", "explore", "{extended}", "--no-browser", "--output", "{folder}/d.json"],
    "refit": ["antiwindup", "refit", *SWEEPS, "--output", "{folder}/built"],
}  # fmt: skip
FILES = {
    "fit": 2,
    "axis": 2,
    "limits": 2,
    "compare": 2,
    "tracking": 2,
    "interpolation": 3,
    "claims": 2,
    "draw": 4,
    "bode": 4,
    "summary": 4,
    "export": 4,
    "check": 2,
}  # others one

KEPT = ("c.parquet.parts/", "built/")  # so that the same command goes on
UNFINISHED = re.compile(r"\.partial-|\.lock")


class End(NamedTuple):
    """How a command ended: what was wrong, nothing if it was done before the signal; and how long that took."""

    wrong: list[str]
    seconds: float
    was_done: bool = False


def inputs(folder: Path) -> dict[str, str]:
    """A model and a design for the commands."""
    from data.thesis import model_named
    from design.chapters_3_4.design_extended import design_extended

    model = model_named("implied")
    design = design_extended(model, reference_omegas=[1.5], a=4.0, pairs=[(2.0, 1.0)])
    (folder / "model.json").write_text(model.to_json(), encoding="utf-8")
    (folder / "extended.json").write_text(design.to_json(), encoding="utf-8")
    return {name: str(folder / f"{name}.json") for name in ("model", "extended")}


def interrupted(command: str, given: Mapping[str, str], name: str, after_s: float) -> End:
    """Start a command, send it a signal ``after_s`` seconds after its first lines have run, and look at its end."""
    with TemporaryDirectory() as folder:
        words = [word.format(folder=folder, **given) for word in COMMANDS[command]]
        process = subprocess.Popen(
            [sys.executable, "-m", *words],
            cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True,
            preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
        )  # fmt: skip
        _wait_for_handlers(process.pid)
        time.sleep(after_s)
        sent = time.monotonic()
        was_done = process.poll() is not None
        if not was_done:
            os.killpg(process.pid, getattr(signal, name))  # to all, as a terminal does
        printed, said = process.communicate(timeout=60)
        seconds = time.monotonic() - sent
        if was_done or process.returncode in (0, 2):  # or as it was sent
            return End(
                [] if process.returncode in (0, 2) else [f"status {process.returncode}, said {said!r}"], 0.0, True
            )
        lines = [line for line in said.splitlines() if line.startswith("Interrupted; ")]
        wrong = [f"status {process.returncode}"] if process.returncode != SIGNALS[name] else []
        wrong += [f"said {said!r}"] if len(lines) != 1 or "Traceback" in said else []
        wrong += [f"printed {printed!r}"] if printed else []
        left = [path for path in _files(Path(folder)) if not path.startswith(KEPT) or UNFINISHED.search(path)]
        whole = len(left) in (0, FILES.get(command, 1)) and not UNFINISHED.search(" ".join(left))
        wrong += [] if whole else [f"left {left}"]
        wrong += [f"process {line} left" for line in _left(process.pid)]
        return End(wrong, seconds)


def _files(folder: Path) -> list[str]:
    return [path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file()]


def _wait_for_handlers(process: int) -> None:
    """Until the process answers SIGTERM itself, as Linux says; elsewhere a moment."""
    status, bit = Path(f"/proc/{process}/status"), 1 << (signal.SIGTERM - 1)
    until = time.monotonic() + 20
    while time.monotonic() < until:
        if not status.exists():
            return time.sleep(0.1)
        caught = [line.split()[1] for line in status.read_text().splitlines() if line.startswith("SigCgt")]
        if not caught or int(caught[0], 16) & bit:
            return None
        time.sleep(0.001)
    return None


def _left(session: int) -> list[str]:
    """The processes of a session that still run after some time."""
    until = time.monotonic() + GRACE_S
    while True:
        shown = subprocess.run(
            ["ps", "-A", "-o", "sess=,stat=,pid=,args="], capture_output=True, text=True, check=True
        ).stdout
        rows = [line.split(maxsplit=3) for line in shown.splitlines()]
        left = [" ".join(row[2:]) for row in rows if row[0] == str(session) and not row[1].startswith("Z")]
        if not left or time.monotonic() > until:
            return left
        time.sleep(0.05)


@click.command()
@click.option("--times", default=50, show_default=True, help="How often each command is interrupted by each signal.")
@click.option("--seed", default=1, show_default=True, help="Of the random times.")
@click.option("--longest", default=3.0, show_default=True, help="Latest time of a signal in seconds.")
def main(times: int, seed: int, longest: float) -> None:
    """Interrupt every command at random times and print how it ends."""
    chance, failed = random.Random(seed), False
    click.echo(f"{'command':14s}{'signal':9s}{'right':>6s}{'wrong':>6s}{'slowest s':>11s}{'done before':>13s}")
    with TemporaryDirectory() as folder:
        given = inputs(Path(folder))
        for command in COMMANDS:
            for name in SIGNALS:
                ends = [interrupted(command, given, name, chance.uniform(0, longest)) for _ in range(times)]
                wrong = [end.wrong for end in ends if end.wrong]
                done = sum(end.was_done and not end.wrong for end in ends)
                slowest = max(end.seconds for end in ends)
                right = times - done - len(wrong)
                click.echo(f"{command:14s}{name:9s}{right:6d}{len(wrong):6d}{slowest:11.3f}{done:13d}")
                for each in wrong:
                    click.echo(f"    {'; '.join(each)}")
                failed = failed or bool(wrong)
    sys.exit(failed)


if __name__ == "__main__":
    main()
