"""The console command ``antiwindup``: builds, and the commands of every room, imported when one is asked for."""

from __future__ import annotations

if __name__ == "__main__":
    from identification.base.process import begin

    begin()

from importlib import import_module

import click

from identification.base.command_line import CommandGroup

COMMANDS = {"new": "new_command"} | dict.fromkeys(("refit", "figures", "report"), "commands")
COMMANDS |= {name: f"{name}_command" for name in ("export", "check", "explore")}
"""Command of this package -> its module."""
ROOMS = ("identification", "design", "experiments", "paper_figures")


class Rooms(CommandGroup):
    """The commands of this package, and the groups of the rooms, each under its room's name and with its first line."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        return [*COMMANDS, *ROOMS]

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        if cmd_name in ROOMS:
            found: click.Command = import_module(f"{cmd_name}.__main__").main
        elif cmd_name in COMMANDS:
            found = getattr(import_module(f"antiwindup.{COMMANDS[cmd_name]}"), cmd_name)
            self.add_command(found)  # with --force where it writes
        else:
            return None
        return found

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        own = {name: self.get_command(ctx, name) for name in COMMANDS}
        with formatter.section("From the bench to the drive"):
            formatter.write_dl([(name, each.get_short_help_str()) for name, each in own.items() if each])
        with formatter.section("Step by step"):
            formatter.write_dl([(room, str(import_module(room).__doc__).splitlines()[0]) for room in ROOMS])


@click.group(cls=Rooms)
def main() -> None:
    """Go from sine sweeps of a plant with dead time to its anti-windup: model, design, saturated loop, figures."""


if __name__ == "__main__":
    main(prog_name="python -m antiwindup")
