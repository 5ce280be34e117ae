"""References of a run: sinusoids with a constant and a ramp, or samples; and the systems that generate them."""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from design.blocks.state_space import block_diagonal
from experiments.engine.saturated_loop import NO_RESETS, Resets
from experiments.runs.steady_control import PI, UNIT, Peak, peak, response, steady_constant
from identification.base.errors import InputError
from identification.model.plant import PlantModel


@dataclass(frozen=True)
class Generator:
    """z' = matrix z from z(0) = start with resets; r = row z.

    Parameters
    ----------
    matrix, row, start
        Shapes (g, g), (g,), (g,).
    resets
        Of all its states.
    """

    matrix: np.ndarray
    row: np.ndarray
    start: np.ndarray
    resets: Resets


@dataclass(frozen=True)
class Reference:
    """r(t) = sum of amplitude_i sin(omega_i t + phase_i) + offset + slope t.

    Parameters
    ----------
    amplitudes, offset, slope
        In the plant's output unit, and in that unit per second.
    omegas
        In rad/s, not negative; as many as there are amplitudes.
    phases_rad
        In radians; as many. No constant has a phase of sine 0, unless its amplitude is 0.
    """

    amplitudes: tuple[float, ...]
    omegas: tuple[float, ...]
    phases_rad: tuple[float, ...]
    offset: float
    slope: float = 0.0

    def __post_init__(self) -> None:
        if not len(self.amplitudes) == len(self.omegas) == len(self.phases_rad) > 0:
            raise InputError(
                f"the reference has {len(self.omegas)} frequencies, {len(self.amplitudes)} amplitudes and "
                f"{len(self.phases_rad)} phases; expected equal numbers of at least 1"
            )
        for amplitude, omega, phase in zip(self.amplitudes, self.omegas, self.phases_rad, strict=True):
            if amplitude != 0 and omega == 0 and math.sin(phase) == 0:
                raise InputError(
                    f"the reference of frequency 0 has the phase {phase:g}, which makes it 0 at all times; expected "
                    "pi/2, which makes it a constant of its amplitude"
                )
        numbers = {
            "amplitude": self.amplitudes,
            "frequency": self.omegas,
            "phase": self.phases_rad,
            "offset": (self.offset,),
            "slope": (self.slope,),
        }
        for name, values in numbers.items():
            for value in values:
                if not math.isfinite(value) or (name == "frequency" and value < 0):
                    raise InputError(
                        f"the reference has the {name} {value:g}; expected finite numbers, and no frequency below 0"
                    )

    def __call__(self, time_s: np.ndarray) -> np.ndarray:
        """r at times of any shape."""
        parts = zip(self.amplitudes, self.omegas, self.phases_rad, strict=True)
        waves = sum(a * np.sin(omega * time_s + phase) for a, omega, phase in parts)
        return np.asarray(waves + self.offset + self.slope * time_s)

    def rounding(self, until_s: float) -> float:
        """A bound of what r computed at times up to ``until_s`` is off, even if these are off by 4 roundings."""
        parts = zip(self.amplitudes, self.omegas, self.phases_rad, strict=True)
        count = len(self.amplitudes)
        waves = sum(abs(a) * (8 * (omega * until_s + abs(phase)) + 8 + count) for a, omega, phase in parts)
        return 2.0**-52 * float(waves + 8 * (abs(self.offset) + abs(self.slope) * until_s))

    @property
    def bend(self) -> float:
        """The most that |r''| reaches, or more: the sum of |amplitude| omega^2."""
        return float(sum(abs(a) * omega**2 for a, omega in zip(self.amplitudes, self.omegas, strict=True)) * (1 + 1e-9))

    @property
    def constants(self) -> tuple[float, ...]:
        """The offset, and the sinusoids of frequency 0, in the plant's output unit."""
        parts = zip(self.amplitudes, self.omegas, self.phases_rad, strict=True)
        return (self.offset, *(a * math.sin(phase) for a, omega, phase in parts if omega == 0))

    @property
    def frequencies(self) -> tuple[float, ...]:
        """Of what it consists of, in rad/s, each once; 0 where it has a constant or a ramp."""
        waves = {omega for a, omega in zip(self.amplitudes, self.omegas, strict=True) if a and omega}
        return tuple(sorted(waves | ({0.0} if any(self.constants) or self.slope else set())))

    @property
    def amplitude(self) -> float:
        """The sum of the amplitudes' sizes, in the plant's output unit: the scale of every band.

        The sinusoids never exceed it together; unless their frequencies are independent they may stay below it.
        """
        return float(np.abs(self.amplitudes).sum())

    @property
    def period_s(self) -> float:
        """Of the slowest sinusoid, in seconds; infinite when all is constant."""
        slowest = min((omega for omega in self.omegas if omega > 0), default=None)
        return math.inf if slowest is None else 2 * math.pi / slowest

    @property
    def exact_period_s(self) -> Fraction:
        """:attr:`period_s`, which is finite, to 80 digits."""
        return 2 * PI / Fraction(min(omega for omega in self.omegas if omega > 0))

    def required(self, plant: PlantModel, middle: float = 0.0) -> Peak:
        """The most that the control which keeps the plant's output on r in the steady state is away from ``middle``.

        In the plant's input unit. It is the control (r/P)(t) = sum of amplitude_i/|P(j omega_i)| sin(omega_i t +
        phase_i - arg P(j omega_i)) and what r's constant and slope take, see
        :func:`experiments.runs.steady_control.steady_constant`; infinite where that grows for ever. See
        :func:`experiments.runs.steady_control.peak`.
        """
        parts = list(zip(self.amplitudes, self.omegas, self.phases_rad, strict=True))
        constant = steady_constant(plant, math.fsum(self.constants), self.slope)
        doubt = steady_constant(plant, 4 * UNIT * sum(map(abs, self.constants)), 0.0)
        return peak([response(plant, *part) for part in parts if part[1] > 0], constant - middle, abs(doubt))

    def generator(self) -> Generator:
        """Its oscillators, and a constant with its integral."""
        waves = (np.array([[0.0, omega], [-omega, 0.0]]) for omega in self.omegas)
        matrix = block_diagonal(*waves, np.array([[0.0, 1.0], [0.0, 0.0]]))
        row = [number for amplitude in self.amplitudes for number in (amplitude, 0.0)]
        start = [number for phase in self.phases_rad for number in (math.sin(phase), math.cos(phase))]
        return Generator(matrix, np.array([*row, 1.0, 0.0]), np.array([*start, self.offset, self.slope]), NO_RESETS)


