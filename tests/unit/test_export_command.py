"""The command export: what it writes, what it says, and what it refuses before anything is written."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest
from click.testing import CliRunner
from compiled_controller import self_test

from antiwindup.__main__ import main
from design.design_file import Design
from experiments.drive import choose_method


@pytest.fixture(scope="module")
def design_file(extended_design: Design, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("design") / "design.json"
    path.write_text(extended_design.to_json(), encoding="utf-8")
    return path


def export(design: Path, output: Path, *options: str) -> tuple[int, str]:
    words = ["export", str(design), "--rate", "500", "--limit", "-12", "10", "--output", str(output), *options]
    result = CliRunner().invoke(main, words)
    return result.exit_code, result.output


def test_what_is_written_and_said(design_file: Path, tmp_path: Path) -> None:
    status, said = export(design_file, tmp_path, "--to", "c", "--precision", "float", "--name", "axis_1")
    assert (status, said.count("\n")) == (0, 1)
    assert said.endswith(f"; axis_1.h, axis_1.c, axis_1_test.c, axis_1_test.csv -> {tmp_path}\n")
    assert "the windup ends whatever the control" in said
    files = {path.name: path.read_text(encoding="utf-8") for path in tmp_path.iterdir()}
    assert len(files) == 4
    assert self_test(files, "axis_1", tmp_path).startswith("axis_1: 1000 samples")


def test_json_says_what_the_design_does(design_file: Path, tmp_path: Path) -> None:
    status, said = export(design_file, tmp_path, "--to", "json", "--anti-windup", "none")
    assert status == 0
    assert re.match(r"At 500 Hz with the method (matched|tustin), which is chosen, the linear loop is stable", said)
    assert "No guarantee: there is no anti-windup; controller.json, controller_test.csv -> " in said
    content = json.loads((tmp_path / "controller.json").read_text(encoding="utf-8"))
    assert (content["rate_hz"], content["limits"]) == (500.0, {"low": -12.0, "high": 10.0})
    assert content["windup"]["A"] == []


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        (["--to", "json", "--precision", "float"], "--precision float belongs to --to c; found --to json"),
        (["--to", "c", "--name", "1st"], "--name is '1st'; expected at most 40 letters, digits and underscores"),
        (["--to", "c", "--name", "a/b"], "--name is 'a/b'"),
        (["--to", "c", "--rate", "nan"], "the rate is nan Hz; expected a positive number"),
        (["--to", "c", "--limit", "3", "-3"], "--limit is 3 -3; expected the lower limit first"),
        (["--to", "c", "--anti-windup", "mine"], "there is no anti-windup 'mine'"),
        (["--to", "c", "--method", "euler"], "the method is 'euler'"),
        (["--to", "python2"], "'python2'"),
    ],
)
def test_what_is_refused(design_file: Path, tmp_path: Path, options: list[str], sentence: str) -> None:
    status, said = export(design_file, tmp_path, *options)
    assert status == 2
    assert sentence in said
    assert not list(tmp_path.iterdir())


def test_an_unstable_loop_is_refused(design_file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(choose_method, "least_rate", lambda *_: "a search")  # of seconds, with tests of its own
    status, said = export(design_file, tmp_path, "--to", "c", "--method", "exact", "--rate", "3")
    assert (status, list(tmp_path.iterdir())) == (2, [])
    assert "At 3 Hz with the method exact the linear loop is UNSTABLE; matched: stable" in said


def test_the_design_is_not_written_over(design_file: Path) -> None:
    before = design_file.read_bytes()
    status, said = export(design_file, design_file.parent, "--to", "json", "--name", "design")
    assert (status, design_file.read_bytes()) == (2, before)
    assert "is an input too" in said
