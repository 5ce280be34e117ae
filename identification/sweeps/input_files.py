"""The files of sweeps that files and folders mean; it imports no reader, so that a build is refused at once."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from identification.base.errors import InputError
from identification.base.files import is_folder, true_path

CSV, MAT, UFF = (".csv", ".tsv", ".lvm"), (".mat",), (".uff", ".unv", ".ufb", ".58")
"""How the names of the files end that are read as each of the three."""


def input_files(paths: Sequence[Path | str]) -> list[Path]:
    """The files that a list of files and folders means, in its order.

    A folder means the files in it that end so, sorted by name; hidden ones and folders within are left out.

    Raises
    ------
    InputError
        A folder holds no such file or may not be read, or a file is given twice.
    """
    files: list[Path] = []
    for path in map(Path, paths):
        files += _files_in(path) if is_folder(path) else [path]
    met = set()
    for file in files:
        if (goal := true_path(file)) in met:
            raise InputError(f"{file}: is given twice; expected each file once")
        met.add(goal)
    return files


def _files_in(folder: Path) -> list[Path]:
    try:
        entries = sorted(folder.iterdir())
    except OSError as error:
        raise InputError(f"{folder}: cannot be read ({error.strerror})") from None
    files = [
        entry
        for entry in entries
        if entry.suffix.lower() in (*CSV, *MAT, *UFF) and not entry.name.startswith(".") and not is_folder(entry)
    ]
    if not files:
        raise InputError(f"{folder}: holds no file that ends in {', '.join((*CSV, *MAT, *UFF))}; expected one or more")
    return files
