"""Imports go one way, between rooms and between their wings, and the contracts in pyproject.toml notice if not."""

from __future__ import annotations

import ast
import re
import subprocess
import sys
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
LINT = [str(Path(sys.executable).with_name("lint-imports")), "--no-cache", "--no-logo"]


def broken(tree: Path) -> dict[str, str]:
    """The names of the contracts that a tree breaks, each with what is said of it."""
    done = subprocess.run(LINT, cwd=tree, capture_output=True, text=True, check=False)
    names = re.findall(r"^(.+) BROKEN", done.stdout, flags=re.MULTILINE)
    assert f"{len(names)} broken" in done.stdout, done.stdout + done.stderr
    assert done.returncode == bool(names)
    titles = [re.sub(r" \(\d+ ignored imports?\)$", "", name) for name in names]
    _, *said = re.split(
        r"^.+\n-+\n\n", done.stdout.partition("Broken contracts")[2].partition("\n\n")[2], flags=re.MULTILINE
    )
    return dict(zip(titles, said, strict=True))


def spoil(tree: Path, importer: str, line: str) -> None:
    """Add a line to a module."""
    path = tree / f"{importer.replace('.', '/')}.py"
    path.write_text(f"{path.read_text(encoding='utf-8')}\n\n{line}\n", encoding="utf-8")


def test_every_contract_is_kept() -> None:
    assert broken(ROOT) == {}


ROOM, TOOL = "rooms import to the left", "the tool knows nothing of the thesis, but for command lines"
FIGURE = "no figure imports another, but what several share"
STUDY, LEDGER = "experiments.thesis.studies.pid", "experiments.thesis.claims.ledger"


WRONG = [
    ("design.stability.jet", "experiments.engine.simulate", ROOM),
    ("identification.base.arrays", "data.thesis", ROOM),
    ("identification.base.files", "identification.model.plant", "wings of identification"),
    ("identification.fitting.likelihood", "identification.bound.shape", "wings of identification"),
    ("design.hinf.pick", "design.stability.axis", "wings of design"),
    ("experiments.engine.pade", "experiments.runs.batch", "wings of experiments"),
    (STUDY, LEDGER, "wings of experiments.thesis"),
    ("paper_figures.look.style", "paper_figures.summary.page", "wings of paper_figures"),
    ("paper_figures.thesis.figures.fig_4_04", "paper_figures.thesis.report.html", "wings of paper_figures.thesis"),
    ("paper_figures.thesis.figures.fig_4_04", "paper_figures.thesis.figures.fig_4_03", FIGURE),
    ("design.auditing.as_text", "data.thesis", TOOL),
    ("experiments.runs.batch", STUDY, TOOL),
    ("paper_figures.summary.page", STUDY, TOOL),
    ("experiments.runs.design_loop", "paper_figures.look.style", ROOM),  # inside a function
    ("experiments.runs.design_loop", "experiments.thesis.studies.pid", TOOL),
]


def test_every_wrong_import_breaks_its_contract(tree: Path) -> None:
    for importer, imported, _ in WRONG[:-2]:
        spoil(tree, importer, f"import {imported}")
    for importer, imported, _ in WRONG[-2:]:
        spoil(tree, importer, f"def lazy() -> None:\n    from {imported} import x")
    found = broken(tree)
    assert set(found) == {contract for _, _, contract in WRONG}
    for importer, imported, contract in WRONG:
        assert f"{importer} -> {imported} (l." in " ".join(found[contract].split())  # lines are broken


def test_a_new_wing_must_be_given_its_place(tree: Path) -> None:
    (tree / "design" / "somewhere.py").write_text('"""Nothing."""\n', encoding="utf-8")
    assert set(broken(tree)) == {"wings of design"}


@pytest.mark.parametrize("room", ["identification", "design", "experiments", "paper_figures"])
def test_a_face_shows_its_own_room_without_the_thesis(room: str) -> None:
    """The package imports what its stub names, which the contracts do not see."""
    stub = (ROOT / room / "__init__.pyi").read_text(encoding="utf-8")
    homes = re.findall(r"^from (\S+) import", stub, flags=re.MULTILINE)
    assert homes
    assert all(home.startswith(f"{room}.") and ".thesis" not in home for home in homes)


@pytest.mark.parametrize("path", sorted((ROOT / "data").glob("*.py")), ids=lambda path: path.name)
def test_the_data_are_made_without_the_tool(path: Path) -> None:
    names = {"identification", "design", "experiments", "paper_figures", "data"}
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        modules = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
        modules += [str(node.module)] if isinstance(node, ast.ImportFrom) else []
        assert not names & {module.split(".")[0] for module in modules}


