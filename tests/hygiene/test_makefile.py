"""The Makefile builds from nothing, does nothing the second time, refuses what is not there, and forgets nothing."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from paper_figures.thesis.figure_registry import figure_module, figure_names

ROOT = Path(__file__).resolve().parents[2]


def make(*arguments: str, folder: Path = ROOT) -> subprocess.CompletedProcess[str]:
    own = {name: value for name, value in os.environ.items() if name not in ("MAKEFLAGS", "MFLAGS", "MAKELEVEL")}
    return subprocess.run(["make", *arguments], cwd=folder, env=own, capture_output=True, text=True, check=False)


@pytest.fixture
def build(tmp_path: Path) -> Path:
    return tmp_path / "build"


def test_from_nothing_then_nothing_to_do(build: Path) -> None:
    table, figure = build / "results" / "pid.csv", build / "figures" / "fig_2_02.pdf"
    goal = ["MODEL=implied", f"BUILD={build}", str(figure)]
    assert not build.exists()
    first = make(*goal)
    assert first.returncode == 0, first.stderr
    assert all(figure.with_suffix(suffix).stat().st_size > 0 for suffix in (".pdf", ".svg", ".png", ".txt"))
    assert table.exists()
    second = make(*goal)
    assert second.returncode == 0
    assert "up to date" in second.stdout
    assert make("-q", *goal).returncode == 0
    # another model rebuilds what is for a model, and the benchmark is for none
    assert make("-q", "MODEL=table", f"BUILD={build}", str(figure)).returncode == 0
    assert make("-q", "MODEL=table", f"BUILD={build}", str(build / "design_extended.json")).returncode == 1


def test_a_dry_run_makes_nothing(build: Path) -> None:
    result = make("-n", "MODEL=implied", f"BUILD={build}", str(build / "figures" / "fig_2_01.pdf"))
    assert result.returncode == 0, result.stderr
    assert "paper_figures draw fig_2_01" in result.stdout
    assert not build.exists()


@pytest.mark.parametrize(
    ("arguments", "part"),
    [(["SWEEPS=nowhere.csv"], "nowhere.csv: no such file"), (["MODEL=nowhere.json"], "nowhere.json: no such file")],
)
def test_missing_files_are_refused_before_anything_is_made(build: Path, arguments: list[str], part: str) -> None:
    result = make("figures", f"BUILD={build}", *arguments)
    assert result.returncode == 2
    assert part in result.stderr
    assert not build.exists()


def test_every_target_is_in_the_help() -> None:
    text = make("help").stdout
    assert all(
        f"\n{name} " in f"\n{text}"
        for name in [
            "help",
            "figures",
            "report",
            "refit",
            "claims",
            "test",
            "bench",
            "study",
            "referee",
            "lint",
            "clean",
        ]
    )


def test_the_report_draws_every_figure_and_judges_the_ledger_first(build: Path) -> None:
    result = make("-n", "MODEL=implied", f"BUILD={build}", "report")
    assert result.returncode == 0, result.stderr
    steps = result.stdout
    assert all(
        f"draw {path.stem} " in steps for path in (ROOT / "paper_figures" / "thesis" / "figures").glob("fig_*.py")
    )
    assert "experiments thesis claims" in steps
    assert "paper_figures report implied data/elevation/" in steps.splitlines()[-1]
    assert not build.exists()


ROOMS = ("identification", "design", "experiments", "paper_figures")
FIGURES = figure_names()
EXPERIMENTS = {
    **{"pid": "pid", "conditions": "conditions", "additive-error": "additive_error", "f-gamma": "f_gamma"},
    **{"delay-free": "delay_free", "extended": "extended", "trade-off": "trade_off", "interpolation": "interpolation"},
    **{"robustness": "robustness", "limits": "limits_extended", "sampled-rates": "sampled"},
}
TARGETS = {
    "identification fit": "build/model.json",
    "design delay-free": "build/design_delay_free.json",
    "design extended": "build/design_robust.json",
    **{f"experiments thesis {command}": f"build/results/{table}.csv" for command, table in EXPERIMENTS.items()},
    "experiments thesis campaign": "build/results/campaign.parquet",
    "experiments campaign-tables": "build/results/campaign_distance.csv",
    "experiments thesis claims": "CLAIMS.md",
    "experiments thesis equations": "docs/equations.md",
    **{f"paper_figures draw {figure}": f"build/figures/{figure}.svg" for figure in FIGURES},
    "paper_figures summary": "build/summary.pdf",
    "paper_figures report": "build/report/index.html",
}
"""What make runs -> one of the files that it writes."""

TABLES = {Path(target).stem: command for command, target in TARGETS.items() if target.startswith("build/results/")}
GOALS = ("READY=ready", f"PYTHON={sys.executable}", "figures", "report", "claims", "build/summary.pdf")

# Each command in a process of its own: it is run, or what it imports is imported; what of ours is opened is printed.
OPENED = """
import ast, importlib, inspect, json, os, sys, textwrap
import click, flint, jinja2, matplotlib.backends.backend_agg, matplotlib.figure, numba, pandas, schemdraw, tqdm
import scipy.optimize, scipy.signal, scipy.stats

