"""What holds of every command: -h, --version, defaults in its help, and one name for one thing."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from importlib.metadata import version

import click
import pytest
from click.testing import CliRunner

from antiwindup.__main__ import main

SAME = {"--force", "--output", "--build", "--plants", "--seed", "--limit"}
"""Options of one name whose types may differ: a builder's and a room's, a file or a folder, one pair or several."""


def every_command(group: click.Group, words: tuple[str, ...] = ()) -> Iterator[tuple[tuple[str, ...], click.Command]]:
    context = click.Context(group)
    for name in group.list_commands(context):
        command = group.get_command(context, name)
        assert command is not None
        if isinstance(command, click.Group):
            yield from every_command(command, (*words, name))
        else:
            yield (*words, name), command


COMMANDS = dict(every_command(main))


@pytest.mark.parametrize("words", COMMANDS, ids=" ".join)
def test_its_help_shows_every_default(words: tuple[str, ...]) -> None:
    """A default that the help does not show is one that enters silently."""
    shown = CliRunner().invoke(main, [*words, "-h"])
    assert shown.exit_code == 0, shown.output
    text = " ".join(shown.output.split())
    for option in (each for each in COMMANDS[words].params if isinstance(each, click.Option)):
        assert option.help, option.name
        default = option.to_info_dict()["default"]
        if isinstance(default, str | int | float) and not isinstance(default, bool) and default != "":
            assert f"[default: {default}" in text or f"default: {default}]" in text, option.name


@pytest.mark.parametrize("words", COMMANDS, ids=" ".join)
def test_the_list_of_commands_shows_its_whole_first_sentence(words: tuple[str, ...]) -> None:
    """click cuts what is longer than 45 characters, and ends it in three dots."""
    assert not COMMANDS[words].get_short_help_str().endswith("...")


@pytest.mark.parametrize("group", [(), ("identification",), ("design",), ("experiments", "thesis"), ("paper_figures",)])
def test_every_group_says_its_version(group: tuple[str, ...]) -> None:
    assert CliRunner().invoke(main, [*group, "--version"]).output.endswith(f"version {version('antiwindup-thesis')}\n")


def test_an_option_is_the_same_in_every_command() -> None:
    found: dict[str, set[tuple[str, bool, int]]] = {}
    for command in COMMANDS.values():
        for option in (each for each in command.params if isinstance(each, click.Option)):
            kind = (option.type.name, option.multiple, option.nargs)
            for name in option.opts:
                found.setdefault(name, set()).add(kind)
    several = {name: kinds for name, kinds in found.items() if len(kinds) > 1 and name not in SAME}
    assert not several
    assert not {"--period", "--slew"} & set(found)


def test_a_shell_completes_commands_and_options() -> None:
    """As click documents it; what a command prints passes through a buffer of ours, which takes bytes too."""
    asked = {"COMP_WORDS": "antiwindup design extended --reference-", "COMP_CWORD": "3"}
    environment = os.environ | asked | {"_ANTIWINDUP_COMPLETE": "bash_complete"}
    run = [sys.executable, "-c", "import sys, antiwindup; sys.argv = ['antiwindup']; antiwindup.main()"]
    said = subprocess.run(run, env=environment, capture_output=True, text=True, check=False)
    assert (said.stdout, said.stderr) == ("plain,--reference-hz\nplain,--reference-omega\n", "")
