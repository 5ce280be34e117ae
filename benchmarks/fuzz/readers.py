"""Commands that read one file and do nothing more: what costs least of the commands of the rooms."""

from __future__ import annotations

from pathlib import Path

import click

from design.design_file import read_design
from experiments.runs.reference_file import read_reference
from experiments.thesis.claims.coverage import read_record
from experiments.thesis.claims.ledger import read_ledger
from identification.base.axis_file import axis_text, read_axis
from identification.base.command_line import CommandGroup
from identification.base.path_types import INPUT
from identification.model.model_file import read_model
from identification.sweeps.read_sweeps import read_sweeps
from paper_figures.result_tables import read_table

FILE = click.argument("file", type=INPUT)


@click.group(cls=CommandGroup)
def main() -> None:
    """Read a file."""


@main.command("design")
@FILE
def design(file: Path) -> None:
    """A design.json, also as a notebook shows it; what it says is written again."""
    found = read_design(file)
    found.to_json()
    found._repr_html_()


@main.command("model")
@FILE
def model(file: Path) -> None:
    """A model.json, in the same way."""
    found = read_model(file)
    found.to_json()
    found._repr_html_()


@main.command("sweeps")
@FILE
def sweeps(file: Path) -> None:
    """Sweeps."""
    read_sweeps(file)


@main.command("table")
@FILE
def table(file: Path) -> None:
    """A table of results."""
    read_table(file)


@main.command("reference")
@FILE
def reference(file: Path) -> None:
    """A sampled reference."""
    read_reference(file)


@main.command("axis")
@FILE
def axis(file: Path) -> None:
    """An axis.toml; what it says is written again."""
    axis_text(read_axis(file), {})


@main.command("claims")
@FILE
def claims(file: Path) -> None:
    """The ledger."""
    read_ledger(file)


@main.command("coverage")
@FILE
def coverage(file: Path) -> None:
    """What was counted of the thesis's numbers."""
    read_record(file)
