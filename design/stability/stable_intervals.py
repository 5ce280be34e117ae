"""For which gains, rotations and dead times a loop is stable: all intervals, their ends found twice."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from design.blocks.block import Block
from design.stability.axis import NO_ZERO, first_edges, sign_of, zeros
from design.stability.characteristic_roots import closing_omega, largest_beyond, normalised, roots_right_of
from design.stability.delay_loop import DelayLoop
from design.stability.jet import Jet, jet, product
from identification.base.arrays import Real
from identification.base.errors import InputError

LARGEST = 1e3  # gain factors beyond it, or below 1/LARGEST, are not looked at
EVENTS = 500_000  # critical dead times beyond the plant's own at most that are looked at
COUNTED = 60  # intervals between neighbouring crossings at most, around the loop's own, whose roots are counted
DISTINCT = 1e-9  # relative distance of critical values between which the roots are counted


class Margin(NamedTuple):
    """A margin, an end or a peak, and the frequency in rad/s where it is reached; None where there is no such limit."""

    value: float
    omega: float | None


class Interval(NamedTuple):
    """Values between which a loop is stable; an end of omega None is the end of what was looked at."""

    least: Margin
    greatest: Margin


class Critical(NamedTuple):
    """Values at which roots j omega, -j omega are on the axis, and by how many the unstable roots change: (n,) each."""

    value: Real
    omega: Real
    change: Real

    def joined(self, other: Critical) -> Critical:
        """Both."""
        return Critical(*(np.concatenate(pair) for pair in zip(self, other, strict=True)))

    def among(self, chosen: np.ndarray) -> Critical:
        """Those of a mask."""
        return Critical(*(each[chosen] for each in self))


class AxisLoop:
    """A loop on the imaginary axis: a + b, P C = b/a as in :func:`design.stability.characteristic_roots.normalised`.

    Parameters
    ----------
    loop
        Stable: no root but hidden ones on or right of the axis.
    """

    def __init__(self, loop: DelayLoop) -> None:
        self.loop = loop
        first, second, third = normalised(loop, 0.0)
        self.a, self.b = (first, second), (third,)
        self.roots = first.zeros + first.poles

    def both(self, centre: Real, half: Real) -> tuple[Jet, Jet]:
        """a and b on cells, see :func:`design.stability.jet.jet`."""
        return jet(self.a, 0.0, centre, half), jet(self.b, 0.0, centre, half)

    def parts(self, omega: Real) -> tuple[Jet, Jet]:
        """a and b at frequencies omega (n,) in rad/s."""
        return self.both(omega, np.zeros_like(omega))

    def edges(self, top: float) -> Real:
        """Where the search for zeros and peaks up to ``top`` (rad/s) begins."""
        return first_edges(self.roots, top)


def gain_intervals(axis: AxisLoop) -> tuple[Interval, ...]:
    """The intervals of factors by which the gain may be multiplied, between 1/LARGEST and LARGEST.

    Notes
    -----
    a + k b = 0 needs b/a real and negative: the zeros of Im(b conj a). As k grows a pair of roots crosses to the
    right where the phase of b/a falls. Below a frequency Omega every crossing is found; beyond it k |b/a| < 1 for k <
    K, :func:`_largest_factor`. Omega is doubled until K reaches LARGEST, or no larger k can be stable: beyond Omega the
    phase falls, :func:`_phase_falls`, and there are more unstable roots at K than all crossings left could take back.
    """
    loop = axis.loop
    top = closing_omega(loop, 0.0, 1.0, 0.5)
    found, edges = _real_root(axis), axis.edges(top)
    while True:
        found = found.joined(_gain_crossings(axis, edges))
        factor = _largest_factor(loop, top)
        later = found.value > factor
        unstable = np.sum(found.change[(found.value > 1) & ~later])
        back = np.sum(np.minimum(found.change[later], 0))
        if factor >= LARGEST or (unstable + back > 0 and _phase_falls(loop, top)):
            break
        top, edges = 2 * top, np.array([top, 2 * top])
    low, high = 1 / LARGEST, min(factor, LARGEST)
    within = found.among((found.value > low) & (found.value < high))
    return _intervals(within, 1.0, (low, high), lambda k: roots_right_of(loop, 0.0, k), "gain factor")


def _real_root(axis: AxisLoop) -> Critical:
    """The factor that puts a root at 0, and whether that root goes right or left: as a/b falls or rises along s."""
    a, b = axis.parts(np.zeros(1))
    with np.errstate(all="ignore"):
        factor = -np.real(a.value / b.value)
        rises = np.real((a.slope / a.value - b.slope / b.value) / 1j) < 0
    return Critical(factor, np.zeros(1), np.where(rises, -1, 1)).among((factor > 0) & np.isfinite(factor))


def _gain_crossings(axis: AxisLoop, edges: Real) -> Critical:
    def real(omega: Real) -> tuple[Real, Real]:
        a, b = axis.parts(omega)
        found = product(b, a)
        return found.value.imag, found.slope.imag

    def judge(centre: Real, half: Real) -> np.ndarray:
        a, b = axis.both(centre, half)
        found = product(b, a)
        code = sign_of(found.value.imag, found.slope.imag, found)
        positive = found.value.real > 0
        code[positive & (sign_of(found.value.real, found.slope.real, found) == NO_ZERO)] = NO_ZERO
        code[a.size * LARGEST < b.least] = NO_ZERO
        return code

    omega, rising = zeros(real, judge, edges)
    a, b = axis.parts(omega)
    factor = np.abs(a.value) / np.maximum(np.abs(b.value), np.finfo(float).tiny)
    return Critical(factor, omega, 2 * rising).among(np.real(b.value * np.conj(a.value)) < 0)


def _largest_factor(loop: DelayLoop, omega: float) -> float:
    """K such that a loop with a gain K times as large or less has no root j omega' with omega' >= omega (rad/s)."""
    inner, outer = largest_beyond(loop.inner_loop, 0.0, omega), largest_beyond(loop.open_loop, 0.0, omega)
    return (1 - inner) / outer if outer else np.inf


def _phase_falls(loop: DelayLoop, omega: float) -> bool:
    """Whether the phase of P C certainly falls at every frequency beyond ``omega`` (rad/s).

    d arg(P forward)/d omega = -h + sum Re 1/(j omega - z) - sum Re 1/(j omega - p), where |Re 1/(j omega - z)| is
    at most |Re z|/(omega - |Im z|)^2, and d arg(1 - T e)/d omega is at most |(T e)'|/(1 - |T|), e = exp(-delay_s s).
    """

    def moves(block: Block, real: bool) -> float:
        roots = np.array(block.zeros + block.poles)
        distance = omega - np.abs(roots)
        return float(np.sum(np.abs(roots.real) / distance**2 if real else 1 / distance)) + block.delay_s * (not real)

    inner = largest_beyond(loop.inner_loop, 0.0, omega)
    own = inner * moves(loop.inner_loop, False) / (1 - inner)
    return bool(moves(loop.open_loop, True) + own < loop.plant.delay_s)


def magnitude_crossings(axis: AxisLoop) -> tuple[Real, Real]:
    """Every frequency (rad/s) where |P C| = 1, and whether |P C| rises (1) or falls (-1) there."""

    def squares(a: Jet, b: Jet) -> Jet:
        over, under = product(b, b), product(a, a)
        return Jet(a.half, over.value - under.value, over.slope - under.slope, *np.add(over[3:], under[3:]))

    def real(omega: Real) -> tuple[Real, Real]:
        found = squares(*axis.parts(omega))
        return found.value.real, found.slope.real

    def judge(centre: Real, half: Real) -> np.ndarray:
        found = squares(*axis.both(centre, half))
        return sign_of(found.value.real, found.slope.real, found)

    return zeros(real, judge, axis.edges(closing_omega(axis.loop, 0.0, 1.0, 1.0)))


def phase_intervals(axis: AxisLoop, omega: Real, rising: Real) -> tuple[Interval, ...]:
    """The intervals of rotations of P C, forward or back, in degrees from 0 to 180.

    Parameters
    ----------
    axis, omega, rising
        A loop and its :func:`magnitude_crossings`.
    """
    a, b = axis.parts(omega)
    phase = np.degrees(np.angle(-b.value * np.conj(a.value)))
    # exp(-j phi) L has a root at j omega for phi = phase and at -j omega for phi = -phase
    found = Critical(np.abs(phase), omega, np.where(phase > 0, -rising, rising))

    def count(degrees: float) -> int:
        return roots_right_of(axis.loop, 0.0, complex(np.exp(-1j * np.radians(degrees))))

    return _intervals(found, 0.0, (0.0, 180.0), count, "rotation in degrees")


def delay_intervals(axis: AxisLoop, omega: Real, rising: Real) -> tuple[tuple[Interval, ...], tuple[float, float]]:
    """The intervals of true dead times in seconds with which the loop is stable, and where they are all.

    Parameters
    ----------
    axis, omega, rising
        A loop and its :func:`magnitude_crossings`.

    Returns
    -------
    intervals
        By increasing dead time.
    listed_s
        Between these the list is complete: 0 and inf when no other dead time is stable.

    Notes
    -----
    A change tau of the plant's dead time puts a root at j omega where exp(-j omega tau) b/a = -1: again and again, 2
    pi/omega apart, at each of finitely many omega. There a pair of roots goes right as tau grows if |b/a| falls, and
    left if it rises. At omega_i this happens at least omega_i tau/(2 pi) - 1 and at most omega_i tau/(2 pi) + 1 times,
    so that no tau is stable beyond 2 pi n/(sum of omega_i where |b/a| falls - sum where it rises), n being
    the number of the omega_i. The difference is positive, since |b/a| vanishes as omega grows.
    """
    loop, delay_s = axis.loop, axis.loop.plant.delay_s
    a, b = axis.parts(omega)
    phase = np.angle(-b.value * np.conj(a.value))
    certain = reach = 0.0
    if len(omega):
        certain = 2 * np.pi * len(omega) / -float(np.sum(rising * omega))
        reach = min(certain, 2 * np.pi * EVENTS / float(np.sum(omega)))
    low, high = max(delay_s - reach, 0.0) if reach < certain else 0.0, delay_s + reach
    first = np.ceil((omega * (low - delay_s) - phase) / (2 * np.pi) - DISTINCT)  # one at 0 counts, as far as is seen
    number = (np.floor((omega * reach - phase) / (2 * np.pi)) + 1 - first).astype(int)
    which = np.repeat(np.arange(len(omega)), number)
    turns = np.arange(len(which)) - np.repeat(np.cumsum(number) - number, number) + first[which]
    value = np.maximum(delay_s + (phase[which] + 2 * np.pi * turns) / omega[which], 0.0)
    found = Critical(value, omega[which], -2 * rising[which])

    def count(true_s: float) -> int:
        return roots_right_of(replace(loop, plant=replace(loop.plant, delay_s=true_s)), 0.0)

    listed = (low, high if reach < certain else np.inf)
    return _intervals(found, delay_s, (low, high), count, "true dead time in seconds"), listed


def _intervals(
    found: Critical, here: float, within: tuple[float, float], count: Callable[[float], int], name: str
) -> tuple[Interval, ...]:
    """The intervals without unstable roots, whose number is counted in each and between them, in COUNTED at most.

    Parameters
    ----------
    found
        All crossings within ``within``.
    here
        Where there are no unstable roots.
    count
        The number of unstable roots by the argument principle.

    Raises
    ------
    InputError
        The crossings and the argument principle disagree.
    """
    order = np.argsort(found.value, kind="stable")
    ordered = Critical(*(each[order] for each in found))
    values = np.concatenate([within[:1], ordered.value, within[1:]])
    numbers = np.concatenate([[0], np.cumsum(ordered.change)]).astype(int)
    own = int(np.searchsorted(ordered.value, here))
    numbers -= numbers[own]
    stable = np.flatnonzero(numbers == 0)
    first, last = max(stable[0] - 1, own - COUNTED // 2, 0), min(stable[-1] + 1, own + COUNTED // 2, len(numbers) - 1)
    for k in range(first, last + 1):
        left, right = values[k : k + 2]
        if right - left > DISTINCT * right:
            middle = (left + right) / 2
            counted = count(middle)
            if counted != numbers[k]:
                raise InputError(
                    f"with the {name} {middle:g} the argument principle counts {counted} unstable roots, the crossings "
                    f"of the imaginary axis {numbers[k]}; expected the same number for margins"
                )
    limits = [
        Margin(0.0, None),
        *(Margin(float(v), float(w)) for v, w in zip(ordered.value, ordered.omega, strict=True)),
    ]
    limits.append(Margin(np.inf, None))
    return tuple(Interval(limits[k], limits[k + 1]) for k in stable if values[k] < values[k + 1] or k == own)
