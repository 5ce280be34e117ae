"""What the options of a command ask for as disturbances of a run."""

from __future__ import annotations

from collections.abc import Sequence

from experiments.runs.disturbances import Disturbances, noise, steps
from identification.base.errors import InputError


def disturbances_of(
    until_s: float,
    input_disturbance: Sequence[tuple[float, ...]],
    output_disturbance: Sequence[tuple[float, ...]],
    asked_noise: tuple[float, float] | None,
    seed: int | None,
) -> Disturbances:
    """The disturbances of :data:`experiments.options.disturbance_options` in a run of ``until_s`` seconds.

    Raises
    ------
    InputError
        One of --noise and --seed is given without the other, or see :func:`experiments.runs.disturbances.steps` and
        :func:`experiments.runs.disturbances.noise`.
    """
    if (asked_noise is None) != (seed is None):
        given, other = ("seed", "noise") if asked_noise is None else ("noise", "seed")
        raise InputError(f"--{given} is given without --{other}; expected both or neither")
    at_input, at_output = (
        steps([(level, *(at_s or (0.0,))) for level, *at_s in levels])
        for levels in (input_disturbance, output_disturbance)
    )
    measured = None if asked_noise is None or seed is None else noise(*asked_noise, seed, until_s)
    return Disturbances(at_input, at_output, measured)
