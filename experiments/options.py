"""Options that several commands of this room take; :mod:`experiments.asked_reference` has what they ask for."""

from __future__ import annotations

import click

from identification.base import path_types
from identification.base.command_line import together
from identification.base.errors import InputError

DESIGN = click.argument("design", type=path_types.INPUT_FILE)
OUTPUT_FOLDER = click.option(
    "--output", type=path_types.OUTPUT_FOLDER, required=True, help="Existing folder for the tables."
)
sinusoid_options = together(
    click.option("--amplitude", type=float, multiple=True, help="Of the reference; once a frequency of DESIGN."),
    click.option("--phase", type=float, multiple=True, help="In radians; once a frequency; 0 unless given."),
    click.option("--offset", type=float, help="Of the reference, 0 unless given."),
)
"""The sinusoids of a reference: ``--amplitude``, ``--phase`` and ``--offset``."""

reference_options = together(
    sinusoid_options,
    click.option(
        "--slope",
        type=float,
        help="Of a ramp added to the reference, a second; --amplitude 0 leaves it alone.",
    ),
    click.option(
        "--reference",
        type=path_types.INPUT_FILE,
        help="CSV of time_s and reference, joined by straight lines or stepping, instead of the sinusoids.",
    ),
)
"""Those, and ``--slope`` and ``--reference``."""


def positive_limit(limit: float | None) -> float | None:
    """Pass a limit on, if there is one; raises InputError when it is not positive."""
    if limit is not None and not limit > 0:
        raise InputError(f"--limit is {limit:g}; expected a positive number")
    return limit
