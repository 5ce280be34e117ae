"""Frequency responses of a design's loop as curves to draw: dense where they turn, broken where they are infinite."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from math import isfinite, tau

import numpy as np

from design.blocks.block import Block, bound_block
from design.blocks.frequency_peak import frequency_grid
from design.design_file import Design
from design.stability.characteristic_roots import closing_omega
from design.stability.delay_loop import DelayLoop
from design.stability.margins import Margins, delay_loop, margins_of
from design.stability.stable_intervals import Margin
from identification.base.arrays import Complex, Real
from identification.base.errors import InputError
from identification.model.additive_bound import AdditiveBound
from identification.model.plant import PlantModel

FINE = 0.03  # longest step of a curve, over 1 and what it is away from 0
ROUNDS, MOST = 14, 100_000  # of refinement, and points
TURNS = 16  # points a turn of the dead time
BEYOND = 20.0  # times the slowest root that is looked at
AROUND = 2.0  # times a peak's frequency that is drawn
SMALL = 0.05  # beyond it |L| is no more


@dataclass(frozen=True)
class LoopCurves:
    """What the loop of a design's controller and a plant does at a frequency, its dead times exact.

    Parameters
    ----------
    loop
        Controller and plant.
    bound
        The additive bound W_a.
    """

    loop: DelayLoop
    bound: AdditiveBound

    @classmethod
    def of(cls, design: Design, plant: PlantModel | None = None) -> LoopCurves:
        """Of a design's own plant unless another is given."""
        return cls(delay_loop(design, plant or design.loop_plant), design.additive_bound)

    @cached_property
    def W_a(self) -> Block:
        """The bound as a block."""
        return bound_block(self.bound)

    @cached_property
    def margins(self) -> Margins | None:
        """What the audit says of the loop; None of a loop that is not stable, which has no norms."""
        try:
            return margins_of(self.loop, self.bound)
        except InputError:
            return None

    @property
    def peaks(self) -> tuple[Margin, ...]:
        """||S||, ||T|| and ||W_a C S|| of a stable loop, each with its frequency in rad/s; else nothing."""
        if self.margins is None:
            return ()
        modulus = self.margins.modulus
        return Margin(1 / modulus.value, modulus.omega), self.margins.T_peak, self.margins.W_a_C_S

    @property
    def peaks_at(self) -> Real:
        """The frequencies (n,) in rad/s of the peaks but 0 and infinity."""
        return np.array([peak.omega for peak in self.peaks if peak.omega and isfinite(peak.omega)])

    def inner(self, omega: Real) -> Complex:
        """1 - feedback exp(-delay_s s), whose zeros are poles of the controller."""
        s = 1j * omega
        return np.asarray(1 - self.loop.feedback(s) * np.exp(-self.loop.delay_s * s))

    def open(self, omega: Real) -> Complex:
        """L = P C; infinite at the poles of C and P."""
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.asarray(self.loop.open_loop(1j * omega) / self.inner(omega))

    def radius(self, omega: Real) -> Real:
        """|W_a C|: how far L of a plant within W_a is from that of the nominal one at most."""
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.abs(self.W_a(1j * omega) * self.loop.forward(1j * omega) / self.inner(omega))

    def magnitudes(self, omega: Real) -> tuple[Real, Real, Real]:
        """|S|, |T| and |W_a C S|; finite at the poles of C."""
        s, inner = 1j * omega, self.inner(omega)
        around = self.loop.open_loop(s)
        returned = inner + around
        W_a_C_S = self.W_a(s) * self.loop.forward(s) / returned
        return np.abs(inner / returned), np.abs(around / returned), np.abs(W_a_C_S)

    def corners(self) -> tuple[float, float]:
        """Between which frequencies in rad/s the loop is looked at: beyond its roots and peaks, to where L is small."""
        roots = [abs(root) for root in self._roots if root]
        delays = [1 / delay_s for delay_s in (self.loop.plant.delay_s, self.loop.delay_s) if delay_s]
        slowest = min([*roots, *delays], default=1.0)
        top = max(closing_omega(self.loop, 0.0, 1.0, SMALL), BEYOND * slowest)
        seen = self.peaks_at
        return min([slowest / BEYOND, *(omega / AROUND for omega in seen)]), max([top, *(AROUND * seen)])

    def grid(self) -> Real:
        """Frequencies (n,) in rad/s between the corners that show each root's resonance and each turn of L."""
        low, high = self.corners()
        found = frequency_grid(self._roots)
        delay_s = max(self.loop.plant.delay_s, self.loop.delay_s)
        step = tau / TURNS / delay_s if delay_s else high
        turns = np.arange(low, min(high, low + MOST * step), step)
        return np.unique(np.concatenate([[low, high], found[(found > low) & (found < high)], turns]))

    @property
    def _roots(self) -> list[complex]:
        blocks = (self.loop.plant, self.loop.forward, self.loop.feedback, self.W_a)
        return [root for block in blocks for root in block.zeros + block.poles]


def traced(curve: Callable[[Real], Complex], omega: Real) -> tuple[Real, Complex]:
    """Frequencies and points of a curve with steps that are short beside the distance from 0 or 1.

    Where the curve passes through infinity the steps stay long, and NaN breaks it.

    Parameters
    ----------
    curve
        Of omega (n,) in rad/s.
    omega
        Where to begin, increasing.
    """
    points = curve(omega)
    for _ in range(ROUNDS):
        long = _is_long(points)
        if not long.any() or points.size > MOST:
            break
        between = np.sqrt(omega[:-1] * omega[1:])[long]
        omega = np.concatenate([omega, between])
        order = np.argsort(omega, kind="stable")
        omega, points = omega[order], np.concatenate([points, curve(between)])[order]
    breaks = np.flatnonzero(_is_long(points)) + 1
    return np.insert(omega, breaks, omega[breaks - 1]), np.insert(points, breaks, np.nan)


def _is_long(points: Complex) -> np.ndarray:
    with np.errstate(invalid="ignore", over="ignore"):
        size = np.abs(points)
        step = np.abs(np.diff(points))
        return np.asarray(~(step <= FINE * (1 + np.minimum(size[:-1], size[1:]))))
