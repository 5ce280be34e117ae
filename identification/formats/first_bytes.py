"""What a file's first bytes say that it is."""

from __future__ import annotations

import re
from pathlib import Path

from identification.base.errors import InputError

HEAD = 1024  # bytes
FIRST_BYTES = {
    ".mat": re.compile(rb"MATLAB [57]\.\d MAT-file|\x89HDF\r\n\x1a\n"),
    ".uff": re.compile(rb"\s*? {4}-1[ \t]*[\r\n]+ *\d+[bB]?\s"),
}


def usual_suffix(path: Path) -> str:
    """How the names of such files end, or nothing if the first bytes do not tell.

    Raises
    ------
    InputError
        The file cannot be read.
    """
    head = first_bytes(path)
    return next((suffix for suffix, begins in FIRST_BYTES.items() if begins.match(head)), "")


def first_bytes(path: Path) -> bytes:
    """The beginning of a file.

    Raises
    ------
    InputError
        The file cannot be read.
    """
    try:
        with path.open("rb") as file:
            return file.read(HEAD)
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror})") from None
