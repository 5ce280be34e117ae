"""Locks: one writer at a time, named to the others; nothing stays behind, whatever ends the writer."""

from __future__ import annotations

import fcntl
import os
import platform
import subprocess
import sys
from collections.abc import Callable
from contextlib import AbstractContextManager
from errno import ENOSYS
from pathlib import Path

import pytest

from identification.base.errors import InputError
from identification.base.folder_lock import locked_file, locked_folder

ROOT = Path(__file__).resolve().parents[2]
HOLD = """
import sys, time
from pathlib import Path
from identification.base import folder_lock
with getattr(folder_lock, sys.argv[1])(Path(sys.argv[2])):
    print("held", flush=True)
    time.sleep(60)
"""
Lock = Callable[[Path], AbstractContextManager[None]]
BOTH = pytest.mark.parametrize("lock", [locked_file, locked_folder])


@BOTH
def test_another_process_is_named_and_its_end_frees_the_lock(lock: Lock, tmp_path: Path) -> None:
    target = tmp_path / "out"
    command = [sys.executable, "-c", HOLD, lock.__name__, str(target)]
    with subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, text=True) as other:
        assert other.stdout is not None
        assert other.stdout.readline() == "held\n"
        (tmp_path / "link").symlink_to(target)
        said = f"process {other.pid} on {platform.node()} is writing it; wait until that ends"
        for name in ("out", "link"):
            with pytest.raises(InputError, match=said), lock(tmp_path / name):
                pass
        other.kill()
    with lock(target):
        pass
    assert not list(tmp_path.rglob(".*"))


@BOTH
def test_a_lock_is_held_within_and_leaves_nothing(lock: Lock, tmp_path: Path) -> None:
    target = tmp_path / "out"
    with lock(target):
        holder = next(path for path in tmp_path.rglob(".*lock"))
        assert holder.read_text(encoding="utf-8").split() == [str(os.getpid()), platform.node()]
        with pytest.raises(InputError, match=f"process {os.getpid()} on"), lock(target):
            pass
    assert not list(tmp_path.iterdir())
    with pytest.raises(ZeroDivisionError), lock(target):
        raise ZeroDivisionError
    assert not list(tmp_path.iterdir())


def test_a_folder_is_made_and_stays_only_with_something_in_it(tmp_path: Path) -> None:
    folder = tmp_path / "a" / "b"
    with locked_folder(folder):
        (folder / "result.csv").touch()
    assert [path.name for path in folder.iterdir()] == ["result.csv"]
    (folder / "result.csv").unlink()
    with locked_folder(folder):
        pass
    assert folder.is_dir()  # which was there before


def test_what_a_killed_process_left_names_nobody(tmp_path: Path) -> None:
    """Its number may be another process's by now."""
    (tmp_path / ".out.csv.lock").write_text(f"{os.getppid()}\n{platform.node()}\n", encoding="utf-8")
    with locked_file(tmp_path / "out.csv"):
        pass
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("text", ["", "12"])
def test_a_lock_that_says_nothing_is_another_processs(text: str, tmp_path: Path) -> None:
    with locked_file(tmp_path / "out.csv"):
        (tmp_path / ".out.csv.lock").write_text(text, encoding="utf-8")
        with pytest.raises(InputError, match=": another process is"), locked_file(tmp_path / "out.csv"):
            pass


def test_a_file_system_without_locks(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def missing(*_: object) -> None:
        raise OSError(ENOSYS, os.strerror(ENOSYS))

    monkeypatch.setattr(fcntl, "flock", missing)
    with (
        pytest.warns(UserWarning, match="flock not supported"),
        locked_file(tmp_path / "out.csv"),
        pytest.raises(InputError, match=f"process {os.getpid()} on"),
        locked_file(tmp_path / "out.csv"),
    ):
        pass
    assert not list(tmp_path.iterdir())


@BOTH
def test_where_nothing_can_be_written(lock: Lock, tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    for target in (tmp_path / "file" / "out", tmp_path / ("x" * 300)):
        with pytest.raises(InputError, match=r"cannot be (made|written) \(|: no such folder"), lock(target):
            pass
    assert [path.name for path in tmp_path.iterdir()] == ["file"]


def test_a_link_that_leads_nowhere_is_no_folder(tmp_path: Path) -> None:
    (tmp_path / "loop").symlink_to(tmp_path / "loop")
    with pytest.raises(InputError, match=r"loop: cannot be made \("), locked_folder(tmp_path / "loop"):
        pass


def test_a_file_in_no_folder_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="nowhere: no such folder"), locked_file(tmp_path / "nowhere" / "out.csv"):
        pass
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("make", [lambda path: path.write_text("precious"), lambda path: path.mkdir(), os.mkfifo])
def test_what_is_no_lock_is_refused_and_left(tmp_path: Path, make: Callable[[Path], object]) -> None:
    own = tmp_path / ".antiwindup.lock"
    make(own)
    before = own.lstat()
    with (
        pytest.raises(InputError, match=r"\.antiwindup\.lock: is not a lock file of this project"),
        locked_folder(tmp_path),
    ):
        pass
    assert (own.lstat().st_ino, own.lstat().st_size) == (before.st_ino, before.st_size)
