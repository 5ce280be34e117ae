"""Where limits can hold a plant with a pole in the open right half plane, and the references that leave it."""

from __future__ import annotations

import math

from experiments.runs.references import Reference, SampledReference
from identification.base.digits import told_apart
from identification.base.errors import InputError
from identification.model.plant import PlantModel


def require_within_region(
    plant: PlantModel, reference: Reference | SampledReference, limits: tuple[float, float]
) -> None:
    """Refuse a reference that takes an unstable plant out of the region in which the limits can hold it.

    Parameters
    ----------
    plant
        The true plant.
    reference
        r(t); samples are judged by their largest and least value, held as constants.
    limits
        (lower, upper), in the actuator's unit.

    Raises
    ------
    InputError
        The plant has a pole p with Re p > 0 and its control on the reference reaches a limit.

    Notes
    -----
    The mode of a real pole obeys z' = p z + u in the control's unit: from |z| > L/p on it grows whatever |u| <= L is.
    On a constant it stands at |u|/p, so that a reference whose control reaches L stands on the border. That a control
    stays within the limits is necessary and not sufficient: a transient may leave the region, and the run diverges.
    """
    if not plant.unstable_poles:
        return
    if isinstance(reference, SampledReference):
        at_rest = float(abs(plant.without_delay()(0j))) if plant.integrators <= 0 else math.inf
        needed = float(abs(reference.values).max()) / at_rest
    else:
        needed = reference.required(plant).value
    low, high = limits
    nearer = min(-low, high)
    if needed >= nearer:
        pole = max(plant.unstable_poles, key=lambda pole: pole.real)
        control, limit = told_apart(needed, nearer, 4, lambda value, digits: f"{value:.{digits}g}")
        raise InputError(
            f"the plant has a pole at {pole:.4g} rad/s in the right half plane and the reference takes a control of "
            f"{control}, the nearer limit is {limit}: once the control is at its limit the plant escapes for ever; "
            f"expected a reference of less than {nearer / needed:.3g} times this one"
        )
