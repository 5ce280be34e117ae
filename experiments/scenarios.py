"""What is simulated: references, the PID benchmark, and the thesis's own values of both."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from identification.files import InputError
from identification.thesis import printed


@dataclass(frozen=True)
class Reference:
    """r(t) = amplitude sin(omega t + phase_rad) + offset.

    Parameters
    ----------
    amplitude, offset
        In the plant's output unit.
    omega
        In rad/s, not negative.
    phase_rad
        In radians.
    """

    amplitude: float
    omega: float
    phase_rad: float
    offset: float

    def __post_init__(self) -> None:
        if not np.isfinite([self.amplitude, self.omega, self.phase_rad, self.offset]).all() or self.omega < 0:
            raise InputError(f"the reference is {self}; expected finite numbers and omega >= 0")

    def __call__(self, time_s: np.ndarray) -> np.ndarray:
        """r at times of any shape."""
        return np.asarray(self.amplitude * np.sin(self.omega * time_s + self.phase_rad) + self.offset)

    def generator(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """The autonomous system that generates r: matrix (3, 3), output row (3,), initial state (3,)."""
        matrix = np.array([[0.0, self.omega, 0.0], [-self.omega, 0.0, 0.0], [0.0, 0.0, 0.0]])
        start = np.array([math.sin(self.phase_rad), math.cos(self.phase_rad), 1.0])
        return matrix, np.array([self.amplitude, 0.0, self.offset]), start


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


def thesis_reference(kind: str, omega: float) -> Reference:
    """The thesis's reference for a design of this kind ("delay-free" or "extended") at another omega in rad/s."""
    values = printed()[kind.replace("-", "_")]["reference"]
    return Reference(values["amplitude"], omega, values["phase_rad"], values["offset"])
