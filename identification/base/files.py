"""Files read and files written: outputs appear whole or not at all."""

from __future__ import annotations

import errno
import os
import stat
import tempfile
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from io import StringIO
from pathlib import Path

from identification.base.errors import InputError, MissingFile


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask


def is_file(path: Path) -> bool:
    """Whether there is such a regular file, as far as may be seen; unlike ``path.is_file()`` it raises nothing."""
    return os.path.isfile(path)  # noqa: PTH113


def is_folder(path: Path) -> bool:
    """Whether there is such a folder, as far as may be seen; unlike ``path.is_dir()`` it raises nothing."""
    return os.path.isdir(path)  # noqa: PTH112


def is_there(path: Path) -> bool:
    """Whether there is anything of that name, as far as may be seen; unlike ``path.exists()`` it raises nothing."""
    return os.path.exists(path)  # noqa: PTH110


def true_path(path: Path) -> Path:
    """The path with all links followed, as far as may be; unlike ``path.resolve()`` it raises nothing."""
    return Path(os.path.realpath(path))


def read_text(path: Path) -> str:
    """Return the text of a UTF-8 file.

    Raises
    ------
    MissingFile
        There is no such file.
    InputError
        The file is no regular one, may not be read, or is not UTF-8 text.
    """
    try:
        with StringIO(read_bytes(path).decode("utf-8"), newline=None) as text:
            return text.read()
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: byte {error.start} is not UTF-8; expected a text file") from None


def read_bytes(path: Path) -> bytes:
    """Return the content of a file.

    Raises
    ------
    MissingFile
        There is no such file.
    InputError
        The file is no regular one or may not be read.
    """
    require_readable(path)
    try:
        return path.read_bytes()
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror})") from None


def require_readable(path: Path) -> None:
    """Refuse what is no file to read: nothing, a folder, a pipe that would never end.

    Raises
    ------
    MissingFile
        There is no such file.
    InputError
        The file is no regular one, or may not be looked at.
    """
    try:
        mode = path.stat().st_mode
    except FileNotFoundError:
        raise MissingFile(f"{path}: no such file") from None
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror})") from None
    if not stat.S_ISREG(mode):
        found = os.strerror(errno.EISDIR) if stat.S_ISDIR(mode) else "neither file nor folder"
        raise InputError(f"{path}: cannot be read ({found})")
    if not os.access(path, os.R_OK):
        raise InputError(f"{path}: cannot be read ({os.strerror(errno.EACCES)})")


def require_folder(folder: Path) -> None:
    """Refuse a folder that files could not be written into, before anything is computed.

    Raises
    ------
    InputError
        There is no such folder, or it may not be written to.
    """
    if not is_folder(folder):
        raise InputError(f"{folder}: no such folder")
    if not os.access(folder, os.W_OK | os.X_OK):
        raise InputError(f"{folder}: cannot be written to ({os.strerror(errno.EACCES)})")


def require_writable(*targets: Path, inputs: Iterable[Path] = ()) -> None:
    """Refuse what :func:`write_whole` could not write, before anything is computed.

    Parameters
    ----------
    targets
        Files to write.
    inputs
        Files to read, which must not be written over.

    Raises
    ------
    InputError
        A target is one of the inputs, is named twice, exists and is no regular file, or its folder is missing or may
        not be written to.
    """
    read = {true_path(path) for path in inputs}
    if len({true_path(path) for path in targets}) < len(targets):
        raise InputError(f"{', '.join(map(str, targets))}: two of these are one file; expected different files")
    for path in targets:
        goal = true_path(path)  # a link is followed, not replaced
        if goal in read:
            raise InputError(f"{path}: is an input too; expected another file to write")
        if is_there(goal) and not is_file(goal):
            raise InputError(f"{path}: cannot be written; expected a file, found something else")
        try:
            goal.parent.stat()
            if not os.access(goal.parent, os.W_OK | os.X_OK):
                raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))
            with suppress(FileNotFoundError):
                goal.stat()  # a name that is too long, a link to itself
        except OSError as error:
            raise InputError(f"{path}: cannot be written ({error.strerror})") from None


def write_whole(writers: Mapping[Path, Callable[[Path], object]], inputs: Iterable[Path] = ()) -> None:
    """Write several files so that either all of them appear, whole, or none does.

    Parameters
    ----------
    writers
        For each path, a function that writes the whole file to the temporary path it is given; that
        path lies in the same folder and has the same suffix.
    inputs
        Files that were read, which must not be written over.

    Raises
    ------
    InputError
        A target is one of the inputs, is named twice, exists and is no regular file, or may not be written.
    """
    read = {path.resolve() for path in inputs}
    if len({path.resolve() for path in writers}) < len(writers):
        raise InputError(f"{', '.join(map(str, writers))}: two of these are one file; expected different files")
    for path in writers:
        if path.resolve() in read:
            raise InputError(f"{path}: is an input too; expected another file to write")
        if path.exists() and not path.is_file():
            raise InputError(f"{path}: cannot be written; expected a file, found something else")
    written: dict[Path, Path] = {}
    target = next(iter(writers), Path())
    try:
        for target, write in writers.items():
            goal = target.resolve()  # a link is followed, not replaced
            handle, name = tempfile.mkstemp(dir=goal.parent, prefix=".partial-", suffix=goal.suffix)
            os.close(handle)
            written[goal] = Path(name)
            write(written[goal])
            with written[goal].open("rb+") as whole:  # a power cut must not leave a name without its contents
                os.fsync(whole.fileno())
            written[goal].chmod(0o666 & ~_umask())
        for target, temporary in written.items():
            temporary.replace(target)
    except OSError as error:
        raise InputError(f"{target}: cannot be written ({error.strerror})") from None
    finally:
        for temporary in written.values():
            temporary.unlink(missing_ok=True)
