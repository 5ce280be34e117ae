"""The group ``thesis``: one command for each of the thesis's experiments, under its references and limits.

Each command imports what it runs, as in :mod:`experiments.__main__`.
"""

from __future__ import annotations

from pathlib import Path

import click

from experiments.campaign.command import plant_options
from experiments.options import DESIGN, OUTPUT_FOLDER, SCHEDULER, positive_limit
from experiments.tables import write_into
from experiments.thesis.claims.commands import claims_command, coverage_command, equations_command
from identification.base.command_line import CommandGroup
from identification.base.errors import InputError
from identification.base.path_types import INPUT

LIMIT = click.option("--limit", type=float, help="Use the saturation limits +-LIMIT instead of the thesis's.")


@click.group("thesis", cls=CommandGroup)
def thesis() -> None:
    """Reproduce and judge the thesis."""


thesis.add_command(claims_command)
thesis.add_command(coverage_command)
thesis.add_command(equations_command)


@thesis.command("pid")
@OUTPUT_FOLDER
def pid(output: Path) -> None:
    """Simulate the PID benchmark of section 2.2.

    The command writes pid.csv and pid_summary.csv.
    """
    from experiments.thesis.studies.pid import pid_tables

    write_into(output, pid_tables())


@thesis.command("f-gamma")
@DESIGN
@OUTPUT_FOLDER
def f_gamma(design: Path, output: Path) -> None:
    """Compute f over gamma for the bound of DESIGN.

    The command writes f_gamma.csv and f_gamma_summary.csv.
    """
    from design.design_file import read_design
    from experiments.thesis.studies.f_gamma import f_gamma_tables

    write_into(output, f_gamma_tables(read_design(design).additive_bound))


@thesis.command("trade-off")
@DESIGN
@OUTPUT_FOLDER
def trade_off(design: Path, output: Path) -> None:
    """Compute f over recovery time and sector.

    f is that of the corrected anti-windup. The command writes trade_off.csv and trade_off_summary.csv.
    """
    from tqdm import tqdm

    from design.design_file import read_design
    from experiments.thesis.studies.trade_off import RECOVERIES, SECTORS, trade_off_tables

    content = read_design(design)
    with tqdm(total=len(SECTORS) * RECOVERIES, desc="trade-off", disable=None, leave=False) as bar:
        write_into(output, trade_off_tables(content, bar.update))


@thesis.command("interpolation")
@DESIGN
@OUTPUT_FOLDER
def interpolation(design: Path, output: Path) -> None:
    """Map where each design of Q works.

    The command writes interpolation.csv, interpolation_map.csv and interpolation_summary.csv.
    """
    from design.design_file import read_design
    from experiments.thesis.studies.interpolation import interpolation_tables

    write_into(output, interpolation_tables(read_design(design, "extended")))


@thesis.command("robustness")
@click.argument("designs", metavar="DESIGN...", nargs=-1, required=True, type=INPUT)
@OUTPUT_FOLDER
def robustness(designs: tuple[Path, ...], output: Path) -> None:
    """Compute |W_a C S| and margins of each DESIGN.

    The command writes robustness.csv and robustness_summary.csv.
    """
    from design.design_file import read_design
    from experiments.thesis.studies.robustness import robustness_tables

    names = [path.stem for path in designs]
    if len(set(names)) < len(names):
        raise InputError(f"two of the designs are named {max(names, key=names.count)}; expected different file names")
    write_into(output, robustness_tables({name: read_design(path) for name, path in zip(names, designs, strict=True)}))


@thesis.command("chapter-2")
@DESIGN
@LIMIT
@OUTPUT_FOLDER
def chapter_2(design: Path, limit: float | None, output: Path) -> None:
    """Simulate the loop of chapter 2.

    The command writes delay_free.csv and delay_free_summary.csv.
    """
    from design.design_file import read_design
    from experiments.thesis.studies.chapter_2 import delay_free_tables

    write_into(output, delay_free_tables(read_design(design, "delay-free"), positive_limit(limit)))


@thesis.command("chapter-4")
@DESIGN
@LIMIT
@OUTPUT_FOLDER
def chapter_4(design: Path, limit: float | None, output: Path) -> None:
    """Simulate the loop of chapter 4.

    The command writes extended.csv and extended_summary.csv.
    """
    from design.design_file import read_design
    from experiments.thesis.studies.chapter_4 import extended_tables

    write_into(output, extended_tables(read_design(design, "extended"), positive_limit(limit)))


@thesis.command("limits")
@DESIGN
@SCHEDULER
@OUTPUT_FOLDER
def limits(design: Path, scheduler: str | None, output: Path) -> None:
    """Bound the least peak error within limits.

    The bound holds for every controller. The command writes limits_KIND.csv and limits_KIND_summary.csv.
    """
    from tqdm import tqdm

    from design.design_file import read_design
    from experiments.physical_limits.limits_tables import limits_tables
    from experiments.thesis.printed_choices import thesis_reference
    from experiments.thesis.studies.conditions import several_limits

    content = read_design(design)
    reference = thesis_reference(content.kind, content.reference_omegas)
    with tqdm(desc="limits", unit="", disable=None, leave=False) as bar:
        asked = several_limits(content)
        write_into(output, limits_tables(content, reference, asked, bar.update, scheduler=scheduler))


