"""The command ``campaign``: many plants inside the additive bound, here or on a cluster."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from experiments.options import DESIGN, LIMIT_PAIR, RATE_LIMIT, SCHEDULER, asked_limits, sinusoid_options
from experiments.pair_options import PairCommand
from identification.base.axis_option import AXIS
from identification.base.command_line import together
from identification.base.errors import InputError
from identification.base.path_types import OUTPUT_FILE

MOST_PERIODS = 10**4

plant_options = together(
    DESIGN,
    click.option("--plants", type=int, required=True, help="Number of plants."),
    click.option(
        "--seed",
        type=int,
        required=True,
        help="Seed of the random numbers; with one seed, plant i is the same in every campaign.",
    ),
    SCHEDULER,
    click.option("--output", type=OUTPUT_FILE, required=True, help="The Parquet file to write."),
    click.option("--anew", is_flag=True, help="Start anew: remove what an interrupted campaign has kept there."),
)
"""Which plants a campaign has, and where it runs."""


@click.command("campaign", cls=PairCommand)
@plant_options
@AXIS
@LIMIT_PAIR
@RATE_LIMIT
@click.option(
    "--periods",
    type=int,
    help=(
        "Length of a run in periods of the reference. Default: 5, or as many as the loop needs to "
        "settle; 1.5 times that where a run settles later than its poles say."
    ),
)
@sinusoid_options
def campaign_command(
    design: Path,
    plants: int,
    seed: int,
    scheduler: str | None,
    output: Path,
    anew: bool,
    limit: tuple[float, ...],
    rate_limit: float,
    periods: int | None,
    **reference: Any,
) -> None:
    """Run DESIGN with plants drawn within W_a.

    The file has three rows for each plant: none, thesis and corrected. After an interruption the same command
    continues with the plants that are left.
    """
    from design.design_file import read_design
    from experiments.asked_reference import sinusoids
    from experiments.campaign.run_campaign import run_campaign
    from experiments.runs.run_length import campaign_periods

    limits = asked_limits(limit)
    if periods is not None and not 1 <= periods <= MOST_PERIODS:
        raise InputError(f"--periods is {periods}; expected 1 to {MOST_PERIODS}")
    content = read_design(design)
    asked = sinusoids(content, **reference)
    length = periods or campaign_periods(content, asked, limits, rate_limit)
    run_campaign(content, design, plants, seed, asked, limits, length, scheduler, output, anew, rate_limit)
