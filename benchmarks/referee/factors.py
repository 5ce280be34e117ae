"""Transfer functions as gain, zeros and poles: the referee's own reading of the project's data, and its values."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import mpmath
import numpy as np
from numpy.typing import NDArray

from design.design_file import Design
from identification.model.additive_bound import AdditiveBound
from identification.model.plant import PlantModel

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]

SAME = 1e-9  # relative distance of two roots that cancel


@dataclass(frozen=True)
class Factors:
    """gain * prod(s - zero)/prod(s - pole), any degrees; roots in rad/s, complex, sorted by modulus."""

    gain: float
    zeros: tuple[complex, ...] = ()
    poles: tuple[complex, ...] = ()

    def __call__(self, s: Any) -> Any:
        """The value at ``s`` (any shape): as numpy numbers, or in mpmath's precision if s is one of its numbers."""
        zeros, poles = (sorted(roots, key=abs) for roots in (self.zeros, self.poles))
        exact = isinstance(s, mpmath.mpc | mpmath.mpf)
        value: Any = mpmath.mpf(self.gain) if exact else np.full(np.shape(s), self.gain, dtype=complex)
        for k in range(max(len(zeros), len(poles))):  # by turns, so that nothing overflows
            if k < len(zeros):
                value = value * (s - mpmath.mpmathify(zeros[k]) if exact else s - zeros[k])
            if k < len(poles):
                value = value / (s - mpmath.mpmathify(poles[k]) if exact else s - poles[k])
        return value

    def __mul__(self, other: Factors) -> Factors:
        """The product, nothing cancelled."""
        return Factors(self.gain * other.gain, self.zeros + other.zeros, self.poles + other.poles)

    def inverse(self) -> Factors:
        """1 over this."""
        return Factors(1 / self.gain, self.poles, self.zeros)

    def reduced(self) -> Factors:
        """Without the poles and zeros that are the same to rounding."""
        zeros, poles = list(self.zeros), []
        for pole in self.poles:
            nearest = min(zeros, key=lambda zero: abs(zero - pole), default=None)
            if nearest is not None and abs(nearest - pole) <= SAME * abs(pole):
                zeros.remove(nearest)
            else:
                poles.append(pole)
        return Factors(self.gain, tuple(zeros), tuple(poles))

    def moved(self, shift: float) -> Factors:
        """This at s + shift."""
        return Factors(self.gain, tuple(z - shift for z in self.zeros), tuple(p - shift for p in self.poles))

    @property
    def excess(self) -> int:
        """Poles less zeros."""
        return len(self.poles) - len(self.zeros)


def unit(*of: Factors) -> float:
    """The geometric mean of the moduli of all roots but 0, in rad/s; 1 when there are none."""
    sizes = [abs(root) for each in of for root in each.zeros + each.poles if root != 0]
    return float(np.exp(np.mean(np.log(sizes)))) if sizes else 1.0


def of_block(block: Any) -> Factors:
    """The numbers of one of the project's blocks, without its dead time."""
    return Factors(float(block.gain), tuple(block.zeros), tuple(block.poles))


def _polynomial(modes: Any, rates: Any) -> Factors:
    gain, roots = 1.0, []
    for mode in modes:
        half, root = mode.omega * mode.zeta, mode.omega * np.sqrt(complex(mode.zeta**2 - 1))
        far = -half - root
        roots += [complex(far), complex(mode.omega**2 / far)]
        gain /= mode.omega**2
    for rate in rates:
        roots.append(complex(-rate))
        gain /= rate
    return Factors(gain, tuple(roots))


def of_plant(plant: PlantModel) -> Factors:
    """P without its dead time."""
    below = _polynomial(plant.pole_modes, plant.real_poles) * Factors(1.0, (0j,) * plant.integrators)
    return Factors(plant.gain) * _polynomial(plant.zero_modes, plant.real_zeros) * below.inverse()


def of_bound(bound: AdditiveBound) -> Factors:
    """W_a."""
    below = _polynomial(bound.pole_modes, bound.real_poles)
    return Factors(bound.gain) * _polynomial(bound.zero_modes, bound.real_zeros) * below.inverse()


@dataclass(frozen=True)
class Loop:
    """A design's loop: C = forward/(1 - feedback exp(-delay_s s)), the plant exp(-true_delay_s s) times ``plant``.

    ``model`` is the controller's own model without its dead time, delay_s.
    """

    plant: Factors
    forward: Factors
    feedback: Factors
    delay_s: float
    true_delay_s: float
    model: Factors = Factors(0.0)

    def returned(self, s: Any) -> Any:
        """1 - feedback exp(-delay s) + P forward at ``s``."""
        late, later = np.exp(-self.delay_s * s), np.exp(-self.true_delay_s * s)
        return 1 - self.feedback(s) * late + self.open(s) * later

    @property
    def open(self) -> Factors:
        """P forward without the dead time, cancelled."""
        return (self.plant * self.forward).reduced()

    def responses(self, omega: Real) -> tuple[Complex, Complex, Complex]:
        """S, T and C S at frequencies omega > 0, finite at the poles of C."""
        s = 1j * np.asarray(omega)
        away = tuple(complex(-abs(pole) or -unit(self.forward)) for pole in self.forward.poles)  # keeps all finite
        numerator = Factors(self.forward.gain, self.forward.zeros, away)
        D = Factors(1.0, self.forward.poles, away)(s)
        inner = D * (1 - self.feedback(s) * np.exp(-self.delay_s * s))
        control = numerator(s)
        through = (self.plant * numerator).reduced()(s) * np.exp(-self.true_delay_s * s)
        total = inner + through
        return inner / total, through / total, control / total


def loop_of(design: Design, plant: PlantModel | None = None) -> Loop:
    """The loop of a design around a true plant, the model unless given; chapter 2 ignores the model's dead time."""
    model = design.plant
    delay_s = 0.0 if design.kind == "delay-free" else model.delay_s
    true = plant or model
    true_delay_s = delay_s if plant is None else true.delay_s
    blocks = {name: of_block(block) for name, block in design.blocks.items()}
    if design.kind == "extended":
        return Loop(of_plant(true), blocks["K"], blocks["T_so"], delay_s, true_delay_s, of_plant(model))
    A = Factors(1.0, of_plant(model).poles)
    A = Factors(float(np.real(1 / np.prod([-root for root in A.zeros if root != 0] or [1.0]))), A.zeros)
    forward = (blocks["K"] * A * blocks["Lambda"].inverse()).reduced()
    return Loop(of_plant(true), forward, Factors(0.0), delay_s, true_delay_s, of_plant(model))
