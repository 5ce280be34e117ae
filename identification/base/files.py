"""Files read and files written: outputs appear whole or not at all."""

from __future__ import annotations

import errno
import json
import os
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from contextvars import ContextVar
from hashlib import sha256
from io import StringIO
from pathlib import Path
from stat import S_ISDIR, S_ISREG

from identification.base.errors import InputError, MissingFile
from identification.base.partial_files import partial_file, remove_abandoned
from identification.base.process import undisturbed

Content = str | bytes | Callable[[Path], object]
"""What a file is to hold, see :func:`write_whole`."""
_journal: Path | None = None
_protected_too: ContextVar[bool] = ContextVar("_protected_too", default=False)


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
    if not S_ISREG(mode):
        found = os.strerror(errno.EISDIR) if S_ISDIR(mode) else "neither file nor folder"
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
        A target is one of the inputs, is named twice, exists and is no regular file, is write-protected, or its
        folder is missing or may not be written to.
    """
    goals = {path: true_path(path) for path in targets}  # a link is followed, not replaced
    read = {true_path(path) for path in inputs}
    if len(set(goals.values())) < len(targets):
        raise InputError(
            f"{', '.join(map(str, targets))}: two of these outputs are the same file; expected different files"
        )
    for path, goal in goals.items():
        if goal in read:
            raise InputError(f"{path}: is an input too; expected another file to write")
        try:
            goal.parent.stat()
        except OSError as error:
            raise InputError(f"{path}: cannot be written ({error.strerror})") from None
        if not os.access(goal.parent, os.W_OK | os.X_OK):
            raise InputError(f"{path}: cannot be written ({os.strerror(errno.EACCES)})")
        require_replaceable(path)


@contextmanager
def write_protected_too() -> Iterator[None]:
    """Let :func:`write_whole` replace write-protected files for a ``with`` block."""
    token = _protected_too.set(True)
    try:
        yield
    finally:
        _protected_too.reset(token)


def keep_journal(journal: Path) -> None:
    """Let :func:`write_whole` note in a file, from now on, what it is about to put in which place."""
    global _journal
    _journal = journal


def note(journal: Path, contents: Mapping[Path, Path]) -> None:
    """Add to a journal a line for each place: its name, and the SHA-256 of the file with what is to stand there."""
    lines = [[noted_name(journal, path), sha256(file.read_bytes()).hexdigest()] for path, file in contents.items()]
    opened = os.open(journal, os.O_WRONLY | os.O_APPEND | os.O_CREAT | getattr(os, "O_NOFOLLOW", 0), 0o666)
    with os.fdopen(opened, "a", encoding="utf-8") as stream:  # a line that was cut off before ends here
        stream.writelines(f"\n{json.dumps(line)}\n" for line in lines)
        stream.flush()
        os.fsync(opened)


def noted_name(journal: Path, path: Path) -> str:
    """The name of a place in a journal, the same however it is spelled and wherever their folder is moved."""
    return os.path.relpath(true_path(path.parent) / path.name, true_path(journal.parent))


def write_whole(contents: Mapping[Path, Content], inputs: Iterable[Path] = ()) -> None:
    """Write several files so that either all of them appear, whole, or none does.

    Parameters
    ----------
    contents
        For each path its text, its bytes, or a function that writes the whole file to the temporary path it is given;
        that path lies in the same folder and has the same suffix.
    inputs
        Files that were read, which must not be written over.

    Raises
    ------
    InputError
        A target is one of the inputs, is named twice, exists and is no regular file, is write-protected, or may not
        be written.
    """
    require_writable(*contents, inputs=inputs)
    goals = {path: true_path(path) for path in contents}
    target = next(iter(contents), Path())
    try:
        for folder in {goal.parent for goal in goals.values()}:
            remove_abandoned(folder)
        with ExitStack() as stack:
            partials = {}
            for target, content in contents.items():
                partials[target] = stack.enter_context(partial_file(goals[target].parent, goals[target].suffix))
                if callable(content):
                    content(partials[target])
                else:
                    partials[target].write_bytes(content.encode() if isinstance(content, str) else content)
                with partials[target].open("rb+") as whole:  # a power cut must not leave a name without its contents
                    os.fsync(whole.fileno())
                partials[target].chmod(0o666 & ~_umask())
            if _journal is not None:
                note(_journal, partials)
            with undisturbed:
                for target, partial in partials.items():
                    partial.replace(goals[target])
    except OSError as error:
        raise InputError(f"{target}: cannot be written ({error.strerror or error})") from None


def require_replaceable(path: Path) -> None:
    """Let pass a file that is not there or may be written over.

    Raises
    ------
    InputError
        The path leads to something else than a file, to a write-protected one, or nowhere.
    """
    try:
        mode = path.stat().st_mode
    except FileNotFoundError:
        return
    except OSError as error:
        raise InputError(f"{path}: cannot be written ({error.strerror})") from None
    if not S_ISREG(mode):
        raise InputError(f"{path}: cannot be written, since it is not a regular file")
    if not _protected_too.get() and not (mode & 0o222 and os.access(path, os.W_OK)):
        raise InputError(f"{path}: is write-protected; expected a file that may be replaced, or --force")
