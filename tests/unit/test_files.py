"""Outputs appear whole or not at all, beside and instead of nothing that is not theirs."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from identification.base.errors import InputError
from identification.base.files import write_protected_too, write_whole
from identification.base.partial_files import remove_partials


def write(*paths: Path, content: str = "new") -> None:
    write_whole({path: lambda partial: partial.write_text(content) for path in paths})


def test_a_write_protected_output_is_replaced_on_request_only(tmp_path: Path) -> None:
    first, target = tmp_path / "first.txt", tmp_path / "kept.txt"
    target.write_text("old")
    target.chmod(0o444)
    with pytest.raises(InputError, match=r"kept\.txt: is write-protected"):
        write(first, target)
    assert {path.name: path.read_text() for path in tmp_path.iterdir()} == {"kept.txt": "old"}
    with write_protected_too():
        write(target)
    assert target.read_text() == "new"


@pytest.mark.parametrize(
    "name", ["x" * 300, "loop/a.txt", "loop", "missing/a.txt", "file/a.txt", "folder"], ids=lambda name: name[:9]
)
def test_where_nothing_can_be_written_one_sentence_says_so_and_nothing_is(tmp_path: Path, name: str) -> None:
    (tmp_path / "loop").symlink_to("loop")
    (tmp_path / "file").touch()
    (tmp_path / "folder").mkdir()
    before = sorted(tmp_path.rglob("*"))
    with pytest.raises(InputError, match="cannot be written") as refusal:
        write(tmp_path / "other.txt", tmp_path / name)
    assert len(str(refusal.value).splitlines()) == 1
    assert sorted(tmp_path.rglob("*")) == before


def test_what_a_killed_process_had_begun_goes_with_the_next_file_written_there(tmp_path: Path) -> None:
    kill = f"""
import os, sys
from pathlib import Path
from identification.base.files import write_whole
def die(path):
    path.write_text("half")
    os.kill(os.getpid(), 9)
write_whole({{Path({str(tmp_path / "a.txt")!r}): die}})
"""
    subprocess.run([sys.executable, "-c", kill], check=False)
    (abandoned,) = tmp_path.iterdir()
    others = [tmp_path / ".partial-mine.txt", tmp_path / re.sub(r"-[0-9a-f]{8}-", "-00000000-", abandoned.name)]
    alive = tmp_path / abandoned.name.replace(abandoned.name.split("-")[2], str(os.getppid()))
    for path in (*others, alive):
        path.touch()
    write(tmp_path / "b.txt")
    assert set(tmp_path.iterdir()) == {*others, alive, tmp_path / "b.txt"}


def test_what_this_process_has_begun_can_be_removed_at_any_time(tmp_path: Path) -> None:
    seen = []

    def interrupted(path: Path) -> None:
        seen.append(path.exists())
        remove_partials()
        seen.append(path.exists())
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        write_whole({tmp_path / "a.txt": interrupted})
    assert seen == [True, False]
    assert list(tmp_path.iterdir()) == []
