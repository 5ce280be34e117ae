"""The wheel, installed without network in an environment of its own, works from any folder; what is missing is said."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
import sysconfig
import tomllib
import venv
import zipfile
from pathlib import Path

import pytest
from click.testing import CliRunner

from data.thesis import model_named
from design.design_file import Design
from experiments.__main__ import main

ROOT = Path(__file__).resolve().parents[2]
ROOMS = ("identification", "design", "experiments", "paper_figures", "antiwindup", "data/thesis")
VERSION = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["version"]
BUILD = (
    "import sys; from setuptools import build_meta; print('built', build_meta.build_wheel(sys.argv[1]))"  # as pip does
)
ASKED = ["--reference-omega", "1.5", "--a", "4", "--e", "2", "--f", "1"]


def run(*command: str | Path, cwd: Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run(list(map(str, command)), cwd=cwd, capture_output=True, text=True, check=False)


def build(tree: Path, folder: Path) -> tuple[Path, set[str]]:
    """Build a wheel into a folder: its file, and the files in it."""
    built = run(sys.executable, "-c", BUILD, folder, cwd=tree)
    assert built.returncode == 0, built.stderr
    wheel = folder / built.stdout.split()[-1]
    return wheel, {name for name in zipfile.ZipFile(wheel).namelist() if ".dist-info/" not in name}


def test_the_wheel_works_from_any_folder(tree: Path, tmp_path: Path) -> None:
    gone = tree / "design" / "gone.py"
    gone.touch()
    assert "design/gone.py" in build(tree, tmp_path / "first")[1]
    gone.unlink()
    wheel, held = build(tree, tmp_path)
    files = {path for room in ROOMS for path in (ROOT / room).rglob("*") if path.is_file()}
    modules = {path.relative_to(ROOT).as_posix() for path in files if path.suffix != ".pyc"}
    assert held == modules
    assert {f"{room}/py.typed" for room in ROOMS[:4]} < held
    assert not (tree / "build").exists()

    environment = tmp_path / "environment"
    venv.create(environment)
    python = environment / "bin" / "python"
    pip = [sys.executable, "-m", "pip", "--disable-pip-version-check", "--quiet", "--python", python]
    installed = run(*pip, "install", "--no-compile", "--no-deps", "--no-index", wheel, cwd=tmp_path)
    assert installed.returncode == 0, installed.stderr
    # the other packages, of which this folder's own .pth files, and with them an editable install of ours, are not read
    (packages,) = environment.glob("lib/*/site-packages")
    (packages / "others.pth").write_text(sysconfig.get_path("purelib"), encoding="utf-8")

    folder = tmp_path / "elsewhere"
    (folder / "data").mkdir(parents=True)
    (folder / "data" / "mine.csv").touch()
    command = environment / "bin" / "antiwindup"
    assert run(command, "--version", cwd=folder).stdout == f"antiwindup, version {VERSION}\n"
    assert (
        run(python, "-m", "antiwindup", "--version", cwd=folder).stdout == f"python -m antiwindup, version {VERSION}\n"
    )
    output = folder / "design.json"
    done = run(command, "design", "extended", "implied", *ASKED, "--output", output, cwd=folder)
    assert done.returncode == 0, done.stderr
    assert json.loads(output.read_text(encoding="utf-8"))["kind"] == "extended"
    where = run(python, "-c", "import design, data.thesis as data; print(design.__file__, data.__file__)", cwd=folder)
    assert all(path.startswith(str(packages)) for path in where.stdout.split())

    refused = run(command, "design", "extended", "nowhere.json", *ASKED, "--output", "x.json", cwd=folder)
    assert (refused.returncode, refused.stderr) == (2, "Error: nowhere.json: no such file\n")

    # what of the user's is named data hides the thesis's sets and nothing else
    mine = folder / "model.json"
    mine.write_text(model_named("implied").to_json(), encoding="utf-8")
    for name in ("data/__init__.py", "data.py"):
        shutil.rmtree(folder / "data", ignore_errors=True)
        (folder / name).parent.mkdir(exist_ok=True)
        (folder / name).write_text("raise RuntimeError('this is mine')", encoding="utf-8")
        refused = run(python, "-m", "design", "extended", "implied", *ASKED, "--output", output, cwd=folder)
        assert (refused.returncode, refused.stderr) == (
            2,
            f"Error: implied: no such file, and another package 'data' ({folder / name}) hides the thesis's sets\n",
        )
    done = run(python, "-m", "design", "extended", mine.name, *ASKED, "--output", output, cwd=folder)
    assert done.returncode == 0, done.stderr


def test_the_help_imports_no_room() -> None:
    code = "import sys, antiwindup.__main__ as it; it.main.main(['--help'], standalone_mode=False); print(*sys.modules)"
    done = run(sys.executable, "-c", code, cwd=ROOT)
    assert all(f"\n  {room}" in done.stdout for room in ROOMS[:4])
    assert not {"scipy", "design.__main__"} & set(done.stdout.splitlines()[-1].split())


def test_a_figure_of_runs_imports_no_engine() -> None:
    """It is drawn of tables: to load compiled code takes longer than to draw."""
    code = "import sys, paper_figures.result_tables, paper_figures.thesis.figures.fig_4_01; print(*sys.modules)"
    loaded = set(run(sys.executable, "-c", code, cwd=ROOT).stdout.split())
    assert "paper_figures.look.panels" in loaded
    assert not {"numba", "scipy"} & loaded


@pytest.mark.parametrize(
    ("missing", "arguments"),
    [
        ("pyarrow", ["campaign-tables", "campaign.parquet", "--output", "."]),
        ("pyarrow", ["campaign", "design.json", "--output", "campaign.parquet"]),
        ("distributed", ["campaign", "design.json", "--output", "campaign.parquet", "--scheduler", "tcp://x:1"]),
    ],
)
def test_a_missing_extra_is_one_sentence(
    missing: str, arguments: list[str], extended_design: Design, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "design.json").write_text(extended_design.to_json(), encoding="utf-8")
    if arguments[0] == "campaign":
        arguments = [*arguments, "--limit", "1", "--plants", "1", "--seed", "1", "--amplitude", "1"]
    monkeypatch.chdir(tmp_path)
    monkeypatch.setitem(sys.modules, missing, None)
    refused = CliRunner().invoke(main, arguments)
    assert refused.exit_code == 2
    assert refused.stderr.splitlines()[-1] == (
        f'Error: this command needs {missing}, which is not installed; run pip install "antiwindup-thesis[campaign]"'
    )
    assert {path.name for path in tmp_path.iterdir()} == {"design.json"}
