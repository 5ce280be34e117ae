"""The house's own rules: data flows one way, the thesis's plant stays in data/, the Makefile knows the tables."""

from __future__ import annotations

import ast
import re
import sys
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
ROOMS = ("identification", "design", "experiments", "paper_figures")
MODULES = sorted(path for room in ROOMS for path in (ROOT / room).glob("*.py"))


def imports(path: Path) -> set[str]:
    names: set[str] = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            names |= {alias.name.split(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            names.add(node.module.split(".")[0])
    return names


@pytest.mark.parametrize("path", MODULES, ids=lambda path: f"{path.parent.name}/{path.name}")
def test_nothing_imports_to_the_right(path: Path) -> None:
    right = ROOMS[ROOMS.index(path.parent.name) + 1 :]
    assert not imports(path) & set(right)


@pytest.mark.parametrize("path", sorted((ROOT / "data").glob("*.py")), ids=lambda path: path.name)
def test_data_scripts_stand_alone(path: Path) -> None:
    assert not imports(path) & set(ROOMS)


@pytest.mark.parametrize("path", MODULES, ids=lambda path: f"{path.parent.name}/{path.name}")
def test_modules_say_their_job_and_stay_short(path: Path) -> None:
    text = path.read_text(encoding="utf-8")
    assert ast.get_docstring(ast.parse(text)), f"{path.name} has no docstring"
    assert len(text.splitlines()) <= 300


@pytest.mark.parametrize("path", MODULES, ids=lambda path: f"{path.parent.name}/{path.name}")
def test_public_functions_have_docstrings(path: Path) -> None:
    tree = ast.parse(path.read_text(encoding="utf-8"))
    for node in tree.body:
        if isinstance(node, ast.FunctionDef | ast.ClassDef) and not node.name.startswith("_"):
            assert ast.get_docstring(node), f"{path.name}: {node.name} has no docstring"


# numbers that belong to the thesis's plant, its bound and its anti-windup
PLANT = {7.105, 0.0195, 0.008, 175.0, 930.0, 282.0, 285.0, 960.0, 8.1e-3, 0.011, 97.0, 0.105, 19.659, 0.0684}


@pytest.mark.parametrize("path", MODULES, ids=lambda path: f"{path.parent.name}/{path.name}")
def test_no_number_of_the_plant_in_the_code(path: Path) -> None:
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Constant) and isinstance(node.value, float):
            assert node.value not in PLANT, f"{path.name}, line {node.lineno}: {node.value}"


@pytest.mark.parametrize("path", sorted((ROOT / "paper_figures").glob("fig_*.py")), ids=lambda path: path.name)
def test_no_figure_imports_another(path: Path) -> None:
    """So that touching one figure's module redraws that figure alone; and the Makefile knows what it does import."""
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    makefile = makefile.replace("$(DIAGRAMS)", re.findall(r"DIAGRAMS := (.*)", makefile)[0])
    text = path.read_text(encoding="utf-8")
    shared = set(re.findall(r"from paper_figures\.(\w+) import", text))
    shared |= set(", ".join(re.findall(r"from paper_figures import (.*)", text)).split(", ")) - {""}
    assert not any(name.startswith("fig_") for name in shared)
    rules = re.findall(r"\$\(call drawing,([^)]*)\): (.*)", makefile)
    known = {
        module for names, files in rules if path.stem in names.split() for module in re.findall(r"(\w+)\.py", files)
    }
    assert shared - {"style"} <= known


def test_makefile_knows_every_figures_tables() -> None:
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    feeds: dict[str, set[str]] = {}
    for table, names in re.findall(r"\$\(call feeds,(\w+),([\w ]+)\)", makefile):
        for name in names.split():
            feeds.setdefault(name, set()).update((table, f"{table}_summary"))
    for name, table in re.findall(r"\$\(call drawing,(\w+)\): \$\(RESULTS\)/(\w+)\.csv", makefile):
        feeds[name].add(table)
    sys.path.insert(0, str(ROOT))
    from paper_figures.thesis.figure_registry import figure_module, figure_names

    diagrams = set(re.search(r"DIAGRAMS := (.*)", makefile)[1].split())  # type: ignore[index]
    assert len(figure_names()) == 27
    for name in figure_names():
        tables = set(figure_module(name).TABLES)
        assert tables <= feeds.get(name, set()), name
        assert (name in diagrams) == (not tables)


def locked(name: str) -> dict[str, str]:
    """Each pin of a lock file, its marker too, with the lines that belong to it."""
    text = (ROOT / name).read_text(encoding="utf-8")
    blocks = re.split(r"^(?=[a-zA-Z0-9_.-]+==)", text, flags=re.MULTILINE)[1:]
    return {block.splitlines()[0].removesuffix(" \\"): block for block in blocks}


@pytest.mark.parametrize(("name", "least"), [("requirements.lock", 30), ("requirements-bench.lock", 5)])
def test_lock_file_has_hashes_and_no_address(name: str, least: int) -> None:
    text = (ROOT / name).read_text(encoding="utf-8")
    assert "://" not in text
    pins = re.findall(r"^[a-zA-Z0-9_.-]+==.*\\$", text, flags=re.MULTILINE)
    assert len(pins) == len(locked(name)) > least
    assert all("--hash=sha256:" in block for block in locked(name).values())


def test_lock_files_agree_on_what_both_name() -> None:
    main, bench = locked("requirements.lock"), locked("requirements-bench.lock")
    names = {pin.split("==")[0] for pin in main}
    both = {pin: block for pin, block in bench.items() if pin.split("==")[0] in names}
    assert both
    for pin, block in both.items():
        assert set(re.findall("sha256:[0-9a-f]+", block)) == set(re.findall("sha256:[0-9a-f]+", main.get(pin, ""))), pin


def test_lock_files_hold_what_the_project_asks_for() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    wanted = {
        "requirements.lock": [
            *project["project"]["dependencies"],
            *project["project"]["optional-dependencies"]["dev"],
        ],
        "requirements-bench.lock": project["dependency-groups"]["bench"],
    }
    for name, requirements in wanted.items():
        pinned = {pin.split("==")[0] for pin in locked(name)}
        assert {re.split("[<>=!~]", requirement)[0] for requirement in requirements} <= pinned, name
