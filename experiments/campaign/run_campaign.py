"""A whole campaign: run what is not kept yet, keep it, say what came out."""

from __future__ import annotations

import hashlib
import math
import sys
from functools import partial
from pathlib import Path

import click
import numpy as np
import pandas as pd
from tqdm import tqdm

from design.design_file import Design
from experiments.campaign.checkpoint import CampaignFile
from experiments.campaign.distributions import PERCENT, RUNS, campaign_tables
from experiments.campaign.run_plants import Campaign, run_chunk
from experiments.runs.references import Reference
from experiments.runs.words import limits_text, sector_text
from experiments.runs.workers import WorkersLostError, spread
from identification.base import process
from identification.base.errors import InputError
from identification.base.files import read_bytes
from identification.base.folder_lock import locked_file

MOST_PLANTS = 10**9


def run_campaign(
    content: Design,
    design: Path,
    plants: int,
    seed: int,
    reference: Reference,
    limits: tuple[float, float],
    periods: int,
    scheduler: str | None,
    output: Path,
    anew: bool,
    rate_limit: float = math.inf,
) -> None:
    """Run a campaign, keep it, and say what came out.

    Parameters
    ----------
    content, design
        The design and its file.
    plants, seed
        How many plants are drawn, and from which random numbers.
    reference, limits, periods, rate_limit
        Of every run, see :class:`experiments.campaign.run_plants.Campaign`.
    scheduler
        Address of a Dask cluster's; None runs the campaign here.
    output, anew
        The parquet file, and whether the parts of another campaign beside it are removed.

    Raises
    ------
    InputError
        A number is out of range, a plant cannot be drawn or run, or the file cannot be written.
    """
    if not (1 <= plants <= MOST_PLANTS and seed >= 0):
        raise InputError(
            f"--plants is {plants} and --seed {seed}; expected 1 to {MOST_PLANTS} plants, a seed from 0 on"
        )
    digest = hashlib.sha256(read_bytes(design)).hexdigest()
    campaign = Campaign(content, digest, seed, reference, limits, periods, rate_limit)
    with locked_file(output):
        file = CampaignFile(output, campaign, plants, design, anew)
        there = plants - sum(last - first for first, last in file.missing)
        _complete(file, campaign, plants, scheduler)
    if there:
        click.echo(f"{there} of {plants} plants were there already")
    summary = campaign_tables(output)["campaign_summary"]
    click.echo(_promised(summary))
    slow = f", at most {rate_limit:g} a second" if math.isfinite(rate_limit) else ""
    click.echo(
        f"{plants} plants within W_a -> {output}; limits {limits_text(*limits)}{slow}, {campaign.horizon_s:.6g} s each"
    )
    for line in _lines(summary):
        click.echo(line)


def _complete(file: CampaignFile, campaign: Campaign, plants: int, scheduler: str | None) -> None:
    """Run what is missing, and write the file."""
    missing = file.missing
    left = sum(last - first for first, last in missing)
    if missing:
        done = spread(partial(run_chunk, campaign), missing, scheduler)
        try:
            with tqdm(total=plants, initial=plants - left, desc="campaign", unit=" plants", disable=None) as bar:
                runs = f"{left} plants, {len(RUNS)} runs of {campaign.horizon_s:.6g} s each"
                if not bar.disable:
                    bar.write(f"{runs}; what is done is kept in {file.folder}", file=sys.stderr)
                for number, columns in done:
                    chunk = missing[number]
                    file.keep(chunk, columns)
                    left -= chunk[1] - chunk[0]
                    bar.update(chunk[1] - chunk[0])
                    kept = f"{plants - left} of {plants} plants are kept in {file.folder}"
                    process.leaves(f"{kept}; the same command continues")
        except WorkersLostError as error:
            raise InputError(f"{error}; the same command continues from there") from None
        finally:
            done.close()
    file.finish()
    process.leaves(process.NOTHING_LOST)


def _promised(summary: pd.DataFrame) -> str:
    """Of which anti-windup a guarantee speaks of these plants, and how many of its runs it covers."""
    said = [
        f"the guarantee of {row['run']}, the sector {sector_text(row['guaranteed_sector'])}, covers "
        f"{row['covered']:.2%} of its runs"
        for row in summary[summary["guaranteed_sector"] > 0].to_dict("records")
    ]
    return f"Of all plants within W_a {'; '.join(said)}" if said else "No guarantee holds for all plants within W_a"


def _lines(summary: pd.DataFrame) -> list[str]:
    """The summary as a table."""
    shares = {"covered": "covered", "linear_stable": "stable", "diverged": "diverged", "recovered": "recovered"}
    measures = {"peak_error_{}": "peak error", "steady_error_{}": "last period", "recovery_{}_s": "recovery s"}
    heads = [f"{label:>11s}" for label in shares.values()]
    lines = ["".join([" " * 10, *heads, *(f"{f'{label}, 5 50 95 %':>30s}" for label in measures.values())])]
    for row in summary.to_dict("records"):
        cells = [f"{row['run']:10s}", *(f"{row[name]:11.2%}" for name in shares)]
        cells += [f"{_number(row[form.format(percent)]):>10s}" for form in measures for percent in PERCENT]
        lines.append("".join(cells))
    return lines


def _number(value: float) -> str:
    return "-" if np.isnan(value) else f"{value:.4g}"
