"""The corrected theta1~: 1 + theta1~ is zero at every plant pole that is not stable, and f is least for a sector."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import linprog

from design.anti_windup import AntiWindup, from_one_plus, uncertainty_cost
from design.block import Block, bound_block, from_polynomial
from design.frequency import frequency_grid
from design.popov import popov_sector
from identification.files import InputError
from identification.plant import AdditiveBound

SETTLED = 0.01  # what is left of y_d after the recovery time
TOLERANCE = 1e-6  # of f, relative
MARGIN = 2e-4  # by which 1/sector is lowered at most, relative: what lies between the frequencies
PER_DECADE = 200  # frequencies
REAL_PART = 0.1  # least real part of n over the denominator of W_a on the axis, which keeps the zeros of n stable
TRIED = 9  # values of b
HALVINGS = 8  # of the distance to the best one's neighbours


@dataclass(frozen=True)
class Corrected:
    """The corrected compensator and its cost.

    Parameters
    ----------
    anti_windup
        theta1~ and 1 + theta1~.
    f
        ||W_a (1 + theta1~)||_inf.
    f_lower
        No n over the same poles meets the linear program's conditions (a slightly larger sector) with a smaller f.
    """

    anti_windup: AntiWindup
    f: float
    f_lower: float


def corrected(
    unstable: tuple[complex, ...], bound: AdditiveBound, recovery_s: float, sector: float, bandwidth: float
) -> Corrected:
    """The theta1~ of least f in a class whose theta2 is stable, for a stated sector, recovery time and bandwidth.

        1 + theta1~ = prod(s - p_i)/(s + rate)^q n(s)/(s + b)^N,  rate = ln(100)/recovery_s,  2 rate <= b <= bandwidth,

    p_i being the q plant poles outside the open left half plane, N the order of W_a, n monic of degree N with
    Re n/d >= 0.1 on the axis, d being W_a's monic denominator; or prod(s - p_i)/(s + bandwidth)^q where that is
    better.

    Parameters
    ----------
    unstable
        Poles of the plant with Re s >= 0 in rad/s, each as often as it is multiple; closed under conjugation.
    bound
        W_a.
    recovery_s
        Time in seconds in which the slowest mode of theta1~, exp(-rate t), falls to 1 % at most; positive.
    sector
        k of Theorem 2.3.1, between 0 and 1: with limits +-L the dead zone lies in it as long as |u| <= L/(1 - k).
    bandwidth
        In rad/s, more than twice the rate; no pole of theta1~ is faster.

    Raises
    ------
    InputError
        A number is out of its range, or no such theta1~ meets the sector.

    Notes
    -----
    The class is ours; the thesis has (2.23) only. theta2 = P (1 + theta1~) is stable if and only if 1 + theta1~ has
    these zeros. Without a bandwidth there is no optimum: s/(s + b) meets every sector below 1, and its f vanishes
    as b grows.

    For a given b f and Popov's condition are convex in the coefficients of n, and with the multiplier 0 (the
    circle criterion, which suffices) they become a linear program over half planes: cuts are added where a
    solution violates |W_a (1 + theta1~)| <= f or Re theta1~ + 1/k >= 0 most, until none does by more than TOLERANCE.
    The third condition, Re n/d >= REAL_PART, keeps the zeros of n stable, near those of d: the control rings with
    them as long as the actuator is saturated. What is returned is judged again: sector, and f within 1 % of f_lower.
    Each program is a relaxation, so that its value is a proved lower bound. b is the best of a grid, halved around
    the best one some times: a search by values alone would move the last digits from machine to machine.
    """
    if not (np.isfinite([recovery_s, sector, bandwidth]).all() and recovery_s > 0 and 0 < sector < 1):
        raise InputError(
            f"the recovery time is {recovery_s:g} s and the sector {sector:g}; "
            "expected a positive time and 0 < sector < 1"
        )
    rate = float(np.log(1 / SETTLED)) / recovery_s
    if not 2 * rate < bandwidth < np.inf:
        raise InputError(
            f"the bandwidth of the anti-windup is {bandwidth:g} rad/s; expected a finite one of more than "
            f"{2 * rate:g}, twice the rate that the recovery in {recovery_s:g} s takes"
        )

    tried: dict[float, tuple[_Program, float, np.ndarray]] = {}
    trials = np.linspace(np.log(2 * rate), np.log(bandwidth), TRIED)
    for _ in range(1 + HALVINGS):
        for logarithm in trials:
            program = _Program(unstable, bound, rate, float(np.exp(logarithm)), sector)
            tried[float(logarithm)] = (program, *program.solve())
        at = sorted(tried)
        k = min(range(len(at)), key=lambda k: tried[at[k]][1])
        trials = np.array([(at[k] + at[other]) / 2 for other in (k - 1, k + 1) if 0 <= other < len(at)])
    program, f_lower, coefficients = tried[at[k]]

    found: list[tuple[float, float, AntiWindup]] = []
    if np.isfinite(f_lower):
        kind = program.compensator(coefficients)
        found.append((uncertainty_cost(bound, kind.one_plus)[0], f_lower, kind))
    fastest = from_one_plus(Block(1.0, unstable, (complex(-bandwidth),) * len(unstable)))
    f = uncertainty_cost(bound, fastest.one_plus)[0]
    found.append((f, f, fastest))
    for f, f_lower, kind in sorted(found, key=lambda each: each[0]):
        if popov_sector(kind.theta1_tilde)[0] >= sector and f <= 1.01 * f_lower:
            return Corrected(kind, f, f_lower)
    raise InputError(
        f"no theta1~ of our class with poles from {rate:g} to {bandwidth:g} rad/s meets the sector {sector:g}; "
        "expected a smaller sector or a slower recovery"
    )


class _Program:
    """The linear program over the coefficients x of n(s) = s^N + sum x_j b^(N - j) s^j, for one b."""

    def __init__(self, unstable: tuple[complex, ...], bound: AdditiveBound, rate: float, b: float, sector: float):
        W_a = bound_block(bound)
        self.fixed = Block(1.0, unstable, (complex(-rate),) * len(unstable))
        self.b, self.order, self.sector = b, bound.order, sector
        roots = (*W_a.zeros, *W_a.poles, *self.fixed.zeros, complex(-rate), complex(-b))
        self.omega = frequency_grid(roots, PER_DECADE)
        s = 1j * self.omega
        powers = (s[:, None] / b) ** np.arange(self.order + 1)
        basis = self.fixed(s)[:, None] * powers / (1 + s[:, None] / b) ** self.order
        self.basis, self.monic = basis[:, :-1], basis[:, -1]
        magnitude = np.abs(W_a(s))
        self.size = float(magnitude.max())
        self.W_a = W_a(s) / self.size
        self.margin = min(MARGIN, (1 - sector) / 2)
        # n in units of W_a's monic denominator
        scale = self.b**self.order / np.prod(s[:, None] - np.array(W_a.poles), axis=1)
        self.shape, self.shape_monic = scale[:, None] * powers[:, :-1], scale * powers[:, -1]

    def solve(self) -> tuple[float, np.ndarray]:
        """The least f, to TOLERANCE from below, and the coefficients; infinite and empty when none was found."""
        rows, limits = [], []

        def bound_magnitude(at: np.ndarray, direction: np.ndarray) -> None:
            weighted = direction * self.W_a[at]
            rows.append(np.column_stack([(weighted[:, None] * self.basis[at]).real, -np.ones(len(at))]))
            limits.append(-(weighted * self.monic[at]).real)

        def bound_sector(at: np.ndarray) -> None:
            rows.append(np.column_stack([-self.basis[at].real, np.zeros(len(at))]))
            limits.append(self.monic[at].real - 1 + (1 - self.margin) / self.sector)

        def bound_phase(at: np.ndarray) -> None:
            rows.append(np.column_stack([-self.shape[at].real, np.zeros(len(at))]))
            limits.append(self.shape_monic[at].real - REAL_PART)

        start = np.arange(0, len(self.omega), 40)
        for direction in (1, 1j, -1, -1j):
            bound_magnitude(start, np.full(len(start), direction))
        bound_sector(start)
        bound_phase(start)
        for _ in range(60):
            found = linprog(
                np.append(np.zeros(self.order), 1.0),
                np.vstack(rows),
                np.concatenate(limits),
                bounds=[(None, None)] * self.order + [(0, None)],
                method="highs",
                options={"primal_feasibility_tolerance": 1e-10, "dual_feasibility_tolerance": 1e-10},
            )
            if found.x is None:  # infeasible, or beyond the solver
                return np.inf, np.empty(0)
            x, f = found.x[:-1], float(found.x[-1])
            one_plus = self.monic + self.basis @ x
            magnitude, real = np.abs(self.W_a * one_plus), one_plus.real - 1 + 1 / self.sector
            phase = (self.shape_monic + self.shape @ x).real
            above, below = magnitude > f * (1 + TOLERANCE), real < self.margin / 2 / self.sector
            turned = phase < (1 - TOLERANCE) * REAL_PART
            if not (above.any() or below.any() or turned.any()):
                return self.size * f, x
            peaks = np.flatnonzero(above & _local_maximum(magnitude))
            bound_magnitude(peaks, np.exp(-1j * np.angle((self.W_a * one_plus)[peaks])))
            bound_sector(np.flatnonzero(below & _local_maximum(-real)))
            bound_phase(np.flatnonzero(turned & _local_maximum(-phase)))
        return np.inf, np.empty(0)

    def compensator(self, x: np.ndarray) -> AntiWindup:
        """theta1~ and 1 + theta1~ with these coefficients."""
        n = from_polynomial(np.append(1.0, x[::-1]), self.b)
        poles = self.fixed.poles + (complex(-self.b),) * self.order
        return from_one_plus(Block(1.0, self.fixed.zeros + n.zeros, poles))


def _local_maximum(values: np.ndarray) -> np.ndarray:
    padded = np.concatenate([[-np.inf], values, [-np.inf]])
    return np.asarray((values >= padded[:-2]) & (values >= padded[2:]))
