"""Commands of the rooms, each in a process of its own, which loads what it needs or is forked from one that has it."""

from __future__ import annotations

import multiprocessing
import os
import sys
import threading
from collections.abc import Sequence
from contextlib import suppress
from multiprocessing.forkserver import ensure_running
from multiprocessing.process import BaseProcess
from pathlib import Path

from identification.base.errors import InputError
from identification.base.files import keep_journal
from identification.base.process import begin, leave_signals_to_parent, own_surroundings, undisturbed

_server = "forkserver" if "forkserver" in multiprocessing.get_all_start_methods() else None
_is_loading = False


def load_ahead() -> None:
    """Begin to load :mod:`antiwindup.preloaded`, once, in a process that the commands from then on are forked from.

    Where that process cannot begin, :func:`start` says why.
    """
    global _is_loading
    if _server is None or _is_loading:
        return
    _is_loading = True
    multiprocessing.get_context("forkserver").set_forkserver_preload(["antiwindup.preloaded"])
    with undisturbed, own_surroundings(), suppress(OSError):
        ensure_running()


def start(command: Sequence[str], log: Path, journal: Path) -> BaseProcess:
    """Start ``antiwindup COMMAND...``; what it prints goes to a file. When this process ends, so does that one.

    Before :func:`load_ahead` was called it is a process that loads what it needs, which is what a single one takes
    least time for.

    Parameters
    ----------
    command
        The room and what stands after it on a command line; no shell reads it.
    log
        An existing file.
    journal
        Where it notes the files that it writes, see :func:`identification.base.files.keep_journal`.

    Raises
    ------
    InputError
        No process can be started.
    """
    context = multiprocessing.get_context(_server if _is_loading else "spawn")
    process: BaseProcess = context.Process(target=_run, args=(tuple(command), str(log), journal))  # type: ignore[attr-defined]
    try:
        with undisturbed, own_surroundings():
            process.start()
    except (EOFError, OSError) as error:
        wanted = "packages that load in this folder, and enough memory and open files for them"
        raise InputError(f"no process can be started ({error}); expected {wanted}") from None
    return process


def _run(command: Sequence[str], log: str, journal: Path) -> None:
    parent = multiprocessing.parent_process()
    assert parent is not None
    threading.Thread(target=_end_after, args=(parent,), daemon=True).start()
    descriptor = os.open(log, os.O_WRONLY | os.O_APPEND)
    for stream in (1, 2):
        os.dup2(descriptor, stream)
    os.close(descriptor)
    leave_signals_to_parent()
    begin()
    keep_journal(journal)
    from antiwindup.__main__ import main

    sys.argv = ["antiwindup", *command]
    main(list(command), prog_name="antiwindup")


def _end_after(parent: BaseProcess) -> None:
    parent.join()
    os.kill(os.getpid(), 15)
