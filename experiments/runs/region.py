"""Where limits can hold a plant with a pole in the open right half plane: the references and the runs that leave it."""

from __future__ import annotations

import cmath
import math

from experiments.runs.references import Reference, SampledReference
from experiments.runs.steady_control import Wave, peak, response, steady_constant
from identification.base.digits import lower_end
from identification.base.errors import InputError
from identification.model.plant import PlantModel

GROWTH = 25.0
"""Time constants of the fastest unstable pole that a run lasts at most: its rounding has grown to 1e-5 by then."""


def require_within_region(
    plant: PlantModel, reference: Reference | SampledReference, limits: tuple[float, float]
) -> None:
    """Refuse a reference that takes an unstable plant out of the region in which the limits can hold it.

    Parameters
    ----------
    plant
        The true plant.
    reference
        r(t); samples are judged by their last value, which is held for ever.
    limits
        (lower, upper), in the actuator's unit.

    Raises
    ------
    InputError
        The plant has a pole p with Re p > 0, and its mode on the reference reaches the border of the region.

    Notes
    -----
    The mode obeys z' = p z + u in the control's unit. With u between the limits a real p lets z be held only between
    -upper/p and -lower/p. A control amplitude sin(omega t) moves it by amplitude/|j omega - p|. For a pair of poles the
    wider interval with Re p is taken. That z on the reference stays inside is necessary and not sufficient: a transient
    may leave the region, and the run diverges.
    """
    low, high = limits
    if not plant.unstable_poles or math.isinf(high - low):
        return
    if isinstance(reference, SampledReference):
        constant, sinusoids = steady_constant(plant, float(reference.values[-1]), 0.0), []
    else:
        parts = zip(reference.amplitudes, reference.omegas, reference.phases_rad, strict=True)
        sinusoids = [response(plant, *part) for part in parts if part[1] > 0]
        constant = steady_constant(plant, math.fsum(reference.constants), reference.slope)
    for pole in plant.unstable_poles:
        waves = [_moved(wave, pole) for wave in sinusoids]
        middle, half = -(low + high) / (2 * pole.real), (high - low) / (2 * pole.real)
        at_rest = -constant / pole.real if pole.imag == 0 else middle
        reached = peak(waves, at_rest - middle).value / half if math.isfinite(constant) else math.inf
        if reached >= 1:
            raise InputError(
                f"the plant has a pole at {pole:.4g} rad/s in the right half plane, and the reference needs a state of "
                f"its mode {reached:.4g} times the largest that the limits {low:g} to {high:g} can hold; expected a "
                "smaller reference or wider limits"
            )


def longest_run(plant: PlantModel) -> float:
    """The time in seconds within which the rounding of a run with an unstable pole does not show; else infinite."""
    fastest = max((pole.real for pole in plant.unstable_poles), default=0.0)
    return GROWTH / fastest if fastest else math.inf


def require_short(plant: PlantModel, until_s: float) -> None:
    """Refuse a run in which the engine's own rounding, which grows like exp(p t) with an unstable pole, would show.

    Raises
    ------
    InputError
        The run is longer than :data:`GROWTH` time constants of the plant's fastest unstable pole.
    """
    longest = longest_run(plant)
    if until_s > longest:
        fastest = GROWTH / longest
        raise InputError(
            f"the run lasts {until_s:.9g} s; expected at most {lower_end(longest, 4)} s, since the plant's pole at "
            f"{fastest:.4g} rad/s in the right half plane amplifies rounding errors (sampled has no such limit)"
        )


def _moved(wave: Wave, pole: complex) -> Wave:
    """What a wave of the control makes of the mode of a pole."""
    turned = 1j * wave.omega - pole
    return Wave(wave.amplitude / abs(turned), wave.omega, wave.phase_rad - cmath.phase(turned), wave.doubt)
