"""The process of a command: what is settled before anything slow is imported, and how it ends when it is told to.

It imports nothing of the project and little of Python, so that a signal is answered from the first millisecond on.
"""

from __future__ import annotations

import faulthandler
import os
import signal
import sys
import threading
import time
import warnings
from contextlib import contextmanager

TYPE_CHECKING = False  # of typing, which takes longer to import than all of this
if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from typing import Any

SIGNALS = tuple(getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name))
THREADS = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")
KILLED = 128  # a status is that and the signal's number, as a shell gives it
LONGEST_END_S = 0.1  # that a process has to end the processes that it began
NOTHING_LOST = "no file is half written"

undisturbed = threading.Lock()  # held while a process or a file begins, until it is listed, and while files get names
_left = NOTHING_LOST


def begin() -> None:
    """Settle, once and first of all, what holds for the whole process of a command.

    Signals end it as :func:`end` says, but for those that are ignored, as under nohup. The matrix library has one
    thread, whatever the environment says, since the last digits of its results depend on their number. Caches go
    where they can be written. What libraries print or warn of is not shown: a command says itself what there is.
    """
    for number in SIGNALS:
        if signal.getsignal(number) != signal.SIG_IGN:
            signal.signal(number, end)
    os.environ.update(dict.fromkeys(THREADS, "1"))
    os.environ["MPLBACKEND"] = "agg"  # no figure has a window
    if not sys.warnoptions:
        warnings.simplefilter("ignore")
        os.environ.setdefault("PYTHONWARNINGS", "ignore")  # of the processes that it begins
    _own_streams()
    _writable_homes()


@contextmanager
def own_surroundings() -> Iterator[None]:
    """Processes that begin meanwhile import this package from where this one did, and nothing from their folder.

    A fork server is not told by Python 3.11 where this process imports from. Their matrix library has one thread.
    """
    before = {name: os.environ.get(name) for name in (*THREADS, "PYTHONSAFEPATH", "PYTHONPATH")}
    root = __file__.rsplit(os.sep, 3)[0]
    others = (path for path in (before["PYTHONPATH"] or "").split(os.pathsep) if path not in ("", root))
    os.environ.update(dict.fromkeys(THREADS, "1"), PYTHONSAFEPATH="1", PYTHONPATH=os.pathsep.join([root, *others]))
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value


def leaves(sentence: str) -> None:
    """Set what :func:`end` says of the files that a command leaves behind."""
    global _left
    _left = sentence


def end(number: int, _frame: object = None) -> None:
    """End the process: no half-written file, no process that it began, one line, and the status 128 + ``number``."""
    try:
        for each in SIGNALS:
            signal.signal(each, signal.SIG_IGN)
        undisturbed.acquire(timeout=0.1)
        _end_children()
        _loaded("identification.base.partial_files", "remove_partials", list)()
    finally:
        try:
            clear = "\r\x1b[K" if sys.stderr.isatty() else ""
            os.write(sys.stderr.fileno(), f"{clear}Interrupted; {_left}.\n".encode(errors="backslashreplace"))
        finally:
            os._exit(KILLED + number)


def _end_children() -> None:
    """End the processes that this one began: those that can, by themselves, since they may have files to remove."""
    children = _loaded("multiprocessing", "active_children", list)()
    for child in children:
        child.terminate()
    patience_s = LONGEST_END_S if _loaded("multiprocessing", "parent_process", list)() is None else LONGEST_END_S / 2
    until = time.monotonic() + patience_s
    for child in children:
        child.join(max(until - time.monotonic(), 0.0))
        child.kill()
    server = getattr(sys.modules.get("multiprocessing.forkserver"), "_forkserver", None)  # told of nowhere
    if (number := getattr(server, "_forkserver_pid", None)) is not None:
        os.kill(number, signal.SIGKILL)


def _loaded(module: str, function: str, otherwise: Callable[[], Any]) -> Callable[[], Any]:
    """A function of a module, if that is imported, and far enough."""
    found: Callable[[], Any] = getattr(sys.modules.get(module), function, otherwise)
    return found


def done() -> None:
    """Take no more signals: the work is done and said, and Python, as it ends, would be killed as if it were not."""
    for number in SIGNALS:
        signal.signal(number, signal.SIG_IGN)


def leave_signals_to_parent() -> None:
    """In a process that a command began: leave to the command what a terminal sends to both; SIGTERM ends this one."""
    for number in SIGNALS:
        if number != signal.SIGTERM:
            signal.signal(number, signal.SIG_IGN)
    if hasattr(signal, "pthread_sigmask"):
        signal.pthread_sigmask(signal.SIG_UNBLOCK, SIGNALS)


def in_thread(work: Callable[[], None], waiting: Callable[[threading.Thread], None]) -> None:
    """Do the work of a command in a thread; Python answers signals in the first one, which has nothing else to do.

    There it could answer none while compiled code of numba or another library runs, and what numba compiled does not
    stand an exception at its end.

    Parameters
    ----------
    work
        What it raises is raised here.
    waiting
        Called with the thread, returns when that has ended or earlier.
    """
    raised: list[BaseException] = []

    def guarded() -> None:
        if hasattr(signal, "pthread_sigmask"):  # processes that it begins leave Ctrl-C to this one, from the start
            signal.pthread_sigmask(signal.SIG_BLOCK, SIGNALS)
        try:
            work()
        except BaseException as error:
            raised.append(error)

    thread = threading.Thread(target=guarded, daemon=True)
    thread.start()
    waiting(thread)
    thread.join()
    if raised:
        raise raised[0]


def _own_streams() -> None:
    """Keep standard output and error for what Python writes; what C writes to them, as LAPACK does, goes nowhere."""
    nowhere = os.open(os.devnull, os.O_RDWR)
    while nowhere < 3:  # a standard stream is closed, and a file must not be taken for it
        nowhere = os.dup(nowhere)
    for number, name, buffering in ((1, "stdout", -1), (2, "stderr", 1)):
        encoding = getattr(getattr(sys, name), "encoding", "utf-8")
        setattr(sys, name, os.fdopen(os.dup(number), "w", buffering, encoding, "backslashreplace"))
        if not faulthandler.is_enabled():  # which whoever looks for a fault has asked to write there
            os.dup2(nowhere, number)


def _writable_homes() -> None:
    """Let caches and settings of libraries go below the temporary folder where the user's home cannot be written to."""
    barred = {}
    for name, home in (("XDG_CACHE_HOME", "~/.cache"), ("XDG_CONFIG_HOME", "~/.config")):
        place = folder = os.path.expanduser(os.environ.get(name) or home)  # noqa: PTH111
        while not os.path.lexists(place) and place != os.path.dirname(place):  # noqa: PTH120
            place = os.path.dirname(place)  # noqa: PTH120
        if not (os.path.isdir(place) and os.access(place, os.W_OK | os.X_OK)):  # noqa: PTH112
            barred[name] = folder
    if not barred:
        return
    from identification.base.cache_folders import temporary_cache

    if (instead := temporary_cache()) is not None:
        kept, is_new = instead
        os.environ.update(dict.fromkeys(barred, str(kept)))
        if is_new:
            sys.stderr.write(f"{', '.join(barred.values())} cannot be written to; caches are kept in {kept}\n")
