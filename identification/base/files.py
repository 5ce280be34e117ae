"""Files read and files written: outputs appear whole or not at all."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path

from identification.base.errors import InputError, MissingFile


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask


def read_text(path: Path) -> str:
    """Return the text of a UTF-8 file.

    Raises
    ------
    MissingFile
        There is no such file.
    InputError
        The file is a folder, may not be read, or is not UTF-8 text.
    """
    try:
        return path.read_text(encoding="utf-8")
    except FileNotFoundError:
        raise MissingFile(f"{path}: no such file") from None
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: byte {error.start} is not UTF-8; expected a text file") from None
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror})") from None


def read_bytes(path: Path) -> bytes:
    """Return the content of a file.

    Raises
    ------
    MissingFile
        There is no such file.
    InputError
        The file is a folder or may not be read.
    """
    try:
        return path.read_bytes()
    except FileNotFoundError:
        raise MissingFile(f"{path}: no such file") from None
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror})") from None


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
