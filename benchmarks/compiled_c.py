"""closed_loop.c compiled by the machine's C compiler, and called with what the engine's own integrator takes."""

from __future__ import annotations

import ctypes
import shutil
import subprocess
import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np

from experiments.engine.compiled_loop import compile_loop
from experiments.engine.saturated_loop import SaturatedLoop

FLAGS = ["-std=c11", "-O3", "-march=native", "-funroll-loops"]
REASSOCIATE = ["-fno-math-errno", "-fno-trapping-math", "-fno-signed-zeros", "-fassociative-math"]  # as the engine may
MOST_EVENTS, ROOM = 4096, 256


def c_run(loop: SaturatedLoop, limit: float, time_s: np.ndarray) -> Callable[[], np.ndarray]:
    """The outputs of a loop, (outputs, s), by the C program; compiling and the tables are not in a call.

    Raises
    ------
    RuntimeError
        No C compiler, or more events than there is room for.
    """
    compiler = shutil.which("cc") or shutil.which("gcc")
    if compiler is None:
        raise RuntimeError("found no C compiler; expected cc or gcc")
    folder = Path(tempfile.mkdtemp())
    library = folder / "closed_loop.so"
    source = Path(__file__).with_name("closed_loop.c")
    subprocess.run([compiler, *FLAGS, *REASSOCIATE, "-shared", "-fPIC", "-o", library, source, "-lm"], check=True)
    integrate = ctypes.CDLL(str(library)).integrate
    shutil.rmtree(folder)

    ready = compile_loop(loop)
    n, k, watched = len(ready.x0), len(ready.delays), ready.reading.shape[1]
    tables = ready.tables
    most, wide = tables.polynomials.shape[1] // (1 + k + watched) - 1, tables.increments.shape[2]
    samples = np.ascontiguousarray(time_s - ready.lags[:, None])
    groups = ready.groups.astype(np.int64)
    values, events = np.zeros((1 + watched, len(time_s))), np.zeros(MOST_EVENTS)

    def at(array: np.ndarray) -> ctypes.c_void_p:
        return array.ctypes.data_as(ctypes.c_void_p)  # keeps the array

    arguments = [
        *(at(part) for part in (*ready.unsaturated, *ready.saturated, *tables)),
        *(n, k, watched, most, wide),
        *(at(part) for part in (ready.delays, ready.x0)),
        *(ctypes.c_double(number) for number in (-limit, limit, time_s[-1], ready.step)),
        *(at(samples), at(groups), len(samples), len(time_s), MOST_EVENTS, ROOM, at(values), at(events)),
    ]

    def run() -> np.ndarray:
        if integrate(*arguments) < 0:
            raise RuntimeError("the C program gave up: the loop diverges, or has more events than there is room for")
        return np.asarray(ready.reading @ values[1:])

    return run
