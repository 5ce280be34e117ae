"""How every command line answers bad input: one sentence, exit status 2, no traceback; or the sentence in a file."""

from __future__ import annotations

import atexit
import gc
import os
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import click
import numpy as np

from identification.base.console import Console, escaped
from identification.base.errors import InputError, MissingFile
from identification.base.files import write_whole

KEPT = ".refused.txt"  # how the name of a kept refusal ends
QUOTED = 80  # characters of a value in a sentence
EXTRAS = {"dask": "campaign", "distributed": "campaign", "pyarrow": "campaign"}  # of pyproject.toml, by their modules


Decorator = Callable[[Callable[..., None]], Callable[..., None]]


def together(*options: Decorator) -> Decorator:
    """One decorator for several options and arguments of a command, which its help lists in this order."""

    def decorated(command: Callable[..., None]) -> Callable[..., None]:
        for option in reversed(options):
            command = option(command)
        return command

    return decorated


class Refusal(click.ClickException):
    """How a command line shows an :class:`InputError`."""

    exit_code = 2


class CommandGroup(Console):
    """A click group whose commands answer an :class:`InputError` with its sentence and exit status 2.

    So they do when finite numbers lead out of what floating point can hold, an overflow or a singular matrix; where
    the memory does not suffice; and where a module of an extra is not installed. Control characters in a sentence,
    which may come from a file or a name, are shown as escapes, and what it quotes is cut.

    With ``--refusal FILE``, for a chain of commands that goes on without the one that refuses, the exit status is 0
    and the sentence stands in FILE too, whose name ends in .refused.txt. A command that lacks an input, which one
    before it refused to write, then does nothing, and writes nothing.
    """

    def __init__(self, *arguments: Any, **attributes: Any) -> None:
        super().__init__(*arguments, **attributes)
        said = "Before the command: where a refusal is kept, a sentence; status 0 then, and when an input is missing."
        self.params.append(
            click.Option(["--refusal"], type=click.Path(path_type=Path, dir_okay=False), metavar="FILE", help=said)
        )

    def invoke(self, ctx: click.Context) -> Any:
        atexit.register(gc.freeze)  # without it the interpreter sweeps all modules as it ends: a third of a second
        refusal: Path | None = ctx.params.pop("refusal")
        if refusal is not None:
            _require_ours(refusal)
            _keep(refusal, None)
        try:
            with np.errstate(over="raise"):
                return super().invoke(ctx)
        except InputError as error:
            sentence, is_missing = plain(str(error)), isinstance(error, MissingFile)
        except (ArithmeticError, np.linalg.LinAlgError) as error:
            sentence, is_missing = f"the numbers given are too extreme to compute with ({error})", False
        except MemoryError as error:
            asked = f" ({str(error)[:1].lower()}{str(error)[1:]})" if str(error) else ""
            sentence, is_missing = f"out of memory{asked}; expected less input, or a machine with more memory", False
        except ModuleNotFoundError as error:
            if error.name not in EXTRAS:
                raise
            extra = f'pip install "antiwindup-thesis[{EXTRAS[error.name]}]"'
            raise Refusal(f"{error.name} is not installed, which this command needs; give {extra}") from None
        except click.ClickException as error:
            error.message = plain(error.message)  # type: ignore[misc]
            raise
        if refusal is None:
            raise Refusal(sentence)
        if is_missing:
            return click.echo(f"{sentence}; nothing is done", err=True)
        Refusal(sentence).show()
        return _keep(refusal, sentence)


def plain(sentence: str) -> str:
    """A sentence for a terminal, and what it quotes cut at QUOTED characters."""
    return re.sub(rf"(?<!\w)'([^']{{{QUOTED}}})[^']+'(?!\w)", r"'\1...'", escaped(sentence))


def _require_ours(refusal: Path) -> None:
    """Refuse a FILE that could be anything but the sentence of an earlier refusal, since it is removed."""
    if not refusal.name.endswith(KEPT):
        raise Refusal(f"--refusal is '{refusal}'; expected a name that ends in {KEPT}")
    if refusal.is_symlink() or (refusal.exists() and not refusal.is_file()):
        raise Refusal(f"{refusal}: is no regular file; expected a file that holds a refusal, or none")
    if not os.access(refusal.parent, os.W_OK):
        raise Refusal(f"{refusal}: cannot be written; expected a folder that exists and may be written to")


def _keep(refusal: Path, sentence: str | None) -> None:
    """Write the sentence of a refusal, or remove that of an earlier one."""
    try:
        if sentence is None:
            refusal.unlink(missing_ok=True)
        else:
            write_whole({refusal: lambda path: path.write_text(f"{sentence}\n", encoding="utf-8")})
    except InputError as error:
        raise Refusal(str(error)) from None
    except OSError as error:
        raise Refusal(f"{refusal}: cannot be written ({error.strerror})") from None
