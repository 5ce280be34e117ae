"""Modes and real roots: factors that are 1 at s = 0, and products of them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from numbers import Real

import numpy as np
from numpy.typing import ArrayLike

from identification.base.arrays import Complex
from identification.base.errors import InputError, shown


def require_finite(**numbers: float) -> None:
    """Raise InputError at the first of the named values that is no finite real number."""
    for name, number in numbers.items():
        if isinstance(number, bool | np.bool_) or not (isinstance(number, Real) and math.isfinite(number)):
            raise InputError(f"{name} is {shown(number)}; expected a finite real number")


def require_positive(**numbers: float) -> None:
    """Raise InputError at the first of the named values that is no positive finite number."""
    require_finite(**numbers)
    for name, number in numbers.items():
        if number <= 0:
            raise InputError(f"{name} is {number:g}; expected a positive number")


@dataclass(frozen=True)
class Mode:
    """One factor 1 + 2 zeta s/omega + (s/omega)^2, normalised to 1 at s = 0.

    Parameters
    ----------
    omega
        Natural frequency in rad/s, positive.
    zeta
        Damping ratio, not zero: positive for roots in the open left half plane, negative for the right.
    """

    omega: float
    zeta: float

    def __post_init__(self) -> None:
        require_positive(omega=self.omega)
        require_finite(zeta=self.zeta)
        if self.zeta == 0:
            raise InputError("zeta is 0; expected a positive number, or a negative one for the right half plane")
        for name in ("omega", "zeta"):
            object.__setattr__(self, name, float(getattr(self, name)))

    def __call__(self, s: ArrayLike) -> Complex:
        """Evaluate the factor at complex frequencies ``s`` (any shape, rad/s)."""
        x: Complex = np.asarray(s, dtype=np.complex128) / self.omega
        return np.asarray(1 + (2 * self.zeta + x) * x)

    @property
    def roots(self) -> tuple[complex, complex]:
        """The two roots in rad/s, conjugate (zeta < 1) or real."""
        spread = np.copysign(1, self.zeta) * np.sqrt(complex(self.zeta**2 - 1))
        # Vieta for the small one: -zeta + spread cancels when zeta is large.
        far = -self.zeta - spread
        return complex(self.omega * far), complex(self.omega / far)


def roots_of(modes: tuple[Mode, ...], rates: tuple[float, ...]) -> list[complex]:
    """The roots in rad/s of a product of modes and factors 1 + s/rate."""
    return [*(root for mode in modes for root in mode.roots), *(complex(-rate) for rate in rates)]


def factors_of(roots: Sequence[complex]) -> tuple[tuple[Mode, ...], tuple[float, ...]]:
    """What :func:`roots_of` takes from what it returns, each kind in the order of its frequencies."""
    pairs = sorted((root for root in roots if root.imag > 0), key=abs)
    modes = tuple(Mode(abs(root), -root.real / abs(root)) for root in pairs)
    return modes, tuple(sorted(-root.real for root in roots if root.imag == 0))


def require_left(**roots: tuple[Mode | float, ...]) -> None:
    """Refuse modes and rates whose roots lie right of the imaginary axis."""
    for name, values in roots.items():
        for value in values:
            of = {f"zeta of {name}": value.zeta} if isinstance(value, Mode) else {f"a number of {name}": value}
            require_positive(**of)


def quotient(
    zero_modes: tuple[Mode, ...],
    real_zeros: tuple[float, ...],
    pole_modes: tuple[Mode, ...],
    real_poles: tuple[float, ...],
    s: Complex,
) -> Complex:
    """The product of the zeros' factors over that of the poles' at complex frequencies ``s`` (any shape, rad/s)."""
    value: Complex = np.ones_like(s)
    for mode in zero_modes:
        value = value * mode(s)
    for mode in pole_modes:
        value = value / mode(s)
    for rate in real_zeros:
        value = value * (1 + s / rate)
    for rate in real_poles:
        value = value / (1 + s / rate)
    return value
