"""Command line of this room: runs of a design, campaigns, limits; and the group ``thesis``, which reproduces the print.

Each command imports what it runs, so that a command line answers at once, and make knows what each command hangs on.
"""

from __future__ import annotations

if __name__ == "__main__":
    from identification.base.process import begin

    begin()

from pathlib import Path
from typing import Any

import click

from experiments.axis_command import axis_command
from experiments.campaign.command import campaign_command
from experiments.options import (
    DESIGN,
    OUTPUT_FOLDER,
    RATE_LIMIT,
    SCHEDULER,
    asked_limits,
    reference_options,
    sinusoid_options,
)
from experiments.pair_options import NumberPair, PairCommand
from experiments.run_commands import sampled_command, simulate_command
from experiments.table_commands import rates_command, tracking_command
from experiments.tables import write_into
from experiments.thesis.commands import thesis
from identification.base.axis_option import AXIS
from identification.base.command_line import CommandGroup
from identification.base.path_types import INPUT_FILE


class Experiments(CommandGroup):
    """Says of a command that only the group ``thesis`` has where it is."""

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        name = args[0]
        if name in thesis.commands and name not in self.commands:
            ctx.fail(f"No such command '{name}'; it is now: thesis {name}")
        return super().resolve_command(ctx, args)


@click.group(cls=Experiments)
def main() -> None:
    """Simulate saturated loops, their dead time exact."""


main.add_command(axis_command)
main.add_command(simulate_command)
main.add_command(sampled_command)
main.add_command(tracking_command)
main.add_command(rates_command)
main.add_command(campaign_command)
main.add_command(thesis)


@main.command("campaign-tables")
@click.argument("campaign", type=INPUT_FILE)
@OUTPUT_FOLDER
def campaign_distributions(campaign: Path, output: Path) -> None:
    """Compute the distributions of a CAMPAIGN.

    The command writes campaign.csv, campaign_distance.csv and campaign_summary.csv.
    """
    from experiments.campaign.distributions import campaign_tables

    write_into(output, campaign_tables(campaign))


@main.command("limits", cls=PairCommand)
@DESIGN
@AXIS
@click.option(
    "--limit",
    "limits",
    type=NumberPair(),
    metavar="[LOW] HIGH",
    multiple=True,
    required=True,
    help="Saturation limits in the actuator's unit: LOW HIGH, or one number for +- that number; can be repeated.",
)
@RATE_LIMIT
@SCHEDULER
@sinusoid_options
@OUTPUT_FOLDER
def limits(
    design: Path,
    limits: tuple[tuple[float, ...], ...],
    rate_limit: float,
    scheduler: str | None,
    output: Path,
    **reference: Any,
) -> None:
    """Bound the least peak error within LIMIT.

    The bound holds for every controller. The command writes limits_KIND.csv and limits_KIND_summary.csv.
    """
    from tqdm import tqdm

    from design.design_file import read_design
    from experiments.asked_reference import sinusoids
    from experiments.physical_limits.limits_tables import limits_tables

    content = read_design(design)
    with tqdm(desc="limits", unit="", disable=None, leave=False) as bar:
        asked = sinusoids(content, **reference)
        names = ("none", "corrected")
        write_into(output, limits_tables(content, asked, limits, bar.update, names, rate_limit, scheduler=scheduler))


@main.command("compare", cls=PairCommand)
@DESIGN
@AXIS
@click.option(
    "--limit",
    type=NumberPair(),
    metavar="[LOW] HIGH",
    help="Saturation limits in the actuator's unit. Default: +-1.2 times the control that the reference needs.",
)
@RATE_LIMIT
@reference_options
@OUTPUT_FOLDER
def compare(design: Path, limit: tuple[float, ...] | None, rate_limit: float, output: Path, **reference: Any) -> None:
    """Compare DESIGN with published anti-windups.

    The command writes compare.csv and compare_runs.csv.
    """
    from tqdm import tqdm

    from design.design_file import read_design
    from experiments.asked_reference import reference_of
    from experiments.comparison import comparison_tables

    content = read_design(design)
    limits = None if limit is None else asked_limits(limit)
    with tqdm(desc="compare", unit="", disable=None, leave=False) as bar:
        asked = reference_of(content, **reference)
        write_into(output, comparison_tables(content, asked, limits, bar.update, rate_limit=rate_limit))


if __name__ == "__main__":
    main(prog_name="python -m experiments")
