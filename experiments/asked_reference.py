"""What the options of a command ask for as the reference of a run."""

from __future__ import annotations

from pathlib import Path

from design.design_file import Design
from experiments.runs.reference_file import read_reference
from experiments.runs.references import Reference, SampledReference
from identification.base.errors import InputError


def sinusoids(
    design: Design, amplitude: tuple[float, ...], phase: tuple[float, ...], offset: float, slope: float = 0.0
) -> Reference:
    """The reference at the frequencies of a design.

    Parameters
    ----------
    design
        Has the frequencies.
    amplitude, phase
        One for each frequency, in the plant's output unit and in radians; no phases are phases of 0.
    offset, slope
        In the plant's output unit, and in that unit per second.

    Raises
    ------
    InputError
        There is no amplitude, there are not as many of each as the design has frequencies, or one is not finite.
    """
    omegas = design.reference_omegas
    if not amplitude:
        said = ", ".join(f"{omega:g}" for omega in omegas)
        raise InputError(f"no --amplitude is given; expected one for each frequency of the design, {said} rad/s")
    return Reference(amplitude, omegas, phase or (0.0,) * len(omegas), offset, slope)


def reference_of(
    design: Design,
    amplitude: tuple[float, ...],
    phase: tuple[float, ...],
    offset: float,
    slope: float,
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
        if value:
            raise InputError(f"--{name} belongs to a reference of sinusoids; found --reference {reference} too")
    return read_reference(reference)
