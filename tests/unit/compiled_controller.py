"""An exported controller compiled by the machine's C compiler, and called sample by sample."""

from __future__ import annotations

import ctypes
import os
import shutil
import subprocess
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest

WARNINGS = ["-Wall", "-Wextra", "-Wconversion", "-Wshadow", "-Wdouble-promotion", "-Wvla", "-pedantic", "-Werror"]
FLAGS = ["-std=c99", "-O2", "-ffp-contract=off", *WARNINGS]
SANITIZED = ["-fsanitize=undefined,address", "-fno-sanitize-recover=all"]
TRAPPED = ["-fsanitize=undefined", "-fsanitize-undefined-trap-on-error", "-shared", "-fPIC"]


def compiler() -> str:
    found = shutil.which("gcc") or shutil.which("cc")
    if found is None:
        assert "CI" not in os.environ, "found no C compiler; expected gcc or cc"
        pytest.skip("no C compiler")
    return found


def self_test(files: Mapping[str, str], name: str, folder: Path) -> str:
    """What the program that comes with the code prints, under sanitizers; its status is 0."""
    _write(files, folder)
    sources = [f"{name}.c", f"{name}_test.c"]
    subprocess.run([compiler(), *FLAGS, *SANITIZED, *sources, "-o", "tested"], cwd=folder, check=True)
    return subprocess.run([folder / "tested"], check=True, capture_output=True, text=True).stdout


class Compiled:
    """``NAME_step`` and ``NAME_start`` on one state, at rest at first; undefined behaviour ends the process."""

    def __init__(self, files: Mapping[str, str], name: str, folder: Path, number: type = ctypes.c_double) -> None:
        _write(files, folder)
        declared = f'#include "{name}.h"\nint size_of(void);\n'
        (folder / "size.c").write_text(f"{declared}int size_of(void) {{ return (int)sizeof({name}_state); }}\n")
        library = folder / "lib.so"
        subprocess.run([compiler(), *FLAGS, *TRAPPED, f"{name}.c", "size.c", "-o", library], cwd=folder, check=True)
        calls = ctypes.CDLL(str(library))
        self._step, self._start, self._init = (getattr(calls, f"{name}_{each}") for each in ("step", "start", "init"))
        self._step.restype = number
        self._step.argtypes = [ctypes.c_void_p, number, number]
        self._start.argtypes = [ctypes.c_void_p, number, number, number]
        self._init.argtypes = [ctypes.c_void_p]
        self.state = ctypes.create_string_buffer(calls.size_of())
        self._number = number
        self.rest()

    def rest(self) -> None:
        self._init(self.state)

    def step(self, reference: float, measurement: float) -> float:
        return float(self._step(self.state, reference, measurement))

    def start(self, reference: float, measurement: float, applied: float) -> int:
        return int(self._start(self.state, reference, measurement, applied))

    @property
    def logged(self) -> tuple[float, int]:
        """The control before the limits, and the number of samples in a row that were not finite."""
        width = ctypes.sizeof(self._number)  # the last three of the structure, the count with room behind it
        tail = self.state.raw[-3 * width :]
        control = np.frombuffer(tail[:width], np.float32 if width == 4 else np.float64)
        return float(control[0]), int(np.frombuffer(tail[2 * width : 2 * width + 4], np.uint32)[0])


def _write(files: Mapping[str, str], folder: Path) -> None:
    for name, text in files.items():
        (folder / name).write_text(text, encoding="utf-8")
