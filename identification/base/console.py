"""A click group as the command of a process: it can be interrupted, shows that it works, prints once it is done."""

from __future__ import annotations

import io
import os
import signal
import sys
from contextlib import redirect_stdout, suppress
from threading import Thread
from typing import Any, NoReturn

import click

from identification.base import process
from identification.base.errors import printable_lines

PATIENCE_S = 2.0  # before a terminal is told that a command still works,
EVERY_S = 0.5  # and how often


class Console(click.Group):
    """A group that, called as a function, is the command of this process, and ends it.

    What the command prints appears when it is done, so that there is nothing of a command that was refused or
    interrupted; control characters, which may come from names, appear as escapes. Where standard output takes none of
    it the status is 1, or as of SIGPIPE where its reader has left.
    """

    def __call__(self, *args: Any, **kwargs: Any) -> NoReturn:
        printed = io.TextIOWrapper(io.BytesIO(), "utf-8", "surrogatepass", newline="", write_through=True)
        status: Any = 0

        def work() -> None:
            nonlocal status
            with redirect_stdout(printed):
                status = self.main(*args, **kwargs, standalone_mode=False) or 0  # type: ignore[call-overload]

        try:
            process.in_thread(work, _show_that_it_works)
        except SystemExit as error:
            status = error.code
        except click.ClickException as error:
            status = error.exit_code
            with suppress(OSError):  # nobody is told, but by the status
                error.show()
        _print(printable_lines(printed.buffer.getvalue().decode("utf-8", "surrogatepass")))
        _flush_errors(status)
        process.done()
        sys.exit(status)


def _show_that_it_works(thread: Thread) -> None:
    """On a terminal, the time that a command takes, unless a bar of its own is there."""
    if not sys.stderr.isatty():
        return
    thread.join(PATIENCE_S)
    if not thread.is_alive():
        return
    from tqdm import tqdm

    with tqdm(desc="at work", bar_format="{desc}: {elapsed}", leave=False, delay=1e-9) as bar:  # not shown yet
        bar.start_t -= PATIENCE_S
        while thread.is_alive():
            (bar.refresh if list(tqdm._instances) == [bar] else bar.clear)()  # type: ignore[attr-defined]
            thread.join(EVERY_S)


def _print(text: str) -> None:
    try:
        sys.stdout.write(text)
        sys.stdout.flush()
    except BrokenPipeError:
        os._exit(process.KILLED + signal.SIGPIPE)
    except OSError as error:
        with suppress(OSError):
            click.echo(f"Error: standard output cannot be written to ({error.strerror})", err=True)
        os._exit(1)


def _flush_errors(status: int) -> None:
    """Python would say at its end that standard error takes nothing, with a status of its own."""
    try:
        sys.stderr.flush()
    except OSError:
        os._exit(status)
