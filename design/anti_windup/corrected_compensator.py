"""The corrected theta1~: 1 + theta1~ is zero at every plant pole that is not stable, and f is least."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from design.anti_windup.compensator import AntiWindup, from_one_plus, uncertainty_cost
from design.anti_windup.condition import Condition
from design.anti_windup.corrected_program import CorrectedProgram, Vertex
from design.blocks.block import Block, bound_block
from design.blocks.frequency_peak import searched_norm
from identification.base.arrays import Real, Whole
from identification.base.errors import InputError
from identification.model.additive_bound import AdditiveBound

SETTLED = 0.01  # what is left of y_d after the recovery time
RATES = 48  # values of the rate in a decade
SPREAD = 1536  # values of b in a decade
DECADES = 5  # below the bandwidth in which poles are looked for, where they may be faster than asked
COARSE = 16  # every so many of them, and of these every eighth first, with every fourth of the rates
OPEN = 1.05  # by which f may be worse at a coarse b for the finer ones beside it to be tried
NEAREST = 6  # solutions by which the points of a finer lattice are first tried
LIKELY = 1.1  # of the least lower bound: what is solved next
WORTH, RESOLVED = 1e-6, 1e-9  # by which f must be better for another theta1~, of f and of ||W_a||
PROGRAMS, MOST = 100, 1e-2  # solved programs with which WORTH grows tenfold, and up to what


class NoCompensatorError(InputError):
    """No theta1~ of the class meets the condition."""


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
        No n over these poles, nor over any of the coarse lattice, meets the linear programs' conditions with a smaller
        f, by weak duality; the conditions as computed in double precision.
    """

    anti_windup: AntiWindup
    f: float
    f_lower: float


