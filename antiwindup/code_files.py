"""Which files of the project each of its commands hangs on, found from the imports.

An import inside a click command belongs to that command alone, one of paper_figures in another room only where the
command has the option --figure; every other one belongs to its module, but for those that only type checkers read. A
file belongs to the modules that name it: by its path, or by its name where it lies beside the module or in data/thesis.
"""

from __future__ import annotations

import ast
import platform
import re
from collections.abc import Iterable, Iterator, Sequence
from functools import cache
from hashlib import sha256
from importlib import metadata
from pathlib import Path

ROOT = Path(__file__).parents[1]
ROOMS = ("identification", "design", "experiments", "paper_figures")
CHECKS, FIGURES = "experiments/thesis/claims/checks", "paper_figures/thesis/figures"
FILE_NAME = re.compile(r"\w[\w./-]*\.\w+")


def code_of(command: Sequence[str]) -> str:
    """A hash of the code that a command runs, of the project's data that it reads and of the packages that it may use.

    Parameters
    ----------
    command
        The room and the words after it, such as ``("experiments", "thesis", "pid", ...)``.
    """
    return hash_of(frozenset(files_of_command(command)))


def files_of_command(command: Sequence[str]) -> list[str]:
    """The project's own files that a command runs and reads, as paths below its root."""
    room, *words = command
    owner, name = ("experiments/thesis", words[1]) if words[0] == "thesis" else (room, words[0])
    found = [
        file
        for file in _modules(owner)
        if name in read(file)[1] and (owner != "experiments" or not file.startswith("experiments/thesis/"))
    ]
    draws = room == "paper_figures" or "--figure" in command
    own = (each for file in found for each in read(file)[1][name] if draws or not each.startswith("paper_figures/"))
    needed = [*files_of(f"{room}.__main__"), *found, *own]
    if name == "draw":
        needed += files_of(f"{FIGURES.replace('/', '.')}.{words[1]}")
    if (room, name) == ("paper_figures", "axis"):
        needed += files_of(f"paper_figures.axis_figures.{words[1]}")
    if name == "claims":
        needed += [path.relative_to(ROOT).as_posix() for path in (ROOT / CHECKS).glob("*.py")]
    return closure(needed)


def figure_tables() -> dict[str, tuple[str, ...]]:
    """Name of each figure of the thesis and of ours -> the names of the tables that it draws."""
    return {path.stem: _tables(path) for path in sorted((ROOT / FIGURES).glob("fig_*.py"))}


def files_of(module: str) -> list[str]:
    """The file of a module of ours and those of the packages around it; none of another module or of a plain name."""
    parts = module.split(".")
    if parts[0] not in (*ROOMS, "data"):
        return []
    steps = [Path(*parts[:n]) for n in range(1, len(parts) + 1)]
    found = [step / "__init__.py" for step in steps] + [step.with_suffix(".py") for step in steps]
    return [path.as_posix() for path in found if (ROOT / path).is_file()]


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
        yield from (place.as_posix() for place in places if (ROOT / place).is_file())
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
    path = ROOT / file
    if path.suffix != ".py":
        return frozenset(), {}
    module, commands = set[str](), {}
    for node in ast.parse(path.read_text(encoding="utf-8")).body:
        found = frozenset(needs(node, Path(file).parent))
        if name := command_name(node):
            commands[name] = found
        else:
            module |= found
    return frozenset(module), commands


@cache
def hash_of(files: frozenset[str]) -> str:
    """The hash of the contents of files of the project and of the versions of the packages it runs with."""
    digests = [platform.python_version()] + [
        f"{file} {sha256((ROOT / file).read_bytes()).hexdigest()}" for file in sorted(files)
    ]
    return sha256("\n".join([*digests, *_packages()]).encode()).hexdigest()


def closure(files: Iterable[str]) -> list[str]:
    """Files with all that they need."""
    met, left = set[str](), list(files)
    while left:
        if (file := left.pop()) not in met:
            met.add(file)
            left += read(file)[0]
    return sorted(met)


@cache
def _modules(folder: str) -> tuple[str, ...]:
    """The modules below a folder of the project."""
    return tuple(sorted(path.relative_to(ROOT).as_posix() for path in (ROOT / folder).rglob("*.py")))


@cache
def _tables(figure: Path) -> tuple[str, ...]:
    """The names that a figure's module gives as its TABLES."""
    for node in ast.parse(figure.read_text(encoding="utf-8")).body:
        if isinstance(node, ast.AnnAssign) and ast.unparse(node.target) == "TABLES" and node.value:
            return tuple(ast.literal_eval(node.value))
    raise TypeError(f"{figure}: no TABLES; expected the names of the tables that it draws")


@cache
def _packages() -> tuple[str, ...]:
    """What the project asks for and runs with, each package with its version; none where it is not installed itself."""
    try:
        asked = [*(metadata.requires("antiwindup-thesis") or []), "llvmlite"]
    except metadata.PackageNotFoundError:
        return ()
    return tuple(f"{name} {_version(name)}" for name in sorted({re.split(r"[^\w.-]", each)[0] for each in asked}))


def _version(package: str) -> str:
    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:
        return "not there"
