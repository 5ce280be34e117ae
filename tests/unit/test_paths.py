"""Paths and values in sentences: looked at without a traceback, quoted on one line, outputs before all else."""

from __future__ import annotations

import json
import os
import re
from pathlib import Path
from xml.etree import ElementTree

import click
import pytest
from click.testing import CliRunner, Result
from hypothesis import given
from hypothesis import strategies as st
from matplotlib.figure import Figure

from benchmarks.fuzz.kinds import commands
from identification.__main__ import main as identification
from identification.base import path_types
from identification.base.errors import LONGEST, InputError, printable, shown
from identification.base.files import (
    is_file,
    is_folder,
    is_there,
    read_text,
    require_folder,
    require_writable,
    true_path,
)
from identification.model.model_file import IdentifiedModel, read_model
from identification.sweeps.read_sweeps import read_sweeps
from paper_figures.__main__ import main as paper_figures
from paper_figures.look import style
from paper_figures.summary.of_fit import _tests as said_of

OUTPUTS = ("output", "build", "page", "responses", "figure")
ODD = ("loop", "loop/a", "x" * 300, "model.json/a", "missing/a", "pipe", "locked/a", os.fsdecode(b"\xff/a"))

values = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text() | st.text(st.characters(codec=None)),
    lambda inner: st.lists(inner) | st.dictionaries(st.text(), inner),
)


@given(values)
def test_a_value_is_quoted_on_one_line_that_is_not_long(value: object) -> None:
    text = shown(value)
    assert len(text) <= LONGEST
    assert text.isprintable()
    if not isinstance(value, list | dict) and len(repr(value)) <= LONGEST:
        assert text == repr(value)


@given(st.text(st.characters(codec=None)))
def test_a_sentence_can_be_printed_and_written_anywhere(text: str) -> None:
    sentence = str(InputError(text))
    assert "\n" not in sentence
    assert printable(sentence) == sentence
    sentence.encode("utf-8")


def test_deep_and_long_values_are_quoted_too() -> None:
    deep: list[object] = []
    for _ in range(100_000):
        deep = [deep]
    assert len(shown(deep)) <= LONGEST
    assert len(shown("x" * 10**6)) <= LONGEST
    assert shown(0.1) == "0.1"


