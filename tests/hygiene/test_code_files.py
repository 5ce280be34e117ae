"""What a build takes for changed: every file of the project that a command opens, and no other."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from functools import cache
from pathlib import Path

import pytest

from antiwindup import code_files
from antiwindup.refit_steps import refit_steps
from antiwindup.steps import Asked
from antiwindup.thesis_steps import report_steps, thesis_steps
from paper_figures.thesis.figure_registry import figure_module, figure_names

ROOT = Path(__file__).resolve().parents[2]
ROOMS = ("identification", "design", "experiments", "paper_figures")

ASKED = Asked(Path("build"), None, ("a.csv",), (Path("a.csv"),))
BEFORE = thesis_steps(ASKED)
STEPS = {step.command: step for step in (*BEFORE, *report_steps(ASKED, BEFORE), *refit_steps(ASKED))}


def words(command: tuple[str, ...]) -> str:
    """The room, the command, and the figure."""
    several = command[1] in ("thesis", "draw") or command[:2] == ("paper_figures", "axis")
    return " ".join(command[: 3 if several else 2])


COMMANDS = {words(command): command for command in STEPS}

# Each command in a process of its own: it is run, or what it imports is imported; what of ours is opened is printed.
OPENED = """
import ast, gc, importlib, inspect, json, os, sys, textwrap
import click, flint, jinja2, matplotlib.backends.backend_agg, matplotlib.figure, numba, pandas, schemdraw, tqdm
import scipy.optimize, scipy.signal, scipy.stats

root, scratch, commands, *rooms = *sys.argv[1:3], json.loads(sys.argv[3]), *sys.argv[4:]
RUNS = {
    "design delay-free": [
        *["implied", "--reference-hz", "0.25", "--epsilon", "1e-4", "--output", scratch + "/design.json"]
    ],
    "design extended": ["implied", "--reference-hz", "0.5", "--output", scratch + "/other.json"],
    "experiments axis": ["implied", "--reference-hz", "0.5", "--output", scratch],
    "experiments thesis pid": ["--output", scratch],
    "experiments thesis equations": ["--page", scratch + "/equations.md"],
    "paper_figures draw fig_2_05": ["--results", scratch, "--output", scratch],
}
opened = set()
sys.addaudithook(lambda event, arguments: event == "open" and opened.add(str(arguments[0])))
sys.path.insert(0, root)
gc.disable()
gc.freeze()
for command in commands:
    if os.fork():
        continue
    room, *words = command.split()
    group = importlib.import_module(room + ".__main__").main
    if command in RUNS:
        group.main([*words, *RUNS[command]], standalone_mode=False)
    else:
        found = group
        for word in words:
            if isinstance(found, click.Group):
                found = found.commands[word]
        function = ast.parse(textwrap.dedent(inspect.getsource(found.callback))).body[0]
        for node in function.body:
            if isinstance(node, (ast.Import, ast.ImportFrom)):
                exec(compile(ast.Module([node], []), command, "exec"))
        if (room, words[0]) == ("paper_figures", "axis"):
            importlib.import_module("paper_figures.axis_figures." + words[1])
        if words[0] == "draw":
            importlib.import_module("paper_figures.thesis.figures." + words[1])
        if words[-1] == "claims":
            from experiments.thesis.claims.ledger import read_ledger
            for name in set(read_ledger()["compute"]) - {""}:
                importlib.import_module(name.split(":")[0])
    if "design.asked_model" in sys.modules:  # which imports it when it is asked for a set
        importlib.import_module("data.thesis")
    # identification/base/compiled.py reads the modules of a room to name the folder of numba's files
    opened = {path for path in opened if not path.endswith((".py", ".pyi")) and "__pycache__" not in path}
    opened |= {module.__file__ for module in sys.modules.values() if getattr(module, "__file__", None)}
    ours = {os.path.relpath(path, root) for path in opened if path.startswith(root + "/")}
    with open(f"{scratch}/{command}.txt", "w") as file:
        file.write(" ".join(path for path in ours if path.split("/")[0] in rooms))
    os._exit(0)
for _ in commands:
    os.wait()
