"""What is simulated: references, the PID benchmark, and the thesis's own values of both."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import block_diag

from identification.files import InputError
from identification.plant import PlantModel
from identification.thesis import printed


@dataclass(frozen=True)
class Reference:
    """r(t) = sum of amplitude_i sin(omega_i t + phase_i), and an offset.

    Parameters
    ----------
    amplitudes, offset
        In the plant's output unit.
    omegas
        In rad/s, not negative; as many as there are amplitudes.
    phases_rad
        In radians; as many.
    """

    amplitudes: tuple[float, ...]
    omegas: tuple[float, ...]
    phases_rad: tuple[float, ...]
    offset: float

    def __post_init__(self) -> None:
        if not len(self.amplitudes) == len(self.omegas) == len(self.phases_rad) > 0:
            raise InputError(
                f"the reference has {len(self.omegas)} frequencies, {len(self.amplitudes)} amplitudes and "
                f"{len(self.phases_rad)} phases; expected as many of each, and one at least"
            )
        numbers = [*self.amplitudes, *self.omegas, *self.phases_rad, self.offset]
        if not np.isfinite(numbers).all() or min(self.omegas) < 0:
            raise InputError(f"the reference is {self}; expected finite numbers and omega >= 0")

    def __call__(self, time_s: np.ndarray) -> np.ndarray:
        """r at times of any shape."""
        parts = zip(self.amplitudes, self.omegas, self.phases_rad, strict=True)
        return np.asarray(sum(a * np.sin(omega * time_s + phase) for a, omega, phase in parts) + self.offset)

    @property
    def amplitude(self) -> float:
        """The most that the sinusoids add up to, in the plant's output unit."""
        return float(np.abs(self.amplitudes).sum())

    @property
    def period_s(self) -> float:
        """Of the slowest sinusoid, in seconds; infinite when all is constant."""
        slowest = min((omega for omega in self.omegas if omega > 0), default=None)
        return math.inf if slowest is None else 2 * math.pi / slowest

    def required(self, plant: PlantModel) -> float:
        """The most that the control reaches which makes the plant's output r in the steady state, in its input unit.

        The sum of amplitude/|P(j omega)|; 0 at omega = 0, where the plant integrates.
        """
        parts = zip(self.amplitudes, self.omegas, strict=True)
        return float(sum(abs(a / complex(plant(1j * omega))) for a, omega in parts if omega > 0))

    def generator(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """The autonomous system that generates r: matrix (n, n), output row (n,), initial state (n,)."""
        matrix = block_diag(*(np.array([[0.0, omega], [-omega, 0.0]]) for omega in self.omegas), np.zeros((1, 1)))
        row = [number for amplitude in self.amplitudes for number in (amplitude, 0.0)]
        start = [number for phase in self.phases_rad for number in (math.sin(phase), math.cos(phase))]
        return matrix, np.array([*row, self.offset]), np.array([*start, 1.0])


def sinusoid(amplitude: float, omega: float, phase_rad: float, offset: float) -> Reference:
    """r(t) = amplitude sin(omega t + phase_rad) + offset, omega in rad/s."""
    return Reference((amplitude,), (omega,), (phase_rad,), offset)


@dataclass(frozen=True)
class PidBenchmark:
    """Section 2.2: gain/(time_constant_s s + 1) exp(-delay_s s) under proportional + integral/s, a step of r."""

    gain: float
    time_constant_s: float
    delay_s: float
    proportional: float
    integral: float
    limit: float
    step: float


def thesis_reference(kind: str, omegas: Sequence[float]) -> Reference:
    """The thesis's reference for a design of this kind ("delay-free" or "extended") at other omegas in rad/s.

    Of several frequencies each has the thesis's amplitude and phase, which is our choice; omega = 0 is a constant.
    """
    values = printed()[kind.replace("-", "_")]["reference"]
    n = len(omegas)
    return Reference((values["amplitude"],) * n, tuple(omegas), (values["phase_rad"],) * n, values["offset"])