ROOMS = ("identification", "design", "experiments", "paper_figures")
INSTALLED = ("antiwindup", "data/thesis", *ROOMS)
BESIDE = {"antiwindup", "setup.py", "benchmarks", "data", "tests", "docs"}
BY_NAME = {
    "antiwindup/__main__.py",
    "antiwindup/preloaded.py",
    "experiments/thesis/claims/equations_page.py",
    "experiments/thesis/claims/ledger.py",
    "identification/base/faces.py",
    "paper_figures/axis_figures/registry.py",
    "paper_figures/thesis/figure_registry.py",
}
"""The modules that import what a text names."""


@cache
def past_the_contracts(file: str, text: str) -> list[str]:
    """What a module does that neither import-linter nor antiwindup/code_files.py sees, for which imports are read."""
    nodes = list(ast.walk(ast.parse(text)))
    documents = {node.value for node in nodes if isinstance(node, ast.Expr)}
    found = []
    for node in nodes:
        if isinstance(node, ast.Import):  # which gives the package, and with it the names of its face
            found += [alias.name for alias in node.names if alias.name.split(".")[0] in ROOMS]
        if isinstance(node, ast.ImportFrom) and (node.module in ROOMS or node.level):
            wings = {path.stem for path in (ROOT / str(node.module)).iterdir()} if node.module in ROOMS else set()
            found += [alias.name for alias in node.names if alias.name not in wings or node.level]
        name = getattr(node, "id", None) or getattr(node, "attr", None) or getattr(node, "name", None)
        if file not in BY_NAME and name in ("import_module", "__import__", "runpy"):
            found.append(name)
        if (
            isinstance(node, ast.Constant)
            and node not in documents
            and not ("/thesis/" in file or "antiwindup/" in file)
        ):
            found += [str(node.value)] if re.search(r"data/thesis|thesis\.toml", str(node.value)) else []
    return found


def all_past_the_contracts(tree: Path) -> dict[str, list[str]]:
    """That of every module that is installed, and the Python that stands beside the rooms without a place there."""
    paths = [path for place in INSTALLED for path in (tree / place).rglob("*.py")]
    texts = {path.relative_to(tree).as_posix(): path.read_text(encoding="utf-8") for path in paths}
    found = {file: past_the_contracts(file, text) for file, text in texts.items()}
    others = [path for path in tree.glob("[!.]*") if path.name not in {*ROOMS, *BESIDE, "build"}]
    found |= {path.name: ["has no place"] for path in others if path.suffix == ".py" or any(path.rglob("*.py"))}
    return {file: names for file, names in found.items() if names}


def test_nothing_goes_past_the_contracts() -> None:
    assert all_past_the_contracts(ROOT) == {}
    assert all("import_module(" in (ROOT / file).read_text(encoding="utf-8") for file in BY_NAME)


@pytest.mark.parametrize(
    ("module", "line", "found"),
    [
        ("design.stability.jet", "from experiments import simulate_many", "simulate_many"),
        ("experiments.runs.batch", "from design import audit", "audit"),
        ("experiments.runs.batch", "import design", "design"),
        ("experiments.runs.batch", "import design.auditing.audit_design as x", "design.auditing.audit_design"),
        ("experiments.runs.batch", "from ..thesis import studies", "studies"),
        ("design.auditing.as_text", "def f() -> None:\n    from identification import fit_model, fit", "fit"),
        ("design.auditing.as_text", "from importlib import import_module as load", "import_module"),
        ("design.auditing.as_text", "import importlib\nimportlib.import_module('data.thesis')", "import_module"),
        ("design.auditing.as_text", "__import__('experiments.thesis')", "__import__"),
        ("design.choices", "TABLE = 'data/thesis/claims.csv'", "data/thesis/claims.csv"),
        ("design.choices", "from pathlib import Path\nx = Path('data') / 'thesis.toml'", "thesis.toml"),
        ("helpers", "import design", "has no place"),
    ],
)
def test_what_goes_past_them_is_found(tree: Path, module: str, line: str, found: str) -> None:
    file = f"{module.replace('.', '/')}.py"
    (tree / file).open("a", encoding="utf-8").close()
    spoil(tree, module, line)
    assert {name: set(names) for name, names in all_past_the_contracts(tree).items()} == {file: {found}}


@pytest.mark.parametrize("line", ["from design import choices", "from design.design_file import Design"])
def test_a_module_itself_may_be_imported(tree: Path, line: str) -> None:
    spoil(tree, "experiments.runs.batch", line)
    assert all_past_the_contracts(tree) == {}
