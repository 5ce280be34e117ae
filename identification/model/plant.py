"""The plant of Thesis Eq. (2.20): gain, modes, real roots and exact delay."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from identification.base.arrays import Complex
from identification.base.errors import InputError, shown
from identification.model.modes import Mode, factors_of, quotient, require_finite, roots_of
from identification.model.parameter import Parameter
from identification.model.python_control import from_control, lowest, to_control

if TYPE_CHECKING:
    from control import TransferFunction

INTEGRATORS = range(-2, 3)
"""Poles at s = 0 that a plant may have; a negative number counts zeros there."""
NEAR_ZERO = 1e-7
"""Of the fastest root's modulus, within which a pole may be at s = 0 but for rounding."""


@dataclass(frozen=True)
class PlantModel:
    """P(s) = gain/s^integrators * prod(zeros)/prod(poles) * exp(-delay_s s), Thesis Eq. (2.20) and (3.1).

    The thesis's class has one integrator and complex modes in the left half plane only; real rigs also have none or
    two, zeros at s = 0, real poles and zeros, and zeros in the right half plane. Every other factor is 1 at s = 0.

    Parameters
    ----------
    gain
        K in output units per input unit and second^integrators, not zero; its sign is the plant's.
    zero_modes, pole_modes
        Anti-resonances and resonances; negative damping puts a pair of roots in the right half plane.
    delay_s
        The dead time h = T_d in seconds, not negative. Evaluated exactly, never as a rational function.
    integrators
        -2 to 2; a negative number counts zeros at s = 0, as a measured velocity or acceleration has.
    real_zeros, real_poles
        Rates a in rad/s of factors 1 + s/a: positive, or negative for a root in the right half plane.

    Raises
    ------
    InputError
        A number is out of its range, or there are more zeros than poles.
    """

    gain: float
    zero_modes: tuple[Mode, ...]
    pole_modes: tuple[Mode, ...]
    delay_s: float
    integrators: int = 1
    real_zeros: tuple[float, ...] = ()
    real_poles: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        require_finite(gain=self.gain, delay_s=self.delay_s)
        for name in ("gain", "delay_s"):
            object.__setattr__(self, name, float(getattr(self, name)))
        if self.gain == 0:
            raise InputError("the plant's gain is 0; expected any other number")
        if self.delay_s < 0:
            raise InputError(f"delay_s is {self.delay_s:g}; expected zero or a positive number of seconds")
        if isinstance(self.integrators, bool) or self.integrators not in INTEGRATORS:
            raise InputError(f"integrators is {shown(self.integrators)}; expected an integer from -2 to 2")
        for name in ("real_zeros", "real_poles"):
            for rate in getattr(self, name):
                require_finite(**{f"a number of {name}": rate})
                if rate == 0:
                    raise InputError(f"a number of {name} is 0; expected any other number (integrators counts s = 0)")
        if self.relative_degree < 0:
            zeros = 2 * len(self.zero_modes) + len(self.real_zeros)
            poles = zeros + self.relative_degree
            raise InputError(f"the plant has {zeros} zeros and {poles} poles; expected no more zeros than poles")

    @property
    def relative_degree(self) -> int:
        """Poles, integrators among them, less zeros."""
        modes = len(self.pole_modes) - len(self.zero_modes)
        return self.integrators + 2 * modes + len(self.real_poles) - len(self.real_zeros)

    def __call__(self, s: ArrayLike) -> Complex:
        """Evaluate P at complex frequencies ``s`` (any shape, rad/s), mode by mode."""
        s = np.asarray(s, dtype=np.complex128)
        lead = self.gain / s**self.integrators * np.exp(-self.delay_s * s)
        return np.asarray(lead * quotient(self.zero_modes, self.real_zeros, self.pole_modes, self.real_poles, s))

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Gain; omega and zeta of each zero mode, of each pole mode; real zeros, real poles; dead time."""
        found = [Parameter("gain", 1, "", self.gain)]
        for kind, modes in (("zero", self.zero_modes), ("pole", self.pole_modes)):
            for index, mode in enumerate(modes, 1):
                found += [Parameter(kind, index, what, getattr(mode, what)) for what in ("omega", "zeta")]
        for kind, rates in (("real_zero", self.real_zeros), ("real_pole", self.real_poles)):
            found += [Parameter(kind, index, "", rate) for index, rate in enumerate(rates, 1)]
        return (*found, Parameter("delay_s", 1, "", self.delay_s))

    @property
    def right_zeros(self) -> tuple[complex, ...]:
        """The zeros in the right half plane, rad/s."""
        zeros = roots_of(self.zero_modes, self.real_zeros)
        return tuple(zero for zero in zeros if zero.real > 0)

    @property
    def unstable_poles(self) -> tuple[complex, ...]:
        """The poles in the open right half plane, rad/s; those at s = 0 are ``integrators``."""
        poles = roots_of(self.pole_modes, self.real_poles)
        return tuple(pole for pole in poles if pole.real > 0)

    def without_delay(self) -> PlantModel:
        """The delay-free factor G(s) of chapter 2."""
        return replace(self, delay_s=0.0)

    def to_control(self, pade_order: int = 0) -> TransferFunction:
        """P(s) as python-control's transfer function, see :func:`identification.model.python_control.to_control`."""
        zeros, poles = roots_of(self.zero_modes, self.real_zeros), roots_of(self.pole_modes, self.real_poles)
        gain = lowest(self.gain, poles, zeros)
        zeros, poles = [*zeros, *[0j] * -self.integrators], [*poles, *[0j] * self.integrators]
        return to_control(gain, zeros, poles, self.delay_s, pade_order, "P")

    @classmethod
    def from_control(cls, system: object, delay_s: float = 0.0, integrators: int | None = None) -> PlantModel:
        """The plant of a python-control system and a dead time in seconds.

        ``integrators`` says how many of the slowest poles are at s = 0, or, negative, how many of the slowest zeros;
        unless given, those that are there exactly.

        Raises
        ------
        InputError
            See :func:`identification.model.python_control.from_control`; a root lies on the imaginary axis but not at
            s = 0; or a pole cannot be distinguished from 0, see :data:`NEAR_ZERO`.
        """
        gain, every, found = from_control(system)
        zeros, poles = sorted(every, key=abs), sorted(found, key=abs)
        at_zero = sum(not zero for zero in zeros) if integrators is None else max(0, -integrators)
        count = sum(not pole for pole in poles) if integrators is None else max(0, integrators)
        largest = max(map(abs, (*poles, *zeros)), default=0.0)
        zeros, left = zeros[at_zero:], poles[count:]
        for kind, roots in (("pole", left), ("zero", zeros)):
            if integrators is None and roots and abs(roots[0]) < NEAR_ZERO * largest:
                raise InputError(
                    f"a {kind} at {roots[0]:.3g} rad/s differs from 0 by no more than rounding errors; expected the "
                    "argument integrators, which says how many are at s = 0"
                )
        (zero_modes, real_zeros), (pole_modes, real_poles) = factors_of(zeros), factors_of(left)
        count -= at_zero
        return cls(lowest(gain, zeros, left), zero_modes, pole_modes, delay_s, count, real_zeros, real_poles)
