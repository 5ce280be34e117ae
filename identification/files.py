"""What every command owes its user: outputs written whole or not at all, bad input answered in one sentence."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import click


class InputError(ValueError):
    """Something the user gave cannot be used; the message is one sentence saying what, where and what else."""


class Refusal(click.ClickException):
    """How a command line shows an :class:`InputError`."""

    exit_code = 2


class CommandGroup(click.Group):
    """A click group whose commands answer an :class:`InputError` with its sentence and exit status 2."""

    def invoke(self, ctx: click.Context) -> Any:
        try:
            return super().invoke(ctx)
        except InputError as error:
            raise Refusal(str(error)) from None


def read_text(path: Path) -> str:
    """Return the text of a UTF-8 file.

    Raises
    ------
    InputError
        The file is missing, is a folder, may not be read, or is not UTF-8 text.
    """
    try:
        return path.read_text(encoding="utf-8")
    except FileNotFoundError:
        raise InputError(f"{path}: no such file") from None
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: byte {error.start} is not UTF-8; expected a text file") from None
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror})") from None


def write_whole(writers: Mapping[Path, Callable[[Path], object]]) -> None:
    """Write several files so that either all of them appear, whole, or none does.

    Parameters
    ----------
    writers
        For each path, a function that writes the whole file to the temporary path it is given; that
        path lies in the same folder and has the same suffix.

    Raises
    ------
    InputError
        A folder does not exist or may not be written to.
    """
    written: dict[Path, Path] = {}
    try:
        for path, write in writers.items():
            try:
                handle, name = tempfile.mkstemp(dir=path.parent, prefix=".partial-", suffix=path.suffix)
            except OSError as error:
                raise InputError(f"{path}: cannot be written ({error.strerror})") from None
            os.close(handle)
            written[path] = Path(name)
            write(written[path])
            written[path].chmod(0o644)
        for path, temporary in written.items():
            temporary.replace(path)
    finally:
        for temporary in written.values():
            temporary.unlink(missing_ok=True)
