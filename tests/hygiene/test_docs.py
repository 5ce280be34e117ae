"""What pages and docstrings name exists, and the errata explain every claim that does not agree."""

from __future__ import annotations

import ast
import re
from importlib import import_module
from pathlib import Path

import click
import pytest

from experiments.thesis.claims.ledger import read_ledger

ROOT = Path(__file__).resolve().parents[2]
ROOMS = ("identification", "design", "experiments", "paper_figures")


@pytest.mark.parametrize(
    ("page", "least"),
    [
        ("explanation/anti_windup.md", 8),
        ("explanation/outside_the_class.md", 7),
        ("how_to/campaigns.md", 4),
        ("explanation/designs.md", 12),
        ("explanation/closed_loop.md", 8),
        ("how_to/explore.md", 7),
        ("thesis/errata.md", 30),
        ("thesis/unprinted_conditions.md", 3),
    ],
)
def test_every_test_that_the_page_names_exists(page: str, least: int) -> None:
    text = (ROOT / "docs" / page).read_text(encoding="utf-8")
    named = re.findall(r"`(tests/[\w/]+\.py)::(\w+)`", text)
    assert len(named) >= least
    for file, name in named:
        assert f"def {name}(" in (ROOT / file).read_text(encoding="utf-8"), f"{file}::{name}"


def test_the_errata_explain_every_claim_that_does_not_agree() -> None:
    """Each in one entry, with a test that the ledger names too."""
    ledger = read_ledger().set_index("id")
    first, *entries = (ROOT / "docs" / "thesis" / "errata.md").read_text(encoding="utf-8").split("\n### ")
    gravest = set(re.findall(r"\((\d+)\)", first.partition("conclusions:")[2].partition("\n\n")[0]))
    assert gravest
    explained: list[str] = []
    for entry in entries:
        text, _, rows = entry.partition("- *Rows:*")
        names = re.findall(r"`([\w.#]+)`", rows.partition("\n\n")[0])
        assert names, entry.splitlines()[0]
        evidence = set(re.findall(r"`(tests/[\w/]+\.py::\w+)`", text))
        assert not [name for name in names if not evidence & set(ledger.loc[name, "evidence"].split())]
        touched = set(ledger.loc[names, "touches"])
        assert (touched == {"conclusion"}) == (entry.partition(".")[0] in gravest), entry.splitlines()[0]
        explained += names
    wanted = ledger.index[ledger["status"].isin(["differs", "not_reproducible"])]
    assert sorted(explained) == sorted(wanted)


REFERENCE = r":(?:func|class|mod|meth|data|attr):`~?([\w.]+)`"


def resolves(name: str, module: str) -> bool:
    """Whether a name of a docstring is there: as it stands, in its module, or in a class of its module."""
    own = import_module(module)
    for start in ("", f"{module}."):
        parts = (start + name).split(".")
        for k in range(len(parts), 0, -1):
            try:
                found: object = import_module(".".join(parts[:k]))
            except ImportError:
                continue
            if all((found := getattr(found, part, None)) is not None for part in parts[k:]):
                return True
            break
    classes = [each for each in vars(own).values() if isinstance(each, type)]
    fields = {field for each in classes for field in (*vars(each), *getattr(each, "__annotations__", ()))}
    return name in fields or name.rpartition(".")[2] in fields


def test_every_reference_in_a_docstring_resolves() -> None:
    """Modules move; what names them must follow."""
    found, lost = 0, []
    for room in (*ROOMS, "data/thesis"):
        for path in sorted((ROOT / room).rglob("*.py")):
            module = ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")
            for name in re.findall(REFERENCE, path.read_text(encoding="utf-8")):
                found += 1
                lost += [] if resolves(name, module) else [f"{module}: {name}"]
    assert found > 250
    assert lost == []


@pytest.mark.parametrize("folder", ["tests", "benchmarks"])
def test_so_does_one_of_the_tests(folder: str) -> None:
    """They are no packages: a short name is one of its own file."""
    names = {
        path: re.findall(REFERENCE, path.read_text(encoding="utf-8")) for path in sorted((ROOT / folder).rglob("*.py"))
    }
    assert sum(map(len, names.values())) >= 3
    for path, found in names.items():
        own = {getattr(node, "name", "") for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))}
        own |= set(re.findall(r"^(\w+)(?:: .+)? = ", path.read_text(encoding="utf-8"), flags=re.MULTILINE))
        assert [name for name in found if name not in own and not resolves(name, "builtins")] == [], path


PAGES = [ROOT / "README.md", ROOT / "data" / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.relative_to(ROOT).as_posix())
def test_links_and_commands_of_a_page_exist(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    for link in re.findall(r"\]\((?!http|#)([^)#]+)", text):
        assert (page.parent / link).exists(), link
    for file in re.findall(rf"`((?:{'|'.join((*ROOMS, 'tests', 'benchmarks', 'tools'))})/[\w/]+\.py)", text):
        assert (ROOT / file).is_file(), file
    for command in re.findall(rf"-m ((?:{'|'.join(ROOMS)}) [\w -]+)", text):
        room, *words = command.split()
        found = import_module(f"{room}.__main__").main
        while isinstance(found, click.Group) and words:
            assert words[0] in found.commands, f"{room} {words[0]}"
            found = found.commands[words.pop(0)]
