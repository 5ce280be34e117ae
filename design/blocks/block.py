"""A transfer function as gain, zeros, poles and dead time: the one form in which designs are kept and exchanged."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from identification.base.arrays import Complex
from identification.base.errors import InputError, shown
from identification.base.json_object import number, numbers
from identification.model.additive_bound import AdditiveBound
from identification.model.modes import Mode
from identification.model.plant import PlantModel
from identification.model.python_control import from_control, to_control

if TYPE_CHECKING:
    from control import TransferFunction

LARGEST_ROOT = 1e30
"""rad/s: no part of a root that is read from a file may be larger; products of larger ones overflow."""


@dataclass(frozen=True)
class Block:
    """gain * prod(s - zero) / prod(s - pole) * exp(-delay_s s); improper blocks (Lambda, F2) are allowed.

    Parameters
    ----------
    gain
        Real leading coefficient, finite.
    zeros, poles
        Roots in rad/s; complex ones come as conjugate pairs whose members are each other's exact conjugate.
    delay_s
        Dead time in seconds, not negative.
    """

    gain: float
    zeros: tuple[complex, ...] = ()
    poles: tuple[complex, ...] = ()
    delay_s: float = 0.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "gain", float(self.gain))
        object.__setattr__(self, "zeros", _paired(self.zeros))
        object.__setattr__(self, "poles", _paired(self.poles))
        if not (math.isfinite(self.gain) and math.isfinite(self.delay_s)):
            raise InputError(
                f"a block has gain {shown(self.gain)} and delay {shown(self.delay_s)}; expected finite numbers"
            )
        if self.delay_s < 0:
            raise InputError(f"a block has the delay {self.delay_s:g} s; expected zero or more (it must be causal)")

    def __call__(self, s: ArrayLike) -> Complex:
        """Evaluate at complex frequencies ``s`` (any shape, rad/s); not finite at a pole."""
        s = np.asarray(s, dtype=complex)
        value = np.full(s.shape, self.gain, dtype=complex)
        with np.errstate(divide="ignore", invalid="ignore"):
            for k in range(max(len(self.zeros), len(self.poles))):  # interleaved, so that nothing overflows
                if k < len(self.zeros):
                    value = value * (s - self.zeros[k])
                if k < len(self.poles):
                    value = value / (s - self.poles[k])
        return value if self.delay_s == 0 else value * np.exp(-self.delay_s * s)

    def __mul__(self, other: Block) -> Block:
        """The series connection; a pole and a zero that are the same number cancel."""
        zeros, poles = list(self.zeros + other.zeros), []
        for pole in self.poles + other.poles:
            if pole in zeros:
                zeros.remove(pole)
            else:
                poles.append(pole)
        return Block(self.gain * other.gain, tuple(zeros), tuple(poles), self.delay_s + other.delay_s)

    def scaled(self, factor: float) -> Block:
        """``factor`` times this block."""
        return Block(self.gain * factor, self.zeros, self.poles, self.delay_s)

    def shifted(self, sigma: float) -> Block:
        """The rational factor at s + sigma: every root moves by -sigma (rad/s)."""
        zeros, poles = (tuple(root - sigma for root in roots) for roots in (self.zeros, self.poles))
        return Block(self.gain, zeros, poles)

    def inverse(self) -> Block:
        """1/block; raises InputError when it is 0, or has a dead time, whose inverse is not causal."""
        if self.gain == 0:
            raise InputError("a block's gain is 0; expected any other number, for it is inverted")
        return Block(1 / self.gain, self.poles, self.zeros, -self.delay_s)

    def without_delay(self) -> Block:
        """The rational factor."""
        return Block(self.gain, self.zeros, self.poles)

    @property
    def relative_degree(self) -> int:
        """Number of poles minus number of zeros; negative for an improper block."""
        return len(self.poles) - len(self.zeros)

    @property
    def unstable_poles(self) -> tuple[complex, ...]:
        """The poles outside the open left half plane, each as often as it is multiple."""
        return tuple(pole for pole in self.poles if not pole.real < 0)

    @property
    def is_stable(self) -> bool:
        """Whether every pole lies in the open left half plane: of a proper block, Thesis Definition 2.1.1."""
        return not self.unstable_poles

    def to_control(self, pade_order: int = 0) -> TransferFunction:
        """The block as python-control's transfer function, :func:`identification.model.python_control.to_control`."""
        return to_control(self.gain, self.zeros, self.poles, self.delay_s, pade_order, "block")

    @classmethod
    def from_control(cls, system: object, delay_s: float = 0.0) -> Block:
        """The block of a python-control system, :func:`identification.model.python_control.from_control`."""
        return cls(*from_control(system), delay_s)

    def to_dict(self) -> dict[str, Any]:
        """The block as design.json holds it."""
        return {
            "gain": self.gain,
            "zeros": [[root.real, root.imag] for root in self.zeros],
            "poles": [[root.real, root.imag] for root in self.poles],
            "delay_s": self.delay_s,
        }

    @classmethod
    def from_dict(cls, content: Mapping[str, Any]) -> Block:
        """Read what :meth:`to_dict` writes; raises InputError when it is not of that form."""
        try:
            return cls(
                number(content, "gain"),
                _listed(content, "zeros"),
                _listed(content, "poles"),
                number(content, "delay_s"),
            )
        except InputError:
            raise
        except (KeyError, TypeError, ValueError, OverflowError) as error:
            raise InputError(f"a block is not of the form gain, zeros, poles, delay_s ({error})") from None


