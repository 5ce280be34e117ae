"""How a command ends: a refusal is one sentence and status 2, a crash is none; write-protected files need --force."""

from __future__ import annotations

import warnings
from pathlib import Path

import click
import numpy as np
import pytest
from click.testing import CliRunner

from antiwindup.__main__ import COMMANDS, ROOMS
from antiwindup.__main__ import main as antiwindup
from identification.base.command_line import CommandGroup
from identification.base.errors import InputError
from identification.base.files import write_whole
from identification.base.path_types import OUTPUT_FILE


@click.group(cls=CommandGroup)
def group() -> None:
    """Commands that end in every way."""


@group.command()
@click.argument("how")
def end(how: str) -> None:
    """End as asked."""
    if how == "refused":
        raise InputError("the sweep is empty; expected numbers")
    if how == "singular":
        np.linalg.inv(np.zeros((2, 2)))
    if how == "overflow":
        np.exp(np.array([1e4]))
    if how.startswith("warned"):
        warnings.warn("odd numbers", RuntimeWarning, stacklevel=1)
    if how == "warned and refused":
        raise InputError("the sweep is empty; expected numbers")
    if how == "crash":
        raise RuntimeError(how)


@group.command()
@click.option("--output", type=OUTPUT_FILE)
def write(output: Path) -> None:
    """Write a file."""
    write_whole({output: lambda path: path.write_text("new", encoding="utf-8")})


@pytest.mark.parametrize(
    ("how", "sentence"),
    [
        ("refused", "the sweep is empty; expected numbers"),
        ("singular", "the given numbers are too large or too small to compute with (Singular matrix)"),
        ("overflow", "the given numbers are too large or too small to compute with (overflow encountered in exp)"),
    ],
)
def test_a_refusal_is_one_sentence_and_status_2(how: str, sentence: str) -> None:
    result = CliRunner().invoke(group, ["end", how])
    assert (result.exit_code, result.stdout, result.stderr) == (2, "", f"Error: {sentence}\n")


def test_a_warning_is_shown_where_there_is_no_refusal() -> None:
    with warnings.catch_warnings(record=True) as shown:
        warnings.simplefilter("always")
        assert CliRunner().invoke(group, ["end", "warned and refused"]).exit_code == 2
        assert not shown
        assert CliRunner().invoke(group, ["end", "warned"]).exit_code == 0
    assert [str(each.message) for each in shown] == ["odd numbers"]


def test_a_crash_and_a_wrong_option_are_no_refusals() -> None:
    assert isinstance(CliRunner().invoke(group, ["end", "crash"]).exception, RuntimeError)
    wrong = CliRunner().invoke(group, ["end", "well", "--no-such-option"])
    assert wrong.exit_code == 2
    assert "No such option" in wrong.stderr


def test_a_write_protected_file_is_replaced_with_force(tmp_path: Path) -> None:
    output = tmp_path / "kept.txt"
    output.write_text("old", encoding="utf-8")
    output.chmod(0o444)
    refused = CliRunner().invoke(group, ["write", "--output", str(output)])
    assert refused.exit_code == 2
    assert f"{output}: is write-protected; expected a file that may be replaced, or --force" in refused.stderr
    assert output.read_text(encoding="utf-8") == "old"
    assert CliRunner().invoke(group, ["write", "--output", str(output), "--force"]).exit_code == 0
    assert output.read_text(encoding="utf-8") == "new"


def commands(found: click.Command, name: str) -> dict[str, click.Command]:
    if not isinstance(found, click.Group):
        return {name: found}
    below = [
        (each, found.get_command(click.Context(found), each)) for each in found.list_commands(click.Context(found))
    ]
    return {path: command for each, one in below if one for path, command in commands(one, f"{name} {each}").items()}


def test_every_command_that_writes_takes_force() -> None:
    every = commands(antiwindup, "antiwindup")
    assert {path.split()[1] for path in every} == {*COMMANDS, *ROOMS}
    assert all(any("--force" in option.opts for option in command.params) for command in every.values())
