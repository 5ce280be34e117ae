"""Options that several commands of this room take; :mod:`experiments.asked_reference` has what they ask for."""

from __future__ import annotations

import math

import click

from experiments.pair_options import NumberPair
from identification.base import path_types
from identification.base.command_line import together
from identification.base.errors import InputError

DESIGN = click.argument("design", type=path_types.INPUT_FILE)
OUTPUT_FOLDER = click.option(
    "--output", type=path_types.OUTPUT_FOLDER, required=True, help="Existing folder for the tables."
)
sinusoid_options = together(
    click.option("--amplitude", type=float, multiple=True, help="Of the reference; once a frequency of DESIGN."),
    click.option(
        "--phase",
        type=float,
        multiple=True,
        help="In radians; once a frequency; 0 unless given, and pi/2 for a constant.",
    ),
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


ANTI_WINDUP = click.option(
    "--anti-windup",
    default="corrected",
    help="none, thesis, corrected, another of DESIGN, or one of others: back-calculation, conditioning, observer, "
    "internal-model, weston-postlethwaite or static.",
)

LIMIT_PAIR = click.option(
    "--limit",
    type=NumberPair(),
    metavar="[LOW] HIGH",
    required=True,
    help="Saturation limits in the actuator's unit, LOW < HIGH, or one number for +- that; inf for none.",
)

RATE_LIMIT = click.option(
    "--rate-limit",
    type=float,
    default=math.inf,
    help="Most change of the actuator in a second, in its unit, unknown to the controller.",
)

SCHEDULER = click.option(
    "--scheduler", metavar="ADDRESS", help="Compute on the Dask cluster with this scheduler, not here."
)

disturbance_options = together(
    click.option(
        "--input-disturbance",
        type=NumberPair(),
        metavar="LEVEL [AT_S]",
        multiple=True,
        help="From AT_S seconds on (0 unless given) LEVEL is added to the actuator's output, in its unit; repeatable.",
    ),
    click.option(
        "--output-disturbance",
        type=NumberPair(),
        metavar="LEVEL [AT_S]",
        multiple=True,
        help="The same at the plant's output, in the reference's unit.",
    ),
    click.option(
        "--noise",
        type=(float, float),
        metavar="STD RATE",
        help="Adds to what is measured straight lines between RATE normal samples a second, in the reference's unit.",
    ),
    click.option("--seed", type=int, help="Of the noise."),
)
"""``--input-disturbance``, ``--output-disturbance``, ``--noise`` and ``--seed``."""


def asked_limits(limit: tuple[float, ...]) -> tuple[float, float]:
    """The limits that :data:`LIMIT_PAIR` asks for; raises InputError when they are not in order."""
    if len(limit) == 2:
        low, high = limit
        if not low < high:
            raise InputError(f"--limit is {low:g} {high:g}; expected the lower limit first")
        return low, high
    positive_limit(limit[0])
    return -limit[0], limit[0]


def positive_limit(limit: float | None) -> float | None:
    """Pass a limit on, if there is one; raises InputError when it is not positive."""
    if limit is not None and not limit > 0:
        raise InputError(f"--limit is {limit:g}; expected a positive number")
    return limit
