"""Command line of this room: ``simulate`` for one run, and one command for each experiment behind the figures."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path

import click
import numpy as np
import pandas as pd
from tqdm import tqdm

from design.anti_windup import AntiWindup, printed_form
from design.contract import Design, read_design
from experiments.additive_error import additive_error_tables
from experiments.claims import read_ledger, recompute
from experiments.closed_loop import simulate
from experiments.delay_free import delay_free_tables
from experiments.extended import extended_tables
from experiments.f_gamma import f_gamma_tables
from experiments.interpolation_regions import interpolation_tables
from experiments.loops import design_loop
from experiments.metrics import last_saturation
from experiments.physical_limits import limits_tables
from experiments.pid import pid_tables
from experiments.robustness import robustness_tables
from experiments.scenarios import Reference, thesis_reference
from experiments.trade_off import RECOVERIES, SECTORS, trade_off_tables
from identification.files import CommandGroup, InputError, write_whole
from identification.frequency_response import read_sweeps
from identification.model import read_model

OUTPUT_FOLDER = click.option(
    "--output", type=click.Path(path_type=Path, file_okay=False), required=True, help="Existing folder for the tables."
)
MOST_ROWS = 1e7

LIMIT = click.option("--limit", type=float, help="Saturation limits +-LIMIT, instead of the thesis's.")
DESIGN = click.argument("design", type=click.Path(path_type=Path, dir_okay=False))


@click.group(cls=CommandGroup)
def main() -> None:
    """Simulate the saturated loops of the thesis, their dead time exact."""


@main.command("simulate")
@DESIGN
@click.option("--limit", type=float, required=True, help="Saturation limits +-LIMIT; inf for none.")
@click.option("--anti-windup", required=True, help="none, thesis, corrected, or another of DESIGN.")
@click.option("--until", type=float, required=True, help="Length of the run in seconds.")
@click.option("--sample-time", type=float, required=True, help="Distance of the output's rows in seconds.")
@click.option("--alpha", type=float, help="Of theta1~ (2.23), instead of the design's; with --anti-windup thesis.")
@click.option("--beta", type=float, help="Of theta1~ (2.23), instead of the design's; with --anti-windup thesis.")
@click.option("--gamma", type=float, help="Of theta1~ (2.23), instead of the design's; with --anti-windup thesis.")
@click.option("--amplitude", type=float, multiple=True, help="Of the reference; once a frequency; else the thesis's.")
@click.option("--phase", type=float, multiple=True, help="In radians; once a frequency; the thesis's unless given.")
@click.option("--offset", type=float, help="Of the reference; the thesis's unless given.")
@click.option("--plant", help="The true plant: a model.json, table or implied; the design's own model unless given.")
@click.option("--output", type=click.Path(path_type=Path, dir_okay=False), required=True, help="CSV to write.")
def simulate_command(
    design: Path,
    limit: float,
    anti_windup: str,
    until: float,
    sample_time: float,
    alpha: float | None,
    beta: float | None,
    gamma: float | None,
    amplitude: tuple[float, ...],
    phase: tuple[float, ...],
    offset: float | None,
    plant: str | None,
    output: Path,
) -> None:
    """Run DESIGN from rest: time_s, reference, output, error, control, saturated_control."""
    _positive(limit)
    if not (np.isfinite([until, sample_time]).all() and 0 < sample_time <= until):
        raise InputError(
            f"--until is {until:g} and --sample-time {sample_time:g}; expected 0 < sample time <= until, both finite"
        )
    if until / sample_time > MOST_ROWS:
        raise InputError(f"{until / sample_time:.3g} rows are asked for; expected at most {MOST_ROWS:.3g}")
    content = read_design(design)
    kind = _compensator(content, anti_windup, {"alpha": alpha, "beta": beta, "gamma": gamma})
    usual = thesis_reference(content.kind, content.reference_omegas)
    reference = Reference(
        amplitude or usual.amplitudes,
        usual.omegas,
        phase or usual.phases_rad,
        usual.offset if offset is None else offset,
    )
    # the quotient of two decimals may come out a rounding below a whole number
    time_s = sample_time * np.arange(int(until / sample_time * (1 + 1e-12)) + 1)
    true_plant = None if plant is None else read_model(plant).plant
    run = simulate(design_loop(content, reference, kind, true_plant), (-limit, limit), time_s)
    table = pd.DataFrame(
        {
            "time_s": run.time_s,
            "reference": run.outputs["reference"],
            "output": run.outputs["output"],
            "error": run.outputs["error"],
            "control": run.control,
            "saturated_control": run.saturated_control,
        }
    )
    write_tables({output: table}, inputs=[design, *([Path(plant)] if plant else [])])
    saturated = last_saturation(run)
    said = "saturated to the end" if np.isnan(saturated) else f"last saturated at {saturated:.6g} s"
    click.echo(f"{len(table)} rows -> {output}; {len(run.events_s)} crossings of the limits, {said}")


def _compensator(design: Design, name: str, numbers: Mapping[str, float | None]) -> AntiWindup | None:
    given = {key: value for key, value in numbers.items() if value is not None}
    if given and name != "thesis":
        raise InputError(f"--{next(iter(given))} belongs to --anti-windup thesis; found --anti-windup {name}")
    if given:
        return printed_form({**design.anti_windup["thesis"], **given})
    return None if name == "none" else design.compensator(name)


@main.command("pid")
@OUTPUT_FOLDER
def pid(output: Path) -> None:
    """The PID benchmark of section 2.2: pid.csv, pid_summary.csv."""
    _write(output, pid_tables())


@main.command("f-gamma")
@DESIGN
@OUTPUT_FOLDER
def f_gamma(design: Path, output: Path) -> None:
    """The parameter study of f(gamma) for the bound of DESIGN: f_gamma.csv, f_gamma_summary.csv."""
    _write(output, f_gamma_tables(read_design(design).additive_bound))


@main.command("trade-off")
@DESIGN
@OUTPUT_FOLDER
def trade_off(design: Path, output: Path) -> None:
    """f of the corrected anti-windup over recovery time and sector: trade_off.csv, trade_off_summary.csv."""
    content = read_design(design)
    with tqdm(total=len(SECTORS) * RECOVERIES, desc="trade-off", disable=None, leave=False) as bar:
        _write(output, trade_off_tables(content, bar.update))


@main.command("interpolation")
@DESIGN
@OUTPUT_FOLDER
def interpolation(design: Path, output: Path) -> None:
    """Where each design of Q works: interpolation.csv, interpolation_map.csv, interpolation_summary.csv."""
    _write(output, interpolation_tables(_of_kind(design, "extended")))


@main.command("robustness")
@click.argument("designs", metavar="DESIGN...", nargs=-1, required=True, type=click.Path(path_type=Path))
@OUTPUT_FOLDER
def robustness(designs: tuple[Path, ...], output: Path) -> None:
    """|W_a C S| and the margins of each DESIGN, named by its file: robustness.csv, robustness_summary.csv."""
    names = [path.stem for path in designs]
    if len(set(names)) < len(names):
        raise InputError(f"two of the designs are named {max(names, key=names.count)}; expected different file names")
    _write(output, robustness_tables({name: read_design(path) for name, path in zip(names, designs, strict=True)}))


@main.command("delay-free")
@DESIGN
@LIMIT
@OUTPUT_FOLDER
def delay_free(design: Path, limit: float | None, output: Path) -> None:
    """The chapter 2 loop: delay_free.csv, delay_free_summary.csv."""
    _write(output, delay_free_tables(_of_kind(design, "delay-free"), _positive(limit)))


@main.command("extended")
@DESIGN
@LIMIT
@OUTPUT_FOLDER
def extended(design: Path, limit: float | None, output: Path) -> None:
    """The chapter 4 loop: extended.csv, extended_summary.csv."""
    _write(output, extended_tables(_of_kind(design, "extended"), _positive(limit)))


@main.command("limits")
@DESIGN
@click.option("--limit", "limits", type=float, multiple=True, help="Saturation limits +-LIMIT; repeatable.")
@OUTPUT_FOLDER
def limits(design: Path, limits: tuple[float, ...], output: Path) -> None:
    """What no controller of DESIGN's plant can better: limits_KIND.csv, limits_KIND_summary.csv (the first LIMIT)."""
    content = read_design(design)
    with tqdm(desc="limits", unit="", disable=None, leave=False) as bar:
        _write(output, limits_tables(content, limits or None, bar.update))


