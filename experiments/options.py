"""Options that several commands of this room take, and what they mean."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import click

from design.design_file import Design
from experiments.runs.reference_file import read_reference
from experiments.runs.references import Reference, SampledReference
from identification.base.errors import InputError

DESIGN = click.argument("design", type=click.Path(path_type=Path, dir_okay=False))
OUTPUT_FOLDER = click.option(
    "--output", type=click.Path(path_type=Path, file_okay=False), required=True, help="Existing folder for the tables."
)
_SINUSOIDS = (
    click.option("--amplitude", type=float, multiple=True, help="Of the reference; once a frequency of DESIGN."),
    click.option("--phase", type=float, multiple=True, help="In radians; once a frequency; 0 unless given."),
    click.option("--offset", type=float, help="Of the reference, 0 unless given."),
)
_OTHERS = (
    click.option(
        "--slope",
        type=float,
        help="Of a ramp added to the reference, a second; --amplitude 0 leaves it alone.",
    ),
    click.option(
        "--reference",
        type=click.Path(path_type=Path, dir_okay=False),
        help="CSV of time_s and reference, joined by straight lines, instead of the sinusoids.",
    ),
)


def sinusoid_options(command: Callable[..., None]) -> Callable[..., None]:
    """Give a command ``--amplitude``, ``--phase`` and ``--offset``, see :func:`sinusoids`."""
    for option in reversed(_SINUSOIDS):
        command = option(command)
    return command


def reference_options(command: Callable[..., None]) -> Callable[..., None]:
    """Give a command those and ``--slope`` and ``--reference``, see :func:`reference_of`."""
    for option in reversed(_OTHERS):
        command = option(command)
    return sinusoid_options(command)


def sinusoids(
    design: Design,
    amplitude: tuple[float, ...],
    phase: tuple[float, ...],
    offset: float | None,
    slope: float | None = None,
) -> Reference:
    """The reference at the frequencies of a design.

    Parameters
    ----------
    design
        Has the frequencies.
    amplitude, phase
        One for each frequency, in the plant's output unit and in radians; no phases are
        phases of 0, and pi/2 at omega = 0, so that the constant is the amplitude.
    offset, slope
        In the plant's output unit, and in that unit per second; None is 0.

    Raises
    ------
    InputError
        There is no amplitude, there are not as many of each as the design has frequencies, or one is not finite.
    """
    omegas = design.reference_omegas
    if not amplitude:
        said = ", ".join(f"{omega:g}" for omega in omegas)
        raise InputError(f"no --amplitude is given; expected one for each frequency of the design, {said} rad/s")
    usual = tuple(0.0 if omega else math.pi / 2 for omega in omegas)
    return Reference(amplitude, omegas, phase or usual, offset or 0.0, slope or 0.0)


def reference_of(
    design: Design,
    amplitude: tuple[float, ...],
    phase: tuple[float, ...],
    offset: float | None,
    slope: float | None,
    reference: Path | None,
) -> Reference | SampledReference:
    """The reference of sinusoids, see :func:`sinusoids`, or the one of a file.

    Raises
    ------
    InputError
        Options of both are given, or see :func:`sinusoids` and
        :func:`experiments.runs.reference_file.read_reference`.
    """
    if reference is None:
        return sinusoids(design, amplitude, phase, offset, slope)
    for name, value in {"amplitude": amplitude, "phase": phase, "offset": offset, "slope": slope}.items():
        if value not in ((), None):
            raise InputError(f"--{name} belongs to a reference of sinusoids; found --reference {reference} too")
    return read_reference(reference)


def positive_limit(limit: float | None) -> float | None:
    """Pass a limit on, if there is one; raises InputError when it is not positive."""
    if limit is not None and not limit > 0:
        raise InputError(f"--limit is {limit:g}; expected a positive number")
    return limit
