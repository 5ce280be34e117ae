"""The command ``export``: the controller of a design for the computer that is to run it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path

import click

from experiments.options import ANTI_WINDUP, DESIGN, LIMIT_PAIR, asked_limits
from experiments.pair_options import PairCommand
from identification.base.axis_option import AXIS
from identification.base.errors import InputError
from identification.base.path_types import OUTPUT_FOLDER

TARGETS = ("c", "matlab", "python", "json", "simulink", "fmu")


@click.command("export", cls=PairCommand)
@DESIGN
@AXIS
@click.option("--rate", type=float, required=True, help="Sampling rate of the controller in Hz.")
@click.option("--to", type=click.Choice(TARGETS), required=True, help="Format to write.")
@LIMIT_PAIR
@ANTI_WINDUP
@click.option(
    "--method",
    help="Discretisation method: matched, tustin or exact. Default: the one that `sampled` chooses.",
)
@click.option(
    "--precision",
    type=click.Choice(["double", "float"]),
    default="double",
    help="Floating-point type of all numbers in the C code (with --to c).",
)
@click.option(
    "--name", default="controller", help="Name of the files and of the functions and types in them; letters and digits."
)
@click.option("--output", type=OUTPUT_FOLDER, required=True, help="Existing folder to write the files to.")
def export(
    design: Path,
    rate: float,
    to: str,
    limit: tuple[float, ...],
    anti_windup: str,
    method: str | None,
    precision: str,
    name: str,
    output: Path,
) -> None:
    """Write DESIGN's controller as code or data.

    The controller includes the anti-windup and the limits. The files for matlab, simulink and python also hold the
    plant. NAME_test.csv beside them is a run of `sampled`, with which the commands of the written controller agree.
    """
    from design.design_file import read_design
    from experiments.drive.choose_method import choose_method
    from experiments.drive.sampled_loop import METHODS, Drive
    from experiments.export import c_code, fmu, json_file, matlab, python_file, simulink
    from experiments.export.check_run import check_run
    from experiments.export.controller import sampled_controller
    from experiments.export.names import require_name
    from identification.base.files import write_whole

    if precision != "double" and to != "c":
        raise InputError(f"--precision {precision} belongs to --to c; found --to {to}")
    require_name(name)
    drive = Drive(rate, method or METHODS[0], asked_limits(limit))
    content = read_design(design)
    linear, judgement = choose_method(content, drive, method)
    if not linear.stable:
        raise InputError(judgement)
    controller = sampled_controller(content, anti_windup, drive.limits, rate, linear.method, name)
    run, plant = check_run(content, controller), content.loop_plant
    given = (controller, run)
    writers: dict[str, Callable[[], Mapping[str, str | bytes]]] = {
        "c": lambda: c_code.files(*given, precision),
        "matlab": lambda: matlab.files(*given, plant),
        "python": lambda: python_file.files(*given, plant),
        "json": lambda: json_file.files(*given),
        "simulink": lambda: simulink.files(*given, plant),
        "fmu": lambda: fmu.files(*given),
    }
    files = writers[to]()
    write_whole({output / file: written for file, written in files.items()}, [design])
    tested = "" if run.saturates else "; the run of its test does not saturate"
    click.echo(f"{judgement}. {controller.promise}{tested}; {', '.join(files)} -> {output}")
