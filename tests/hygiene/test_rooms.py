"""The house's rules: short modules that say their job, the plant's numbers in data/, locks that hold what is asked."""

from __future__ import annotations

import ast
import os
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
ROOMS = ("identification", "design", "experiments", "paper_figures", "data/thesis")
MODULES = [ROOT / "antiwindup.py", *sorted(path for room in ROOMS for path in (ROOT / room).rglob("*.py"))]


def name_of(path: Path) -> str:
    return path.relative_to(ROOT).as_posix()


def test_there_are_modules_in_every_wing() -> None:
    assert len(MODULES) > 200
    wings = {path.parent for path in MODULES}
    assert {ROOT / "identification/base", ROOT / "experiments/thesis/claims/checks", ROOT / "data/thesis"} <= wings


def test_modules_stay_short() -> None:
    """That they say their job, ruff sees to (D100 to D104)."""
    assert [name_of(path) for path in MODULES if len(path.read_text(encoding="utf-8").splitlines()) > 300] == []


# numbers that belong to the thesis's plant, its bound and its anti-windup
PLANT = {7.105, 0.0195, 0.008, 175.0, 930.0, 282.0, 285.0, 960.0, 8.1e-3, 0.011, 97.0, 0.105, 19.659, 0.0684}


def test_no_number_of_the_plant_in_the_code() -> None:
    found = [
        f"{name_of(path)}, line {node.lineno}: {node.value}"
        for path in MODULES
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.Constant) and isinstance(node.value, float) and node.value in PLANT
    ]
    assert found == []


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
            *(one for extra in project["project"]["optional-dependencies"].values() for one in extra),
        ],
        "requirements-bench.lock": project["dependency-groups"]["bench"],
    }
    for name, requirements in wanted.items():
        pinned = {pin.split("==")[0] for pin in locked(name)}
        assert {re.split("[<>=!~]", requirement)[0] for requirement in requirements} <= pinned, name


def digests(tree: Path) -> list[str]:
    """The folder of numba's cache and the sha256 of a campaign's code, of the package in a folder."""
    code = "import os, experiments.campaign.run_plants as r; print(os.environ['NUMBA_CACHE_DIR'], r.code_sha256())"
    own = {name: value for name, value in os.environ.items() if name != "NUMBA_CACHE_DIR"}
    return subprocess.run(
        [sys.executable, "-c", code], cwd=tree, env=own, capture_output=True, text=True, check=True
    ).stdout.split()


def test_an_edit_in_a_wing_changes_what_the_code_is_known_by(tree: Path) -> None:
    """Else a compiled function would run as it was before, and a campaign go on with other code."""

    def edited(file: str) -> list[str]:
        with (tree / file).open("a", encoding="utf-8") as module:
            module.write("# edited\n")
        return digests(tree)

    first = digests(tree)
    assert first == digests(tree)
    assert Path(first[0]).parent == tree / "experiments" / "__pycache__"
    compiled = edited("experiments/engine/crossings.py")
    assert compiled[0] != first[0]
    assert compiled[1] != first[1]
    other = edited("design/stability/jet.py")
    assert other[0] == compiled[0]
    assert other[1] != compiled[1]


def test_a_room_that_cannot_be_written_to_caches_in_the_users_folder(tree: Path, tmp_path: Path) -> None:
    code = "import os; os.access = lambda *_: False; import experiments; print(os.environ['NUMBA_CACHE_DIR'])"
    own = {name: value for name, value in os.environ.items() if name != "NUMBA_CACHE_DIR"}
    found = subprocess.run(
        [sys.executable, "-c", code], cwd=tree, env=own | {"XDG_CACHE_HOME": str(tmp_path)}, capture_output=True
    )
    assert Path(found.stdout.decode().strip()).parent == tmp_path / "antiwindup"
