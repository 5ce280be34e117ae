"""Which files of the project each of its commands hangs on, found from the imports.

An import inside a click command belongs to that command alone, one of paper_figures in another room only where the
command has the option --figure; every other one belongs to its module, but for those that only type checkers read. A
file belongs to the modules that name it: by its path, or by its name where it lies beside the module or in data/thesis.
"""

from __future__ import annotations

import ast
import json
import os
import platform
import re
from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from functools import cache
from hashlib import sha256
from importlib import metadata
from pathlib import Path

from identification.base.cache_folders import cache_folders
from identification.base.errors import InputError
from identification.base.files import is_file, read_text, write_whole

ROOT = Path(__file__).parents[1]
IMPORT = "import "
ROOMS = ("identification", "design", "experiments", "paper_figures")
CHECKS, FIGURES = "experiments/thesis/claims/checks", "paper_figures/thesis/figures"
FILE_NAME = re.compile(r"\w[\w./-]*\.\w+")
_NAME = f"code-files-{sha256(bytes(ROOT)).hexdigest()[:16]}.json"  # what was found in the modules of this copy


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


def mentions(node: ast.AST) -> Iterator[str]:
    """What a statement imports of ours, as ``import a.b``, and what in it may name a file."""
    if isinstance(node, ast.If) and isinstance(node.test, ast.Name) and node.test.id == "TYPE_CHECKING":
        return
    imported: list[str] = []
    if isinstance(node, ast.Import):
        imported = [alias.name for alias in node.names]
    elif isinstance(node, ast.ImportFrom) and node.module:
        imported = [f"{node.module}.{alias.name}" for alias in node.names]
    elif isinstance(node, ast.Constant) and isinstance(node.value, str) and FILE_NAME.fullmatch(node.value):
        yield node.value
    yield from (f"{IMPORT}{name}" for name in imported if name.partition(".")[0] in (*ROOMS, "data"))
    for below in ast.iter_child_nodes(node):
        yield from mentions(below)


@cache
def meant(mention: str, folder: str) -> tuple[str, ...]:
    """The files that are meant by what a module in a folder mentions."""
    if mention.startswith(IMPORT):
        return tuple(files_of(mention.removeprefix(IMPORT)))
    places = (Path(place, mention) for place in ("", folder, "data/thesis"))
    return tuple(place.as_posix() for place in places if (ROOT / place).is_file())


def command_name(node: ast.AST) -> str | None:
    """The name of the click command that a function is, if it is one."""
    for call in getattr(node, "decorator_list", []):
        if isinstance(call, ast.Call) and isinstance(call.func, ast.Attribute) and call.func.attr == "command":
            return str(call.args[0].value) if call.args and isinstance(call.args[0], ast.Constant) else node.name  # type: ignore[attr-defined]
    return None


@cache
def read(file: str) -> tuple[frozenset[str], dict[str, frozenset[str]]]:
    """What a module needs, and what each of its commands needs besides."""
    if not file.endswith(".py"):
        return frozenset(), {}
    folder, kept = os.path.dirname(file), _kept()  # noqa: PTH120
    if (found := kept.get(digest(file))) is None:
        found = kept[digest(file)] = _parsed(file)
    needs = {
        name: frozenset(each for mention in said for each in meant(mention, folder)) for name, said in found.items()
    }
    return needs.pop(""), needs


def _parsed(file: str) -> dict[str, list[str]]:
    """What each command of a module mentions; with no name, what the rest of the module does."""
    found: dict[str, list[str]] = {"": []}
    for node in ast.parse((ROOT / file).read_text(encoding="utf-8")).body:
        name = command_name(node) or ""
        found[name] = sorted({*found.get(name, []), *mentions(node)})
    return found


@cache
def _kept() -> dict[str, dict[str, list[str]]]:
    """Digest of a module -> what :func:`_parsed` found in it, in this process or in one before."""
    for folder in cache_folders():
        with suppress(InputError, ValueError):
            return dict(json.loads(read_text(folder / _NAME)))
    return {}


def keep() -> None:
    """Keep for the next build what was found in the modules, where that is possible."""
    modules = {digest(file) for room in ROOMS for file in _modules(room)}
    kept = json.dumps({each: found for each, found in _kept().items() if each in modules})
    for folder in cache_folders():
        with suppress(InputError, OSError):
            folder.mkdir(mode=0o700, parents=True, exist_ok=True)
            if not is_file(place := folder / _NAME) or read_text(place) != kept:
                write_whole({place: kept})
            return


@cache
def digest(file: str) -> str:
    """The SHA-256 of a file of the project."""
    return sha256((ROOT / file).read_bytes()).hexdigest()


@cache
def hash_of(files: frozenset[str]) -> str:
    """The hash of the contents of files of the project and of the versions of the packages it runs with."""
    digests = [platform.python_version(), *(f"{file} {digest(file)}" for file in sorted(files))]
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
