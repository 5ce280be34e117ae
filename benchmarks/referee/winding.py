"""Roots of a quasi-polynomial right of a line, counted by the argument principle with a bound for every step.

    N(s) = sum_j gain_j prod_i (s - zero_ji) exp(-delay_j s),   the first term monic of degree n, no delay.

A step from a to b along the line is taken only where the terms together cannot move by more than 0.7 |N(a)|, as

    |prod(1 + e_i) - 1| <= exp(sum |e_i|) - 1,   |e_i| <= (b - a)/|a - zero_i|,   or (b - a) delay for the delay,

says: then N stays away from 0 in between and its phase changes by the principal value. Above a frequency from which on
the other terms together are less than half of the first (they have a lower degree: the loops are retarded), the
phase is that of the first but for the phase of 1 + their ratio, which tends to 0.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit

from benchmarks.referee.factors import Complex, Factors, Loop, Real, unit

ROUNDING = 1e-13  # relative
MOST_STEPS = 300_000
SMALLEST = 1e-14  # step relative to where it is: there N cannot be told from 0


class OnTheLine(Exception):
    """A root lies on the line as far as can be seen."""


class Undecided(Exception):
    """The referee's own computation does not reach an answer."""


@njit(cache=True)
def _march(
    gains: Complex, zeros: Complex, counts: Real, delays: Real, moved: Complex, x: float, start: float, end: float,
    trail: Real,
) -> tuple[float, int]:  # fmt: skip
    """The phase that N gains from x + j start to x + j end, and the number of steps; -1 on a root, -2 of too many.

    The first points go into ``trail``.
    """
    terms = len(gains)
    omega, phase, steps = start, 0.0, 0
    size, speed = np.zeros(terms), np.zeros(terms)
    last, away = 0j, 0.0
    while True:
        s = complex(x, omega)
        total = 0j
        # over prod(s - moved), whose own phase is subtracted, so that nothing overflows
        for j in range(terms):
            value, rate = gains[j], delays[j]
            for i in range(max(int(counts[j]), len(moved))):
                if i < counts[j]:
                    value *= s - zeros[j, i]
                    rate += 1 / max(abs(s - zeros[j, i]), 1e-300)
                if i < len(moved):
                    value /= s - moved[i]
            value *= np.exp(-delays[j] * s)
            total += value
            size[j], speed[j] = abs(value), rate
        turned = 0.0
        for i in range(len(moved)):
            turned += np.angle(s - moved[i])  # within a quarter turn: Re s > Re moved
        if steps > 0:
            step_phase = np.angle(total / last) + (turned - away)
            # N's own change is the principal value; its parts may add up to a turn more
            phase += step_phase - 2 * np.pi * np.rint(step_phase / (2 * np.pi))
        if steps < len(trail):
            trail[steps] = omega
        if omega >= end:
            return phase, steps
        last, away = total, turned
        slope = 0.0
        for j in range(terms):
            if size[j] > 0:
                slope += size[j] * speed[j]
        step = 0.6 * abs(total) / slope if slope > 0 else end - omega
        while True:
            change = 0.0
            for j in range(terms):
                if size[j] > 0:
                    change += size[j] * (np.exp(min(step * speed[j], 50.0)) - 1)
            if change <= 0.7 * abs(total):
                break
            step *= 0.7
            if not step > 0:
                return phase, -1
        if step <= SMALLEST * abs(omega) or step == 0.0:
            return phase, -1
        steps += 1
        if steps > MOST_STEPS:
            return phase, -2
        omega = min(omega + step, end)


