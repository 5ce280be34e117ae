"""The commands that run one design once: ``simulate`` in continuous time, ``sampled`` with a computer and a drive."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import click

from experiments.options import (
    ANTI_WINDUP,
    DESIGN,
    LIMIT_PAIR,
    asked_limits,
    disturbance_options,
    drive_options,
    reference_options,
)
from experiments.pair_options import PairCommand
from experiments.tables import csv_writer
from identification.base.axis_option import AXIS
from identification.base.command_line import together
from identification.base.errors import InputError
from identification.base.files import require_writable, write_whole
from identification.base.path_types import FIGURE_FILE, OUTPUT_FILE

MOST_ROWS = 1e7
SHARE = "{desc}: {percentage:3.0f}%|{bar}| {elapsed}<{remaining}"  # of a run, in a bar

_run_options = together(
    DESIGN,
    AXIS,
    LIMIT_PAIR,
    ANTI_WINDUP,
    click.option("--until", type=float, required=True, help="Length of the run in seconds."),
    reference_options,
    disturbance_options,
    click.option(
        "--rate-limit",
        type=float,
        default=math.inf,
        help="Largest change of the actuator's output per second, in its unit. The controller does not know it.",
    ),
    click.option(
        "--plant", help="True plant of the loop: a model.json, table or implied. Default: the design's own model."
    ),
    click.option("--output", type=OUTPUT_FILE, required=True, help="The CSV file to write."),
    click.option("--figure", type=FIGURE_FILE, help="Draw the run to this file: .pdf, .svg or .png."),
)


@click.command("simulate", cls=PairCommand)
@_run_options
@click.option("--sample-time", type=float, required=True, help="Time between two rows of the output, in seconds.")
@click.option(
    "--alpha",
    type=float,
    help="Coefficient of theta1~, Eq. (2.23), instead of the design's (with --anti-windup thesis).",
)
@click.option(
    "--beta",
    type=float,
    help="Coefficient of theta1~, Eq. (2.23), instead of the design's (with --anti-windup thesis).",
)
@click.option(
    "--gamma",
    type=float,
    help="Coefficient of theta1~, Eq. (2.23), instead of the design's (with --anti-windup thesis).",
)
def simulate_command(
    design: Path,
    limit: tuple[float, ...],
    anti_windup: str,
    until: float,
    sample_time: float,
    rate_limit: float,
    alpha: float | None,
    beta: float | None,
    gamma: float | None,
    plant: str | None,
    input_disturbance: Sequence[tuple[float, ...]],
    output_disturbance: Sequence[tuple[float, ...]],
    noise: tuple[float, float] | None,
    seed: int | None,
    output: Path,
    figure: Path | None,
    **reference: Any,
) -> None:
    """Run DESIGN from rest in continuous time.

    The columns are time_s, reference, output, error, control and saturated_control; with --noise also measured.
    """
    import numpy as np
    import pandas as pd
    from tqdm import tqdm

    from design.anti_windup.compensator import second_order
    from design.asked_model import asked_model
    from design.design_file import read_design
    from experiments.asked_disturbances import disturbances_of
    from experiments.asked_reference import reference_of
    from experiments.engine.simulate import simulate
    from experiments.runs.design_loop import design_loop
    from experiments.runs.disturbances import UNDISTURBED
    from experiments.runs.guarantee import guarantee
    from experiments.runs.metrics import last_saturation
    from experiments.runs.region import require_short, require_within_region
    from experiments.runs.sector_promise import judge_run

    limits = asked_limits(limit)
    if not 0 < sample_time <= until < math.inf:
        raise InputError(
            f"--until is {until:.12g} and --sample-time {sample_time:.12g}; expected 0 < sample time <= until < inf"
        )
    _require_few_rows(until / sample_time)
    numbers = {name: value for name, value in (("alpha", alpha), ("beta", beta), ("gamma", gamma)) if value is not None}
    if numbers and anti_windup != "thesis":
        raise InputError(f"--{next(iter(numbers))} belongs to --anti-windup thesis; found --anti-windup {anti_windup}")
    inputs = _inputs(design, plant, reference["reference"])
    require_writable(output, *([] if figure is None else [figure]), inputs=inputs)
    content = read_design(design)
    kind = content.chosen(anti_windup)
    if numbers:
        thesis = content.thesis
        kind = second_order(**{"alpha": thesis.alpha, "beta": thesis.beta, "gamma": thesis.gamma} | numbers)
    # the quotient of two decimals may come out a rounding below a whole number
    time_s = sample_time * np.arange(int(until / sample_time * (1 + 1e-12)) + 1)
    asked = reference_of(content, **reference)
    disturbances = disturbances_of(until, input_disturbance, output_disturbance, noise, seed)
    true = None if plant is None else asked_model(plant).plant
    require_within_region(true or content.loop_plant, asked, limits)
    require_short(true or content.loop_plant, until)
    loop = design_loop(content, asked, kind, true, disturbances)
    with tqdm(total=until, desc="simulate", bar_format=SHARE, disable=None, leave=False) as bar:
        run = simulate(loop, limits, time_s, bar.update, rate_limit)
    table = pd.DataFrame(
        {
            "time_s": run.time_s,
            "reference": run.outputs["reference"],
            "output": run.outputs["output"],
            "error": run.outputs["error"],
            "control": run.control,
            "saturated_control": run.saturated_control,
        }
        | ({"measured": run.outputs["measured"]} if noise else {})
    )
    saturated = last_saturation(run)
    never = not len(run.events_s) and not np.isnan(saturated)
    promised = ""
    if kind is not None and not never:
        promised = _unpromised(disturbances != UNDISTURBED, slow=bool(np.any(np.abs(run.modes) > 1)))
    if kind is not None and not never and not promised:
        given = guarantee(content, kind, true)
        promised = str(judge_run(given, loop, limits, run, asked, true or content.loop_plant))
    writers = {output: csv_writer(table)}
    if figure is not None:
        from paper_figures.look.plot_run import plot_run
        from paper_figures.look.style import figure_writer

        writers[figure] = figure_writer(plot_run({anti_windup: run}, limits, content.signals))
    write_whole(writers, inputs)
    beyond, crossings = ("saturated", "crossings of the limits")
    if math.isfinite(rate_limit):
        beyond, crossings = ("saturated or slewing", "beginnings and ends of saturation or slewing")
    said = f"{beyond} to the end" if np.isnan(saturated) else f"last {beyond} at {saturated:.6g} s"
    if never:
        said = f"never {beyond}"
    click.echo(_first(promised, f"{len(table)} rows -> {output}; {len(run.events_s)} {crossings}, {said}"))


@click.command("sampled", cls=PairCommand)
@_run_options
@click.option("--rate", type=float, required=True, help="Sampling rate of the controller in Hz.")
@click.option(
    "--method",
    help=(
        "Discretisation method: matched, tustin or exact. Default: among those with a stable linear "
        "loop, the one with the least steady error."
    ),
)
@drive_options
@click.option(
    "--form",
    default="coprime",
    help="Realisation of the controller: coprime (no hidden modes) or thesis (as drawn in Fig. 2.6).",
)
@click.option(
    "--resolution",
    type=float,
    default=0.0,
    help="Resolution of the computer's numbers, in the actuator's unit; 0 for double precision.",
)
def sampled_command(
    design: Path,
    limit: tuple[float, ...],
    anti_windup: str,
    until: float,
    rate: float,
    method: str | None,
    quantum: float,
    rate_limit: float,
    input_delay: float,
    form: str,
    resolution: float,
    plant: str | None,
    input_disturbance: Sequence[tuple[float, ...]],
    output_disturbance: Sequence[tuple[float, ...]],
    noise: tuple[float, float] | None,
    seed: int | None,
    output: Path,
    figure: Path | None,
    **reference: Any,
) -> None:
    """Run DESIGN's controller on a computer.

    The actuator may have levels, a rate limit and a delay. The command writes a row for each sample. The columns are
    those of `simulate`: control is the command of the computer, saturated_control the output of the actuator.
    """
    import pandas as pd
    from tqdm import tqdm

    from design.asked_model import asked_model
    from design.design_file import read_design
    from experiments.asked_disturbances import disturbances_of
    from experiments.asked_reference import reference_of
    from experiments.drive.choose_method import choose_method
    from experiments.drive.sampled_loop import METHODS, Drive, simulate_sampled
    from experiments.runs.disturbances import UNDISTURBED
    from experiments.runs.guarantee import guarantee
    from experiments.runs.references import Reference
    from experiments.runs.region import require_within_region
    from experiments.runs.sector_promise import steady_control, verdict

    drive = Drive(rate, method or METHODS[0], asked_limits(limit), quantum, rate_limit, input_delay, resolution)
    _require_few_rows(until * rate)
    inputs = _inputs(design, plant, reference["reference"])
    require_writable(output, *([] if figure is None else [figure]), inputs=inputs)
    content = read_design(design)
    kind = content.chosen(anti_windup)
    asked = reference_of(content, **reference)
    disturbances = disturbances_of(until, input_disturbance, output_disturbance, noise, seed)
    true = None if plant is None else asked_model(plant).plant
    require_within_region(true or content.loop_plant, asked, drive.limits)
    omegas = asked.frequencies if isinstance(asked, Reference) else None
    linear, judgement = choose_method(content, drive, method, true, omegas, form)
    drive = replace(drive, method=linear.method)
    click.echo(judgement)
    with tqdm(total=until * rate, desc="sampled", bar_format=SHARE, disable=None, leave=False) as bar:
        run = simulate_sampled(content, asked, kind, drive, until, true, bar.update, disturbances, form)
    low, high = drive.limits
    beyond = run.time_s[(run.control < low) | (run.control > high)]
    last = f", the last at {beyond[-1]:.6g} s" if len(beyond) else ""
    promised, slow = "", run.slewed(drive)
    if kind is not None and (len(beyond) or slow):
        promised = _unpromised(disturbances != UNDISTURBED, slow, drive.quantum > 0)
    if kind is not None and len(beyond) and not promised:
        steady = steady_control(asked, true or content.loop_plant, run.time_s)
        found = verdict(guarantee(content, kind, true), run.time_s, run.control, steady, drive.limits)
        promised = str(found)
        if found.covered:
            promised = f"No guarantee on a computer; in continuous time it would cover the run: {found.needs}"
    columns = {name: values for name, values in vars(run).items() if values is not None}
    writers = {output: csv_writer(pd.DataFrame(columns))}
    if figure is not None:
        from paper_figures.look.plot_run import plot_run
        from paper_figures.look.style import figure_writer

        unstable = f"The linear loop is UNSTABLE at {rate:g} Hz with the method {drive.method}"
        title = "" if linear.stable else unstable
        writers[figure] = figure_writer(plot_run({anti_windup: run}, drive.limits, content.signals, title))
    write_whole(writers, inputs)
    click.echo(_first(promised, f"{len(run.time_s)} rows -> {output}; {len(beyond)} samples beyond the limits{last}"))


def _unpromised(disturbed: bool, slow: bool, rounds: bool = False) -> str:
    """Why a run has no guarantee beside its limits; empty where nothing is the matter."""
    if disturbed:
        return "Whether the guarantee covers the run is not judged under disturbances"
    if slow:
        return "No guarantee: the rate limit acted, and the guarantee covers saturation limits alone"
    if rounds:
        return "No guarantee: the actuator has levels, and the guarantee covers saturation limits alone"
    return ""


def _first(promised: str, said: str) -> str:
    """What a command says, after what it says of the run's guarantee, if anything."""
    return f"{promised}; {said}" if promised else said


def _require_few_rows(rows: float) -> None:
    if rows > MOST_ROWS:
        raise InputError(f"the output has {rows:.3g} rows; expected at most {MOST_ROWS:.3g}")


def _inputs(design: Path, plant: str | None, reference: Path | None) -> list[Path]:
    return [design, *([Path(plant)] if plant else []), *([reference] if reference else [])]
