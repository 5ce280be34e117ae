"""Gain, roots and dead time <-> python-control's transfer functions; python-control is imported on request."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from identification.base.arrays import Real
from identification.base.errors import InputError

if TYPE_CHECKING:
    from control import TransferFunction

ROUNDING = 1e-10
"""Of what norms allow, below which a Markov parameter is taken for 0."""


class Roots(NamedTuple):
    """gain * prod(s - zero)/prod(s - pole), roots in rad/s."""

    gain: float
    zeros: tuple[complex, ...]
    poles: tuple[complex, ...]


def lowest(gain: float, zeros: Sequence[complex], poles: Sequence[complex]) -> float:
    """The factor before prod(1 - s/zero)/prod(1 - s/pole), of the leading coefficient ``gain``; no root is 0.

    With zeros and poles exchanged the leading coefficient, of that factor.
    """
    return float((gain * np.prod(np.negative(zeros)) / np.prod(np.negative(poles))).real)


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

    Of a state space the poles are the eigenvalues of A, the relative degree that of the first Markov parameter that
    rounding does not explain, and the zeros as many of the system pencil's as that leaves, those of least size.

    Raises
    ------
    InputError
        The system is another, or has a number that is not real and finite.
    """
    import control

    if not isinstance(system, control.StateSpace | control.TransferFunction):
        raise InputError(f"the system is a {type(system).__name__}; expected a transfer function or a state space")
    if not system.issiso():
        raise InputError(f"the system has {system.ninputs} inputs and {system.noutputs} outputs; expected one of each")
    if system.isdtime(strict=True):
        raise InputError(f"the system is of discrete time, dt = {system.dt}; expected continuous time")
    if isinstance(system, control.StateSpace):
        return _roots_of_state_space(system.A, system.B[:, 0], system.C[0], float(system.D[0, 0]))
    numerator, denominator = (np.trim_zeros(part[0][0], "f") for part in (system.num, system.den))
    if not (np.isfinite([*numerator, *denominator]).all() and numerator.size):
        raise InputError("the system's transfer function is 0 or not finite; expected finite numbers")
    zeros, poles = (tuple(complex(root) for root in np.roots(part)) for part in (numerator, denominator))
    return Roots(float(numerator[0] / denominator[0]), zeros, poles)


def _roots_of_state_space(A: Real, b: Real, c: Real, d: float) -> Roots:
    from scipy.linalg import eigvals

    n, size = len(b), max(1e-300, float(np.linalg.norm(A, 2))) if len(b) else 1.0
    if not np.isfinite([*A.ravel(), *b, *c, d]).all():
        raise InputError("the state space is not finite; expected finite numbers")
    markov, least, vector = d, ROUNDING * float(np.linalg.norm(b) * np.linalg.norm(c)) / size, b
    degree = 0
    while degree <= n and abs(markov) <= least:
        degree, markov, least, vector = degree + 1, float(c @ vector), least * size, A @ vector
    if degree > n:
        raise InputError("the system's transfer function is 0; expected a system that responds")
    pencil = np.block([[A, b[:, None]], [c[None, :], np.array([[d]])]])
    found = eigvals(pencil, np.diag([1.0] * n + [0.0]))
    zeros = sorted(found[np.isfinite(found)], key=abs)[: n - degree]
    return Roots(markov, tuple(complex(z) for z in zeros), tuple(complex(p) for p in np.linalg.eigvals(A)))
