"""The Makefile hands every value over as it is, and runs nothing that stands in one."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
from pathlib import Path

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from antiwindup.from_make import arguments, words
from identification.base.errors import InputError

ROOT = Path(__file__).resolve().parents[2]
# Written where make is run: the arguments of the last, and what make handed over.
PYTHON = """#!/bin/sh
printf '%s\\0' "$@" > arguments
env -0 > handed
"""
NAMES = [
    *("sweep (1).csv", "Tom's.csv", 'a "quoted" name.csv', "a&b.csv", "a:b.csv", "a;touch pwned;.csv", "-dash.csv"),
    *("`touch pwned`.csv", "$(touch pwned).csv", "$(shell touch pwned).csv", "${HOME}.csv", "a$b$$c.csv", "#a.csv"),
    *(
        "扫频.csv",
        os.fsdecode(b"latin-\xe9.csv"),
        "per%cent.csv",
        "tab\there.csv",
        "back\\slash.csv",
        "a=b.csv",
        "*.csv",
    ),
    *("|", "~", "!", "{a,b}", "[x]", "<in >out", "\\", "'", '"'),
]


@pytest.fixture
def make(tmp_path: Path) -> Path:
    """A folder with the Makefile and a stand-in for Python."""
    shutil.copy(ROOT / "Makefile", tmp_path)
    for name in ("requirements.lock", "pyproject.toml", "requirements-bench.lock", "ready", ".compiled"):
        (tmp_path / name).touch()
    python = tmp_path / "python"
    python.write_text(PYTHON, encoding="utf-8")
    python.chmod(0o755)
    return tmp_path


def run(folder: Path, *arguments: str, **environment: str) -> subprocess.CompletedProcess[str]:
    own = {name: value for name, value in os.environ.items() if name not in ("MAKEFLAGS", "MFLAGS", "MAKELEVEL")}
    command = ["make", f"PY={folder / 'python'}", f"READY={folder / 'ready'}", *arguments]
    return subprocess.run(command, cwd=folder, env=own | environment, capture_output=True, text=True, check=False)


def seen(folder: Path) -> tuple[list[str], dict[str, str]]:
    argv, handed = (os.fsdecode((folder / name).read_bytes()).split("\0")[:-1] for name in ("arguments", "handed"))
    variables = dict(line.split("=", 1) for line in handed)
    return argv, {name[11:]: value for name, value in variables.items() if name.startswith("ANTIWINDUP_")}


@pytest.mark.parametrize("name", NAMES)
def test_every_value_arrives_as_it_is(make: Path, name: str) -> None:
    before = {path.name for path in make.iterdir()}
    given = {
        "SWEEPS": name,
        "OUT": name,
        "MODEL": name,
        "FIT": name,
        "LIMIT": name,
        "PLANTS": name,
        "AXIS": name,
        "ONLY": name,
    }
    for result in (
        run(make, "refit", *(f"{key}={value}" for key, value in given.items())),
        run(make, "refit", **given),
    ):
        assert result.returncode == 0, result.stderr
        argv, handed = seen(make)
        assert argv == ["-m", "antiwindup.from_make", "refit"]
        assert {handed[key] for key in given if key != "OUT"} == {handed["OUTPUT"]} == {name}
        assert {path.name for path in make.iterdir()} == before | {"arguments", "handed"}
    assert run(make, "figures", f"BUILD={name}").returncode == 0
    assert seen(make)[1]["OUTPUT"] == name
    for target, variable in (("study", "SETS"), ("referee", "CASES")):
        assert run(make, target, f"{variable}={name}").returncode == 0
        assert f"--{variable.lower()}={name}" in seen(make)[0]


def test_what_is_not_given_has_its_default(make: Path) -> None:
    (make / "data" / "elevation").mkdir(parents=True)
    for name in ("b_frf.csv", "a_frf.csv", "a_raw.csv"):
        (make / "data" / "elevation" / name).touch()
    run(make, "refit")
    handed = seen(make)[1]
    assert (handed["SWEEPS"], handed["OUTPUT"]) == ("data/elevation/a_frf.csv data/elevation/b_frf.csv", "build/refit")
    run(make, "report")
    assert seen(make)[1]["OUTPUT"] == "build"
    run(make, "refit", "OUT=")
    assert seen(make)[1]["OUTPUT"] == ""


def test_a_command_line_has_each_value_in_a_word_of_its_own(tmp_path: Path) -> None:
    given = {"OUTPUT": "-my folder", "MODEL": "", "FIT": "--modes 1 --loss 'soft-l1'", "SWEEPS": "-a.csv b.csv"}
    command = [
        "refit",
        "--output=-my folder",
        "--axis=my axis.toml",
        "--limit=-3 12",
        "--modes",
        "1",
        "--loss",
        "soft-l1",
        "--",
        "-a.csv",
        "b.csv",
    ]
    assert arguments("refit", given | {"LIMIT": "-3 12", "AXIS": "my axis.toml"}) == command
    assert arguments("figures", {"OUTPUT": "b", "ONLY": "fig_2_01 fig_2_02", "FORCE": "yes"})[2:-1] == [
        *("--only=fig_2_01", "--only=fig_2_02", "--force")
    ]


@pytest.mark.parametrize(
    ("variables", "part"),
    [
        ({"FORCE": "no"}, "FORCE is 'no'; expected yes or nothing"),
        ({"FIT": "--output elsewhere"}, "FIT is '--output elsewhere': No such option"),
        ({"FIT": "--force"}, "No such option"),
        ({"FIT": "a.csv"}, "unexpected extra argument"),
        ({"FIT": "--modes 99"}, "FIT is '--modes 99': "),
        ({"FIT": "'"}, "No closing quotation"),
    ],
)
def test_a_variable_holds_what_it_is_for_and_nothing_else(variables: dict[str, str], part: str) -> None:
    with pytest.raises(InputError, match=re.escape(part)):
        arguments("refit", {"OUTPUT": "mine", "SWEEPS": "a.csv"} | variables)


@given(st.lists(st.text("ab '\"\\$`", min_size=1), min_size=1, max_size=3))
@example(["a", "b c"])
def test_names_with_blanks_are_one_name_or_quoted(names: list[str]) -> None:
    """What is no file yet is read as a shell would read it, and nothing in it is run."""
    quoted = " ".join("'" + name.replace("'", "'\\''") + "'" for name in names)
    assert words(quoted) == names


def test_a_name_with_blanks_that_is_there_needs_no_quotes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    for name in ("my sweep.csv", "Tom's.csv", "a.csv"):
        (tmp_path / name).touch()
    assert words("my sweep.csv") == ["my sweep.csv"]
    assert words("a.csv Tom's.csv") == ["a.csv", "Tom's.csv"]
    assert words("a.csv 'my sweep.csv'") == ["a.csv", "my sweep.csv"]
    with pytest.raises(InputError, match="No closing quotation"):
        words("a.csv Bob's.csv")


def test_every_target_is_in_the_help() -> None:
    text = run(ROOT, "help").stdout
    targets = [
        "help",
        "bench-build",
        "figures",
        "report",
        "refit",
        "claims",
        "test",
        "suite",
        "bench",
        "study",
        "referee",
        "fuzz",
        "faults",
    ]
    targets += ["audit", "docs", "lint", "release-check", "clean"]
    assert all(f"\n{name} " in f"\n{text}" for name in targets)
