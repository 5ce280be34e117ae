"""What the options of a command ask for as the reference of a run."""

from __future__ import annotations

import math
from pathlib import Path

from design.design_file import Design
from experiments.runs.reference_file import read_reference
from experiments.runs.references import Reference, SampledReference
from identification.base.errors import InputError


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
