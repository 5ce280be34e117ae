"""closed_loop.c compiled by the machine's C compiler for one loop, whose equations are written into it."""

from __future__ import annotations

import ctypes
import shutil
import subprocess
import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np

from experiments.engine.compiled_loop import CompiledLoop, compile_loop
from experiments.engine.saturated_loop import SaturatedLoop
from experiments.engine.step_table import Rows

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
    ready = compile_loop(loop)
    n, k, watched = len(ready.x0), len(ready.delays), len(ready.reads)
    folder = Path(tempfile.mkdtemp())
    (folder / "loop.h").write_text(straight_code(ready))
    library = folder / "closed_loop.so"
    source = Path(__file__).with_name("closed_loop.c")
    into = ["-shared", "-fPIC", f"-I{folder}", "-o", library, source, "-lm"]
    subprocess.run([compiler, *FLAGS, *REASSOCIATE, *into], check=True)
    integrate = ctypes.CDLL(str(library)).integrate
    shutil.rmtree(folder)

    samples = np.ascontiguousarray(time_s - ready.lags[:, None])
    groups = ready.groups.astype(np.int64)
    influence = np.ascontiguousarray(ready.tables.influence[:2, : 1 + k, :n])
    values, events = np.zeros((1 + watched, len(time_s))), np.zeros(MOST_EVENTS)

    def at(array: np.ndarray) -> ctypes.c_void_p:
        return array.ctypes.data_as(ctypes.c_void_p)  # keeps the array

    arguments = [
        *(at(part) for part in (influence, ready.delays, ready.x0)),
        *(ctypes.c_double(number) for number in (-limit, limit, time_s[-1], ready.step)),
        *(at(samples), at(groups), len(samples), len(time_s), MOST_EVENTS, ROOM, at(values), at(events)),
    ]

    def run() -> np.ndarray:
        if integrate(*arguments) < 0:
            raise RuntimeError("the C program gave up: the loop diverges, or has more events than there is room for")
        return np.asarray(ready.reading @ values[1:])

    return run


def straight_code(loop: CompiledLoop) -> str:
    """The header loop.h: sizes, and what the C program computes term by term, entry by entry.

    A row of the loop without saturation that B enters is written with u in the place of m, where that is shorter.
    """
    n, k, watched = len(loop.x0), len(loop.delays), len(loop.reads)
    signals = loop.tables.magnitudes.shape[1]
    free, limited = np.split(_dense(loop.rows, n + 1 + k)[: 2 * (n + signals)], 2)
    most = loop.tables.polynomials.shape[1] // signals - 1
    lines = [f"#define {name} {value}" for name, value in (("N", n), ("K", k), ("WATCHED", watched), ("MOST", most))]
    for mode, rows in enumerate((free, limited)):
        rates = []
        for r in range(n):
            by_m = limited[r].copy()
            by_m[n] = 0.0
            behind_u = mode == 0 and limited[r, n] != 0 and np.count_nonzero(by_m) + 1 < np.count_nonzero(rows[r])
            text = f"{_sum(by_m)} + {float(limited[r, n])!r} * s[0]" if behind_u else _sum(rows[r])
            rates.append(f"f[{r}] = h * ({text});")
        parts = {
            f"rate_{mode}(const double *restrict v, const double *restrict s, double h, double *restrict f)": rates,
            f"signals_{mode}(const double *restrict v, double *restrict s)": [
                f"s[{i}] = {_sum(rows[n + i])};" for i in range(1 + k)
            ],
            f"watched_{mode}(const double *restrict v, double *restrict s)": [
                f"s[{i}] = {_sum(rows[n + signal])};" for i, signal in enumerate(loop.reads)
            ],
        }
        lines += [f"static inline void {head} {{ {' '.join(body)} }}" for head, body in parts.items()]
    return "\n".join(lines) + "\n"


def _dense(rows: Rows, columns: int) -> np.ndarray:
    dense = np.zeros((len(rows.indptr) - 1, columns))
    for r in range(len(dense)):
        entries = slice(int(rows.indptr[r]), int(rows.indptr[r + 1]))
        dense[r, rows.indices[entries]] = rows.data[entries]
    return dense


def _sum(row: np.ndarray) -> str:
    return " + ".join(f"{float(row[c])!r} * v[{c}]" for c in np.flatnonzero(row)) or "0.0"
