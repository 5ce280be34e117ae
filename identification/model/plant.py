"""The plant of Thesis Eq. (2.20) and the additive bound of (2.22), each as gain, modes and exact delay."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from numbers import Real
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from identification.base.arrays import Complex
from identification.base.errors import InputError, shown
from identification.model.parameter import Parameter
from identification.model.python_control import from_control, lowest, to_control

if TYPE_CHECKING:
    from control import TransferFunction

NEAR_ZERO = 1e-7
"""Of the fastest root's modulus, within which a pole may be at s = 0 but for rounding."""
HIGHEST_ORDER = 8
"""Most poles of an additive bound that is fitted."""


def _finite(**numbers: float) -> None:
    for name, number in numbers.items():
        if isinstance(number, bool | np.bool_) or not (isinstance(number, Real) and math.isfinite(number)):
            raise InputError(f"{name} is {shown(number)}; expected a finite real number")


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
        Damping ratio, not zero: positive for roots in the open left half plane, negative for the right.
    """

    omega: float
    zeta: float

    def __post_init__(self) -> None:
        _positive(omega=self.omega)
        _finite(zeta=self.zeta)
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
        Anti-resonances, of negative damping for zeros in the right half plane, and resonances.
    delay_s
        The dead time h = T_d in seconds, not negative. Evaluated exactly, never as a rational function.
    integrators
        -2 to 2; a negative number counts zeros at s = 0, as a measured velocity or acceleration has.
    real_zeros, real_poles
        Rates a in rad/s of factors 1 + s/a: positive, or negative for a zero in the right half plane.

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
        _finite(gain=self.gain, delay_s=self.delay_s)
        for name in ("gain", "delay_s"):
            object.__setattr__(self, name, float(getattr(self, name)))
        if self.gain == 0:
            raise InputError("the plant's gain is 0; expected any other number")
        if self.delay_s < 0:
            raise InputError(f"delay_s is {self.delay_s:g}; expected zero or a positive number of seconds")
        if isinstance(self.integrators, bool) or self.integrators not in (-2, -1, 0, 1, 2):
            raise InputError(f"integrators is {shown(self.integrators)}; expected an integer from -2 to 2")
        _left(real_poles=self.real_poles, pole_modes=self.pole_modes)
        for rate in self.real_zeros:
            _finite(**{"a number of real_zeros": rate})
            if rate == 0:
                raise InputError("a number of real_zeros is 0; expected any other number (integrators counts s = 0)")
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
        return np.asarray(lead * _quotient(self.zero_modes, self.real_zeros, self.pole_modes, self.real_poles, s))

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
        zeros = _roots(self.zero_modes, self.real_zeros)
        return tuple(zero for zero in zeros if zero.real > 0)

    def without_delay(self) -> PlantModel:
        """The delay-free factor G(s) of chapter 2."""
        return replace(self, delay_s=0.0)

    def to_control(self, pade_order: int = 0) -> TransferFunction:
        """P(s) as python-control's transfer function, see :func:`identification.model.python_control.to_control`."""
        zeros, poles = _roots(self.zero_modes, self.real_zeros), _roots(self.pole_modes, self.real_poles)
        gain = lowest(self.gain, poles, zeros)
        zeros, poles = [*zeros, *[0j] * -self.integrators], [*poles, *[0j] * self.integrators]
        return to_control(gain, zeros, poles, self.delay_s, pade_order, "P")

    @classmethod
    def from_control(cls, system: object, delay_s: float = 0.0, integrators: int | None = None) -> PlantModel:
        """The plant of a python-control system and a dead time in seconds.

        ``integrators`` says how many of the slowest poles are at s = 0; unless given, those that are there exactly.
        Zeros at s = 0 are those that are there exactly.

        Raises
        ------
        InputError
            See :func:`identification.model.python_control.from_control`; a pole lies right of the imaginary axis; a
            root lies on it but not at s = 0; or rounding hides whether a pole is at s = 0, see :data:`NEAR_ZERO`.
        """
        gain, every, found = from_control(system)
        zeros = [zero for zero in every if zero]
        poles = sorted(found, key=abs)
        count = sum(not pole for pole in poles) if integrators is None else integrators
        left = poles[count:]
        if integrators is None and left and abs(left[0]) < NEAR_ZERO * max(map(abs, (*poles, *zeros))):
            raise InputError(
                f"a pole is at {left[0]:.3g} rad/s, which rounding does not tell from 0; expected integrators to say "
                "how many there are"
            )
        (zero_modes, real_zeros), (pole_modes, real_poles) = _factors(zeros), _factors(left)
        count -= len(every) - len(zeros)
        return cls(lowest(gain, zeros, left), zero_modes, pole_modes, delay_s, count, real_zeros, real_poles)