def corrected(
    unstable: tuple[complex, ...],
    bound: AdditiveBound,
    recovery_s: float,
    condition: Condition,
    bandwidth: float,
    faster: bool = True,
) -> Corrected:
    """The theta1~ of least f found in a class whose theta2 is stable, for a condition, a recovery time and a bandwidth.

        1 + theta1~ = prod(s - p_i)/(s + rate)^q n(s)/(s + b)^N,  ln(100)/recovery_s <= rate <= b <= bandwidth,

    p_i being the q plant poles outside the open left half plane, N the order of W_a, n monic of degree N with
    Re n/d >= 0.1 on the axis, d being W_a's monic denominator; rate = bandwidth/10^(i/48), b = bandwidth/10^(j/1536)
    for whole i, j, none below bandwidth/10^5 if ``faster``; or the washout, prod(s - p_i)/(s + bandwidth)^q, where that
    is better; unless ``faster`` it has the rate in the place of the bandwidth, but where nothing else is found.

    Parameters
    ----------
    unstable
        Poles of the plant with Re s >= 0 in rad/s, each as often as it is multiple; closed under conjugation.
    bound
        W_a.
    recovery_s
        Time in seconds in which the slowest mode of theta1~, exp(-rate t), falls to 1 % at most; positive.
    condition
        A sector of Theorem 2.3.1, or that 1 + theta1~ is positive real, for the model or for every plant within W_a.
    bandwidth
        In rad/s, no less than ln(100)/recovery_s; no pole of theta1~ is faster.
    faster
        Whether rate may exceed the least one of the lattice that the recovery time allows.

    Raises
    ------
    InputError
        A number is out of its range; or, as a NoCompensatorError, no such theta1~ meets the condition.

    Notes
    -----
    The class is ours; the thesis has (2.23) only. With a stable theta1~, theta2 = P (1 + theta1~) is stable if and only
    if 1 + theta1~ has these zeros. For one integrator and a strictly proper W_a no bandwidth means no optimum:
    s/(s + b) meets every sector below 1, and its f vanishes as b grows.

    For given poles f and the condition are convex in the coefficients of n, a linear program over half planes, see
    :class:`design.anti_windup.corrected_program.CorrectedProgram`. The third condition, Re n/d >= 0.1, keeps the zeros
    of n stable, near those of d: the control rings with them as long as the actuator is saturated.

    The poles lie on a lattice that hangs on the bandwidth alone, so that a longer recovery only adds to it. f does not
    increase with the recovery time by more than that by which it must be better for another theta1~ to be taken: 1e-6
    of it and 1e-9 of ||W_a||, where many programs have to be solved more (tenfold for each hundred, 1e-2 at most); and
    than the tolerance of the programs' N + 1 active conditions makes, 1e-9 of ||W_a|| each.
    Every point of a coarse lattice, j a multiple of 16, is solved or excluded by the dual of a program that was solved
    nearby. Between them a point counts if its f is not below 1/OPEN of the lower one of its two coarse neighbours'
    programs; so one whose neighbours are both excluded with that margin cannot win. What is returned is judged again:
    the condition and f as computed from the roots.
    """
    if not 0 < recovery_s < np.inf:
        raise InputError(f"the recovery time is {recovery_s:g} s; expected a positive number")
    slowest = float(np.log(1 / SETTLED)) / recovery_s
    if not slowest * (1 - 1e-9) <= bandwidth < np.inf:
        raise InputError(
            f"the bandwidth of the anti-windup is {bandwidth:.9g} rad/s; expected a finite one of at least "
            f"{slowest:.9g} rad/s, which the recovery in {recovery_s:g} s needs"
        )
    decades = min(float(np.log10(bandwidth / slowest)) + 1e-9, DECADES if faster else np.inf)
    slowest = bandwidth / 10**decades
    search = _Search(unstable, bound, condition, bandwidth, slowest)
    search.take_washout(unstable, bandwidth if faster else bandwidth * 10.0 ** (-int(RATES * decades) / RATES))
    i, j = (each.ravel() for each in np.indices((int(RATES * decades) + 1, int(SPREAD / COARSE * decades) + 1)))
    if not faster:
        i, j = i[i == i.max()], j[i == i.max()]
    j = j * COARSE
    first = ((i - i.min()) % 4 == 0) & (j % (8 * COARSE) == 0)
    lower, proved = np.zeros((2, len(i)))
    for points in (first, ~first):
        lower[points], proved[points] = search.run(i[points], j[points])
    near = np.flatnonzero(lower < OPEN * search.wanted)
    beside = np.concatenate([np.arange(1 - COARSE, 0), np.arange(1, COARSE)])
    fine = np.unique([np.repeat(i[near], len(beside)), (j[near, None] + beside).ravel()], axis=1)
    search.run(*fine[:, fine[1] >= 0])
    if search.best is None:
        search.take_washout(unstable, bandwidth)
    if search.best is None:
        raise NoCompensatorError(
            f"no theta1~ with poles from {slowest:g} to {bandwidth:g} rad/s that meets {condition} was found; expected "
            "a weaker guarantee or a slower recovery"
        )
    f, _ = uncertainty_cost(bound, search.best.one_plus)
    return Corrected(search.best, f, max(search.floor, min(f, float(proved.min()), search.best_lower)))


