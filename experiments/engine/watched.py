"""Compiled loops that can be watched and stopped: they run beside the thread that waits for them.

Compiled code does not answer Ctrl-C, and numba does not stand the exception that is raised as it returns: in Python's
first thread, which signals are for, a compiled loop would end in a crash of the interpreter.
"""

from __future__ import annotations

import os
import signal
import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from concurrent.futures import wait as wait_for
from contextvars import copy_context
from typing import TypeVar

import numpy as np

STOP, REACHED = 0, 1  # of a watch: whether to stop, and how far the loop is
EVERY_S = 0.1  # how often a waiting thread looks

_idle: list[ThreadPoolExecutor] = []  # a new thread would have all its memory to fetch, which takes 5 % of a run
if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_idle.clear)  # a thread is not forked with its process

Result = TypeVar("Result")
Tick = Callable[[float], object]


class Stopped(Exception):
    """A loop was stopped; whoever stopped it does not wait for its result."""


def watch() -> np.ndarray:
    """Two numbers that a loop reads and writes once a step, STOP and REACHED; shape (2,)."""
    return np.zeros(2)


def watched(loop: Callable[[np.ndarray], Result], tick: Tick | None = None) -> Result:
    """The result of a loop that can be interrupted and tells how far it is.

    Parameters
    ----------
    loop
        Called with a :func:`watch`; ends soon after its STOP is not 0. Numba's lock on compilation it may hold longer.
    tick
        Called some times a second, in this thread, with what REACHED has grown by.
    """
    state = watch()
    is_first = threading.current_thread() is threading.main_thread()
    if tick is None and not (is_first and signal.getsignal(signal.SIGINT) != signal.SIG_IGN):
        return loop(state)
    told, pool = 0.0, _idle.pop() if _idle else ThreadPoolExecutor(1)
    running = pool.submit(copy_context().run, loop, state)  # with what numpy raises here
    try:
        while not wait_for([running], EVERY_S).done:
            if tick is not None and state[REACHED] > told:
                tick(state[REACHED] - told)
                told = state[REACHED]
        return running.result()
    finally:
        state[STOP] = 1.0
        if running.done():
            _idle.append(pool)
        else:
            pool.shutdown(wait=False)
