"""The command ``axis``: what an engineer said of an axis, and what was chosen for the rest, each with its reason."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from design.choices import GUARANTEES
from experiments.options import reference_options
from experiments.pair_options import NumberPair, PairCommand
from identification.base.axis_file import KEYS
from identification.base.axis_option import AXIS
from identification.base.command_line import together
from identification.base.path_types import OUTPUT_FOLDER

axis_options = together(
    AXIS,
    click.option("--reference-hz", type=float, multiple=True, help=KEYS["reference-hz"].comment),
    reference_options,
    click.option("--limit", type=NumberPair(), metavar="[LOW] HIGH", help=KEYS["limit"].comment),
    *(
        click.option(f"--{name}", type=float, help=KEYS[name].comment)
        for name in ("rate-limit", "rate", "quantum", "robust-level", "recovery")
    ),
    click.option("--guarantee", type=click.Choice(GUARANTEES), help=KEYS["guarantee"].comment),
)
"""What is said of an axis, but for the names of its signals, which the model has."""


def given_keys(options: dict[str, Any]) -> dict[str, Any]:
    """Options of an axis by their keys, those that were given; raises InputError where a value is none of its kind."""
    named = {name.replace("_", "-"): value for name, value in options.items() if value not in (None, ())}
    return {name: KEYS[name].read(value, f"--{name}") for name, value in named.items()}


@click.command("axis", cls=PairCommand)
@click.argument("model")
@axis_options
@click.option("--output", type=OUTPUT_FOLDER, required=True, help="Existing folder to write to.")
def axis_command(model: str, output: Path, **options: Any) -> None:
    """Choose what your axis.toml leaves open.

    The command writes axis.toml for MODEL, which other commands read with --axis, and axis.csv with the reason of
    each choice. Without a reference it chooses one that the plant can follow with 80 % of the limits.
    """
    import os

    from design.asked_model import asked_model
    from experiments.chosen_axis import as_table, choose_axis
    from experiments.tables import csv_writer
    from identification.base.axis_file import axis_text
    from identification.base.files import Content, write_whole

    given = given_keys(options)
    axis = choose_axis(asked_model(model), given)
    values = {name: setting.value for name, setting in axis.items()}
    if "reference" in values:
        values["reference"] = os.path.relpath(values["reference"], output)
    notes = {name: f"CHOSEN: {setting.why}." for name, setting in axis.items() if setting.why}
    inputs = [Path(given["reference"])] if "reference" in given else []
    contents: dict[Path, Content] = {
        output / "axis.toml": axis_text(values, notes),
        output / "axis.csv": csv_writer(as_table(axis)),
    }
    write_whole(contents, inputs=[Path(model), *inputs])
    click.echo(f"-> {output / 'axis.toml'}")
    for name, setting in axis.items():
        if setting.why:
            click.echo(f"  {name} = {as_table({name: setting})['value'][0]}: {setting.why}")
