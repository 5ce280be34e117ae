"""Options that several commands of this room take."""

from __future__ import annotations

from math import tau

import click

from design.choices import GUARANTEES, SECTOR
from identification.base.command_line import together
from identification.base.errors import InputError
from identification.base.path_types import INPUT_FILE, OUTPUT_FILE

OUTPUT = click.option("--output", type=OUTPUT_FILE, required=True, help="The design.json to write.")
DESIGN = click.argument("design", type=INPUT_FILE)
frequency_options = together(
    click.option(
        "--reference-hz",
        "hertz",
        type=float,
        multiple=True,
        help="Frequency of the reference in Hz; give it once for each sinusoid. 0 is a constant.",
    ),
    click.option(
        "--reference-omega",
        "omegas",
        type=float,
        multiple=True,
        help="Frequency of the reference in rad/s, instead of --reference-hz.",
    ),
)
"""Frequencies of the reference, the same for both designs."""
corrected_options = together(
    click.option(
        "--recovery",
        type=float,
        help=(
            "Corrected anti-windup: the slowest mode of theta1~ falls to 1 % within this time, in "
            "seconds. (y_d also contains the plant's own modes.) Default: the time of the loop itself."
        ),
    ),
    click.option(
        "--guarantee",
        type=click.Choice(GUARANTEES),
        help=(
            "Corrected anti-windup: what is guaranteed. global: the windup ends for every control. "
            "robust: also for every plant within W_a. sector: up to a largest control. Default: global "
            "where the plant allows it, else sector."
        ),
    ),
    click.option(
        "--sector",
        type=float,
        help="With --guarantee sector: k of the circle criterion, below 1. The guarantee covers |u| up to "
        "(limit - k V)/(1 - k), where V is the largest control that the reference needs. "
        f"Default: {SECTOR:g}.",
    ),
    click.option(
        "--bandwidth",
        type=float,
        help=(
            "Corrected anti-windup: no pole of theta1~ is faster than this, in rad/s. Default: the "
            "fastest root of P and W_a."
        ),
    ),
)
"""Of the corrected anti-windup, the same for both designs."""


def asked_frequencies(hertz: tuple[float, ...], omegas: tuple[float, ...]) -> tuple[float, ...]:
    """All frequencies of the reference in rad/s; raises InputError when there is none."""
    if not hertz and not omegas:
        raise InputError(
            "no frequency of the reference is given; expected --reference-hz or --reference-omega, 0 for a constant"
        )
    return *(tau * frequency for frequency in hertz), *omegas
