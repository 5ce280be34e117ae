"""Margins of a loop with its exact dead time, and whether the additive bound guarantees its stability."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from design.anti_windup.condition import Robustness
from design.blocks.block import bound_block, plant_block
from design.design_file import Design
from design.stability.axis import peak
from design.stability.characteristic_roots import closing_omega, largest_beyond, roots_right_of, unstable_roots
from design.stability.coprime import Terms
from design.stability.delay_loop import DelayLoop
from design.stability.jet import Jet, combined, jet
from design.stability.stable_intervals import (
    AxisLoop,
    Interval,
    Margin,
    delay_intervals,
    gain_intervals,
    magnitude_crossings,
    phase_intervals,
)
from identification.base.arrays import Complex, Real
from identification.base.errors import InputError
from identification.model.additive_bound import AdditiveBound
from identification.model.plant import PlantModel

TAIL = 1e-5  # of a peak: what may exceed it beyond the frequencies looked at, or exceed its limit there unseen


@dataclass(frozen=True)
class Margins:
    """What a loop tolerates, each limit alone, with L = P C and negative feedback.

    Parameters
    ----------
    delay_s
        The plant's own dead time in seconds.
    gains
        The intervals of factors by which the gain may be multiplied. They are all that there are between 1/LARGEST and
        LARGEST; ends that are not reached within that are 0 and inf.
    phases_deg
        The intervals of rotations of L, forward or back, in degrees from 0 to 180; an end of inf is 180.
    delays_s
        The intervals of true dead times of the plant in seconds, the controller being kept as it is; 0 and inf without
        a limit.
    delays_listed_s
        The dead times between which ``delays_s`` is complete: 0 and inf but for loops with half a million crossings.
    modulus
        min |1 + L| = 1/||S||.
    T_peak
        ||T||, T = L/(1 + L).
    W_a_C_S
        || W_a C S ||: below 1 every plant P + Delta, Delta stable and |Delta| < |W_a|, is stabilised.
    hidden
        Hidden roots that are not in the open left half plane, see :class:`DelayLoop`; no margin sees them.
    """

    delay_s: float
    gains: tuple[Interval, ...]
    phases_deg: tuple[Interval, ...]
    delays_s: tuple[Interval, ...]
    delays_listed_s: tuple[float, float]
    modulus: Margin
    T_peak: Margin
    W_a_C_S: Margin
    hidden: tuple[complex, ...]

    @property
    def gain_down(self) -> Margin:
        """The least factor down to which the gain may fall."""
        return _around(self.gains, 1.0).least

    @property
    def gain_up(self) -> Margin:
        """The greatest factor up to which the gain may rise."""
        return _around(self.gains, 1.0).greatest

    @property
    def phase_deg(self) -> Margin:
        """The least rotation of L, forward or back, that makes the loop unstable, in degrees."""
        return self.phases_deg[0].greatest

    @property
    def delay_least_s(self) -> Margin:
        """The true dead time in seconds down to which the plant's may fall."""
        return _around(self.delays_s, self.delay_s).least

    @property
    def delay_greatest_s(self) -> Margin:
        """The true dead time in seconds up to which the plant's may rise."""
        return _around(self.delays_s, self.delay_s).greatest

    @property
    def is_guaranteed(self) -> bool:
        """Whether the additive bound guarantees robust stability, wherever within TAIL of it the peak lies."""
        return (1 + TAIL) * self.W_a_C_S.value < 1


def delay_loop(design: Design, plant: PlantModel) -> DelayLoop:
    """A design's controller, Thesis Eq. (3.10) or (3.31), with any plant and its dead time.

    Notes
    -----
    Chapter 2, C = K A/Lambda, hides every pole of the plant. A disturbance at the plant's input excites them; s = 0
    is among them, so that y drifts. Chapters 3 and 4, K = s T_so A/(s B), hide every pole of the plant, every zero
    (the control rings with it) and the poles of T_so. There s = 0 is seen neither from the reference nor from the
    plant's input, as 1 - T_so exp(-T_d s) is zero there twice; but in the controller as drawn a disturbance of its
    inner loop, or initial states of K or T_so, leave a constant offset in y for ever. A pole in the open right half
    plane must not be hidden: the controller runs in the form of :mod:`design.chapters_3_4.realisation`, which holds it.
    """
    forward, feedback = design.controller_parts()
    held = design.plant.unstable_poles if plant.unstable_poles == design.plant.unstable_poles else ()
    return DelayLoop(plant_block(plant), forward, feedback, design.loop_plant.delay_s, held)