print(json.dumps({command: open(f"{scratch}/{command}.txt").read().split() for command in commands}))
"""


@pytest.fixture(scope="module")
def opened(tmp_path_factory: pytest.TempPathFactory) -> dict[str, set[str]]:
    """For each command, the files of the project that it imports and, as far as it was run, reads."""
    scratch = str(tmp_path_factory.mktemp("scratch"))
    text = subprocess.run(
        [sys.executable, "-c", OPENED, str(ROOT), scratch, json.dumps(list(COMMANDS)), *ROOMS, "data"],
        capture_output=True,
        text=True,
        check=True,
    ).stdout
    return {command: set(files) for command, files in json.loads(text.splitlines()[-1]).items()}


def forgotten(opened: dict[str, set[str]]) -> set[tuple[str, str]]:
    """Commands with the files that they open and whose change would go unnoticed."""
    return {
        (name, file)
        for name, command in COMMANDS.items()
        for file in opened[name] - set(code_files.files_of_command(command))
    }


def test_no_file_is_forgotten(opened: dict[str, set[str]]) -> None:
    assert len(COMMANDS) > 40
    assert not forgotten(opened)
    assert {"data/thesis/thesis.toml", "experiments/tables.py"} <= opened["experiments thesis pid"]
    assert "paper_figures/look/figures.mplstyle" in opened["paper_figures draw fig_2_05"]


@pytest.mark.parametrize(
    ("module", "needed", "command"),
    [
        ("experiments/thesis/commands.py", "experiments/thesis/studies/pid.py", "experiments thesis pid"),
        (
            "paper_figures/thesis/figures/fig_2_02.py",
            "paper_figures/thesis/figures/shared_pid.py",
            "paper_figures draw fig_2_02",
        ),
    ],
)
def test_a_forgotten_file_is_found(
    opened: dict[str, set[str]], monkeypatch: pytest.MonkeyPatch, module: str, needed: str, command: str
) -> None:
    read = code_files.read

    def without(file: str) -> tuple[frozenset[str], dict[str, frozenset[str]]]:
        own, commands = read(file)
        if file != module:
            return own, commands
        return own - {needed}, {name: files - {needed} for name, files in commands.items()}

    monkeypatch.setattr(code_files, "read", without)
    assert (command, needed) in forgotten(opened)
    assert {name for name, _ in forgotten(opened)} == {command}


@pytest.mark.parametrize(
    ("file", "module"),
    [
        ("data/thesis/claims.csv", "experiments/thesis/claims/ledger.py paper_figures/thesis/report/inputs.py"),
        ("data/thesis/thesis.toml", "data/thesis/__init__.py"),
        ("experiments/drive/sampled_loop.py", None),
        ("experiments/engine/simulate.py", None),
        ("experiments/tables.py", None),
        ("experiments/thesis/commands.py", None),
        ("identification/base/files.py", None),
        ("paper_figures/look/panels.py", None),
        ("paper_figures/thesis/figures/fig_2_12.py", None),
        ("paper_figures/thesis/report/report.html.j2", "paper_figures/thesis/report/html.py"),
    ],
)
def test_a_file_belongs_to_the_commands_that_open_it_alone(
    opened: dict[str, set[str]], file: str, module: str | None
) -> None:
    """``module`` is what reads the file, where that is not imported."""
    expected = {name for name, files in opened.items() if files & set((module or file).split())}
    assert {name for name, command in COMMANDS.items() if file in code_files.files_of_command(command)} == expected
    assert expected


def test_a_command_has_another_hash_when_a_file_of_its_own_changes(monkeypatch: pytest.MonkeyPatch) -> None:
    figure, other = COMMANDS["paper_figures draw fig_2_12"], COMMANDS["paper_figures draw fig_2_13"]
    before = code_files.code_of(figure), code_files.code_of(other)
    read_bytes = Path.read_bytes
    monkeypatch.setattr(
        Path, "read_bytes", lambda path: read_bytes(path) + (b"#" if path.name == "fig_2_12.py" else b"")
    )
    for kept in (code_files.digest, code_files.hash_of):
        monkeypatch.setattr(code_files, kept.__name__, cache(kept.__wrapped__))
    after = code_files.code_of(figure), code_files.code_of(other)
    assert (before[0] == after[0], before[1] == after[1]) == (False, True)


def test_every_figure_is_drawn_from_its_tables() -> None:
    for figure in figure_names():
        step = STEPS[COMMANDS[f"paper_figures draw {figure}"]]
        assert [path.stem for path in step.needs] == list(figure_module(figure).TABLES)


def test_every_step_comes_after_those_whose_files_it_reads_and_no_file_has_two_makers() -> None:
    for steps in ([*BEFORE, *report_steps(ASKED, BEFORE)], refit_steps(ASKED)):
        made: set[Path] = set()
        outputs = {path for step in steps for path in step.outputs}
        for step in steps:
            assert (set(step.needs) | set(step.uses)) & outputs <= made
            assert not made & {*step.outputs, step.refusal}
            made |= {*step.outputs, step.refusal}
    assert os.path.commonpath(made) == "build"
