"""A controller as a co-simulation unit by FMI 2.0: its C code, wrapped, compiled for this machine, and described."""

from __future__ import annotations

import platform
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from hashlib import sha256
from io import BytesIO
from pathlib import Path
from typing import NamedTuple
from zipfile import ZIP_DEFLATED, ZipFile, ZipInfo

from experiments.export import c_code
from experiments.export.check_run import CheckRun
from experiments.export.controller import SampledController
from experiments.export.templates import templates
from identification.base.errors import InputError
from identification.base.partial_files import partial_file

FLAGS = ("-std=c99", "-O2", "-ffp-contract=off", "-shared", "-fPIC")
LIBRARIES = {"linux": ("linux", ".so"), "darwin": ("darwin", ".dylib"), "win32": ("win", ".dll")}
SAID = 200  # characters of what a compiler says
LONG_AGO = (1980, 1, 1, 0, 0, 0)  # the same files give the same archive


class _Variable(NamedTuple):
    """A variable as the description lists it, in the order of the values in the wrapper."""

    name: str
    causality: str
    unit: str
    description: str


def files(controller: SampledController, run: CheckRun) -> dict[str, str | bytes]:
    """The files by their names: NAME.fmu and NAME_test.csv.

    Parameters
    ----------
    controller, run
        As :func:`experiments.export.c_code.files` takes them.

    Raises
    ------
    InputError
        There is no C compiler named cc, it refuses the code, or FMI names no such machine.
    """
    name, signals = controller.name, controller.signals
    written = c_code.files(controller, run)
    own = {file: written[file] for file in (f"{name}.h", f"{name}.c")}
    given, seen = c_code.names(signals)
    content = {
        "c": controller,
        "guid": sha256("".join(own.values()).encode()).hexdigest(),
        "input": given,
        "sources": [f"{name}.c", f"{name}_fmu.c"],
        "units": sorted({signals.input_unit, signals.output_unit} - {""}),
        "variables": [
            _Variable(f"reference_{seen}", "input", signals.output_unit, f"reference of {signals.output_name}"),
            _Variable(f"measured_{seen}", "input", signals.output_unit, f"measured {signals.output_name}"),
            _Variable(f"command_{given}", "output", signals.input_unit, f"{signals.input_name} within the limits"),
            _Variable(f"unsaturated_{given}", "output", signals.input_unit, f"{signals.input_name} before the limits"),
            _Variable("invalid", "output", "", "samples in a row that were not finite"),
        ],
    }
    environment = templates(number=repr)
    sources = own | {f"{name}_fmu.c": environment.get_template("fmu.c.j2").render(content)}
    system, suffix = _machine()
    archive = {
        "modelDescription.xml": environment.get_template("fmu.xml.j2").render(content).encode(),
        f"binaries/{system}/{name}{suffix}": _compiled(sources, suffix),
        **{f"sources/{file}": text.encode() for file, text in sources.items()},
    }
    return {f"{name}.fmu": _zipped(archive), f"{name}_test.csv": written[f"{name}_test.csv"]}


def _machine() -> tuple[str, str]:
    """FMI's name of this machine, and how its libraries' names end."""
    bits = {"x86_64": "64", "amd64": "64"}.get(platform.machine().lower())
    if bits is None or sys.platform not in LIBRARIES:
        raise InputError(f"FMI 2.0 has no name for a {platform.machine()} with {sys.platform}; expected --to c")
    system, suffix = LIBRARIES[sys.platform]
    return system + bits, suffix


def _compiled(sources: Mapping[str, str], suffix: str) -> bytes:
    """The library of the sources; raises InputError where there is no compiler, or it refuses them."""
    compiler = shutil.which("cc")
    if compiler is None:
        raise InputError("found no C compiler named cc, which a unit needs; expected one, or --to c")
    header = next(text for file, text in sources.items() if file.endswith(".h"))
    own = [re.sub('#include ".*"', "", text) for file, text in sources.items() if file.endswith(".c")]
    with partial_file(Path(tempfile.gettempdir()), suffix) as library:
        made = subprocess.run(
            [compiler, *FLAGS, "-x", "c", "-", "-o", library],
            input="\n".join([header, *own]), capture_output=True, text=True, check=False,
        )  # fmt: skip
        if made.returncode:
            raise InputError(f"{compiler} refuses the code: {' '.join(made.stderr.split())[:SAID]}")
        return library.read_bytes()


def _zipped(content: Mapping[str, bytes]) -> bytes:
    with BytesIO() as stream:
        with ZipFile(stream, "w", ZIP_DEFLATED) as archive:
            for name, data in content.items():
                archive.writestr(ZipInfo(name, LONG_AGO), data, ZIP_DEFLATED)
        return stream.getvalue()
