"""The commands that run one design many times: ``tracking`` over its anti-windups, ``rates`` over a computer's rate."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from experiments.options import (
    DESIGN,
    LIMIT_PAIR,
    OUTPUT_FOLDER,
    RATE_LIMIT,
    asked_limits,
    drive_options,
    reference_options,
)
from experiments.pair_options import PairCommand
from experiments.tables import write_into
from identification.base.axis_option import AXIS


@click.command("tracking", cls=PairCommand)
@DESIGN
@AXIS
@LIMIT_PAIR
@reference_options
@RATE_LIMIT
@OUTPUT_FOLDER
def tracking_command(design: Path, limit: tuple[float, ...], rate_limit: float, output: Path, **reference: Any) -> None:
    """Run DESIGN with each of its anti-windups.

    Each run starts from rest: without anti-windup, with the corrected one, and with each one that you added. The
    command writes tracking.csv and tracking_summary.csv.
    """
    from design.design_file import read_design
    from experiments.asked_reference import reference_of
    from experiments.tracking import tracking_tables

    limits, content = asked_limits(limit), read_design(design)
    names, asked = ("none", "corrected", *content.added), reference_of(content, **reference)
    write_into(output, tracking_tables(content, asked, limits, names, rate_limit=rate_limit))


@click.command("rates", cls=PairCommand)
@DESIGN
@AXIS
@LIMIT_PAIR
@reference_options
@RATE_LIMIT
@click.option("--rate", type=float, help="Also run at this sampling rate, in Hz.")
@drive_options
@OUTPUT_FOLDER
def rates_command(
    design: Path,
    limit: tuple[float, ...],
    rate_limit: float,
    rate: float | None,
    quantum: float,
    input_delay: float,
    output: Path,
    **reference: Any,
) -> None:
    """Run DESIGN's controller at several rates.

    The rates are 2 to 64 samples per period of the loop's fastest root. The command writes rates.csv.
    """
    from tqdm import tqdm

    from design.design_file import read_design
    from experiments.asked_reference import reference_of
    from experiments.rates import rates_tables

    limits, content = asked_limits(limit), read_design(design, "extended")
    asked = reference_of(content, **reference)
    with tqdm(desc="rates", unit=" runs", disable=None, leave=False) as bar:
        tables = rates_tables(
            content,
            asked,
            limits,
            rate=rate,
            quantum=quantum,
            rate_limit=rate_limit,
            input_delay_s=input_delay,
            tick=bar.update,
        )
        write_into(output, tables)
