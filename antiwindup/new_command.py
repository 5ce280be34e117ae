"""The command ``new``: an axis.toml to fill in."""

from __future__ import annotations

from pathlib import Path

import click

from identification.base.axis_file import axis_text
from identification.base.errors import InputError
from identification.base.files import is_there, require_writable, write_whole


@click.command("new")
@click.argument("path", metavar="[FILE]", type=click.Path(path_type=Path), default=Path("axis.toml"))
@click.option("--force", is_flag=True, help="Replace an existing file.")
def new(path: Path, force: bool) -> None:
    """Write an axis file for you to fill in.

    FILE (default axis.toml) holds the names, units, reference, limits and computer of your axis. Every line is a
    comment at first. `refit` and the other commands read the file with --axis.
    """
    if not force and is_there(path):
        raise InputError(f"{path}: exists already; expected another name, or --force")
    require_writable(path)
    write_whole({path: axis_text({}, {})})
    click.echo(f"-> {path}: remove the # from the lines that you fill in")