root, scratch, commands, *rooms = *sys.argv[1:3], json.loads(sys.argv[3]), *sys.argv[4:]
RUNS = {
    "design delay-free": ["implied", "--period", "4", "--epsilon", "1e-4", "--output", scratch + "/design.json"],
    "experiments thesis pid": ["--output", scratch],
    "experiments thesis equations": ["--page", scratch + "/equations.md"],
    "paper_figures draw fig_2_05": ["--results", scratch, "--output", scratch],
}
opened = set()
sys.addaudithook(lambda event, arguments: event == "open" and opened.add(str(arguments[0])))
sys.path.insert(0, root)
for command in commands:
    if os.fork():
        continue
    room, *words = command.split()
    group = importlib.import_module(room + ".__main__").main
    if command in RUNS:
        group([*words, *RUNS[command]], standalone_mode=False)
    else:
        found = group
        for word in words:
            if isinstance(found, click.Group):
                found = found.commands[word]
        function = ast.parse(textwrap.dedent(inspect.getsource(found.callback))).body[0]
        for node in function.body:
            if isinstance(node, (ast.Import, ast.ImportFrom)):
                exec(compile(ast.Module([node], []), command, "exec"))
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
def tree(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of the project in which make has touched all that it makes."""
    tree = tmp_path_factory.mktemp("tree")
    for name in (*ROOMS, "data", "tools", "docs"):
        shutil.copytree(ROOT / name, tree / name, ignore=shutil.ignore_patterns("__pycache__", "*_raw.csv"))
    for name in ("Makefile", "CLAIMS.md", "requirements.lock", "pyproject.toml"):
        shutil.copy(ROOT / name, tree / name)
    (tree / "ready").touch()
    (tree / "build" / "report").mkdir(parents=True)
    touched = make("-t", *GOALS, folder=tree)
    assert touched.returncode == 0, touched.stderr
    return tree


@pytest.fixture(scope="module")
def opened(tmp_path_factory: pytest.TempPathFactory) -> dict[str, set[str]]:
    """For each command, the files of the project that it imports and, as far as it was run, reads."""
    scratch = str(tmp_path_factory.mktemp("scratch"))
    text = subprocess.run(
        [sys.executable, "-c", OPENED, str(ROOT), scratch, json.dumps(list(TARGETS)), *ROOMS, "data"],
        capture_output=True,
        text=True,
        check=True,
    ).stdout
    return {command: set(files) for command, files in json.loads(text.splitlines()[-1]).items()}


def prerequisites(tree: Path) -> dict[str, set[str]]:
    """Every file that make makes with what it hangs on."""
    lines = re.findall(r"^([^\s#:]+): (.*)$", make("-npq", *GOALS, folder=tree).stdout, re.MULTILINE)
    return {target: set(files.split(" | ")[0].split()) for target, files in lines}


@pytest.fixture(scope="module")
def hang_on(tree: Path) -> dict[str, set[str]]:
    """That of the copy."""
    return prerequisites(tree)


def forgotten(hang_on: dict[str, set[str]], opened: dict[str, set[str]]) -> set[tuple[str, str]]:
    """Commands with the files that they open and whose targets make does not take for stale when these change."""
    return {(command, file) for command, files in opened.items() for file in files - hang_on[TARGETS[command]]}


def commands_before(command: str) -> set[str]:
    """The commands whose files a command reads."""
    room, *_, name = command.split()
    designs = {"design delay-free", "design extended"}
    tables = set(TABLES.values()) - {"experiments thesis pid", "experiments thesis conditions"}
    if room == "design" or name == "additive-error":
        return {"identification fit"}
    if name == "campaign-tables":
        return {"experiments thesis campaign"}
    if name == "summary":
        return {"identification fit", *designs, *tables}
    if name == "report":
        return set(TARGETS) - {"experiments thesis equations", "paper_figures summary", "paper_figures report"}
    if name in FIGURES:
        return {TABLES[table] for table in figure_module(name).TABLES if table in TABLES}
    if room == "experiments" and name not in ("pid", "conditions", "claims", "equations"):
        return designs if name == "limits" else {f"design {'delay-free' if name == 'delay-free' else 'extended'}"}
    return set()


def test_no_prerequisite_is_forgotten(hang_on: dict[str, set[str]], opened: dict[str, set[str]]) -> None:
    assert not forgotten(hang_on, opened)
    assert {"data/thesis/thesis.toml", "experiments/tables.py"} <= opened["experiments thesis pid"]
    assert "paper_figures/look/figures.mplstyle" in opened["paper_figures draw fig_2_05"]
    for figure in FIGURES:
        tables = {f"build/results/{table}.csv" for table in figure_module(figure).TABLES}
        assert tables == {file for file in hang_on[f"build/figures/{figure}.svg"] if file.startswith("build/")}


def test_a_forgotten_prerequisite_is_found(tree: Path, opened: dict[str, set[str]]) -> None:
    file = tree / "build" / "prerequisites.mk"
    text = file.read_text(encoding="utf-8")
    for name, command, module in (
        ("CODE-thesis-pid", "experiments thesis pid", "experiments/tables.py"),
        ("CODE-fig_4_01", "paper_figures draw fig_4_01", "paper_figures/look/panels.py"),
        ("CODE-identification-fit", "identification fit", "identification/base/files.py"),
    ):
        file.write_text(re.sub(rf"(?m)^({name} :=.*) {module}", r"\1", text), encoding="utf-8")
        try:
            assert forgotten(prerequisites(tree), opened) == {(command, module)}
        finally:
            file.write_text(text, encoding="utf-8")


@pytest.mark.parametrize(
    ("file", "module"),
    [
        ("data/thesis/claims.csv", "experiments/thesis/claims/ledger.py"),
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
def test_a_newer_file_makes_stale_what_hangs_on_it_alone(
    hang_on: dict[str, set[str]], opened: dict[str, set[str]], file: str, module: str | None
) -> None:
    """``module`` is what reads the file, where that is not imported."""
    expected = {command for command, files in opened.items() if (module or file) in files}
    stale = {file}
    for _ in range(6):  # as many steps as there are from a sweep to the report
        expected |= {command for command in TARGETS if commands_before(command) & expected}
        stale |= {target for target, files in hang_on.items() if files & stale}
    assert {command for command, target in TARGETS.items() if target in stale} == expected


def test_make_runs_what_is_stale_and_nothing_else(tree: Path) -> None:
    figure = make("-n", "-W", "paper_figures/thesis/figures/fig_2_12.py", *GOALS, folder=tree).stdout
    assert re.findall(r"draw (\w+)", figure) == ["fig_2_12"]
    assert "-m" not in make("-n", "-W", "README.md", *GOALS, folder=tree).stdout
