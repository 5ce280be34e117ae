"""The imports of the rooms -> build/prerequisites.mk, a make variable for each command with the files that it runs.

    CODE-ROOM-COMMAND    what `python -m ROOM COMMAND` imports
    CODE-thesis-COMMAND  what `python -m experiments thesis COMMAND` imports
    CODE-FIGURE          what the module of a figure imports
    CODE-checks          what the functions that the ledger names import

An import inside a click command belongs to that command alone; every other one belongs to its module. Needs nothing
but Python, since make asks before there is an environment.
"""

from __future__ import annotations

import ast
import sys
from collections.abc import Iterable, Iterator
from functools import cache
from pathlib import Path

ROOMS = ("identification", "design", "experiments", "paper_figures")
DATA = {"data/thesis/__init__.py": ("data/thesis/thesis.toml",)}
CHECKS, FIGURES = "experiments/thesis/claims/checks", "paper_figures/thesis/figures"


def files_of(module: str) -> list[str]:
    """The file of a module of ours and those of the packages around it; none of another module or of a plain name."""
    parts = module.split(".")
    if parts[0] not in (*ROOMS, "data"):
        return []
    steps = [Path(*parts[:n]) for n in range(1, len(parts) + 1)]
    found = [step / "__init__.py" for step in steps] + [step.with_suffix(".py") for step in steps]
    return [path.as_posix() for path in found if path.is_file()]


def imports(nodes: Iterable[ast.AST]) -> Iterator[str]:
    """The files that import statements anywhere in these nodes name."""
    for node in (below for top in nodes for below in ast.walk(top)):
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom) and node.module:
            names = [f"{node.module}.{alias.name}" for alias in node.names]
        else:
            continue
        for name in names:
            yield from files_of(name)


def command_name(node: ast.AST) -> str | None:
    """The name of the click command that a function is, if it is one."""
    for call in getattr(node, "decorator_list", []):
        if isinstance(call, ast.Call) and isinstance(call.func, ast.Attribute) and call.func.attr == "command":
            return str(call.args[0].value) if call.args and isinstance(call.args[0], ast.Constant) else node.name  # type: ignore[attr-defined]
    return None


@cache
def read(file: str) -> tuple[frozenset[str], dict[str, frozenset[str]]]:
    """What a module imports, and what each of its commands imports besides."""
    body = ast.parse(Path(file).read_text(encoding="utf-8")).body
    commands = {name: frozenset(imports([node])) for node in body if (name := command_name(node))}
    return frozenset(imports(node for node in body if not command_name(node))), commands


def closure(files: Iterable[str]) -> list[str]:
    """Files with all that they import, and what belongs to these that is no Python."""
    met: set[str] = set()
    left = list(files)
    while left:
        file = left.pop()
        if file not in met:
            met.add(file)
            left += read(file)[0]
    folders = {Path(file).parent for file in met if file.startswith("paper_figures/")}
    others = (path for folder in folders for path in folder.iterdir() if path.is_file() and path.suffix != ".py")
    return sorted(met | {data for file in met for data in DATA.get(file, ())} | {path.as_posix() for path in others})


def variables() -> dict[str, list[str]]:
    """Each make variable with its files."""
    found = {}
    for room in ROOMS:
        for file in sorted(path.as_posix() for path in Path(room).rglob("*.py")):
            owner = "thesis" if file.startswith("experiments/thesis/") else room
            for name, own in read(file)[1].items():
                found[f"CODE-{owner}-{name}"] = closure([*files_of(f"{room}.__main__"), file, *own])
    for path in sorted(Path(FIGURES).glob("fig_*.py")):
        found[f"CODE-{path.stem}"] = closure(files_of(".".join(path.with_suffix("").parts)))
    found["CODE-checks"] = closure(path.as_posix() for path in Path(CHECKS).glob("*.py"))
    return found


if __name__ == "__main__":
    text = "".join(f"{name} := {' '.join(files)}\n" for name, files in variables().items())
    Path(sys.argv[1]).write_text(text, encoding="utf-8")
