"""Compiled loops that can be watched and stopped: they run beside the thread that waits for them.

Compiled code does not answer Ctrl-C, and numba does not stand the exception that is raised as it returns: in Python's
first thread, which signals are for, a compiled loop would end in a crash of the interpreter.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from concurrent.futures import wait as wait_for
from contextvars import copy_context
from typing import TypeVar

import numpy as np

STOP, REACHED = 0, 1  # of a watch: whether to stop, and how far the loop is
EVERY_S = 0.1  # how often a waiting thread looks

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
    if tick is None and threading.current_thread() is not threading.main_thread():
        return loop(state)
    told, pool = 0.0, ThreadPoolExecutor(1)
    try:
        running = pool.submit(copy_context().run, loop, state)  # with what numpy raises here
        while not wait_for([running], EVERY_S).done:
            if tick is not None and state[REACHED] > told:
                tick(state[REACHED] - told)
                told = state[REACHED]
        return running.result()
    finally:
        state[STOP] = 1.0
        pool.shutdown(wait=False)
