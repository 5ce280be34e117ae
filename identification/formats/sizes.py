"""How much memory a file may ask for."""

from __future__ import annotations

from pathlib import Path

from identification.base.errors import InputError
from identification.base.files import require_readable

MOST_BYTES = 10**9  # of a file of text, or of what is read of one that is compressed


def require_size(path: Path) -> None:
    """Refuse a file of more than MOST_BYTES.

    Raises
    ------
    MissingFile
        There is no such file.
    InputError
        It is larger, or cannot be looked at.
    """
    require_readable(path)
    require_bytes(f"{path}: holds", path.stat().st_size)


def require_bytes(what: str, size: int) -> None:
    """Raise InputError about what is of more than MOST_BYTES."""
    if size > MOST_BYTES:
        raise InputError(f"{what} {size / 1e9:.3g} GB; expected at most {MOST_BYTES / 1e9:.3g} GB")
