"""One command line in a folder of its own: accepted, refused in a sentence, or a fault."""

from __future__ import annotations

import json
import math
import os
import re
import signal
import sys
import traceback
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from tempfile import TemporaryFile
from typing import Any
from xml.etree import ElementTree

import click

from benchmarks.fuzz.readers import main as readers
from identification.base.errors import printable_lines

ROOT = Path(__file__).resolve().parents[2]
LONGEST = 400  # characters of a sentence beside the longest argument, which it may quote
MOVED = ("antiwindup", "check")  # whose status 1 is an answer
ROOMS = ("identification", "design", "experiments", "paper_figures")


@dataclass(frozen=True)
class Outcome:
    """What became of a command line.

    Parameters
    ----------
    kind
        ``accepted``, ``refused`` or ``fault``.
    said
        The sentence of a refusal; what is wrong.
    place
        Of a fault: what tells it from others.
    """

    kind: str
    said: str = ""
    place: str = ""


class Slow(BaseException):
    """A command takes longer than it may."""


class Fault(Exception):
    """A command did what none may."""


def run(arguments: Sequence[str], folder: Path, seconds: float, again: bool = False) -> Outcome:
    """Run a command line in a folder and judge it.

    Parameters
    ----------
    arguments
        ``experiments``, ``simulate`` and so on; ``readers`` is the group of :mod:`benchmarks.fuzz.readers`.
    folder
        Its files; the command runs in it.
    seconds
        Beyond these it is a fault.
    again
        Whether an accepted one is run twice, and has to write the same bytes.
    """
    before = _content(folder)
    try:
        status, out, err = _ended(arguments, folder, seconds)
        after = _content(folder)
        if status == 2:
            _require_sentence(out, err, arguments)
            if after != before:
                raise Fault(f"refused, but wrote {_changed(before, after)}")
            return Outcome("refused", err.rpartition("Error: ")[2].strip())
        if status and not (status == 1 and tuple(arguments[:2]) == MOVED):
            raise Fault(f"status {status}: {err[-200:]}")
        if err.strip():
            raise Fault(f"accepted, but said {err[:200]!r}")
        unlimited = any(map(_is_extreme, arguments))  # as the limits are, so is what a table tells of them
        for path in _changed(before, after):
            _require_whole(Path(os.fsdecode(path)), unlimited)
        if again:
            _ended(arguments, folder, seconds)
            if _content(folder) != after:
                raise Fault(f"a second run wrote other bytes: {_changed(after, _content(folder))}")
        return Outcome("accepted", out)
    except Fault as error:
        return Outcome("fault", str(error), re.sub(r"[\d.]+|'.*'|b'.*|/\S+", "#", str(error))[:80])
    except (Exception, Slow) as error:
        frames = [each for each in traceback.extract_tb(error.__traceback__) if _of_ours(each.filename)]
        last = f"{Path(frames[-1].filename).name}:{frames[-1].name}" if frames else ""
        said = "".join(traceback.format_exception(error)[-12:])
        return Outcome("fault", said, f"{type(error).__name__} in {last}")


def _ended(arguments: Sequence[str], folder: Path, seconds: float) -> tuple[int, str, str]:
    """Exit status and what was said on both streams, by the libraries too."""
    room, *rest = arguments
    group = readers if room == "readers" else import_module(f"{room}.__main__").main
    here = Path.cwd()
    os.chdir(folder)
    try:
        with _captured() as said, _within(seconds), warnings.catch_warnings(record=True) as warned:
            warnings.simplefilter("always")
            status = _status(group, rest, room)
    finally:
        os.chdir(here)
    out, err = said
    return status, out, "".join(f"{each.category.__name__}: {each.message}\n" for each in warned) + err


def _status(group: click.Group, arguments: Sequence[str], room: str) -> int:
    try:
        group.main(list(arguments), prog_name=f"python -m {room}")
    except SystemExit as end:
        return end.code if isinstance(end.code, int) else 0
    return 0


