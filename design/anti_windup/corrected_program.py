"""The linear programs of the corrected theta1~: the best n(s) for given poles, and what its dual says of others."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

import numpy as np

from design.anti_windup.compensator import AntiWindup, from_one_plus
from design.anti_windup.condition import Condition, PositiveReal
from design.blocks.block import Block, bound_block, from_polynomial, geometric_scale
from design.blocks.frequency_peak import frequency_grid
from identification.base.arrays import Complex, Real
from identification.model.additive_bound import AdditiveBound

PER_DECADE = 200  # frequencies
REAL_PART = 0.1  # least real part of n over the denominator of W_a on the axis, which keeps the zeros of n stable
LARGEST = 1e4  # coefficient of n/d - 1, in terms that are 1 at most on the axis
TOLERANCE = 1e-7  # of f, relative
FEASIBLE = 1e-9  # tolerance of the other conditions
EXCHANGES = 300
COARSE = 24  # frequencies of the first bounds
PATIENCE = 25  # exchanges without progress, after which any violated condition enters, so that none goes in circles
SIGN = 1e-9  # relative size of a multiplier of the wrong sign that is rounding
PIVOT = 1e-9  # least one, relative
ROUNDING = 1e-15  # of a sum of few products


class Kind(Enum):
    """What a row of the program says of the coefficients x and of f."""

    COEFFICIENT = "x_k <= LARGEST"
    FLOOR = "f >= 0"
    MAGNITUDE = "Re weight |E| (1 + psi x) <= f"
    CONDITION = "Re turn E (1 + psi x) weight >= least"
    SHAPE = "Re (1 + psi x) >= REAL_PART"


@dataclass(frozen=True)
class Row:
    """A row of the program at one frequency (or, for COEFFICIENT, for one coefficient); ``weight`` is the turn too."""

    kind: Kind
    k: int = 0
    weight: complex = 0j


@dataclass(frozen=True)
class Vertex:
    """Where the dual simplex method ended for one pair of poles.

    Parameters
    ----------
    rows
        As many active rows as unknowns; one more, last, where it contradicts the others.
    x
        Coefficients, shape (N,); None where there is no solution, or none of interest.
    """

    rows: tuple[Row, ...]
    x: Real | None


class CorrectedProgram:
    """Least f of 1 + theta1~ = E (1 + psi x), E = prod(s - p_i)/(s + rate)^q d/(s + b)^N, for any rate and b.

    Parameters
    ----------
    unstable
        The p_i in rad/s, closed under conjugation.
    bound
        W_a, with the monic denominator d of degree N; psi_k = s^k/d, k < N, each scaled to 1 at most on the axis.
    condition
        What 1 + theta1~ has to meet beside f.
    bandwidth, slowest
        In rad/s: no rate or b is above or below.
    """

    def __init__(
        self,
        unstable: tuple[complex, ...],
        bound: AdditiveBound,
        condition: Condition,
        bandwidth: float,
        slowest: float,
    ) -> None:
        W_a = bound_block(bound)
        shaping = condition.robustness.roots if isinstance(condition, PositiveReal) and condition.robustness else ()
        self.unstable, self.poles, self.N = unstable, W_a.poles, len(W_a.poles)
        grid = frequency_grid((*W_a.zeros, *W_a.poles, *unstable, *shaping, complex(-bandwidth)), PER_DECADE)
        self.below = below = int(np.ceil(max(0.0, PER_DECADE * np.log10(grid[0] / (1e-3 * slowest)))))
        self.omega = np.concatenate([grid[0] * 10.0 ** (-np.arange(below, 0, -1) / PER_DECADE), grid])
        s = 1j * self.omega
        self.unit = geometric_scale(Block(1.0, self.poles))
        d = np.prod((s[:, None] - np.array(self.poles)) / self.unit, axis=1)
        psi = (s[:, None] / self.unit) ** np.arange(self.N) / d[:, None]
        self.scale = np.abs(psi[below:]).max(axis=0)
        self.psi = psi / self.scale
        values = W_a(s)
        self.size = float(np.abs(values[below:]).max())
        self.W_a = values / self.size
        self.least, self.turns = condition.least, condition.turns(self.omega)
        self.is_scaled = condition.is_scaled and bool(unstable)
        self.objective = np.append(np.zeros(self.N), 1.0)

    def _factor(self, s: Complex, rate: Real | float, b: Real | float) -> Complex:
        """E at frequencies s for poles of the same shape, or the other way round."""
        value = np.ones(np.broadcast(s, rate, b).shape, dtype=complex)
        for zero in self.unstable:
            value = value * (s - zero) / (s + rate)
        for pole in self.poles:
            value = value * (s - pole) / (s + b)
        return value

    def _weight(self, omega: Real | float, rate: Real | float) -> Real | float:
        """Of the condition, see :class:`design.anti_windup.condition.PositiveReal`."""
        return 1 + (rate / omega) ** 2 if self.is_scaled else 1.0

    def _row(self, row: Row, rate: Real, b: Real) -> tuple[Real, Real]:
        """Left sides, shape (P, N + 1), and limits, (P,), of one row for poles of shape (P,)."""
        E = self._factor(1j * self.omega[row.k], rate, b)
        left, shape = np.zeros((len(E), self.N + 1)), self.psi[row.k]
        if row.kind is Kind.COEFFICIENT:
            left[:, row.k] = 1.0
            return left, np.full(len(E), LARGEST)
        if row.kind is Kind.FLOOR:
            left[:, -1] = -1.0
            return left, np.zeros(len(E))
        if row.kind is Kind.MAGNITUDE:
            value = row.weight * np.abs(E)
            left[:, :-1], left[:, -1] = (value[:, None] * shape).real, -1.0
            return left, -value.real
        if row.kind is Kind.CONDITION:
            value = row.weight * E * self._weight(self.omega[row.k], rate)
            left[:, :-1] = -(value[:, None] * shape).real
            return left, value.real - self.least
        left[:, :-1] = -shape.real
        return left, np.full(len(E), 1 - REAL_PART)

    def solve(self, rate: float, b: float, stop: float, tighter: float = 0.0) -> Vertex:
        """The dual simplex method over all frequencies: the most violated condition enters until none is.

        Parameters
        ----------
        rate, b
            Poles in rad/s.
        stop
            The search ends as soon as f is known to be larger.
        tighter
            By which the left side of the condition has to exceed ``least``; with another than 0 the vertex is none of
            :meth:`lower_bounds`.
        """
        first = min(self.below, int(np.searchsorted(self.omega, 1e-3 * rate * (1 - 1e-9))))
        psi, E = self.psi[first:], self._factor(1j * self.omega[first:], rate, b)
        weighted = self.W_a[first:] * E
        turned = self.turns[:, first:] * E * self._weight(self.omega[first:], rate)
        rows = [Row(Kind.COEFFICIENT, k) for k in range(self.N)] + [Row(Kind.FLOOR)]
        left, limits = np.eye(self.N + 1), np.append(np.full(self.N, LARGEST), 0.0)
        left[-1, -1] = -1.0
        chance, stalled, reached = np.random.default_rng(0), 0, -1.0
        for _ in range(EXCHANGES):
            try:
                x, f = np.split(np.linalg.solve(left, limits), [self.N])
            except np.linalg.LinAlgError:
                break
            if f[0] * self.size > stop:
                break
            shape = 1 + psi @ x
            value = weighted * shape
            excess = np.stack(
                [
                    (np.abs(value) - f[0]) / max(f[0], 1e-3) * (FEASIBLE / TOLERANCE),
                    REAL_PART - shape.real,
                    *(self.least + tighter - (turned * shape).real),
                ]
            )
            kind, k = np.unravel_index(np.argmax(excess), excess.shape)
            if excess[kind, k] <= FEASIBLE:
                return Vertex(tuple(rows), x)
            stalled, reached = (stalled + 1, reached) if f[0] <= reached else (0, f[0])
            if stalled > PATIENCE:
                kind, k = chance.choice(np.argwhere(excess > FEASIBLE))
            entering = Row(Kind.SHAPE, first + int(k))
            if kind == 0:
                weight = complex(np.exp(-1j * np.angle(value[k])) * weighted[k] / np.abs(E[k]))
                entering = Row(Kind.MAGNITUDE, first + int(k), weight)
            elif kind > 1:
                entering = Row(Kind.CONDITION, first + int(k), complex(self.turns[kind - 2, first + k]))
            new, limit = self._row(entering, np.array([rate]), np.array([b]))
            i = self._leaves(left, new[0])
            if i is None:
                return Vertex((*rows, entering), None)
            rows[i], left[i] = entering, new[0]
            limits[i] = limit[0] - (tighter if entering.kind is Kind.CONDITION else 0.0)
        return Vertex(tuple(rows), None)

    def _leaves(self, left: Real, new: Real) -> int | None:
        """The active row that a new one replaces; None where it contradicts them."""
        dual, step = np.linalg.solve(left.T, np.column_stack([-self.objective, new])).T
        leaves = np.flatnonzero(step > PIVOT * np.abs(step).max())
        if not len(leaves):
            return None
        share = np.maximum(dual[leaves], 0) / step[leaves]
        ties = leaves[share <= share.min() + 1e-14]
        return int(ties[np.argmax(step[ties])])

    def first_bounds(self, rate: Real, b: Real) -> Real:
        """f >= REAL_PART |W_a E| at every frequency, since |n/d| >= Re n/d; for poles of shape (P,), shape (P,)."""
        bounds = np.zeros(len(rate))
        for k in range(0, len(self.omega), len(self.omega) // COARSE):
            E = self._factor(1j * self.omega[k], rate, b)
            bounds = np.maximum(bounds, self.size * REAL_PART * np.abs(self.W_a[k] * E))
        return bounds

    def lower_bounds(self, vertex: Vertex, rate: Real, b: Real) -> Real:
        """What the active rows of one solution say of other poles, by weak duality.

        Parameters
        ----------
        vertex
            From :meth:`solve`.
        rate, b
            Poles in rad/s, shape (P,).

        Returns
        -------
        ndarray, shape (2, P)
            Lower bounds of f with these poles: the rows are summed with multipliers y >= 0 so that f is left. First to
            the solver's tolerance; then with what rounding leaves of x and f in the sum, no more than LARGEST and
            ||W_a||, subtracted at its worst. The rows are as computed in double precision. Infinite where they
            contradict each other.
        """
        pairs = [self._row(row, rate, b) for row in vertex.rows]
        left, limits = np.stack([pair[0] for pair in pairs], axis=1), np.stack([pair[1] for pair in pairs], axis=1)
        n = self.N + 1
        sums, worst = np.swapaxes(left[:, :n], 1, 2), np.append(np.full(self.N, LARGEST), 1.0)
        contradicts = len(vertex.rows) > n
        targets = np.broadcast_to(-self.objective[:, None], (len(rate), n, 1))
        if contradicts:
            targets = np.concatenate([targets, -left[:, -1, :, None]], axis=2)
        try:
            found = np.linalg.solve(sums, targets)
        except np.linalg.LinAlgError:
            return np.full((2, len(rate)), -np.inf)
        wrong = (found < -SIGN * np.abs(found).max(axis=1, keepdims=True)).any(axis=1)
        found = np.maximum(found, 0)
        rest = np.abs(sums @ found - targets) + ROUNDING * (np.abs(sums) @ found + np.abs(targets))
        loss = np.stack([np.where(wrong, np.inf, 0.0), np.swapaxes(rest, 1, 2) @ worst])
        totals = (limits[:, :n, None] * found).sum(axis=1)
        bounds = -totals[:, 0] - loss[..., 0]
        if contradicts:
            bounds[limits[:, -1] + totals[:, 1] + loss[..., 1] < 0] = np.inf
        return np.asarray(self.size * bounds)

    def compensator(self, rate: float, b: float, x: Real) -> AntiWindup:
        """theta1~ and 1 + theta1~ with these poles and coefficients."""
        n = np.real(np.poly(np.array(self.poles) / self.unit))
        n[1:] += (x / self.scale)[::-1]
        poles = (complex(-rate),) * len(self.unstable) + (complex(-b),) * self.N
        return from_one_plus(Block(1.0, self.unstable + from_polynomial(n, self.unit).zeros, poles))