@dataclass(frozen=True)
class QuasiPolynomial:
    """N(s) as above, and how many roots it has right of a line."""

    gains: tuple[complex, ...]
    zeros: tuple[tuple[complex, ...], ...]
    delays: tuple[float, ...]

    @property
    def degree(self) -> int:
        """n."""
        return len(self.zeros[0])

    def count(self, line: float = 0.0, trail: Real | None = None) -> int:
        """Roots with a real part above ``line`` (rad/s), each as often as it is multiple.

        ``trail`` takes the frequencies of the steps, which resolve N on the line; those it has no room for are lost.
        """
        real = all(complex(gain).imag == 0 for gain in self.gains)
        top = self._top(line)
        table = np.zeros((len(self.zeros), max(1, *(len(zeros) for zeros in self.zeros))), dtype=complex)
        for row, zeros in zip(table, self.zeros, strict=True):
            row[: len(zeros)] = sorted(zeros, key=abs)
        counts = np.array([float(len(zeros)) for zeros in self.zeros])
        first = np.array(sorted(self.zeros[0], key=abs), dtype=complex)
        scale = np.abs(first - line)
        scale[scale == 0] = top / 100
        moved = line - np.maximum(np.abs(first.real - line), 0.05 * scale) + 1j * first.imag
        phase, steps = _march(
            np.array(self.gains, dtype=complex), table, counts, np.array(self.delays), moved,
            line, 0.0 if real else -top, top, np.zeros(0) if trail is None else trail,
        )  # fmt: skip
        if steps == -2:
            raise Undecided(f"more than {MOST_STEPS} steps along a line")
        if steps < 0:
            raise OnTheLine
        ends = 1 if real else 2
        for sign in (1.0, -1.0)[:ends]:
            s = complex(line, sign * top)
            phase += float(np.sum(np.pi / 2 - sign * np.angle(s - first)) - sign * np.angle(1 + self._rest(s)))
        roots = self.degree / 2 - phase / np.pi if real else (self.degree - phase / np.pi) / 2
        if abs(roots - round(roots)) > 1e-3:
            raise Undecided("a phase is no multiple of half a turn")
        return round(roots)

    def _rest(self, s: complex) -> complex:
        total = 0j
        for gain, zeros, delay in zip(self.gains[1:], self.zeros[1:], self.delays[1:], strict=True):
            total += gain * complex(Factors(1.0, zeros, self.zeros[0])(s)) * np.exp(-delay * s)
        return total

    def _top(self, line: float) -> float:
        """Where the bound on the other terms over the first one falls to a half; it falls further from there on."""
        largest = max((abs(root - line) for zeros in self.zeros for root in zeros), default=0.0)
        others = list(zip(self.gains[1:], self.zeros[1:], self.delays[1:], strict=True))
        top = 4 * largest
        if not largest:  # monomials
            sizes = [(abs(gain) * np.exp(-delay * line), self.degree - len(zeros)) for gain, zeros, delay in others]
            return max((2 * len(sizes) * size) ** (1 / lower) for size, lower in sizes) if sizes else 1.0
        while True:
            total = 0.0
            for gain, zeros, delay in others:
                above = len(zeros) * np.log1p(largest / top) - self.degree * np.log1p(-largest / top)
                lower = (self.degree - len(zeros)) * np.log(top)
                total += abs(gain) * float(np.exp(above - lower - delay * line))
            if total <= 0.5:
                return top
            top *= 1.5


def characteristic(loop: Loop, gain: complex = 1.0, true_delay_s: float | None = None) -> QuasiPolynomial:
    """D (1 - feedback exp(-delay s) + gain P forward exp(-true_delay s)), D the common denominator, cancelled.

    Where feedback and P forward have the same roots to rounding and the same dead time, they are one term; and none if
    their gains are the same to rounding too: a controller with K = T_so/P, on its own model.
    """
    later = loop.true_delay_s if true_delay_s is None else true_delay_s
    through, feedback = loop.open, loop.feedback.reduced()
    common = list(through.poles)
    spare = list(through.poles)
    for pole in feedback.poles:
        near = min(spare, key=lambda other: abs(other - pole), default=None)
        if near is not None and abs(near - pole) <= 1e-9 * abs(pole):
            spare.remove(near)
        else:
            common.append(pole)
    below = Factors(1.0, tuple(common))
    terms = [(complex(1.0), below.zeros, 0.0)]
    inner, outer = ((below * each).reduced() for each in (feedback, through))
    if loop.delay_s == later and _same(inner.zeros, outer.zeros):
        rest = complex(gain * outer.gain - inner.gain)
        terms.append((rest if abs(rest) > ROUNDING * abs(inner.gain) else 0j, outer.zeros, later))
    else:
        terms.append((complex(-inner.gain), inner.zeros, loop.delay_s))
        terms.append((complex(gain * outer.gain), outer.zeros, later))
    terms = [term for term in terms if term[0] != 0]
    gains, zeros, delays = zip(*terms, strict=True)
    return QuasiPolynomial(gains, zeros, delays)


def _same(first: tuple[complex, ...], second: tuple[complex, ...]) -> bool:
    return len(first) == len(second) and not Factors(1.0, first, second).reduced().zeros


def trail(loop: Loop) -> Real:
    """Frequencies above 0 that resolve the loop on the axis: the steps of the count, and what is around each root."""
    points = np.zeros(200_000)
    characteristic(loop).count(0.0, points)
    roots = loop.plant.zeros + loop.plant.poles + loop.forward.zeros + loop.forward.poles + loop.feedback.zeros
    return np.unique(np.concatenate([points[points > 0], around(roots, unit(loop.plant, loop.forward))]))


def around(roots: tuple[complex, ...], scale: float) -> Real:
    """Frequencies above 0 around each root, 1e-3 to 1e3 times as far off as it is from the axis, and far out."""
    offsets = np.concatenate([-np.geomspace(1e3, 1e-3, 121), [0.0], np.geomspace(1e-3, 1e3, 121)])
    sizes = [abs(root) for root in roots if root != 0] or [scale]
    far = np.geomspace(1e-4 * min(sizes), 1e4 * max(sizes), 4000)
    near = [
        abs(root.imag) + max(abs(root.real), 1e-9 * abs(root)) * offsets
        for root in roots
        if root != 0 and root.imag >= 0
    ]
    points = np.concatenate([far, *near])
    return np.unique(points[points > 0])
