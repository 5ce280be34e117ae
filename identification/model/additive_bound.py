"""The additive bound W_a, Thesis Eq. (2.22) in general, as gain, modes and real roots."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from identification.base.arrays import Complex
from identification.base.errors import InputError
from identification.model.modes import Mode, factors_of, quotient, require_left, require_positive, roots_of
from identification.model.python_control import from_control, lowest, to_control

if TYPE_CHECKING:
    from control import TransferFunction


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
        require_positive(gain=self.gain)
        require_left(real_zeros=self.real_zeros, zero_modes=self.zero_modes)
        require_left(real_poles=self.real_poles, pole_modes=self.pole_modes)
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
        shape = quotient(self.zero_modes, self.real_zeros, self.pole_modes, self.real_poles, s)
        return np.asarray(self.gain * shape)

    def to_control(self) -> TransferFunction:
        """W_a(s) as python-control's transfer function."""
        zeros, poles = roots_of(self.zero_modes, self.real_zeros), roots_of(self.pole_modes, self.real_poles)
        return to_control(lowest(self.gain, poles, zeros), zeros, poles, 0.0, 0, "W_a")

    @classmethod
    def from_control(cls, system: object) -> AdditiveBound:
        """The bound |system|; raises InputError when it is not stable, minimum phase and as above."""
        gain, zeros, poles = from_control(system)
        (zero_modes, real_zeros), (pole_modes, real_poles) = factors_of(zeros), factors_of(poles)
        return cls(abs(lowest(gain, zeros, poles)), zero_modes, pole_modes, real_zeros, real_poles)
