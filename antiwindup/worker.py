"""Commands of the rooms, each in a process of its own, forked from one that has the packages loaded already."""

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
from identification.base.process import begin, leave_signals_to_parent, undisturbed

PACKAGES = [
    "flint",
    "jinja2",
    "matplotlib.backends.backend_pdf",
    "matplotlib.backends.backend_svg",
    "matplotlib.figure",
    "numba",
    "pandas",
    "scipy.optimize",
    "scipy.signal",
    "scipy.stats",
    "tqdm",
]
"""What takes long to import."""


def prepare() -> None:
    """Begin to load the packages, in the process from which the others are forked, while this one does something else.

    Where that process cannot begin, :func:`start` says why.
    """
    os.environ["PYTHONSAFEPATH"] = "1"  # the processes import nothing from the folder that they happen to run in
    if "forkserver" in multiprocessing.get_all_start_methods():
        multiprocessing.get_context("forkserver").set_forkserver_preload(PACKAGES)
        with undisturbed, suppress(OSError):
            ensure_running()


def start(command: Sequence[str], log: Path, journal: Path) -> BaseProcess:
    """Start ``antiwindup COMMAND...``; what it prints goes to a file. When this process ends, so does that one.

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
    prepare()
    has_server = "forkserver" in multiprocessing.get_all_start_methods()
    context = multiprocessing.get_context("forkserver") if has_server else multiprocessing.get_context("spawn")
    process: BaseProcess = context.Process(target=_run, args=(tuple(command), str(log), journal))
    try:
        with undisturbed:
            process.start()
    except (EOFError, OSError) as error:
        wanted = "packages that load in this folder, and the files and the memory that they need"
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
