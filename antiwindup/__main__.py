"""The console command ``antiwindup``: builds, and the commands of every room, imported when one is asked for."""

from __future__ import annotations

if __name__ == "__main__":
    from identification.base.process import begin

    begin()

from importlib import import_module

import click

from identification.base.command_line import CommandGroup

BUILDS = ("refit", "figures", "report")
ROOMS = ("identification", "design", "experiments", "paper_figures")


class Rooms(CommandGroup):
    """The builds, and the groups of the rooms, each under its room's name and with its room's first line."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        return [*BUILDS, *ROOMS]

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        if cmd_name in ROOMS:
            found: click.Command = import_module(f"{cmd_name}.__main__").main
        elif cmd_name in BUILDS:
            found = getattr(import_module("antiwindup.commands"), cmd_name)
        else:
            return None
        return found

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        with formatter.section("Builds"):
            formatter.write_dl([(name, self.get_command(ctx, name).get_short_help_str(90)) for name in BUILDS])  # type: ignore[union-attr]
        with formatter.section("Commands"):
            formatter.write_dl([(room, str(import_module(room).__doc__).splitlines()[0]) for room in ROOMS])


@click.group(cls=Rooms)
def main() -> None:
    """From sine sweeps of a plant with dead time to its anti-windup: models, designs, saturated loops, figures."""


if __name__ == "__main__":
    main(prog_name="python -m antiwindup")
