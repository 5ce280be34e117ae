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
    "--output", type=path_types.OUTPUT_FOLDER, required=True, help="Existing folder to write the tables to."
)
sinusoid_options = together(
    click.option(
        "--amplitude",
        type=float,
        multiple=True,
        help="Amplitude of the reference; give it once for each frequency of DESIGN.",
    ),
    click.option(
        "--phase",
        type=float,
        multiple=True,
        help="Phase of the reference in radians; give it once for each frequency. Default: 0, for a constant pi/2.",
    ),
    click.option("--offset", type=float, help="Constant that is added to the reference. Default: 0."),
)
"""The sinusoids of a reference: ``--amplitude``, ``--phase`` and ``--offset``."""

reference_options = together(
    sinusoid_options,
    click.option(
        "--slope",
        type=float,
        help=(
            "Slope per second of a ramp that is added to the reference. With --amplitude 0 the ramp is "
            "the whole reference."
        ),
    ),
    click.option(
        "--reference",
        type=path_types.INPUT_FILE,
        help=(
            "Read the reference from a CSV file with the columns time_s and reference. Straight lines "
            "join the rows; two rows of one time are a step."
        ),
    ),
)
"""Those, and ``--slope`` and ``--reference``."""


ANTI_WINDUP = click.option(
    "--anti-windup",
    default="corrected",
    help="Anti-windup: none, thesis, corrected, one that you added to DESIGN, or a published one: back-calculation, "
    "conditioning, observer, internal-model, weston-postlethwaite or static.",
)

LIMIT_PAIR = click.option(
    "--limit",
    type=NumberPair(),
    metavar="[LOW] HIGH",
    required=True,
    help="Saturation limits in the actuator's unit: LOW HIGH, or one number for +- that number; inf for no limit.",
)

RATE_LIMIT = click.option(
    "--rate-limit",
    type=float,
    default=math.inf,
    help="Largest change of the actuator's output per second, in its unit. The controller does not know it.",
)

drive_options = together(
    click.option(
        "--quantum",
        type=float,
        default=0.0,
        help="Distance between two levels of the actuator, in its unit; 0 for no levels.",
    ),
    click.option("--input-delay", type=float, default=0.0, help="Delay from the sample to the actuator, in seconds."),
)
"""The levels and the delay of a real actuator: ``--quantum`` and ``--input-delay``."""

SCHEDULER = click.option(
    "--scheduler",
    metavar="ADDRESS",
    help="Compute on the Dask cluster with this scheduler address instead of on this machine.",
)

disturbance_options = together(
    click.option(
        "--input-disturbance",
        type=NumberPair(),
        metavar="LEVEL [AT_S]",
        multiple=True,
        help="Add LEVEL to the actuator's output from AT_S seconds on (default 0), in its unit; can be repeated.",
    ),
    click.option(
        "--output-disturbance",
        type=NumberPair(),
        metavar="LEVEL [AT_S]",
        multiple=True,
        help=(
            "Add LEVEL to the plant's output from AT_S seconds on (default 0), in the reference's unit; "
            "can be repeated."
        ),
    ),
    click.option(
        "--noise",
        type=(float, float),
        metavar="STD RATE",
        help=(
            "Add noise to the measured output: straight lines between RATE normal samples per second "
            "with standard deviation STD, in the reference's unit."
        ),
    ),
    click.option("--seed", type=int, help="Seed of the noise."),
)
"""``--input-disturbance``, ``--output-disturbance``, ``--noise`` and ``--seed``."""


def asked_limits(limit: tuple[float, ...]) -> tuple[float, float]:
    """The limits that :data:`LIMIT_PAIR` asks for; raises InputError when they are not in order."""
    if len(limit) == 2:
        low, high = limit
        if not low < high:
            raise InputError(f"--limit is {low:.12g} {high:.12g}; expected the lower limit first")
        return low, high
    positive_limit(limit[0])
    return -limit[0], limit[0]


def positive_limit(limit: float | None) -> float | None:
    """Pass a limit on, if there is one; raises InputError when it is not positive."""
    if limit is not None and not limit > 0:
        raise InputError(f"--limit is {limit:g}; expected a positive number")
    return limit
