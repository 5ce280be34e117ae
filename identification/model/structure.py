"""What a fit has to choose before any number: integrators, zeros and poles; and the parameters that follow from it."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from identification.base.arrays import Flags, Real, Whole
from identification.model.plant import Mode, PlantModel


@dataclass(frozen=True, order=True)
class Structure:
    """K/s^integrators times a polynomial of degree ``zeros`` over one of degree ``poles`` times exp(-h s).

    A polynomial of degree d with all its roots in the left half plane is d // 2 modes, two real roots being a mode
    with zeta >= 1, and d % 2 real roots. So degrees say all: there are no two ways to write the same plant.

    The parameters theta, (zeros + poles + 2,), are log |K|, then log omega and log zeta of the zero modes and of the
    pole modes, then log rate of the real zero and of the real pole if there are any, then the delay.
    """

    integrators: int
    zeros: int
    poles: int

    @property
    def proper(self) -> bool:
        """Whether there are no more zeros than poles."""
        return 0 <= self.zeros <= self.poles + self.integrators and self.poles >= 0

    @property
    def modes(self) -> tuple[int, int]:
        """Numbers of zero modes and of pole modes."""
        return self.zeros // 2, self.poles // 2

    @property
    def real(self) -> tuple[int, int]:
        """Numbers of real zeros and of real poles, each 0 or 1."""
        return self.zeros % 2, self.poles % 2

    @property
    def size(self) -> int:
        """Number of parameters."""
        return self.zeros + self.poles + 2

    def __str__(self) -> str:
        counts = (self.integrators, *self.modes, *self.real)
        names = ("integrator", "zero mode", "pole mode", "real zero", "real pole")
        words = [f"{n} {name}{'s' if n > 1 else ''}" for n, name in zip(counts, names, strict=True) if n]
        return ", ".join(words) or "a gain"

    @property
    def parts(self) -> tuple[slice, slice, slice, slice]:
        """Where theta holds the zero modes, the pole modes, the real zero and the real pole."""
        ends = np.cumsum([1, 2 * self.modes[0], 2 * self.modes[1], *self.real])
        return tuple(slice(int(a), int(b)) for a, b in pairwise(ends))  # type: ignore[return-value]

    def split(self, theta: Real) -> tuple[Real, Real, Real, Real]:
        """Zero modes (n, 2), pole modes (n, 2), real zeros and real poles of theta, all logarithms."""
        zero_modes, pole_modes, real_zeros, real_poles = (theta[part] for part in self.parts)
        return zero_modes.reshape(-1, 2), pole_modes.reshape(-1, 2), real_zeros, real_poles

    def frequencies(self) -> Flags:
        """(zeros + poles + 2,) where theta is the logarithm of a frequency."""
        is_frequency = np.zeros(self.size, dtype=bool)
        for part, step in zip(self.parts, (2, 2, 1, 1), strict=True):
            is_frequency[part.start : part.stop : step] = True
        return is_frequency

    def in_order(self, theta: Real) -> Whole:
        """The order of theta's entries that sorts zero modes and pole modes by omega."""
        order = np.arange(theta.size)
        for part in self.parts[:2]:
            pairs = order[part].reshape(-1, 2)
            order[part] = pairs[np.argsort(theta[pairs[:, 0]], kind="stable")].ravel()
        return order

    def plant(self, theta: Real, sign: float) -> PlantModel:
        """The plant of theta in physical units; ``sign`` is the gain's."""
        zero_modes, pole_modes, real_zeros, real_poles = self.split(theta)
        return PlantModel(
            gain=float(sign * np.exp(theta[0])),
            zero_modes=tuple(Mode(float(omega), float(zeta)) for omega, zeta in np.exp(zero_modes)),
            pole_modes=tuple(Mode(float(omega), float(zeta)) for omega, zeta in np.exp(pole_modes)),
            delay_s=float(theta[-1]),
            integrators=self.integrators,
            real_zeros=tuple(float(rate) for rate in np.exp(real_zeros)),
            real_poles=tuple(float(rate) for rate in np.exp(real_poles)),
        )


def in_physical_units(theta: Real, errors: Real) -> Real:
    """Standard errors (p,) of theta, all logarithms but the delay, as those of the parameters themselves."""
    return np.asarray(errors * np.append(np.exp(theta[:-1]), 1.0))


@dataclass(frozen=True)
class Wanted:
    """The structures that the user admits: None leaves a number to the data.

    Parameters
    ----------
    integrators
        0, 1 or 2.
    modes
        Numbers of zero modes and of pole modes.
    real
        Numbers of real zeros and of real poles, each 0 or 1.
    """

    integrators: int | None = None
    modes: tuple[int, int] | None = None
    real: tuple[int, int] | None = None

    def admits(self, structure: Structure) -> bool:
        """Whether ``structure`` is proper and has the numbers asked for."""
        return (
            structure.proper
            and self.integrators in (None, structure.integrators)
            and self.modes in (None, structure.modes)
            and self.real in (None, structure.real)
        )
