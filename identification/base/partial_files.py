"""Files that a process has begun and not ended: gone at the end, at a signal, or with the next process."""

from __future__ import annotations

import errno
import os
import re
import socket
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from hashlib import sha256
from itertools import count
from pathlib import Path
from stat import S_ISREG

from identification.base.process import undisturbed

_HOST = sha256(socket.gethostname().encode()).hexdigest()[:8]
_PARTIAL = re.compile(rf"\.partial-{_HOST}-(\d+)-\d+(\..*)?")
_numbers = count()
_partials: set[Path] = set()


def remove_partials() -> None:
    """Remove the files that this process has begun and not ended, as it is about to be ended itself."""
    for path in tuple(_partials):
        path.unlink(missing_ok=True)


@contextmanager
def removed_at_the_end(path: Path) -> Iterator[None]:
    """Remove a file, if it is there, at the end of a ``with`` block, or when the process is ended by a signal."""
    _partials.add(path)
    try:
        yield
    finally:
        path.unlink(missing_ok=True)
        _partials.discard(path)


@contextmanager
def partial_file(folder: Path, suffix: str) -> Iterator[Path]:
    """A new empty file in a folder, which is gone at the end unless it was renamed; a signal's handler removes it too.

    Raises
    ------
    OSError
        No file can be made in the folder.
    """
    path = folder / f".partial-{_HOST}-{os.getpid()}-{next(_numbers)}{suffix}"
    with ExitStack() as stack:
        with undisturbed:
            stack.enter_context(removed_at_the_end(path))
            path.touch(0o600, exist_ok=False)
        yield path


def remove_abandoned(folder: Path) -> None:
    """Remove what a process of this machine, which is no more, had begun to write in a folder."""
    for path in folder.glob(".partial-*"):
        if (found := _PARTIAL.fullmatch(path.name)) and not _runs(int(found[1])) and S_ISREG(path.lstat().st_mode):
            path.unlink(missing_ok=True)


def _runs(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except OSError as error:
        return error.errno != errno.ESRCH
    except OverflowError:
        return False
    return True
