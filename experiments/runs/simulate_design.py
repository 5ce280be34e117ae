"""One run of a design: its loop built and simulated."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from design.design_file import Asked, Design
from experiments.engine.simulate import Run, limit_pair, simulate
from experiments.runs.compare_anti_windups import span
from experiments.runs.design_loop import design_loop
from experiments.runs.disturbances import UNDISTURBED, Disturbances
from experiments.runs.references import Reference, SampledReference
from experiments.runs.region import require_short, require_within_region
from identification.base.errors import InputError
from identification.model.plant import PlantModel

PERIODS = 5
SAMPLES = 5001


def simulate_design(
    design: Design,
    limits: float | Sequence[float],
    reference: Reference | SampledReference,
    anti_windup: Asked = "corrected",
    *,
    until_s: float | None = None,
    samples: int = SAMPLES,
    plant: PlantModel | None = None,
    rate_limit: float = math.inf,
    disturbances: Disturbances = UNDISTURBED,
) -> Run:
    """Simulate the loop of Fig. 2.6 around a design from rest, every dead time exact.

    Parameters
    ----------
    design
        Of either kind.
    limits
        Of the actuator in its unit, (lower, upper), or one number for +-limits; infinite for none.
    reference
        r(t) in the plant's output unit.
    anti_windup
        The name of one that the design holds, or one of your own; None (or "none") for no anti-windup.
    until_s
        Length of the run in seconds. Unless given, five periods of the slowest sinusoid; of a constant, ten times the
        recovery time of the corrected anti-windup; of samples, their last time.
    samples
        How many evenly spaced times the run is read at; they do not influence the integration.
    plant
        The true plant; the design's own model unless given.
    rate_limit
        The most that the actuator's output changes in a second, in its unit. The controller knows the limits and not
        the rate: u_tilde stays u - sat(u), see :func:`experiments.runs.design_loop.design_loop`.
    disturbances
        At the plant's input and output, and measurement noise.

    Returns
    -------
    Run
        See :class:`experiments.engine.simulate.Run`.

    Raises
    ------
    InputError
        The design holds no such anti-windup, fewer samples than two are asked for, the reference leaves the region of
        an unstable plant or the run is too long for it (:mod:`experiments.runs.region`), or see
        :func:`experiments.engine.simulate.simulate`.
    """
    if samples < 2:
        raise InputError(f"the number of samples is {samples}; expected 2 or more")
    if until_s is None:
        until_s = PERIODS * span(design, reference) if isinstance(reference, Reference) else reference.time_s[-1]
    require_within_region(plant or design.loop_plant, reference, limit_pair(limits))
    require_short(plant or design.loop_plant, until_s)
    loop = design_loop(design, reference, anti_windup, plant, disturbances)
    return simulate(loop, limit_pair(limits), np.linspace(0.0, until_s, samples), rate=rate_limit)