class _Search:
    """The best theta1~ of the points of a lattice that were tried."""

    def __init__(
        self,
        unstable: tuple[complex, ...],
        bound: AdditiveBound,
        condition: Condition,
        bandwidth: float,
        slowest: float,
    ) -> None:
        self.W_a, self.condition, self.bandwidth = bound_block(bound), condition, bandwidth
        self.program = CorrectedProgram(unstable, bound, condition, bandwidth, slowest)
        self.known: list[tuple[float, float, Vertex]] = []
        self.least: dict[tuple[int, int], float] = {}
        self.best: AntiWindup | None = None
        self.f = self.best_lower = np.inf
        # no f is below |W_a| at infinity, where 1 + theta1~ is 1
        self.floor = 0.0 if self.W_a.relative_degree else self.W_a.gain

    def take_washout(self, unstable: tuple[complex, ...], rate: float) -> None:
        """Make the washout of a rate in rad/s the best so far if it meets the condition."""
        washout = from_one_plus(Block(1.0, unstable, (complex(-rate),) * len(unstable)))
        if self.condition.holds(washout):
            self.best, self.f = washout, searched_norm(self.W_a * washout.one_plus)[0]

    @property
    def wanted(self) -> float:
        """The f that would be worth another compensator, in the unit of W_a."""
        worth = min(WORTH * 10 ** (len(self.known) / PROGRAMS), MOST)
        return self.f * (1 - worth) - RESOLVED * self.program.size if self.f > self.floor * (1 + WORTH) else 0.0

    def run(self, i: Whole, j: Whole) -> Real:
        """Solve or exclude points of the lattice; the lower bounds of their f, shape (2, P), as of the program."""
        rate, b = self._poles(i, j)
        lower = np.where(j * RATES <= i * SPREAD, self.program.first_bounds(rate, b), np.inf) * np.ones((2, 1))
        waiting = np.flatnonzero(lower[0] < self.wanted)  # of rate <= b

        def raise_bounds(points: Whole, vertex: Vertex) -> None:
            found = self.program.lower_bounds(vertex, rate[points], b[points])
            lower[:, points] = np.maximum(lower[:, points], found)

        if self.known:
            rates, spreads = np.array([known[:2] for known in self.known]).T
            away = np.hypot(np.log(rate[waiting, None] / rates), np.log(b[waiting, None] / spreads))
            for ranked in np.argsort(away, axis=1)[:, :NEAREST].T:
                for k in np.unique(ranked[lower[0, waiting] < self.wanted]):
                    raise_bounds(waiting[(ranked == k) & (lower[0, waiting] < self.wanted)], self.known[k][2])
        while True:
            waiting = waiting[lower[0, waiting] < self.wanted]
            if not len(waiting):
                return lower
            likely = lower[0, waiting] <= LIKELY * lower[0, waiting].min()
            k = int(waiting[likely][-1])  # the slowest, since f mostly falls with the rate
            vertex = self.program.solve(float(rate[k]), float(b[k]), self.wanted)
            self.known.append((float(rate[k]), float(b[k]), vertex))
            raise_bounds(waiting, vertex)
            waiting = waiting[waiting != k]
            if vertex.x is not None:
                self._consider(int(i[k]), int(j[k]), vertex.x, float(lower[1, k]))

    def _poles(self, i: Whole | int, j: Whole | int) -> tuple[Real, Real]:
        """Rate and b in rad/s."""
        return np.asarray(self.bandwidth * 10.0 ** (-i / RATES)), np.asarray(self.bandwidth * 10.0 ** (-j / SPREAD))

    def _consider(self, i: int, j: int, x: Real, lower: float) -> None:
        """Keep a compensator that is better than the best so far, meets the condition and counts."""
        rate, b = (float(each) for each in self._poles(i, j))
        kind = self.program.compensator(rate, b, x)
        f, _ = searched_norm(self.W_a * kind.one_plus)
        waiting = iter(self.condition.tighter)
        while f < self.wanted and not self.condition.holds(kind):
            tighter = next(waiting, None)
            solved = None if tighter is None else self.program.solve(rate, b, self.wanted, tighter).x
            if solved is None:
                return
            kind = self.program.compensator(rate, b, solved)
            f, _ = searched_norm(self.W_a * kind.one_plus)
        if not f < self.wanted:
            return
        below = j - j % COARSE
        beside = [at for at in {below, below + COARSE * (j > below)} if at * RATES <= i * SPREAD]
        if j == below or f >= min(self._least_f(i, at) for at in beside) / OPEN:
            self.best, self.f, self.best_lower = kind, f, lower

    def _least_f(self, i: int, j: int) -> float:
        """The least f of a program, whatever the best so far; infinite if it has no solution."""
        if (i, j) not in self.least:
            rate, b = (float(each) for each in self._poles(i, j))
            vertex = self.program.solve(rate, b, np.inf)
            bound = self.program.lower_bounds(vertex, *(np.array([each]) for each in (rate, b)))[0, 0]
            self.least[i, j] = float(bound) if vertex.x is not None else np.inf
        return self.least[i, j]
