"""What the project wrote into a folder: its ``manifest.json``, with the hash of each file and of what it came from."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path

from identification.base.errors import InputError, MissingFile, shown
from identification.base.files import read_bytes, read_text, write_whole
from identification.base.json_object import member, read_json, record

NAME = "manifest.json"
SCHEMA = 1
NOTED = re.compile(r'\[("(?:[^"\\]|\\.)*"), "([0-9a-f]{64})"\]')  # a line of a journal


@dataclass(frozen=True)
class Written:
    """One file.

    Parameters
    ----------
    source
        Hash of what it was made from: the command, its inputs, the code.
    content
        SHA-256 of the file; None while it is being written.
    """

    source: str
    content: str | None


def read_manifest(folder: Path) -> dict[str, Written]:
    """Return the files that the manifest of a folder lists, by their paths below it; none where there is no manifest.

    Raises
    ------
    InputError
        The manifest cannot be read or is not one.
    """
    path = folder / NAME
    if os.path.islink(path):  # noqa: PTH114
        raise InputError(f"{path}: is a link; expected a file that this project wrote, or none")
    try:
        files = member(read_json(path, SCHEMA), "files")
        for name in files:
            if not name.isprintable() or not Path(name).parts or Path(name).is_absolute() or ".." in Path(name).parts:
                raise InputError(f"{shown(name)} lies outside the folder; expected the name of a file in it")
        return {name: record(Written, member(files, name)) for name in files}
    except MissingFile:
        return {}
    except InputError as error:
        raise InputError(str(error) if str(path) in str(error) else f"{path}: {error}") from None


def write_manifest(folder: Path, files: Mapping[str, Written]) -> None:
    """Write the manifest of a folder, or remove it where there are no files; raises InputError where that fails."""
    path = folder / NAME
    if not files:
        return path.unlink(missing_ok=True)
    content = {"schema": SCHEMA, "files": {name: vars(files[name]) for name in sorted(files)}}
    return write_whole({path: json.dumps(content, indent=1) + "\n"})


def read_journal(path: Path) -> dict[str, set[str]]:
    """Return what :func:`identification.base.files.note` kept: name of a place -> hashes. A line cut off is none.

    Raises
    ------
    InputError
        The file cannot be read or is no journal.
    """
    found: dict[str, set[str]] = {}
    if not os.path.lexists(path):
        return found
    if os.path.islink(path) or path.lstat().st_nlink != 1:  # noqa: PTH114
        raise InputError(f"{path}: is a link; expected the journal of a build, or no such file")
    for number, line in enumerate(read_text(path).split("\n"), 1):
        if noted := NOTED.fullmatch(line):
            found.setdefault(json.loads(noted[1]), set()).add(noted[2])
        elif line and not line.startswith('["'):
            raise InputError(f"{path}, line {number}: holds no path with a hash; expected the journal of a build")
    return found


def content_of(path: Path) -> str | None:
    """The SHA-256 of a file, or None if there is no such file; raises InputError where it cannot be read."""
    try:
        return sha256(read_bytes(path)).hexdigest()
    except MissingFile:
        return None


def require_as_written(folder: Path, paths: Iterable[Path]) -> None:
    """Refuse files that were changed since the project wrote them.

    Parameters
    ----------
    folder
        A folder, which need not have a manifest.
    paths
        Any files; those that are not there, are outside the folder or not in its manifest may hold anything.

    Raises
    ------
    InputError
        A file has another content than the manifest lists.
    """
    written = read_manifest(folder)
    for path in paths:
        listed = written.get(path.relative_to(folder).as_posix()) if path.is_relative_to(folder) else None
        if listed is not None and content_of(path) not in (None, listed.content):
            raise InputError(f"{path}: was changed since it was written; expected what {folder / NAME} lists")
