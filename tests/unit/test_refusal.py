"""``--refusal FILE``: a refusal is kept, a missing input is passed over, everything else is as without it."""

from __future__ import annotations

import warnings
from pathlib import Path

import click
import numpy as np
import pytest
from click.testing import CliRunner, Result

from design.__main__ import main as design
from identification.base.command_line import CommandGroup
from identification.base.errors import InputError
from identification.base.files import read_text
from paper_figures.__main__ import main as paper_figures


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
    if how.endswith(".json"):
        read_text(Path(how))


def run(kept: Path, *arguments: str) -> Result:
    kept.write_text("a refusal of yesterday\n", encoding="utf-8")
    return CliRunner().invoke(group, ["--refusal", str(kept), "end", *arguments])


@pytest.mark.parametrize(
    ("how", "sentence"),
    [
        ("refused", "the sweep is empty; expected numbers"),
        ("singular", "the numbers given are too extreme to compute with (Singular matrix)"),
        ("overflow", "the numbers given are too extreme to compute with (overflow encountered in exp)"),
    ],
)
def test_a_refusal_is_kept_and_the_exit_status_is_0(tmp_path: Path, how: str, sentence: str) -> None:
    kept = tmp_path / "model.refused.txt"
    result = run(kept, how)
    assert result.exit_code == 0, result.output
    assert result.stderr == f"Error: {sentence}\n"
    assert kept.read_text(encoding="utf-8") == f"{sentence}\n"
    assert [path.name for path in tmp_path.iterdir()] == [kept.name]
    without = CliRunner().invoke(group, ["end", how])
    assert (without.exit_code, without.stderr) == (2, result.stderr)


def test_a_warning_is_shown_where_there_is_no_refusal() -> None:
    with warnings.catch_warnings(record=True) as shown:
        warnings.simplefilter("always")
        assert CliRunner().invoke(group, ["end", "warned and refused"]).exit_code == 2
        assert not shown
        assert CliRunner().invoke(group, ["end", "warned"]).exit_code == 0
    assert [str(each.message) for each in shown] == ["odd numbers"]


def test_a_success_leaves_no_refusal(tmp_path: Path) -> None:
    assert run(tmp_path / "model.refused.txt", "well").exit_code == 0
    assert not list(tmp_path.iterdir())


def test_without_an_input_nothing_is_done(tmp_path: Path) -> None:
    missing = tmp_path / "model.json"
    result = run(tmp_path / "design.refused.txt", str(missing))
    assert (result.exit_code, result.stderr) == (0, f"{missing}: no such file; nothing is done\n")
    assert not list(tmp_path.iterdir())
    assert CliRunner().invoke(group, ["end", str(missing)]).exit_code == 2


def test_a_crash_and_a_wrong_option_are_no_refusals(tmp_path: Path) -> None:
    kept = tmp_path / "model.refused.txt"
    assert isinstance(run(kept, "crash").exception, RuntimeError)
    wrong = run(kept, "well", "--no-such-option")
    assert wrong.exit_code == 2
    assert "No such option" in wrong.stderr
    assert not list(tmp_path.iterdir())


def test_a_refusal_that_cannot_be_kept_is_one(tmp_path: Path) -> None:
    for how in ("refused", "well"):
        result = CliRunner().invoke(group, ["--refusal", str(tmp_path / "nowhere" / "r.refused.txt"), "end", how])
        assert result.exit_code == 2
        assert "cannot be written" in result.stderr


def test_nothing_but_a_refusal_is_removed(tmp_path: Path) -> None:
    """Not an input, an output, a link nor a device that was given by mistake."""
    design, link, folder = tmp_path / "design.json", tmp_path / "a.refused.txt", tmp_path / "b.refused.txt"
    design.write_text("{}", encoding="utf-8")
    link.symlink_to(design)
    folder.mkdir()
    for given in (design, link, folder, Path("/dev/null"), Path()):
        result = CliRunner().invoke(group, ["--refusal", str(given), "end", "well"])
        assert result.exit_code == 2, given
    assert design.read_text(encoding="utf-8") == "{}"
    assert link.is_symlink()
    assert Path("/dev/null").is_char_device()


def test_the_commands_of_make_pass_over_what_was_not_made(tmp_path: Path) -> None:
    chosen = ["--period", "4", "--epsilon", "1e-4", "--output", str(tmp_path / "design.json")]
    drawn = ["fig_2_10", "--results", str(tmp_path), "--output", str(tmp_path)]
    refusal = ["--refusal", str(tmp_path / "command.refused.txt")]
    for main, arguments in (
        (design, ["delay-free", str(tmp_path / "model.json"), *chosen]),
        (paper_figures, ["draw", *drawn]),
    ):
        result = CliRunner().invoke(main, [*refusal, *arguments])
        assert result.exit_code == 0, result.output
        assert "nothing is done" in result.stderr
        assert not list(tmp_path.iterdir())
