"""What a fit has to choose before any number: integrators, zeros and poles; and the parameters that follow from it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise

import numpy as np

from identification.base.arrays import Flags, Real, Whole
from identification.base.errors import InputError
from identification.model.modes import Mode
from identification.model.plant import PlantModel

MOST_REAL = 3
"""Real zeros, and real poles, that can be asked for."""


@dataclass(frozen=True, order=True)
class Structure:
    """K/s^integrators times a polynomial of zeros over one of poles times exp(-h s), with the half planes of its roots.

    A polynomial of degree d with all its roots in one half plane is d // 2 modes, two real roots being a mode
    with zeta >= 1, and d % 2 real roots. So degrees say all: there are no two ways to write the same plant, but for
    ``real_pairs``.

    The parameters theta, (zeros + right + poles + 2,), are log |K|, then log omega and log |zeta| of the zero modes
    (left half plane, then right) and of the pole modes, then the log rates of the real zeros (left, then right) and of
    the real poles, then the delay.

    Parameters
    ----------
    integrators
        Poles at s = 0, of INTEGRATORS.
    zeros, right
        Degrees of the zeros' polynomials: left of the imaginary axis, and right of it.
    poles
        Degree of the poles' polynomial; they lie left of the axis.
    delayed
        Whether there is a dead time to find; theta holds one in any case.
    real_pairs
        Of left zeros, right zeros and poles, how many modes are written as two real roots each.
    """

    integrators: int
    zeros: int
    poles: int
    right: int = 0
    delayed: bool = True
    real_pairs: tuple[int, int, int] = (0, 0, 0)

    @classmethod
    def of(cls, plant: PlantModel, *, delayed: bool = True) -> Structure:
        """The structure of a plant whose modes and real roots are written as they are.

        Raises
        ------
        InputError
            A pole lies in the right half plane, or a mode on the imaginary axis.
        """
        if plant.unstable_poles or any(mode.zeta == 0 for mode in (*plant.zero_modes, *plant.pole_modes)):
            raise InputError(
                "the plant has poles in the right half plane or undamped modes; expected neither, as in a fit"
            )
        right = [mode.zeta < 0 for mode in plant.zero_modes].count(True), [a < 0 for a in plant.real_zeros].count(True)
        left = len(plant.zero_modes) - right[0], len(plant.real_zeros) - right[1]
        sides = left, right, (len(plant.pole_modes), len(plant.real_poles))
        zeros, zeros_right, poles = (2 * modes + rates for modes, rates in sides)
        pairs = [rates // 2 for _, rates in sides]
        return cls(plant.integrators, zeros, poles, zeros_right, delayed, (pairs[0], pairs[1], pairs[2]))

    def theta(self, plant: PlantModel) -> Real:
        """Theta (size,) of a plant of this structure; modes sorted by omega and real roots by rate, each kind apart."""
        modes = [*sorted(plant.zero_modes, key=lambda mode: mode.zeta < 0), *plant.pole_modes]
        rates = [*sorted(plant.real_zeros, key=lambda rate: rate < 0), *plant.real_poles]
        values = [plant.gain, *(each for mode in modes for each in (mode.omega, mode.zeta)), *rates]
        theta = np.append(np.log(np.abs(values)), plant.delay_s)
        return np.asarray(theta[self.in_order(theta)])

    @property
    def proper(self) -> bool:
        """Whether no polynomial is of a negative degree and there are no more zeros than poles."""
        polynomials_exist = all(
            modes >= 0 and degree >= 0 for (modes, _), degree in zip(self.sides, self.degrees, strict=True)
        )
        return polynomials_exist and self.zeros + self.right <= self.poles + self.integrators

    @property
    def degrees(self) -> tuple[int, int, int]:
        """Of the left zeros, of the right zeros and of the poles."""
        return self.zeros, self.right, self.poles

    @cached_property
    def sides(self) -> tuple[tuple[int, int], tuple[int, int], tuple[int, int]]:
        """Modes and real roots of the left zeros, of the right zeros and of the poles."""
        of_each = zip(self.degrees, self.real_pairs, strict=True)
        counts = [(degree // 2 - pairs, degree % 2 + 2 * pairs) for degree, pairs in of_each]
        return counts[0], counts[1], counts[2]

    @cached_property
    def modes(self) -> tuple[int, int]:
        """Numbers of zero modes and of pole modes."""
        left, right, poles = (modes for modes, _ in self.sides)
        return left + right, poles

    @cached_property
    def real(self) -> tuple[int, int]:
        """Numbers of real zeros and of real poles."""
        left, right, poles = (rates for _, rates in self.sides)
        return left + right, poles

    @cached_property
    def size(self) -> int:
        """Length of theta."""
        return self.zeros + self.right + self.poles + 2

    @property
    def free(self) -> int:
        """Number of parameters that the data choose."""
        return self.size - (not self.delayed)

    def __str__(self) -> str:
        (left_modes, left_rates), (right_modes, right_rates), (pole_modes, real_poles) = self.sides
        counts = {
            "integrator": max(self.integrators, 0),
            "differentiator": max(-self.integrators, 0),
            "zero mode": left_modes,
            "right-half-plane zero mode": right_modes,
            "pole mode": pole_modes,
            "real zero": left_rates,
            "right-half-plane real zero": right_rates,
            "real pole": real_poles,
        }
        words = [f"{n} {name}{'s' if n > 1 else ''}" for name, n in counts.items() if n] or ["a gain"]
        return ", ".join([*words, *([] if self.delayed else ["no dead time"])])

    @cached_property
    def counts(self) -> tuple[int, ...]:
        """Integrators, then the lengths of :attr:`parts`: modes and real roots of left zeros, right zeros and poles."""
        return (self.integrators, *(modes for modes, _ in self.sides), *(rates for _, rates in self.sides))

    @cached_property
    def parts(self) -> tuple[slice, ...]:
        """Where theta holds the modes of left zeros, right zeros and poles, then the real roots of the same."""
        ends = np.cumsum([1, *(2 * modes for modes in self.counts[1:4]), *self.counts[4:]])
        return tuple(slice(int(a), int(b)) for a, b in pairwise(ends))

    def split(self, theta: Real) -> tuple[Real, ...]:
        """Modes (n, 2) of left zeros, right zeros and poles, then the real roots of the same, all logarithms."""
        parts = [theta[part] for part in self.parts]
        return (*(modes.reshape(-1, 2) for modes in parts[:3]), *parts[3:])

    def frequencies(self) -> Flags:
        """(size,) where theta is the logarithm of a frequency."""
        is_frequency = np.zeros(self.size, dtype=bool)
        for part, step in zip(self.parts, (2, 2, 2, 1, 1, 1), strict=True):
            is_frequency[part.start : part.stop : step] = True
        return is_frequency

    def in_order(self, theta: Real) -> Whole:
        """The order of theta's entries that sorts modes by omega and real roots by rate, each kind apart."""
        order = np.arange(theta.size)
        for part, step in zip(self.parts, (2, 2, 2, 1, 1, 1), strict=True):
            groups = order[part].reshape(-1, step)
            order[part] = groups[np.argsort(theta[groups[:, 0]], kind="stable")].ravel()
        return order

    def with_real_roots(self, theta: Real) -> tuple[Structure, Real]:
        """The structure and theta (size,) in which two real roots are written as such and not as a mode of zeta > 1."""
        parts = list(self.split(theta))
        pairs = list(self.real_pairs)
        for side in range(3):
            modes, rates = parts[side], parts[3 + side]
            overdamped = modes[:, 1] > 0
            spread = np.arccosh(np.exp(np.maximum(modes[overdamped, 1], 0)))
            middle = modes[overdamped, 0]
            parts[side] = modes[~overdamped]
            parts[3 + side] = np.concatenate([rates, middle - spread, middle + spread])
            pairs[side] += int(overdamped.sum())
        there = replace(self, real_pairs=(pairs[0], pairs[1], pairs[2]))
        return there, np.concatenate([theta[:1], *(part.ravel() for part in parts), theta[-1:]])

    def plant(self, theta: Real, sign: float) -> PlantModel:
        """The plant of theta in physical units; ``sign`` is the gain's."""
        left_modes, right_modes, pole_modes, left_rates, right_rates, real_poles = map(np.exp, self.split(theta))
        return PlantModel(
            gain=float(sign * np.exp(theta[0])),
            zero_modes=(*_modes(left_modes, 1), *_modes(right_modes, -1)),
            pole_modes=_modes(pole_modes, 1),
            delay_s=float(theta[-1]),
            integrators=self.integrators,
            real_zeros=(*left_rates.tolist(), *(-right_rates).tolist()),
            real_poles=tuple(real_poles.tolist()),
        )

    def signs(self) -> Real:
        """(size,) of the plant's parameters but the gain: -1 for what the right half plane makes negative."""
        signs = np.ones(self.size)
        _, right_modes, _, _, right_rates, _ = self.parts
        signs[right_modes.start + 1 : right_modes.stop : 2] = signs[right_rates] = -1
        return signs


def _modes(modes: Real, side: int) -> tuple[Mode, ...]:
    """Modes of omega and zeta (n, 2), of negative damping where ``side`` is -1."""
    return tuple(Mode(omega, side * zeta) for omega, zeta in modes.tolist())


def in_physical_units(theta: Real, errors: Real) -> Real:
    """Standard errors (p,) of theta, all logarithms but the delay, as those of the parameters themselves."""
    return np.asarray(errors * np.append(np.exp(theta[:-1]), 1.0))


@dataclass(frozen=True)
class Wanted:
    """The structures that the user admits: None leaves a number to the data.

    Parameters
    ----------
    integrators
        One of INTEGRATORS.
    modes
        Numbers of zero modes and of pole modes.
    real
        Numbers of real zeros and of real poles, each up to MOST_REAL.
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
