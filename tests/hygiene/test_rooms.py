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
ROOMS = ("antiwindup", "identification", "design", "experiments", "paper_figures", "data/thesis")
MODULES = sorted(path for room in ROOMS for path in (ROOT / room).rglob("*.py"))


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


@pytest.mark.parametrize(
    ("name", "least"), [("requirements.lock", 30), ("requirements-bench.lock", 5), ("requirements-audit.lock", 5)]
)
def test_lock_file_has_hashes_and_no_address(name: str, least: int) -> None:
    text = (ROOT / name).read_text(encoding="utf-8")
    assert "://" not in text
    pins = re.findall(r"^[a-zA-Z0-9_.-]+==.*\\$", text, flags=re.MULTILINE)
    assert len(pins) == len(locked(name)) > least
    assert all("--hash=sha256:" in block for block in locked(name).values())


@pytest.mark.parametrize("name", ["requirements-bench.lock", "requirements-audit.lock"])
def test_lock_files_agree_on_what_both_name(name: str) -> None:
    main, added = locked("requirements.lock"), locked(name)
    names = {pin.split("==")[0] for pin in main}
    pins = {pin.split(" ;")[0]: block for pin, block in main.items()}  # a marker may be asked for by one of them alone
    both = {pin: block for pin, block in added.items() if pin.split("==")[0] in names}
    assert both
    for pin, block in both.items():
        there = pins.get(pin.split(" ;")[0], "")
        assert set(re.findall("sha256:[0-9a-f]+", block)) == set(re.findall("sha256:[0-9a-f]+", there)), pin


def test_lock_files_hold_what_the_project_asks_for() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    wanted = {
        "requirements.lock": [
            *project["project"]["dependencies"],
            *(one for extra in project["project"]["optional-dependencies"].values() for one in extra),
        ],
        **{f"requirements-{name}.lock": asked for name, asked in project["dependency-groups"].items()},
    }
    for name, requirements in wanted.items():
        pinned = {pin.split("==")[0] for pin in locked(name)}
        assert {re.split("[<>=!~]", requirement)[0] for requirement in requirements} <= pinned, name


def run(tree: Path, code: str, **environment: str) -> list[str]:
    """What a program prints that imports the package in a folder, under an environment of its own."""
    own = {name: value for name, value in os.environ.items() if name != "NUMBA_CACHE_DIR"} | environment
    done = subprocess.run([sys.executable, "-c", code], cwd=tree, env=own, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout.split()


DIGESTS = """
import sys
import experiments.engine.integrator
from experiments.runs import code_hash
from identification.base.compiled import code_cache
for file in (None, None, "experiments/engine/crossings.py", "design/stability/jet.py"):
    if file:
        with open(file, "a", encoding="utf-8") as module:
            module.write("# edited\\n")
    code_cache.cache_clear()
    code_hash.code_sha256.cache_clear()
    print(code_cache("experiments"), code_hash.code_sha256())
"""


def test_an_edit_in_a_wing_changes_what_the_code_is_known_by(tree: Path, tmp_path: Path) -> None:
    """Else a compiled function would run as it was before, and a campaign go on with other code."""
    words = iter(run(tree, DIGESTS, XDG_CACHE_HOME=str(tmp_path)))
    first, again, compiled, other = zip(words, words, strict=True)
    assert first == again
    assert Path(first[0]).parent == tmp_path / "antiwindup"
    assert compiled[0] != first[0]
    assert compiled[1] != first[1]
    assert other[0] == compiled[0]
    assert other[1] != compiled[1]


COMPILED = """
import os, sys, tempfile
import numpy as np
from identification.base.compiled import code_cache
for environment, temporary in {cases!r}:
    if os.fork():
        os.wait()
        continue
    os.environ.update(environment)
    tempfile.tempdir = temporary
    from experiments.engine import crossings
    crossings._sign_changes(np.array([1.0, -2.0]))
    print(code_cache("experiments"), flush=True)
    os._exit(0)
"""


def test_where_compiled_code_is_kept(tree: Path, tmp_path: Path) -> None:
    """In the user's cache folder, else below the temporary one, else nowhere; never beside the modules."""
    users, other, barred = tmp_path / "users", tmp_path / "other", tmp_path / "barred"
    other.mkdir()
    barred.touch()
    cases = (
        ({"XDG_CACHE_HOME": str(users)}, other, users / "antiwindup"),
        ({"XDG_CACHE_HOME": "", "HOME": str(users)}, other, users / ".cache" / "antiwindup"),
        ({"XDG_CACHE_HOME": str(barred)}, other, other / f"antiwindup-{os.getuid()}"),
        ({"XDG_CACHE_HOME": str(barred)}, barred, None),
        ({"XDG_CACHE_HOME": str(barred), "NUMBA_CACHE_DIR": str(users)}, other, users),
    )
    found = run(tree, COMPILED.format(cases=[(environment, str(temporary)) for environment, temporary, _ in cases]))
    for folder, (_, _, expected) in zip(found, cases, strict=True):
        assert folder == "None" if expected is None else Path(folder).parent == expected
        assert expected is None or any(Path(folder).glob("*.nbc"))
    assert [path for path in tree.rglob("*") if path.suffix in (".nbi", ".nbc")] == []


def test_functions_of_the_users_are_kept_where_numba_keeps_them(tree: Path, tmp_path: Path) -> None:
    (tree / "mine.py").write_text("import numba\n@numba.njit(cache=True)\ndef f():\n    return 1\n", encoding="utf-8")
    code = "import os, experiments.engine.crossings, mine; mine.f(); print('NUMBA_CACHE_DIR' in os.environ)"
    assert run(tree, code, XDG_CACHE_HOME=str(tmp_path / "users")) == ["False"]
    assert [path.parent for path in tree.rglob("*.nbi")] == [tree / "__pycache__"]
    assert not [path for path in tmp_path.rglob("mine*.nbi") if tree not in path.parents]


def test_every_compiled_function_is_kept_so() -> None:
    importers = [name_of(path) for path in MODULES if re.search("^(import|from) numba", path.read_text("utf-8"), re.M)]
    assert importers == ["identification/base/compiled.py"]
