"""The console command ``antiwindup``: the commands of every room, of which a room's are imported when one is asked."""

from __future__ import annotations

from identification.base.process import begin

begin()

from importlib import import_module

import click

from identification.base.console import Console

ROOMS = ("identification", "design", "experiments", "paper_figures")


class Rooms(Console):
    """The groups of the rooms, each under its room's name and with the first line of its room's docstring."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(ROOMS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        if cmd_name not in ROOMS:
            return None
        group: click.Command = import_module(f"{cmd_name}.__main__").main
        return group

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        with formatter.section("Commands"):
            formatter.write_dl([(room, str(import_module(room).__doc__).splitlines()[0]) for room in ROOMS])


@click.group(cls=Rooms)
@click.version_option(package_name="antiwindup-thesis")
def main() -> None:
    """From sine sweeps of a plant with dead time to its anti-windup: models, designs, saturated loops, figures."""


if __name__ == "__main__":
    main(prog_name="python -m antiwindup")
