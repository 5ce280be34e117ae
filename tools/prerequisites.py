"""The imports of the rooms -> build/prerequisites.mk, make variables with the files that each command hangs on.

    CODE-ROOM-COMMAND    what `python -m ROOM COMMAND` runs and reads of the project's own
    CODE-thesis-COMMAND  what `python -m experiments thesis COMMAND` does
    CODE-FIGURE          what the module of a figure does
    CODE-checks          what the functions that the ledger names do
    TABLES-FIGURE        the tables that the figure draws

An import inside a click command belongs to that command alone; every other one belongs to its module, but for those
that only type checkers read. A file belongs to the modules that name it: by its path, or by its name where it lies
beside the module or in data/thesis. Needs nothing but Python, since make asks before there is an environment.
"""

from __future__ import annotations

import ast
import re
import sys
from collections.abc import Iterable, Iterator
from functools import cache
from pathlib import Path

ROOMS = ("identification", "design", "experiments", "paper_figures")
CHECKS, FIGURES = Path("experiments/thesis/claims/checks"), Path("paper_figures/thesis/figures")
FILE_NAME = re.compile(r"\w[\w./-]*\.\w+")


def files_of(module: str) -> list[str]:
    """The file of a module of ours and those of the packages around it; none of another module or of a plain name."""
    parts = module.split(".")
    if parts[0] not in (*ROOMS, "data"):
        return []
    steps = [Path(*parts[:n]) for n in range(1, len(parts) + 1)]
    found = [step / "__init__.py" for step in steps] + [step.with_suffix(".py") for step in steps]
    return [path.as_posix() for path in found if path.is_file()]


def needs(node: ast.AST, folder: Path) -> Iterator[str]:
    """The files that a statement of a module in this folder imports or names."""
    if isinstance(node, ast.If) and isinstance(node.test, ast.Name) and node.test.id == "TYPE_CHECKING":
        return
    if isinstance(node, ast.Import):
        for alias in node.names:
            yield from files_of(alias.name)
    elif isinstance(node, ast.ImportFrom) and node.module:
        for alias in node.names:
            yield from files_of(f"{node.module}.{alias.name}")
    elif isinstance(node, ast.Constant) and isinstance(node.value, str) and FILE_NAME.fullmatch(node.value):
        places = (place / node.value for place in (Path(), folder, Path("data/thesis")))
        yield from (place.as_posix() for place in places if place.is_file())
    for below in ast.iter_child_nodes(node):
        yield from needs(below, folder)


def command_name(node: ast.AST) -> str | None:
    """The name of the click command that a function is, if it is one."""
    for call in getattr(node, "decorator_list", []):
        if isinstance(call, ast.Call) and isinstance(call.func, ast.Attribute) and call.func.attr == "command":
            return str(call.args[0].value) if call.args and isinstance(call.args[0], ast.Constant) else node.name  # type: ignore[attr-defined]
    return None


@cache
def read(file: str) -> tuple[frozenset[str], dict[str, frozenset[str]]]:
    """What a module needs, and what each of its commands needs besides."""
    path = Path(file)
    if path.suffix != ".py":
        return frozenset(), {}
    module, commands = set[str](), {}
    for node in ast.parse(path.read_text(encoding="utf-8")).body:
        found = frozenset(needs(node, path.parent))
        if name := command_name(node):
            commands[name] = found
        else:
            module |= found
    return frozenset(module), commands


def closure(files: Iterable[str]) -> list[str]:
    """Files with all that they need."""
    met, left = set[str](), list(files)
    while left:
        if (file := left.pop()) not in met:
            met.add(file)
            left += read(file)[0]
    return sorted(met)


def tables(figure: Path) -> list[str]:
    """The names that a figure's module gives as its TABLES."""
    for node in ast.parse(figure.read_text(encoding="utf-8")).body:
        if isinstance(node, ast.AnnAssign) and ast.unparse(node.target) == "TABLES" and node.value:
            return list(ast.literal_eval(node.value))
    raise SystemExit(f"{figure}: no TABLES; expected the names of the tables that it draws")


def variables() -> dict[str, list[str]]:
    """Each make variable with its words."""
    found = {}
    for room in ROOMS:
        for file in sorted(path.as_posix() for path in Path(room).rglob("*.py")):
            owner = "thesis" if file.startswith("experiments/thesis/") else room
            for name, own in read(file)[1].items():
                found[f"CODE-{owner}-{name}"] = closure([*files_of(f"{room}.__main__"), file, *own])
    for path in sorted(FIGURES.glob("fig_*.py")):
        found[f"CODE-{path.stem}"] = closure(files_of(".".join(path.with_suffix("").parts)))
        found[f"TABLES-{path.stem}"] = tables(path)
    found["CODE-checks"] = closure(path.as_posix() for path in CHECKS.glob("*.py"))
    return found


if __name__ == "__main__":
    text = "".join(f"{name} := {' '.join(words)}\n" for name, words in variables().items())
    Path(sys.argv[1]).write_text(text, encoding="utf-8")