@thesis.command("conditions")
@SCHEDULER
@OUTPUT_FOLDER
def conditions(scheduler: str | None, output: Path) -> None:
    """Search for the thesis's unprinted conditions.

    The command writes conditions.csv and conditions_summary.csv.
    """
    from functools import partial

    from tqdm import tqdm

    from experiments.runs.batch import on_cluster, threaded
    from experiments.thesis.unprinted.search import conditions_tables

    with tqdm(desc="conditions", unit="", disable=None, leave=False) as bar:
        there = partial(on_cluster, scheduler=scheduler) if scheduler else threaded
        write_into(output, conditions_tables(each=partial(there, tick=bar.update)))


@thesis.command("wide-conditions")
@OUTPUT_FOLDER
def wide_conditions(output: Path) -> None:
    """Search more conditions, for some minutes.

    The search is wider than that of the command `conditions`. The command writes wide_conditions.csv.
    """
    from functools import partial

    from tqdm import tqdm

    from experiments.runs.batch import threaded
    from experiments.thesis.unprinted.wide_search import wide_conditions_table

    with tqdm(desc="conditions", unit="", disable=None, leave=False) as bar:
        write_into(output, {"wide_conditions": wide_conditions_table(each=partial(threaded, tick=bar.update))})


@thesis.command("sampled-rates")
@DESIGN
@LIMIT
@OUTPUT_FOLDER
def sampled_rates(design: Path, limit: float | None, output: Path) -> None:
    """Run chapter 4's controller at several rates.

    The controller runs on a computer. The command writes sampled.csv and sampled_summary.csv.
    """
    from design.design_file import read_design
    from experiments.thesis.studies.sampled_rates import sampled_rates_tables

    write_into(output, sampled_rates_tables(read_design(design, "extended"), positive_limit(limit)))


@thesis.command("compare")
@DESIGN
@LIMIT
@OUTPUT_FOLDER
def compare(design: Path, limit: float | None, output: Path) -> None:
    """Compare DESIGN with published anti-windups.

    The command writes compare.csv and compare_runs.csv.
    """
    from tqdm import tqdm

    from design.design_file import read_design
    from experiments.comparison import comparison_tables
    from experiments.thesis.printed_choices import thesis_reference

    content = read_design(design)
    reference = thesis_reference(content.kind, content.reference_omegas)
    with tqdm(desc="compare", unit="", disable=None, leave=False) as bar:
        write_into(output, comparison_tables(content, reference, positive_limit(limit), bar.update))


@thesis.command("hidden-modes")
@DESIGN
@LIMIT
@OUTPUT_FOLDER
def hidden_modes(design: Path, limit: float | None, output: Path) -> None:
    """Compute the drift that rounding causes.

    The loop is that of chapter 4, for a quarter of an hour. The command writes hidden_modes.csv and
    hidden_modes_summary.csv.
    """
    from tqdm import tqdm

    from design.design_file import read_design
    from experiments.thesis.studies.hidden_modes import hidden_modes_tables

    content = read_design(design, "extended")
    with tqdm(desc="hidden modes", unit="", disable=None, leave=False) as bar:
        write_into(output, hidden_modes_tables(content, positive_limit(limit), bar.update))


@thesis.command("campaign")
@plant_options
@LIMIT
def campaign(
    design: Path, plants: int, seed: int, scheduler: str | None, output: Path, anew: bool, limit: float | None
) -> None:
    """Run DESIGN with plants drawn within W_a.

    The reference is the thesis's. All else is as in `experiments campaign`.
    """
    from design.design_file import read_design
    from experiments.campaign.run_campaign import run_campaign
    from experiments.thesis.printed_choices import thesis_reference
    from experiments.thesis.studies.conditions import usual_limit, usual_periods

    content = read_design(design)
    given = positive_limit(limit)
    used = usual_limit(content) if given is None else given
    limits, reference = (-used, used), thesis_reference(content.kind, content.reference_omegas)
    run_campaign(content, design, plants, seed, reference, limits, usual_periods(content), scheduler, output, anew)


@thesis.command("additive-error")
@click.argument("model")
@click.argument("sweeps", nargs=-1, required=True, type=INPUT)
@OUTPUT_FOLDER
def additive_error(model: str, sweeps: tuple[Path, ...], output: Path) -> None:
    """Compute the distance of SWEEPS from MODEL.

    The command writes additive_error.csv and additive_error_summary.csv.
    """
    from design.asked_model import asked_model
    from experiments.thesis.studies.additive_error import additive_error_tables
    from identification.sweeps.read_sweeps import read_sweeps

    write_into(output, additive_error_tables(asked_model(model), read_sweeps(sweeps)))
