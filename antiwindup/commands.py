"""The commands of a build: refit for a plant of the user's, figures and report for the thesis.

Each command imports what it runs, so that a command line answers at once.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from dataclasses import replace
from math import inf
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
from click.core import ParameterSource

from experiments.axis_command import axis_options, given_keys
from experiments.pair_options import PairCommand
from identification.__main__ import fit_options, reading_options, signal_options
from identification.base.axis_file import KEYS, require_consistent
from identification.base.axis_option import words_of
from identification.base.command_line import together
from identification.base.errors import InputError, shown
from identification.base.files import require_readable, true_path

if TYPE_CHECKING:
    from antiwindup.steps import Asked, Step

SWEEPS = click.argument("sweeps", metavar="SWEEP...", nargs=-1, required=True)
LIMIT = click.option("--limit", type=float, help="Use the saturation limits +-LIMIT instead of the thesis's.")
MODEL = click.option(
    "--model",
    help="Draw for this plant instead of a fit of SWEEP: a model.json, or table or implied (the thesis's sets).",
)
build_options = together(
    click.option("--output", required=True, help="The folder to write to."),
    click.option(
        "--plants",
        type=click.IntRange(1),
        default=200,
        help="Number of random plants drawn within the bound W_a (Fig. A.6).",
    ),
    click.option(
        "--jobs", type=click.IntRange(1), help="Number of steps that run at once. Default: one for each processor."
    ),
    click.option(
        "--force", is_flag=True, help="Replace any file in the place of an output, even one that you wrote or changed."
    ),
    reading_options,
    fit_options,
)
"""What every build takes."""


@click.command("refit", cls=PairCommand)
@SWEEPS
@axis_options
@signal_options
@build_options
def refit(sweeps: tuple[str, ...], **options: Any) -> None:
    """Go from SWEEP files to a tested design.

    The command fits the files, designs a controller for your axis, simulates it, draws the results and sums them up.

    Write what you know of the axis into the file of --axis, which `antiwindup new` makes, or give options of the same
    names. Without a reference the command chooses one that the plant can follow with 80 % of the limits.

    A second run repeats only the steps whose inputs have changed. No file of yours is replaced or removed. When a
    design or a simulation refuses the plant, only the steps that need it are left out.
    """
    from antiwindup.refit_steps import refit_steps

    of_axis = {name: options.pop(name) for name in list(options) if name.replace("_", "-") in KEYS}
    given = given_keys({name: value for name, value in of_axis.items() if _is_given(name)})
    require_consistent(given)
    names = {name: value for name, value in given.items() if name.endswith(("-name", "-unit"))}
    axis = tuple(words_of({name: value for name, value in given.items() if name not in names}))
    files = tuple(Path(given[name]) for name in ("reference",) if name in given)
    for path in files:
        require_readable(path)
    asked, how = _asked(sweeps, None, **options)
    asked = replace(asked, fit=(*asked.fit, *words_of(names)), axis=axis, axis_files=files)
    steps = refit_steps(asked)
    _build(asked, steps, steps, goes_on=True, **how)


@click.command("figures")
@SWEEPS
@MODEL
@click.option(
    "--only", metavar="FIGURE", multiple=True, help="Draw only this figure, for example fig_2_01. Default: all."
)
@LIMIT
@build_options
def figures(sweeps: tuple[str, ...], model: str | None, only: tuple[str, ...], **options: Any) -> None:
    """Draw all figures from SWEEP files.

    They are the figures of the thesis and our own, A.1 to A.9.
    """
    from antiwindup.thesis_steps import report_steps, thesis_steps

    asked, how = _asked(sweeps, model, **options)
    steps = thesis_steps(asked)
    names = [step.name for step in steps if step.command[:2] == ("paper_figures", "draw")]
    if unknown := set(only) - set(names):
        raise InputError(f"--only is {min(unknown)!r}; expected one of {', '.join(names)}")
    wanted = [step for step in steps if step.name in only] if only else steps
    _build(asked, [*steps, *report_steps(asked, steps)], wanted, goes_on=False, **how)


@click.command("report")
@SWEEPS
@MODEL
@LIMIT
@build_options
def report(sweeps: tuple[str, ...], model: str | None, **options: Any) -> None:
    """Write one HTML page on the thesis.

    It has the figures with their data, every verdict on the thesis, the fit and the audits.
    """
    from antiwindup.thesis_steps import report_steps, thesis_steps

    asked, how = _asked(sweeps, model, **options)
    steps = thesis_steps(asked)
    steps += report_steps(asked, steps)
    _build(asked, steps, steps, goes_on=False, **how)


def _asked(
    sweeps: tuple[str, ...],
    model: str | None,
    output: str,
    plants: int,
    jobs: int | None,
    force: bool,
    limit: float | None = None,
    **fit: Any,
) -> tuple[Asked, dict[str, Any]]:
    """What a build is for, with files that are there; and how it is run."""
    from antiwindup.steps import Asked
    from identification.sweeps.input_files import input_files

    if not output or true_path(Path(output)) == Path(true_path(Path(output)).anchor):
        raise InputError(f"--output is {shown(output)}; expected a folder that holds nothing but the outputs")
    if limit is not None and not 0 < limit < inf:
        raise InputError(f"--limit is {limit:g}; expected a positive number")
    for name in (*sweeps, *([model] if model else ()), output):
        if "\n" in name:
            raise InputError(f"{shown(name)}: holds a line break; expected a name of one line")
    given = {name: value for name, value in fit.items() if _is_given(name)}
    words = [word for name, value in given.items() for word in _words(name, value)]
    files = tuple(input_files(sweeps))
    asked = Asked(Path(output), model, sweeps, files, fit=tuple(words), limit=limit, plants=plants)
    for path in asked.sweep_files:
        require_readable(path)
    if model is not None:
        from design.asked_model import asked_model

        asked_model(model)
    return asked, {"jobs": jobs or os.cpu_count() or 1, "force": force}


def _is_given(name: str) -> bool:
    """Whether an option of this command stands on the command line or in the file of --axis."""
    source = click.get_current_context().get_parameter_source(name)
    return source in (ParameterSource.COMMANDLINE, ParameterSource.DEFAULT_MAP)


def _words(name: str, value: object) -> list[str]:
    """An option of the fit as a command line has it: a flag, auto, counts of zeros and poles, pairs, or as it is."""
    option = f"--{name.replace('_', '-')}"
    if isinstance(value, bool):
        return [option] if value else []
    if isinstance(value, dict):
        return [option, ",".join(f"{theirs}={ours}" for theirs, ours in value.items())]
    if name == "band":
        return [option, *map(str, value)]  # type: ignore[call-overload]
    if isinstance(value, tuple):
        return [option, "/".join(map(str, value))]
    return [option, "auto" if value is None else str(value)]


def _build(asked: Asked, steps: Sequence[Step], wanted: Sequence[Step], goes_on: bool, jobs: int, force: bool) -> None:
    """Run what a build lacks and say what came out."""
    from tqdm import tqdm

    from antiwindup.build import Build, Crash
    from antiwindup.code_files import keep

    inputs = (*asked.sweep_files, *(asked.model_files if asked.model else ()), *asked.axis_files)
    build = Build(asked.folder, steps, inputs, wanted, goes_on, jobs, force)
    with tqdm(bar_format="{desc}", disable=None, leave=False) as bar:

        def tell(ended: int, running: Sequence[str]) -> None:
            bar.set_description_str(f"step {ended + 1} of {build.runs}: {', '.join(running)}")

        try:
            build.run(tell)
        except Crash as crash:
            bar.close()
            click.echo(str(crash), err=True)
            sys.exit(1)
    keep()
    click.echo(build.printed.get("fit", ""), nl=False)
    for name, sentence in build.refused.items():
        click.echo(f"{name} was refused: {sentence}")
    ran = len(build.printed)
    click.echo(f"{ran} step{' was' if ran == 1 else 's were'} run, {len(build.refused)} refused -> {asked.folder}")
