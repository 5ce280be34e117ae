"""Command line of this room: ``simulate`` and ``sampled`` for one run, and one command for each experiment.

What takes long to import, and only one command needs, that command imports.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import click
import pandas as pd
from tqdm import tqdm

from design.contract import Design, read_design
from experiments.campaign_command import campaign_command
from experiments.campaign_tables import campaign_tables
from experiments.claims_commands import claims_command, coverage_command, equations_command
from experiments.delay_free import delay_free_tables
from experiments.extended import extended_tables
from experiments.interpolation_regions import interpolation_tables
from experiments.pid import pid_tables
from experiments.robustness import robustness_tables
from experiments.run_commands import DESIGN, positive_limit, sampled_command, simulate_command
from experiments.tables import write_tables
from identification.files import CommandGroup, InputError
from identification.model import read_model

OUTPUT_FOLDER = click.option(
    "--output", type=click.Path(path_type=Path, file_okay=False), required=True, help="Existing folder for the tables."
)
LIMIT = click.option("--limit", type=float, help="Saturation limits +-LIMIT, instead of the thesis's.")


@click.group(cls=CommandGroup)
def main() -> None:
    """Simulate the saturated loops of the thesis, their dead time exact."""


main.add_command(simulate_command)
main.add_command(sampled_command)
main.add_command(campaign_command)
main.add_command(claims_command)
main.add_command(coverage_command)
main.add_command(equations_command)


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
    from experiments.f_gamma import f_gamma_tables

    _write(output, f_gamma_tables(read_design(design).additive_bound))


@main.command("trade-off")
@DESIGN
@OUTPUT_FOLDER
def trade_off(design: Path, output: Path) -> None:
    """f of the corrected anti-windup over recovery time and sector: trade_off.csv, trade_off_summary.csv."""
    from experiments.trade_off import RECOVERIES, SECTORS, trade_off_tables

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
    _write(output, delay_free_tables(_of_kind(design, "delay-free"), positive_limit(limit)))


@main.command("extended")
@DESIGN
@LIMIT
@OUTPUT_FOLDER
def extended(design: Path, limit: float | None, output: Path) -> None:
    """The chapter 4 loop: extended.csv, extended_summary.csv."""
    _write(output, extended_tables(_of_kind(design, "extended"), positive_limit(limit)))


@main.command("limits")
@DESIGN
@click.option("--limit", "limits", type=float, multiple=True, help="Saturation limits +-LIMIT; repeatable.")
@OUTPUT_FOLDER
def limits(design: Path, limits: tuple[float, ...], output: Path) -> None:
    """What no controller of DESIGN's plant can better: limits_KIND.csv, limits_KIND_summary.csv (the first LIMIT)."""
    from experiments.physical_limits import limits_tables

    content = read_design(design)
    with tqdm(desc="limits", unit="", disable=None, leave=False) as bar:
        _write(output, limits_tables(content, limits or None, bar.update))


@main.command("conditions")
@OUTPUT_FOLDER
def conditions(output: Path) -> None:
    """What the thesis does not print, searched by what it does: conditions.csv, conditions_summary.csv."""
    from experiments.unprinted_conditions import conditions_tables

    if not output.is_dir():
        raise InputError(f"{output}: no such folder")
    with tqdm(desc="conditions", unit="", disable=None, leave=False) as bar:
        _write(output, conditions_tables(tick=bar.update))


@main.command("sampled-rates")
@DESIGN
@LIMIT
@OUTPUT_FOLDER
def sampled_rates(design: Path, limit: float | None, output: Path) -> None:
    """The chapter 4 loop on a computer with a real drive, over its rate: sampled.csv, sampled_summary.csv."""
    from experiments.sampled_rates import sampled_rates_tables

    _write(output, sampled_rates_tables(_of_kind(design, "extended"), positive_limit(limit)))


@main.command("campaign-tables")
@click.argument("campaign", type=click.Path(path_type=Path, dir_okay=False))
@OUTPUT_FOLDER
def campaign_distributions(campaign: Path, output: Path) -> None:
    """The distributions of a CAMPAIGN: campaign.csv, campaign_distance.csv, campaign_summary.csv."""
    _write(output, campaign_tables(campaign))


@main.command("additive-error")
@click.argument("model")
@click.argument("sweeps", nargs=-1, required=True, type=click.Path(path_type=Path))
@OUTPUT_FOLDER
def additive_error(model: str, sweeps: tuple[Path, ...], output: Path) -> None:
    """The additive error of SWEEPS against MODEL: additive_error.csv, additive_error_summary.csv."""
    from experiments.additive_error import additive_error_tables
    from identification.frequency_response import read_sweeps

    _write(output, additive_error_tables(read_model(model), read_sweeps(sweeps)))


def _of_kind(path: Path, kind: str) -> Design:
    design = read_design(path)
    if design.kind != kind:
        raise InputError(f"{path}: kind is '{design.kind}'; expected '{kind}'")
    return design


def _write(folder: Path, tables: Mapping[str, pd.DataFrame]) -> None:
    if not folder.is_dir():
        raise InputError(f"{folder}: no such folder")
    write_tables({folder / f"{name}.csv": table for name, table in tables.items()})


if __name__ == "__main__":
    main(prog_name="python -m experiments")