@dataclass(frozen=True)
class AdditiveBound:
    """W_a(s) = gain * prod(zeros)/prod(poles), stable and minimum phase, Thesis Eq. (2.22) in general.

    (2.22) itself has one real zero and one resonance, see :meth:`printed_form`.

    Parameters
    ----------
    gain
        |W_a(0)| in the plant's units, positive.
    zero_modes, pole_modes
        Pairs of zeros and of poles.
    real_zeros, real_poles
        Rates a > 0 in rad/s of factors 1 + s/a.

    Raises
    ------
    InputError
        A number is out of its range, there is no pole, or there are more zeros than poles.
    """

    gain: float
    zero_modes: tuple[Mode, ...]
    pole_modes: tuple[Mode, ...]
    real_zeros: tuple[float, ...] = ()
    real_poles: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        _positive(gain=self.gain)
        _left(real_zeros=self.real_zeros, zero_modes=self.zero_modes)
        _left(real_poles=self.real_poles, pole_modes=self.pole_modes)
        zeros = 2 * len(self.zero_modes) + len(self.real_zeros)
        if not max(1, zeros) <= self.order:
            raise InputError(
                f"the bound has {zeros} zeros and {self.order} poles; expected one pole or more and no more zeros"
            )

    @classmethod
    def printed_form(cls, gain: float, corner: float, omega: float, zeta: float) -> AdditiveBound:
        """gain (1 + s/corner) / (1 + 2 zeta s/omega + (s/omega)^2), Thesis Eq. (2.22)."""
        return cls(gain, (), (Mode(omega, zeta),), (corner,))

    @property
    def order(self) -> int:
        """Number of poles."""
        return 2 * len(self.pole_modes) + len(self.real_poles)

    @property
    def is_printed_form(self) -> bool:
        """Whether it has one real zero and one pair of poles, as (2.22) has."""
        return (len(self.zero_modes), len(self.pole_modes), len(self.real_zeros), len(self.real_poles)) == (0, 1, 1, 0)

    @property
    def corner(self) -> float:
        """Frequency in rad/s of the slowest zero, in (2.22) the only one; of the fastest pole where there is none."""
        zeros = [*self.real_zeros, *(mode.omega for mode in self.zero_modes)]
        return min(zeros) if zeros else max(*self.real_poles, *(mode.omega for mode in self.pole_modes), 0.0)

    @property
    def resonance(self) -> Mode:
        """The least damped pair of poles, in (2.22) the only one; without pairs, zeta = 1 at the slowest pole."""
        if self.pole_modes:
            return min(self.pole_modes, key=lambda mode: mode.zeta)
        return Mode(min(self.real_poles), 1.0)

    def __call__(self, s: ArrayLike) -> Complex:
        """Evaluate W_a at complex frequencies ``s`` (any shape, rad/s)."""
        s = np.asarray(s, dtype=np.complex128)
        shape = _quotient(self.zero_modes, self.real_zeros, self.pole_modes, self.real_poles, s)
        return np.asarray(self.gain * shape)

    def to_control(self) -> TransferFunction:
        """W_a(s) as python-control's transfer function."""
        zeros, poles = _roots(self.zero_modes, self.real_zeros), _roots(self.pole_modes, self.real_poles)
        return to_control(lowest(self.gain, poles, zeros), zeros, poles, 0.0, 0, "W_a")

    @classmethod
    def from_control(cls, system: object) -> AdditiveBound:
        """The bound |system|; raises InputError when it is not stable, minimum phase and as above."""
        gain, zeros, poles = from_control(system)
        (zero_modes, real_zeros), (pole_modes, real_poles) = _factors(zeros), _factors(poles)
        return cls(abs(lowest(gain, zeros, poles)), zero_modes, pole_modes, real_zeros, real_poles)


def _roots(modes: tuple[Mode, ...], rates: tuple[float, ...]) -> list[complex]:
    """The roots in rad/s of a product of modes and factors 1 + s/rate."""
    return [*(root for mode in modes for root in mode.roots), *(complex(-rate) for rate in rates)]


def _factors(roots: Sequence[complex]) -> tuple[tuple[Mode, ...], tuple[float, ...]]:
    """What :func:`_roots` takes from what it returns, each kind in the order of its frequencies."""
    pairs = sorted((root for root in roots if root.imag > 0), key=abs)
    modes = tuple(Mode(abs(root), -root.real / abs(root)) for root in pairs)
    return modes, tuple(sorted(-root.real for root in roots if root.imag == 0))


def _left(**roots: tuple[Mode | float, ...]) -> None:
    """Refuse modes and rates whose roots lie right of the imaginary axis."""
    for name, values in roots.items():
        for value in values:
            of = {f"zeta of {name}": value.zeta} if isinstance(value, Mode) else {f"a number of {name}": value}
            _positive(**of)


def _quotient(
    zero_modes: tuple[Mode, ...],
    real_zeros: tuple[float, ...],
    pole_modes: tuple[Mode, ...],
    real_poles: tuple[float, ...],
    s: Complex,
) -> Complex:
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
