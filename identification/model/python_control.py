"""Gain, roots and dead time <-> python-control's transfer functions; python-control is imported on request."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from identification.base.errors import InputError

if TYPE_CHECKING:
    from control import TransferFunction


class Roots(NamedTuple):
    """gain * prod(s - zero)/prod(s - pole), roots in rad/s."""

    gain: float
    zeros: tuple[complex, ...]
    poles: tuple[complex, ...]


def to_control(
    gain: float, zeros: Sequence[complex], poles: Sequence[complex], delay_s: float, pade_order: int, name: str
) -> TransferFunction:
    """gain * prod(s - zero)/prod(s - pole) * exp(-delay_s s) as python-control's transfer function.

    Parameters
    ----------
    gain, zeros, poles
        Real leading coefficient; roots in rad/s.
    delay_s
        Dead time in seconds, which python-control has no exact form for.
    pade_order
        Order of the Pade approximation that stands for the dead time; 0 leaves the dead time out, which the name of
        the system then says.
    name
        Of the system.

    Raises
    ------
    InputError
        The order is negative.
    """
    import control

    if pade_order < 0:
        raise InputError(f"the order of the Pade approximation is {pade_order}; expected 0 or more")
    if delay_s and not pade_order:
        name = f"{name} without its dead time"
    system = control.tf(gain * np.poly(zeros).real, np.poly(poles).real)
    if delay_s and pade_order:
        system *= control.tf(*control.pade(delay_s, pade_order))
    system.name = name
    return system


def from_control(system: object) -> Roots:
    """The gain and the roots of a python-control system: continuous, one input and one output.

    Raises
    ------
    InputError
        The system is another, or has a number that is not real and finite.
    """
    import control

    try:
        rational = control.tf(system)
    except (TypeError, ValueError) as error:
        raise InputError(f"{type(system).__name__} is no transfer function ({error})") from None
    if not rational.issiso():
        raise InputError(
            f"the system has {rational.ninputs} inputs and {rational.noutputs} outputs; expected one of each"
        )
    if rational.isdtime(strict=True):
        raise InputError(f"the system is of discrete time, dt = {rational.dt}; expected continuous time")
    numerator, denominator = (np.trim_zeros(part[0][0], "f") for part in (rational.num, rational.den))
    if not (np.isfinite([*numerator, *denominator]).all() and numerator.size):
        raise InputError("the system's transfer function is 0 or not finite; expected finite numbers")
    zeros, poles = (tuple(complex(root) for root in np.roots(part)) for part in (numerator, denominator))
    return Roots(float(numerator[0] / denominator[0]), zeros, poles)
