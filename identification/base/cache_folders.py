"""Where caches go: the user's own folder for them, or one below the temporary folder where the home takes none."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator
from pathlib import Path


def cache_folders() -> Iterator[Path]:
    """Where caches of this user may be kept, best first; folders that need not exist nor allow writing.

    antiwindup in XDG_CACHE_HOME or else in ~/.cache, and a folder of the user's below the temporary one.
    """
    users = Path(os.path.expanduser(os.environ.get("XDG_CACHE_HOME") or "~/.cache"))  # noqa: PTH111  # raises nothing
    if users.is_absolute():
        yield users / "antiwindup"
    if (below := temporary_cache()) is not None:
        yield below[0]


def temporary_cache() -> tuple[Path, bool] | None:
    """The folder, made if need be, and whether it is new; None where it cannot be made or is another user's.

    Another user could have put code there.
    """
    user = getattr(os, "getuid", int)()
    folder = Path(tempfile.gettempdir()) / f"antiwindup-{user}"
    try:
        folder.mkdir(mode=0o700)
        return folder, True
    except FileExistsError:
        return (folder, False) if folder.is_dir() and folder.lstat().st_uid == user else None
    except OSError:
        return None