@contextmanager
def _captured() -> Iterator[list[str]]:
    """What is written to standard output and standard error, by Python or not, once the block has ended."""
    said: list[str] = []
    sys.stdout.flush()
    sys.stderr.flush()
    with TemporaryFile() as out, TemporaryFile() as err:
        kept = os.dup(1), os.dup(2)
        try:
            for number, file in ((1, out), (2, err)):
                os.dup2(file.fileno(), number)
            with (
                open(1, "w", encoding="utf-8", errors="backslashreplace", closefd=False) as texts,
                open(2, "w", encoding="utf-8", errors="backslashreplace", closefd=False) as errors,
                redirect_stdout(texts),
                redirect_stderr(errors),
            ):
                yield said
        finally:
            for number, copy in zip((1, 2), kept, strict=True):
                os.dup2(copy, number)
                os.close(copy)
            for file in (out, err):
                file.seek(0)
                said.append(file.read().decode("utf-8", "backslashreplace"))


@contextmanager
def _within(seconds: float) -> Iterator[None]:
    def late(number: int, frame: Any) -> None:
        raise Slow(f"takes longer than {seconds:g} s")

    before = signal.signal(signal.SIGALRM, late)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)


def _require_sentence(out: str, err: str, arguments: Sequence[str]) -> None:
    """Nothing but click's usage and one sentence that may be printed anywhere."""
    usage, _, sentence = err.rpartition("Error: ")
    if out or (usage and not usage.startswith("Usage: ")):
        raise Fault(f"refused, but said {(out + usage)[:200]!r}")
    if not sentence.strip() or not _is_printable(err):
        raise Fault(f"refused by what is no printable sentence: {err[:200]!r}")
    if "\n" in sentence.strip():
        raise Fault(f"refused in several lines: {sentence[:200]!r}")
    if len(sentence) > LONGEST + max(map(len, arguments)):
        raise Fault(f"refused by {len(sentence)} characters: {sentence[:200]!r}")


def _require_whole(path: Path, unlimited: bool) -> None:
    """A file that was written can be read, and holds no infinite number."""
    content = path.read_bytes()
    if path.name.startswith(".partial"):
        raise Fault(f"left {path.name}")
    if not content:
        raise Fault(f"wrote an empty {path.suffix}")
    if path.suffix == ".json" and content.startswith(b"{"):
        json.loads(content, parse_constant=_refuse, parse_float=_finite)
    elif path.suffix in (".svg", ".xml"):
        ElementTree.fromstring(content)
    elif path.suffix == ".csv" and not unlimited and re.search(rb"(^|,)-?(inf|nan)", content):
        raise Fault("wrote a number that is not finite")
    elif path.suffix == ".txt" and not _is_printable(content.decode("utf-8")):
        raise Fault("wrote a text that is not printable")


def _is_extreme(argument: str) -> bool:
    try:
        return abs(float(argument.rpartition("=")[2])) > 1e300
    except ValueError:
        return False


def _refuse(name: str) -> float:
    raise Fault(f"wrote {name}")


def _finite(text: str) -> float:
    return float(text) if math.isfinite(float(text)) else _refuse(text)


def _is_printable(text: str) -> bool:
    return printable_lines(text) == text


def _content(folder: Path) -> dict[bytes, bytes]:
    """The regular files below a folder; names as bytes, which they are."""
    found = {}
    for where, _, names in os.walk(os.fsencode(folder)):
        for path in (os.path.join(where, name) for name in names):  # noqa: PTH118
            if os.path.isfile(path) and not os.path.islink(path):  # noqa: PTH113, PTH114
                with open(path, "rb") as file:  # noqa: PTH123
                    found[path] = file.read()
    return found


def _changed(before: dict[bytes, bytes], after: dict[bytes, bytes]) -> list[bytes]:
    return sorted(path for path in before.keys() | after.keys() if before.get(path) != after.get(path))


def _of_ours(file: str) -> bool:
    return any(Path(file).is_relative_to(ROOT / room) for room in ROOMS)