@dataclass(frozen=True)
class SampledReference:
    """r(t) by straight lines between samples; before the first and after the last it stays as it is there.

    Parameters
    ----------
    time_s
        Shape (s,), in seconds, increasing but for jumps: where two samples have one time, r has the second value from
        that time on.
    values
        Shape (s,), in the plant's output unit.
    """

    time_s: np.ndarray
    values: np.ndarray

    def __post_init__(self) -> None:
        for name in ("time_s", "values"):
            object.__setattr__(self, name, np.asarray(getattr(self, name), dtype=float))
        if not (self.time_s.shape == self.values.shape and self.time_s.ndim == 1 and len(self.time_s) > 0):
            raise InputError(
                f"the sampled reference has shapes {self.time_s.shape} and {self.values.shape}; expected equal "
                "lengths of at least 1"
            )
        if not (np.isfinite(self.time_s).all() and np.isfinite(self.values).all()):
            raise InputError("the sampled reference is not finite; expected finite numbers")
        step = np.diff(self.time_s)
        if np.any(step < 0) or np.any((step[1:] == 0) & (step[:-1] == 0)):
            raise InputError(
                "the times of the sampled reference do not increase; expected increasing times, or two samples at one "
                "time for a jump"
            )

    def __call__(self, time_s: np.ndarray) -> np.ndarray:
        """r at times of any shape."""
        return np.asarray(np.interp(time_s, self.time_s, self.values))

    @property
    def amplitude(self) -> float:
        """Half the distance of its extremes, in the plant's output unit."""
        return float(np.ptp(self.values)) / 2

    def generator(self) -> Generator:
        """An integrator and its slope, both set at every sample after t = 0."""
        knots = np.union1d(self.time_s[self.time_s > 0], 0.0)
        levels = self(knots)
        before = np.interp(-knots[1:], -self.time_s[::-1], self.values[::-1])  # at a jump the first of the two values
        slopes = np.append((before - levels[:-1]) / np.diff(knots), 0.0)
        if knots[0] < self.time_s[0]:
            slopes[0] = 0.0
        pieces = np.column_stack([levels, slopes])
        matrix, row = np.array([[0.0, 1.0], [0.0, 0.0]]), np.array([1.0, 0.0])
        return Generator(matrix, row, pieces[0], Resets(knots[1:], pieces[1:]))


def sinusoid(amplitude: float, omega: float, phase_rad: float = 0.0, offset: float = 0.0) -> Reference:
    """r(t) = amplitude sin(omega t + phase_rad) + offset, omega in rad/s."""
    return Reference((amplitude,), (omega,), (phase_rad,), offset)
