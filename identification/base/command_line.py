"""How every command line answers bad input: one sentence, exit status 2, no traceback."""

from __future__ import annotations

import atexit
import gc
import re
import warnings
from collections.abc import Callable
from typing import Any

import click

from identification.base.console import Console
from identification.base.errors import InputError, printable
from identification.base.files import write_protected_too

HELP: dict[str, Any] = {"show_default": True, "help_option_names": ["-h", "--help"]}  # of every command
QUOTED = 80  # characters of a value in a sentence
WRITTEN = {"output", "page", "build", "responses", "record", "figure", "junit", "markdown"}
"""Options that name what a command writes."""
EXTRAS = {"bokeh": "explore"} | dict.fromkeys(("dask", "distributed", "pyarrow"), "campaign")
"""The extras of pyproject.toml by the modules that they install."""


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

    A command that writes takes ``--force`` too. Every help shows the defaults; ``-h`` is ``--help``.
    """

    def __init__(self, *args: Any, **attributes: Any) -> None:
        super().__init__(*args, **{"context_settings": HELP} | attributes)
        click.version_option(package_name="antiwindup-thesis")(self)

    def add_command(self, cmd: click.Command, name: str | None = None) -> None:
        cmd.context_settings = HELP | dict(cmd.context_settings)  # of a command that is asked without its group, too
        names = {param.name for param in cmd.params}
        if names & WRITTEN and "force" not in names:
            cmd.params.append(
                click.Option(
                    ["--force"],
                    is_flag=True,
                    is_eager=True,  # outputs are looked at as they are parsed
                    expose_value=False,
                    callback=_forced,
                    help="Replace write-protected files.",
                )
            )
        super().add_command(cmd, name)

    def invoke(self, ctx: click.Context) -> Any:
        import numpy as np  # which a command that only says its help needs not load

        atexit.register(gc.freeze)  # without it the interpreter sweeps all modules as it ends: a third of a second
        try:
            with np.errstate(over="raise"), warnings.catch_warnings(record=True) as held:  # a refusal is one sentence
                result = super().invoke(ctx)
            for each in held:
                warnings.warn_explicit(each.message, each.category, each.filename, each.lineno)
            return result
        except InputError as error:
            raise Refusal(plain(str(error))) from None
        except (ArithmeticError, np.linalg.LinAlgError) as error:
            raise Refusal(f"the given numbers are too large or too small to compute with ({error})") from None
        except MemoryError as error:
            asked = f" ({str(error)[:1].lower()}{str(error)[1:]})" if str(error) else ""
            raise Refusal(f"out of memory{asked}; expected less input, or a machine with more memory") from None
        except ModuleNotFoundError as error:
            if error.name not in EXTRAS:
                raise
            extra = f'pip install "antiwindup-thesis[{EXTRAS[error.name]}]"'
            raise Refusal(f"this command needs {error.name}, which is not installed; run {extra}") from None
        except OSError as error:
            raise Refusal(plain(f"the operating system refuses ({error})")) from None
        except click.ClickException as error:
            error.message = plain(error.message)  # type: ignore[misc]
            raise


def _forced(ctx: click.Context, _param: click.Parameter, is_asked: bool) -> None:
    if is_asked:
        ctx.find_root().with_resource(write_protected_too())  # which is left even where an option after it is refused


def plain(sentence: str) -> str:
    """A sentence for a terminal: characters that do not print as escapes, what is quoted cut at QUOTED characters."""
    return re.sub(rf"(?<!\w)'([^']{{{QUOTED}}})[^']+'(?!\w)", r"'\1...'", printable(sentence))
