"""The least peak error under a limited input as a linear program, enclosed by an input and by a dual certificate."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal

import numpy as np
import scipy.sparse as sparse
from scipy.linalg import expm
from scipy.optimize import linprog

from design.realization import StateSpace
from experiments.cells import Cells, absolute_integral, integral
from identification.files import InputError

SAMPLES = 4  # times in a step at which the program knows the error
REFINED = 4  # parts of a step, each with a value of u of its own, near the time from which the error counts
NEAR = (20, 2)  # steps before and after that time that are refined
PHASE = 0.3  # most that the fastest pole turns or decays within a cell, rad
WIDTHS = (0.0, 0.5, 1.0, 1.5, 2.0, 3.0)  # of the averages that are tried, in steps
PASSES = 3  # three boxes in a row are a smooth bell
SPARE = 6  # steps at the end of a start from rest that only serve the averages
MOST_CELLS = 2_000_000
# the first is the fastest, the others seldom fail
ATTEMPTS: tuple[tuple[Literal["highs-ipm", "highs-ds"], bool], ...] = (
    ("highs-ipm", True),
    ("highs-ipm", False),
    ("highs-ds", False),
)


@dataclass(frozen=True)
class Interval:
    """A number known to lie between ``lower`` and ``upper``."""

    lower: float
    upper: float


@dataclass(frozen=True)
class PeakProgram:
    """min over u, |u| <= limit, of the greatest |r(t) - y(t)| from a given time on, y the output of a plant.

    Parameters
    ----------
    plant
        Strictly proper, without dead time.
    span_s
        The period, or from rest at t = 0 the horizon, in seconds.
    steps
        Intervals of ``span_s`` in each of which the program holds u; its bounds are evaluated on finer cells.
    periodic
        Whether u and y are periodic; else y starts from rest.
    integrates
        Whether the plant has a pole at zero: a periodic u then has the mean zero and y a free constant.

    Raises
    ------
    InputError
        The fastest pole asks for more than two million cells.
    """

    plant: StateSpace
    span_s: float
    steps: int
    periodic: bool
    integrates: bool

    def __post_init__(self) -> None:
        if self.fineness * self.steps > MOST_CELLS:
            raise InputError(
                f"the plant's fastest pole, {self._fastest:.4g} rad/s, is too fast beside {self.span_s:.4g} s of "
                f"reference; expected at most {MOST_CELLS * PHASE / self.span_s:.3g} rad/s"
            )

    @property
    def _centred(self) -> bool:
        return self.periodic and self.integrates

    @cached_property
    def _cells(self) -> Cells:
        return Cells(self.plant, self.cell_s, self.fineness * self.steps, self.periodic, self._centred)

    @cached_property
    def _fastest(self) -> float:
        return float(np.abs(np.linalg.eigvals(self.plant.A)).max())

    @property
    def fineness(self) -> int:
        """Cells in a step."""
        sample_s = self.span_s / (self.steps * SAMPLES * REFINED)
        return SAMPLES * REFINED * max(1, int(np.ceil(sample_s * self._fastest / PHASE)))

    @property
    def part(self) -> int:
        """Cells in a part of a refined step."""
        return self.fineness // REFINED

    @property
    def cell_s(self) -> float:
        """Length of a cell in seconds."""
        return self.span_s / (self.steps * self.fineness)

    @property
    def counted(self) -> int:
        """How many of ``time_s`` count: from rest all but those in the last six steps."""
        return len(self.time_s) - (0 if self.periodic else SPARE * self.fineness)

    @cached_property
    def time_s(self) -> np.ndarray:
        """Ends of the cells, shape (cells + 1,); of a periodic program without the last, (cells,)."""
        return np.arange(self.steps * self.fineness + (not self.periodic)) * self.cell_s

    def solve(self, reference: np.ndarray, limit: float, first: int = 0) -> Interval:
        """Enclose the least peak error.

        Parameters
        ----------
        reference
            r at ``time_s``, in the unit of y.
        limit
            Of |u|, positive.
        first
            Index into ``time_s`` from which on the error counts, a multiple of ``part``; 0 if periodic.

        Returns
        -------
        Interval
            In the unit of y. No measurable u with |u| <= limit stays below ``lower``; some u reaches ``upper``.

        Raises
        ------
        InputError
            The program could not be solved.

        Notes
        -----
        The program holds u and knows e at samples only. What that leaves open is closed by moving averages.
        Averaged, u keeps its limit and stops exciting resonances between the samples. The dual weights mu,
        sum |mu_j| = 1, bound the error of every u:

            max |e| >= sum mu_j e(t_j) >= sum mu_j r(t_j) - limit * integral |sum mu_j g(t_j - t)| dt,

        g the response to an impulse. Where u has the mean zero, so have the weights, and the median of the sum in
        the integral may be taken off it. Averaged weights are as good as others, and excite g less. Several
        averages are tried and the best bound of each kind kept: every one of them holds.
        """
        scale = float(np.abs(reference).max()) or 1.0
        r, gain = reference / scale, limit / scale
        u, mu = self._optimum(r, gain, first)
        uppers = [self._peak(r, gain * self._average(u, width, first), first) for width in WIDTHS]
        lowers = [self._certificate(r, gain, self._average(mu, width, first)) for width in WIDTHS]
        return Interval(scale * max(0.0, *lowers), scale * min(uppers))

    def _edges(self, first: int) -> np.ndarray:
        """Where the steps begin and end, in cells; from rest they are refined near ``first``."""
        whole = np.arange(self.steps + 1) * self.fineness
        if self.periodic:
            return whole
        parts = np.arange(self.steps * REFINED + 1) * self.part
        before, after = (steps * self.fineness for steps in NEAR)
        return np.union1d(whole, parts[(parts >= first - before) & (parts <= first + after)])

    def _optimum(self, r: np.ndarray, gain: float, first: int) -> tuple[np.ndarray, np.ndarray]:
        """Solve the program: u in every cell, as a share of its limit, and the weights of e at the cells' ends.

        The variables are the states at the steps' ends (but for the start from rest), u in the steps, the peak.
        """
        c, n = self._scaled.C, len(self._scaled.b)
        edges = self._edges(first)
        lengths = np.diff(edges)
        steps = len(lengths)
        ends = steps + (not self.periodic)
        state = sparse.eye_array(ends).tocsr()[:, 0 if self.periodic else 1 :]
        before, after = state[:steps], state[np.arange(1, steps + 1) % ends]
        dynamics: Any = sparse.hstack([sparse.kron(after, np.eye(n)), sparse.csr_array((n * steps, steps + 1))])
        outputs, samples = [], []
        for length in np.unique(lengths):
            chosen = np.flatnonzero(lengths == length)
            these = sparse.eye_array(steps).tocsr()[chosen]
            kept, driven = self._over(length)
            nothing = sparse.csr_array((n * steps, 1))
            flow = [sparse.kron(these.T @ these @ before, kept), sparse.kron(these.T @ these, driven[:, None])]
            dynamics = dynamics - sparse.hstack([*flow, nothing])
            for inside in range(0, length, length // SAMPLES):
                kept, driven = self._over(inside)
                outputs.append(sparse.hstack([sparse.kron(these @ before, c @ kept), (c @ driven)[0] * these]))
                samples.append(edges[chosen] + inside)
        if not self.periodic:
            outputs.append(sparse.hstack([sparse.kron(state[-1:], c), sparse.csr_array((1, steps))]))
            samples.append(edges[-1:])
        sampled = np.concatenate(samples)
        counted = np.flatnonzero(sampled >= first)
        output, sampled = gain * sparse.vstack(outputs).tocsr()[counted], sampled[counted]
        peak = sparse.csr_array(-np.ones((len(counted), 1)))
        both: Any = sparse.vstack([sparse.hstack([output, peak]), sparse.hstack([-output, peak])])
        control = slice(output.shape[1] - steps, output.shape[1])
        bounds: Any = np.full((output.shape[1] + 1, 2), [-np.inf, np.inf])
        bounds[control] = -1.0, 1.0
        for method, presolve in ATTEMPTS:
            solution = linprog(
                np.append(np.zeros(output.shape[1]), 1.0),
                A_ub=both,
                b_ub=np.concatenate([r[sampled], -r[sampled]]),
                A_eq=dynamics,
                b_eq=np.zeros(n * steps),
                bounds=bounds,
                method=method,
                options={"presolve": presolve},
            )
            if solution.status == 0:
                break
        else:
            raise InputError(f"the linear program of the least error was not solved ({solution.message})")
        u, prices = np.clip(np.asarray(solution.x)[control], -1.0, 1.0), np.asarray(solution.ineqlin.marginals)
        weights = prices[: len(counted)] - prices[len(counted) :]
        if self._centred:
            u, weights = u - u.mean(), weights - weights.mean()
        mu = np.zeros(len(r))
        mu[sampled] = weights
        return np.repeat(u / max(1.0, np.abs(u).max()), lengths), mu

    def _over(self, cells: int) -> tuple[np.ndarray, np.ndarray]:
        """What becomes of the states in so many cells, by themselves and under u = 1."""
        span_s = cells * self.cell_s
        return expm(self._scaled.A * span_s), integral(self._scaled.A, span_s) @ self._scaled.b

    @cached_property
    def _scaled(self) -> StateSpace:
        """The plant with states of which a sinusoid of amplitude 1, at a pole or once in the span, makes 1 at most."""
        A, b, slowest = self.plant.A, self.plant.b, 2 * np.pi / self.span_s
        omegas = np.append(slowest, np.abs(np.linalg.eigvals(A)).clip(min=slowest))
        size = np.max([np.abs(np.linalg.solve(1j * omega * np.eye(len(b)) - A, b)) for omega in omegas], axis=0)
        return StateSpace(A * size / size[:, None], b / size, self.plant.C * size, self.plant.d)

    def _average(self, values: np.ndarray, width: float, first: int) -> np.ndarray:
        """Repeated moving averages, from ``first`` on, of values in the cells or at their ends.

        Where there is no period to go on with, the values are mirrored at both ends. As a matrix that is symmetric
        with rows of non-negative shares, sum 1: it averages, keeps the sum, and may be put on mu as well as on e.
        """
        half, later = int(width * self.fineness / 2), values[first:]
        for _ in range(PASSES):
            total = np.append(0.0, np.cumsum(np.pad(later, half, mode="wrap" if self.periodic else "symmetric")))
            later = (total[2 * half + 1 :] - total[: -2 * half - 1]) / (2 * half + 1)
        return np.append(values[:first], later)

    def _peak(self, r: np.ndarray, u: np.ndarray, first: int) -> float:
        """The greatest error under u, constant in each cell; second differences tell how far it bulges within one."""
        error = r - self._cells.output(u)
        error = np.pad(error, 2, mode="wrap") if self.periodic else np.pad(error, 1, mode="edge")
        if self._centred:
            error -= (error.max() + error.min()) / 2
        size, bend = np.abs(error[1:-1]), np.abs(np.diff(error, 2))
        inside = np.maximum(size[:-1], size[1:]) + np.maximum(bend[:-1], bend[1:]) / 8
        return float(inside[first : self.counted].max())

    def _certificate(self, r: np.ndarray, gain: float, mu: np.ndarray) -> float:
        """What the weights mu prove, see :meth:`solve`.

        Within a cell the sum in the integral is smooth: it differs from its chord by at most cell_s^2/8 times the
        second derivative, which is read at the cell's ends, and in the mean by at most two thirds of that. Where it
        therefore keeps its sign its integral is known exactly; elsewhere that of its chord, and the rest is added.
        """
        mu = np.where(np.arange(len(mu)) < self.counted, mu, 0.0)
        total = np.abs(mu).sum()
        if total == 0:
            return 0.0
        left, right = self._cells.correlation(mu / total)
        exact = self._cells.integrals(mu / total)
        bend = self.cell_s**2 / 8 * np.maximum(*np.abs(self._cells.correlation(mu / total, derivative=2)))
        if self._centred:
            middle = np.median(np.append(left, right))
            left, right, exact = left - middle, right - middle, exact - middle * self.cell_s
        keeps = (left * right > 0) & (np.minimum(np.abs(left), np.abs(right)) > bend)
        doubtful = self.cell_s * (absolute_integral(left, right) + 2 / 3 * bend)
        area = np.where(keeps, np.abs(exact), doubtful).sum()
        return float(mu @ r / total - gain * area)
