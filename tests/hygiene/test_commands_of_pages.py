"""Every command line of a page is one that click takes: its options exist, and their values are of their types."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import click
import pytest

from antiwindup.__main__ import main

ROOT = Path(__file__).resolve().parents[2]
SHELL = re.compile(r"^```(?:sh|bash|console)\n(.*?)^```", flags=re.MULTILINE | re.DOTALL)
FILE = re.compile(r".+\.[a-z]\w*$")


def commands_of(page: Path) -> list[list[str]]:
    """The words of each command of ours in the blocks of a page that are a shell's, without the program's name."""
    found = []
    for block in SHELL.findall(page.read_text(encoding="utf-8")):
        for line in block.replace("\\\n", " ").splitlines():
            command = line.partition("||")[0].strip().removeprefix("$P -m ").removeprefix("python -m ")
            is_room = not line.strip().startswith(command)
            if is_room or command.startswith("antiwindup "):
                words = shlex.split(command, comments=True)
                found.append(words if is_room and words[0] != "antiwindup" else words[1:])
    return found


PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
COMMANDS = [
    pytest.param(words, id=f"{page.relative_to(ROOT).as_posix()}: {' '.join(words)}")
    for page in PAGES
    for words in commands_of(page)
]


def test_there_are_commands() -> None:
    assert len(COMMANDS) > 30


@pytest.mark.parametrize("words", COMMANDS)
def test_click_takes_the_command(words: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    for word in words:
        if FILE.fullmatch(word):
            (tmp_path / word).parent.mkdir(parents=True, exist_ok=True)
            (tmp_path / word).write_text(
                "rate = 2000\nlimit = 12\n" if word.endswith(".toml") else "", encoding="utf-8"
            )
    for folder in ("drive", "figures", "mine", "results", "tables"):
        (tmp_path / folder).mkdir(exist_ok=True)
    command: click.Command = main
    context = click.Context(main, info_name="antiwindup")
    while isinstance(command, click.Group):
        name, *words = words
        found = command.get_command(context, name)
        assert found is not None, name
        command = found
    command.make_context(command.name, words, parent=context)  # a mistake raises a UsageError, which says which