@pytest.fixture
def odd(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with a link to itself, a pipe, a file, and a folder that nobody may look into."""
    (tmp_path / "loop").symlink_to("loop")
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "model.json").touch()
    real = os.stat

    def stat(path: object, **options: object) -> os.stat_result:
        if isinstance(path, str | os.PathLike) and "locked" in os.fspath(path):
            raise PermissionError(13, "Permission denied")
        return real(path, **options)  # type: ignore[arg-type,call-overload]

    monkeypatch.setattr(os, "stat", stat)
    return tmp_path


@pytest.mark.parametrize("name", ODD, ids=lambda name: ascii(name[:8])[1:-1])
def test_what_cannot_be_looked_at_is_one_sentence(odd: Path, name: str) -> None:
    path = odd / name
    assert not is_file(path)
    assert not is_folder(path)
    assert not is_there(path) or name == "pipe"
    assert true_path(path).name
    for act in (read_text, require_writable, require_folder):
        with pytest.raises(InputError, match=r"cannot be|no such"):
            act(path)


def test_every_path_of_a_command_is_of_a_type_that_looks_at_it() -> None:
    outputs = path_types.OUTPUT_FILE, path_types.OUTPUT_FOLDER, path_types.FIGURE_FILE
    types = (path_types.INPUT, path_types.INPUT_FILE), outputs
    met = set()
    for words, command in commands():
        for each in command.params:
            if isinstance(each.type, click.Path):
                assert each.type in types[each.name in OUTPUTS], (words, each.name)
                met.add(each.name)
    assert met >= set(OUTPUTS)


def _bode(*paths: Path | str) -> Result:
    model, sweep, output = map(str, paths)
    return CliRunner().invoke(paper_figures, ["bode", model, sweep, "--output", output])


@pytest.mark.parametrize("output", ["", "missing", "model.json"])
def test_an_output_is_refused_before_anything_is_read(tmp_path: Path, output: str) -> None:
    (tmp_path / "model.json").touch()
    result = _bode("nowhere.json", "nowhere.csv", tmp_path / output if output else "")
    assert result.exit_code == 2
    assert "nowhere" not in result.output


def test_a_fit_is_not_made_for_an_output_that_is_an_input(tmp_path: Path) -> None:
    sweep = tmp_path / "sweep.csv"
    sweep.write_text("no sweep", encoding="utf-8")
    result = CliRunner().invoke(identification, ["fit", str(sweep), "--output", str(sweep)])
    assert (result.exit_code, result.output) == (
        2,
        f"Error: {sweep}: is an input too; expected another file to write\n",
    )


def test_names_that_are_no_utf_8_and_do_not_print_are_read_drawn_and_written(
    implied: IdentifiedModel, tmp_path: Path
) -> None:
    model, sweep = (tmp_path / os.fsdecode(name) for name in (b"\xff\x1b$\\frac$.json", b"a\x07\x9b$x$.csv"))
    model.write_text(implied.to_json(), encoding="utf-8")
    assert read_model(model).plant == implied.plant
    rows = "".join(f"{10 * k},{1 / k},{-1 / k}\n" for k in range(1, 20))
    sweep.write_text(f"# SYNTHETIC\nomega,real,imag\n{rows}", encoding="utf-8")
    result = _bode(model, sweep, tmp_path)
    assert result.exit_code == 0, result.output
    assert "a\\x07\\udc9b$x$.csv" in (tmp_path / "bode.txt").read_text(encoding="utf-8")
    ElementTree.parse(tmp_path / "bode.svg")


def test_no_figure_holds_control_characters(tmp_path: Path) -> None:
    figure = Figure()
    figure.text(0.5, 0.5, "a\x1b\nb\udcff")
    files = style.rendered(figure, tmp_path, "a", "caption\x07\nof two lines")
    ElementTree.fromstring(files[tmp_path / "a.svg"])
    assert files[tmp_path / "a.txt"] == b"caption\\x07\nof two lines\n"


def test_a_member_that_is_given_twice_is_refused(implied: IdentifiedModel, tmp_path: Path) -> None:
    path = tmp_path / "model.json"
    gain = json.dumps(implied.plant.gain)
    path.write_text(implied.to_json().replace(f'"gain": {gain}', f'"gain": {gain}, "gain": 1.0', 1), encoding="utf-8")
    with pytest.raises(InputError, match=r"an object has several members 'gain'; expected each once"):
        read_model(path)


LOOKS = re.compile(r"\.(exists|is_file|is_dir|resolve)\(")
LOOKED_AT = (  # at files of the program's own, or where the path of a command has been looked at already
    *("antiwindup/code_files.py", "identification/base/files.py", "identification/base/cache_folders.py"),
    *("experiments/campaign/checkpoint.py", "experiments/thesis/claims/equations_page.py"),
)


def test_no_path_of_a_user_is_looked_at_but_by_what_raises_nothing() -> None:
    """On Python 3.11 ``Path.exists`` and its like raise for a name that is too long or a folder that is closed."""
    root = Path(__file__).resolve().parents[2]
    rooms = ("antiwindup", "identification", "design", "experiments", "paper_figures")
    modules = [path for room in rooms for path in (root / room).rglob("*.py")]
    found = {path.relative_to(root).as_posix() for path in modules if LOOKS.search(path.read_text(encoding="utf-8"))}
    assert found <= set(LOOKED_AT)


def test_a_test_has_a_printable_name_whatever_its_file_is_called(tmp_path: Path) -> None:
    file = tmp_path / os.fsdecode(b"\xff\x1b.csv")
    rows = "".join(f"{line},1,1\n" for line in range(1, 20))
    file.write_text(f"frequency_hz,real,imag\n{rows}", encoding="utf-8")
    (test,) = read_sweeps(file)
    assert test.name == r"\udcff\x1b.csv"
    assert test.path == file
    assert said_of([test]).isprintable()