def _listed(content: Mapping[str, Any], key: str) -> tuple[complex, ...]:
    """The roots at ``key``, a list of pairs of numbers."""
    if not isinstance(content[key], list):
        raise InputError(f"{key} is {shown(content[key])}; expected a list of pairs of numbers")
    roots = tuple(complex(real, imag) for real, imag in (numbers({key: root}, key) for root in content[key]))
    if any(max(abs(root.real), abs(root.imag)) > LARGEST_ROOT for root in roots):
        raise InputError(f"{key} is {shown(content[key])}; expected numbers of at most {LARGEST_ROOT:g} rad/s")
    return roots


def mode_product(gain: float, modes: Iterable[Mode], rates: Iterable[float] = ()) -> Block:
    """gain * prod(1 + 2 zeta s/omega + (s/omega)^2) * prod(1 + s/rate) as a polynomial block."""
    roots: list[complex] = []
    for rate in rates:
        roots.append(complex(-rate))
        gain /= rate
    for mode in modes:
        roots += mode.roots
        gain /= mode.omega**2
    return Block(gain, tuple(roots))


def plant_numerator(plant: PlantModel) -> Block:
    """B(s) of Thesis Eq. (2.3), normalised as (2.20) is: B(s)/s^zeros at 0 -> K at s = 0."""
    return Block(1.0, (0j,) * -plant.integrators) * mode_product(plant.gain, plant.zero_modes, plant.real_zeros)


def plant_denominator(plant: PlantModel) -> Block:
    """A(s) of Thesis Eq. (2.3), normalised as (2.20) is: A(s)/s^integrators -> 1 at s = 0."""
    return Block(1.0, (0j,) * plant.integrators) * mode_product(1.0, plant.pole_modes, plant.real_poles)


def plant_block(plant: PlantModel) -> Block:
    """P(s) = B(s)/A(s) exp(-h s) as a block, Thesis Eq. (2.3) and, with its dead time, (3.11)."""
    rational = plant_numerator(plant) * plant_denominator(plant).inverse()
    return Block(rational.gain, rational.zeros, rational.poles, plant.delay_s)


def bound_block(bound: AdditiveBound) -> Block:
    """W_a(s) of Thesis Eq. (2.22), of any order, as a block."""
    zeros = mode_product(bound.gain, bound.zero_modes, bound.real_zeros)
    return zeros * mode_product(1.0, bound.pole_modes, bound.real_poles).inverse()


def polynomial(block: Block, scale: float = 1.0) -> np.ndarray:
    """Real coefficients, highest power first, of gain * prod(scale x - zero), a polynomial in x = s/scale.

    Raises
    ------
    InputError
        The block has poles or a dead time.
    """
    if block.poles or block.delay_s:
        raise InputError("a block with poles or dead time is not a polynomial")
    roots = np.array(block.zeros, dtype=complex) / scale
    return block.gain * scale ** len(roots) * np.atleast_1d(np.real(np.poly(roots)))


def from_polynomial(coefficients: ArrayLike, scale: float = 1.0) -> Block:
    """The polynomial block with these real coefficients (highest power first) in x = s/scale."""
    trimmed = np.trim_zeros(np.asarray(coefficients, dtype=float), "f")
    if not len(trimmed):
        return Block(0.0)
    degree = len(trimmed) - 1
    return Block(trimmed[0] / scale**degree, tuple(complex(root) for root in np.roots(trimmed) * scale))


def geometric_scale(*blocks: Block) -> float:
    """The geometric mean of the moduli of all non-zero roots, rad/s; 1 when there are none.

    It is the frequency unit in which the coefficients of the blocks' polynomials spread least.
    """
    moduli = [abs(root) for block in blocks for root in block.zeros + block.poles if root != 0]
    return float(np.exp(np.mean(np.log(moduli)))) if moduli else 1.0


def fastest_root(*blocks: Block) -> float:
    """The largest modulus of a zero or pole of the blocks, rad/s; 0 without any."""
    return max((abs(root) for block in blocks for root in block.zeros + block.poles), default=0.0)


def _paired(roots: Iterable[complex]) -> tuple[complex, ...]:
    """Sort roots and make conjugate pairs exact; raises InputError when a complex root has no partner."""
    waiting = [complex(root) for root in roots]
    count = len(waiting)
    if not all(math.isfinite(root.real) and math.isfinite(root.imag) for root in waiting):
        raise InputError(f"a block has the roots {waiting}; expected finite numbers")
    result: list[complex] = []
    for root in sorted(waiting, key=lambda root: (abs(root), root.real, abs(root.imag))):
        if root.imag == 0:
            result.append(root)
        elif root.imag > 0:
            partner = min(
                (other for other in waiting if other.imag < 0),
                key=lambda other: abs(other - root.conjugate()),
                default=None,
            )
            if partner is None or abs(partner - root.conjugate()) > 1e-6 * abs(root):
                raise InputError(f"a block's root {root:g} has no conjugate partner; expected real coefficients")
            waiting.remove(partner)
            result += [root, root.conjugate()]
    if len(result) != count:
        raise InputError(f"a block's roots {waiting} are not closed under conjugation; expected real coefficients")
    return tuple(result)