def margins_of(loop: DelayLoop, bound: AdditiveBound) -> Margins:
    """All margins of a stable loop, with the exact dead times.

    Parameters
    ----------
    loop
        Its plant is the nominal one.
    bound
        W_a, the additive bound on what the plant may differ by.

    Raises
    ------
    InputError
        The loop is not stable or a root is on the imaginary axis, so that it has no margins.

        Or the crossings of the axis and the argument principle disagree, so that none can be told.

    Notes
    -----
    The ends of the intervals are the crossings of the imaginary axis, the numbers of unstable roots between them are
    counted once more, :mod:`design.stability.stable_intervals`. The peaks are found by branch and bound on 0 to a
    frequency Omega, :func:`design.stability.axis.peak`; beyond it 1 - feedback exp(-delay_s s) and 1 + L are bounded,
    and Omega is doubled until nothing there exceeds the peak by more than TAIL of it.
    """
    outside = tuple(root for root in loop.hidden if root.real >= 0)
    unstable = roots_right_of(loop, 0.0) + sum(root.real > 0 for root in outside)
    if unstable:
        raise InputError(f"the loop has {unstable_roots(unstable)}; margins are those of a stable loop")
    axis = AxisLoop(loop)
    omega, rising = magnitude_crossings(axis)
    delays, listed = delay_intervals(axis, omega, rising)
    W_a_F = loop.forward * bound_block(bound)

    def beyond(numerator: Callable[[float, float, float], float]) -> Callable[[float], float]:
        """Of |numerator|/|1 + L| from the bounds of |feedback| and |P forward|."""

        def bound_at(omega: float) -> float:
            inner, outer = (largest_beyond(block, 0.0, omega) for block in (loop.inner_loop, loop.open_loop))
            return numerator(omega, inner, outer) / (1 - inner - outer)

        return bound_at

    S = _peak(axis, axis.a, beyond(lambda _, inner, outer: 1 - inner), 1.0)
    return Margins(
        delay_s=loop.plant.delay_s,
        gains=gain_intervals(axis),
        phases_deg=phase_intervals(axis, omega, rising),
        delays_s=delays,
        delays_listed_s=listed,
        modulus=Margin(1 / S.value, S.omega),
        T_peak=_peak(axis, axis.b, beyond(lambda _, inner, outer: outer), 0.0),
        W_a_C_S=_peak(
            axis,
            (loop.forward * bound_block(bound) * axis.a[0],),
            beyond(lambda omega, *_: largest_beyond(W_a_F, 0.0, omega)),
            abs(W_a_F.gain) if W_a_F.relative_degree == 0 else 0.0,
        ),
        hidden=outside,
    )


def responses(loop: DelayLoop, omega: Real) -> tuple[Complex, Complex]:
    """S and C S of a loop at frequencies omega (n,) in rad/s, its dead times exact; finite at the poles of C.

    Of an extended design S is S_aw of Thesis Eq. (3.25).
    """
    s = 1j * omega
    inner = 1 - loop.feedback(s) * np.exp(-loop.delay_s * s)
    returned = inner + loop.plant(s) * loop.forward(s)
    return np.asarray(inner / returned), np.asarray(loop.forward(s) / returned)


def robustness_of(loop: DelayLoop, bound: AdditiveBound) -> Robustness:
    """|W_a C S| of a loop at any frequency; rational where the controller predicts its plant, C S = forward."""
    W_a = bound_block(bound)
    blocks = (loop.plant, loop.forward, loop.feedback, W_a)
    return Robustness(
        lambda omega: np.asarray(np.abs(W_a(1j * omega) * responses(loop, omega)[1])),
        tuple(root for block in blocks for root in block.zeros + block.poles),
        W_a * loop.forward if loop.is_predicted else None,
    )


def tracking_floor(plant: PlantModel, bound: AdditiveBound, omegas: ArrayLike) -> float:
    """A lower bound on ||W_a C S|| of every controller that follows a reference of these frequencies perfectly.

    Parameters
    ----------
    plant
        The nominal one.
    bound
        W_a.
    omegas
        Frequencies of the reference in rad/s, shape (n,), n > 0; 0 for a constant.

    Returns
    -------
    float
        The largest |W_a/P|: T(j omega) = 1 means C S = T/P = 1/P there, however C is made.

    Raises
    ------
    InputError
        There is no frequency, or one is negative or not finite.
    """
    at = np.asarray(omegas, dtype=float)
    if at.size == 0 or not np.all(np.isfinite(at) & (at >= 0)):
        raise InputError(f"the reference has the frequencies {at.tolist()} rad/s; expected one or more, none negative")
    inverse = plant_block(plant).without_delay().inverse()
    return float(np.max(np.abs((bound_block(bound) * inverse)(1j * at))))


def _around(intervals: tuple[Interval, ...], value: float) -> Interval:
    """The interval that holds the value."""
    return next(each for each in intervals if each.least.value <= value <= each.greatest.value)


def _peak(axis: AxisLoop, numerator: Terms, beyond: Callable[[float], float], limit: float) -> Margin:
    """The largest |numerator/(a + b)| on 0 <= omega <= infinity, where it is ``limit``."""

    def above(centre: Real, half: Real) -> Jet:
        return jet(numerator, 0.0, centre, half)

    def below(centre: Real, half: Real) -> Jet:
        return combined(*axis.both(centre, half), 1.0)

    top = closing_omega(axis.loop, 0.0, 1.0, 0.5)
    edges, zero = axis.edges(top), np.zeros(1)
    at_zero = float(np.abs(above(zero, zero).value / below(zero, zero).value)[0])
    best = max(Margin(at_zero, 0.0), Margin(limit, float("inf")))
    while True:
        value, at = peak(above, below, edges, best.value * (1 + TAIL * (best.omega == np.inf)))
        if at is not None:
            best = Margin(value, at)
        if beyond(top) <= (1 + TAIL) * best.value:
            return best
        top, edges = 2 * top, np.array([top, 2 * top])
