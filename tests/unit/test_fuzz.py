"""Damaged files, odd numbers and odd names are answered or refused in a sentence; what is neither is seen."""

from __future__ import annotations

import os
import time
import warnings
from pathlib import Path

import click
import numpy as np
import pytest

from benchmarks.fuzz import outcome
from benchmarks.fuzz.__main__ import CORPUS, fuzz, judged, keep, kept
from benchmarks.fuzz.kinds import KINDS, Case
from identification.base.command_line import CommandGroup
from identification.base.errors import InputError

CASES = 80
FAILED = sorted(path.parent for path in CORPUS.rglob("command.json"))


@pytest.mark.parametrize("kind", KINDS)
def test_no_case_is_a_fault(kind: str) -> None:
    found = list(fuzz(kind, CASES, seed=1, cheap=True))
    faults = [f"{case.arguments}: {judged.said}" for case, judged in found if judged.kind == "fault"]
    assert not faults, "\n".join(faults[:5])
    kinds = {judged.kind for _, judged in found}
    assert kinds == {"accepted", "refused"}


@pytest.mark.parametrize("folder", FAILED, ids=lambda folder: f"{folder.parent.name}-{folder.name}")
def test_what_failed_before_does_so_no_more(folder: Path) -> None:
    found = judged(kept(folder), seconds=30)
    assert found.kind != "fault", found.said


@click.group(cls=CommandGroup)
def group() -> None:
    """Commands that end in every way."""


@group.command()
@click.argument("how")
def end(how: str) -> None:
    """End as asked."""
    if how == "refuses and writes":
        Path("written.txt").write_text("a")
    if how.startswith("refuses"):
        raise InputError("no good")
    if how == "writes what is not finite":
        Path("written.json").write_text('{"a": NaN}')
    if how == "writes nothing":
        Path("written.txt").touch()
    if how == "writes no XML":
        Path("written.svg").write_text("<svg>\x1b</svg>")
    if how == "writes other bytes":
        Path("written.txt").write_text(str(time.perf_counter_ns()))
    if how == "warns":
        warnings.warn("odd", stacklevel=1)
    if how == "writes as a library does":
        os.write(2, b"** On entry to DLASCL parameter number 4 had an illegal value")
    if how == "exits":
        raise SystemExit(3)
    if how == "takes long":
        time.sleep(1)
    if how == "raises":
        np.zeros(1)[1]


@pytest.mark.parametrize(
    ("how", "kind", "said"),
    [
        *(("well", "accepted", ""), ("refuses", "refused", "no good")),
        *(("refuses and writes", "fault", "written.txt"), ("writes what is not finite", "fault", "NaN")),
        *(("writes nothing", "fault", "empty"), ("writes no XML", "fault", "ParseError")),
        *(("writes other bytes", "fault", "other bytes"), ("warns", "fault", "odd")),
        *(("writes as a library does", "fault", "DLASCL"), ("exits", "fault", "status 3")),
        *(("takes long", "fault", "longer than"), ("raises", "fault", "IndexError")),
    ],
)
def test_the_judge(how: str, kind: str, said: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(outcome, "readers", group)
    found = outcome.run(("readers", "end", how), tmp_path, seconds=0.2, again=True)
    assert found.kind == kind
    assert said in found.said


def test_a_case_is_kept_as_it_was(tmp_path: Path) -> None:
    case = Case(("readers", "sweeps", "a"), {"a/b.csv": b"\xff\x00"}, {"c": "-> a"})
    keep(case, tmp_path)
    assert kept(tmp_path) == case
