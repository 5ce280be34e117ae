"""One writer at a time: a file or a folder is locked while a command writes it."""

from __future__ import annotations

import os
import platform
import re
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from stat import S_ISREG

from identification.base.errors import InputError
from identification.base.files import is_folder, is_there
from identification.base.partial_files import removed_at_the_end

OURS = re.compile(rb"(\d+(\n([^\n]*\n?)?)?)?")  # what a lock holds, half-written too: a process and its host


@contextmanager
def locked_folder(folder: Path) -> Iterator[None]:
    """Keep other processes from writing into a folder, which is made if it is not there.

    Raises
    ------
    InputError
        Another process writes into it, and the sentence names it; or the folder cannot be made or written to.

    Notes
    -----
    The lock lies in the folder, so that nothing beside it need be writable, and is the same one whatever links lead
    there. Folders that were made and are still empty at the end are removed.
    """
    try:
        made = [path for path in (folder, *folder.parents) if not is_there(path)]
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{folder}: cannot be made ({error.strerror})") from None
    try:
        with _held(folder / ".antiwindup.lock", folder):
            yield
    finally:
        with suppress(OSError):
            for path in made:
                path.rmdir()


@contextmanager
def locked_file(file: Path) -> Iterator[None]:
    """Keep other processes from writing a file, which need not exist, in a folder that does.

    Raises
    ------
    InputError
        Another process writes it, and the sentence names it; or nothing can be written beside it.
    """
    folder, name = os.path.split(os.path.realpath(file))
    with _held(Path(folder, f".{name}.lock"), file):
        yield


@contextmanager
def _held(lock: Path, target: Path) -> Iterator[None]:
    """Hold the lock of ``target``.

    Notes
    -----
    It is the operating system's (flock, over NFS too), and ends with the process however that ends; only its file,
    which says who holds it, can stay behind, and holds nothing up. Where a file system keeps no such locks, the file
    itself is the lock, and that of a process that is gone is broken.
    """
    from filelock import FileLock, Timeout

    if not is_folder(lock.parent):
        raise InputError(f"{target.parent}: no such folder")
    _require_ours(lock)
    holder = FileLock(lock, timeout=0)
    try:
        holder.acquire()
    except Timeout:
        raise InputError(f"{target}: {_holder(lock)} is writing it; wait until that ends") from None
    except OSError as error:
        raise InputError(f"{target}: cannot be written ({error.strerror})") from None
    try:
        with removed_at_the_end(lock):  # before it is let go: the next one's file has the same name
            try:
                lock.write_text(f"{os.getpid()}\n{platform.node()}\n", encoding="utf-8")
            except OSError as error:
                raise InputError(f"{target}: cannot be written ({error.strerror})") from None
            yield
    finally:
        holder.release()


def _require_ours(lock: Path) -> None:
    """Refuse a file in the place of a lock that no command has left there."""
    try:
        if not os.path.lexists(lock):
            return
        found = lock.lstat()
        if not (S_ISREG(found.st_mode) and found.st_nlink == 1 and OURS.fullmatch(lock.read_bytes())):
            raise InputError(f"{lock}: is not a lock file of this project; expected no such file")
    except FileNotFoundError:  # which its holder has just removed
        return
    except OSError as error:
        raise InputError(f"{lock}: cannot be read ({error.strerror})") from None


def _holder(lock: Path) -> str:
    """Who holds a lock, as its file says; a process just about to write that, or one that let go, is another one."""
    try:
        process, host = lock.read_text(encoding="utf-8").split("\n")[:2]
        return f"process {int(process)} on {host}"
    except (OSError, ValueError):
        return "another process"
