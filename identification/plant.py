"""The plant of Thesis Eq. (2.20) and the additive bound of (2.22), each as gain, modes and exact delay."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from identification.files import InputError

Complex = NDArray[np.complex128]


def _finite(**numbers: float) -> None:
    for name, number in numbers.items():
        if not (isinstance(number, int | float) and math.isfinite(number)):
            raise InputError(f"{name} is {number!r}; expected a finite real number")


def _positive(**numbers: float) -> None:
    _finite(**numbers)
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
        Damping ratio, positive: the factor's roots lie in the open left half plane.
    """

    omega: float
    zeta: float

    def __post_init__(self) -> None:
        _positive(omega=self.omega, zeta=self.zeta)

    def __call__(self, s: ArrayLike) -> Complex:
        """Evaluate the factor at complex frequencies ``s`` (any shape, rad/s)."""
        x: Complex = np.asarray(s, dtype=np.complex128) / self.omega
        return np.asarray(1 + (2 * self.zeta + x) * x)

    @property
    def roots(self) -> tuple[complex, complex]:
        """The two roots in rad/s, conjugate (zeta < 1) or real."""
        spread = np.sqrt(complex(self.zeta**2 - 1))
        # Vieta for the small one: -zeta + spread cancels when zeta is large.
        far = -self.zeta - spread
        return complex(self.omega * far), complex(self.omega / far)


@dataclass(frozen=True)
class PlantModel:
    """P(s) = gain/s * prod(zero modes)/prod(pole modes) * exp(-delay_s s), Thesis Eq. (2.20) and (3.1).

    Parameters
    ----------
    gain
        K in output units per second and input unit, not zero; its sign is the plant's.
    zero_modes, pole_modes
        Anti-resonances and resonances; as many zero modes as pole modes, or fewer.
    delay_s
        The dead time h = T_d in seconds, not negative. Evaluated exactly, never as a rational function.
    """

    gain: float
    zero_modes: tuple[Mode, ...]
    pole_modes: tuple[Mode, ...]
    delay_s: float

    def __post_init__(self) -> None:
        _finite(gain=self.gain, delay_s=self.delay_s)
        if self.gain == 0:
            raise InputError("the plant's gain is 0; expected any other number")
        if self.delay_s < 0:
            raise InputError(f"delay_s is {self.delay_s:g}; expected zero or a positive number of seconds")
        if len(self.zero_modes) > len(self.pole_modes):
            raise InputError(
                f"the plant has {len(self.zero_modes)} zero modes and {len(self.pole_modes)} pole modes; "
                "expected no more zero modes than pole modes"
            )

    def __call__(self, s: ArrayLike) -> Complex:
        """Evaluate P at complex frequencies ``s`` (any shape, rad/s), mode by mode."""
        s = np.asarray(s, dtype=np.complex128)
        value: Complex = np.asarray(self.gain / s * np.exp(-self.delay_s * s))
        for mode in self.zero_modes:
            value = value * mode(s)
        for mode in self.pole_modes:
            value = value / mode(s)
        return value

    def without_delay(self) -> PlantModel:
        """The delay-free factor G(s) of chapter 2."""
        return replace(self, delay_s=0.0)


@dataclass(frozen=True)
class AdditiveBound:
    """W_a(s) = gain (1 + s/corner) / (1 + 2 zeta s/omega + (s/omega)^2), Thesis Eq. (2.22).

    Parameters
    ----------
    gain
        |W_a(0)| in the plant's units, positive.
    corner, omega
        Zero and resonance in rad/s, positive.
    zeta
        Damping ratio of the resonance, positive.
    """

    gain: float
    corner: float
    omega: float
    zeta: float

    def __post_init__(self) -> None:
        _positive(gain=self.gain, corner=self.corner, omega=self.omega, zeta=self.zeta)

    def __call__(self, s: ArrayLike) -> Complex:
        """Evaluate W_a at complex frequencies ``s`` (any shape, rad/s)."""
        s = np.asarray(s, dtype=np.complex128)
        return self.gain * (1 + s / self.corner) / Mode(self.omega, self.zeta)(s)