@main.command("additive-error")
@click.argument("model")
@click.argument("sweeps", nargs=-1, required=True, type=click.Path(path_type=Path))
@OUTPUT_FOLDER
def additive_error(model: str, sweeps: tuple[Path, ...], output: Path) -> None:
    """The additive error of SWEEPS against MODEL: additive_error.csv, additive_error_summary.csv."""
    _write(output, additive_error_tables(read_model(model), read_sweeps(sweeps)))


@main.command("claims")
@OUTPUT_FOLDER
def claims(output: Path) -> None:
    """The numbers that the thesis prints, computed again: claims.csv."""
    table = recompute(read_ledger())
    _write(output, {"claims": table})
    click.echo(f"{len(table)} printed numbers -> {output / 'claims.csv'}")
    for verdict, count in table["verdict"].value_counts().items():
        click.echo(f"  {verdict:17s}{count:4d}")
    for row in table[table["verdict"] != table["status"]].itertuples():
        click.echo(f"  {row.id}: the ledger says {row.status}, recomputed it {row.verdict}")


def _positive(limit: float | None) -> float | None:
    if limit is not None and not limit > 0:
        raise InputError(f"--limit is {limit:g}; expected a positive number")
    return limit


def _of_kind(path: Path, kind: str) -> Design:
    design = read_design(path)
    if design.kind != kind:
        raise InputError(f"{path}: kind is '{design.kind}'; expected '{kind}'")
    return design


def _write(folder: Path, tables: Mapping[str, pd.DataFrame]) -> None:
    if not folder.is_dir():
        raise InputError(f"{folder}: no such folder")
    write_tables({folder / f"{name}.csv": table for name, table in tables.items()})


def write_tables(tables: Mapping[Path, pd.DataFrame], inputs: Iterable[Path] = ()) -> None:
    """Write tables as CSV with 12 significant digits, all of them or none; NaN is written as an empty cell."""
    write_whole(
        {
            path: lambda partial, table=table: table.to_csv(  # type: ignore[misc]
                partial, index=False, float_format="%.12g", lineterminator="\n"
            )
            for path, table in tables.items()
        },
        inputs,
    )


if __name__ == "__main__":
    main(prog_name="python -m experiments")
