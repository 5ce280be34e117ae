"""The folder of the user's below the temporary one, where caches go when the home folder takes none."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path


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
