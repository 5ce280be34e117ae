"""The least peak error under a limited input as a linear program, enclosed by an input and by a dual certificate."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property

import clarabel
import numpy as np
import scipy.sparse as sparse

from experiments.physical_limits.averages import average, best, spread
from experiments.physical_limits.certificates import Samples, forced, reached, whole
from experiments.physical_limits.exact_chain import fastest
from experiments.physical_limits.intervals import Interval, outward
from experiments.physical_limits.response_cells import UNIT, Cells
from experiments.runs.references import Reference
from identification.base.errors import InputError
from identification.model.plant import PlantModel

SAMPLES = 4  # times in a step at which the program knows the error; one, its middle, of a plant whose output jumps
REFINED = 4  # parts of a step, each with a value of u of its own, near the time from which the error counts
GRAINS = SAMPLES * REFINED  # of a step: at whole ones lie the samples of a part
NEAR = (20, 2)  # steps before and after that time that are refined
PHASE = 0.6  # most that the fastest pole turns or decays within a cell, rad
WIDTHS = (0.0, 0.5, 1.0, 1.5, 2.0, 3.0)  # of the averages that are tried, in steps
SPARE = 6  # steps at the end of a start from rest that only serve the averages
LOST = 1e-3  # of the weights may lie beyond the time to which the error counts, or that much of r is hardly an error
MOST_CELLS = 2_000_000
SOLVED = 1e-6  # to this share of r the program is; what that leaves open, the bounds count
GRAIN = 1e-8  # of the distance of the limits, more than a grain in so many cells


@dataclass(frozen=True)
class PeakProgram:
    """min over u, low <= u <= high, of the greatest |r(t) - y(t)| from a given time on, y the output of a plant.

    Parameters
    ----------
    plant
        With a pole; its dead time is left out.
    span_s
        The period, or from rest at t = 0 the horizon, in seconds.
    steps
        Intervals of ``span_s`` in each of which the program holds u; its bounds are evaluated on finer cells.
    periodic
        Whether u and y are periodic; else y starts from rest. Where the plant has a pole at zero, a periodic u has
        the mean zero and y a free constant.

    Raises
    ------
    InputError
        The fastest pole asks for more than two million cells.
    """

    plant: PlantModel
    span_s: Fraction
    steps: int
    periodic: bool

    def __post_init__(self) -> None:
        if self.fineness * self.steps > MOST_CELLS:
            raise InputError(
                f"the plant's fastest pole, {self._fastest:.4g} rad/s, is too fast for {float(self.span_s):.4g} s of "
                f"the reference; expected at most {MOST_CELLS * PHASE / float(self.span_s):.3g} rad/s"
            )

    @property
    def _centred(self) -> bool:
        return self.periodic and self.plant.integrators > 0

    @cached_property
    def _cells(self) -> Cells:
        count = self.fineness * self.steps
        return Cells(self.plant, self.span_s / count, count, "periodic" if self.periodic else "rest")

    @cached_property
    def _fastest(self) -> float:
        return fastest(self.plant)

    @property
    def fineness(self) -> int:
        """Cells in a step."""
        sample_s = float(self.span_s) / (self.steps * SAMPLES * REFINED)
        return SAMPLES * REFINED * max(1, int(np.ceil(sample_s * self._fastest / PHASE)))

    @property
    def part(self) -> int:
        """Cells in a part of a refined step."""
        return self.fineness // REFINED

    @property
    def cell_s(self) -> float:
        """Length of a cell in seconds."""
        return float(self.span_s) / (self.steps * self.fineness)

    @property
    def counted(self) -> int:
        """How many of ``time_s`` count: from rest all but those in the last six steps."""
        return len(self.time_s) - (0 if self.periodic else SPARE * self.fineness)

    @cached_property
    def time_s(self) -> np.ndarray:
        """Ends of the cells, shape (cells + 1,); of a periodic program without the last, (cells,)."""
        return np.arange(self.steps * self.fineness + (not self.periodic)) * self.cell_s

    def solve(
        self, reference: Reference, limits: tuple[float, float], first: int = 0, ahead_s: float = 0.0
    ) -> Interval:
        """Enclose the least peak error.

        Parameters
        ----------
        reference
            r; if the program is periodic, of its period.
        limits
            The lower and the upper one of u, in order; 0 between them where the plant integrates.
        first
            Index into ``time_s`` from which on the error counts, a multiple of ``part``; 0 if periodic.
        ahead_s
            r(t + ahead_s) is followed.

        Returns
        -------
        Interval
            In the unit of y. No measurable u within the limits stays below ``lower``; some u reaches ``upper``. Both
            are bounds of the plant and the reference as their numbers say, all roundings included, that of a table to
            12 digits too.

        Raises
        ------
        InputError
            The program could not be solved, or the plant is too slow or turns too often for a bound.

        Notes
        -----
        The program holds u and knows e at samples only. What that leaves open is closed by moving averages: averaged, u
        keeps its limit and stops exciting resonances between the samples, and the program's dual weights excite the
        plant less. What an average of u reaches, :func:`experiments.physical_limits.certificates.reached` bounds; what
        weights prove, whichever they are, :func:`experiments.physical_limits.certificates.forced`. Several averages are
        tried and the best bound of each kind kept: every one of them holds, however well the program was solved. From
        rest the error counts in the program beyond the time to which it counts here, so that the averages of u find a
        u there that goes on; weights that lie beyond prove nothing, and are then those of a second program without.
        """
        values, counted = reference(self.time_s + ahead_s), slice(first, self.counted)
        if self._centred:  # a constant counts for nothing
            values = values - (values.max() + values.min()) / 2
        scale = float(np.abs(values).max()) or 1.0
        doubt = reference.rounding(float(self.span_s) + ahead_s) / scale + 4 * UNIT
        r, size = Samples(values / scale, doubt, reference.bend * self.cell_s**2 / 8 / scale), max(map(abs, limits))
        gain, shares = size / scale, (limits[0] / size, limits[1] / size)
        u, mu = self._optimum(r.values, gain, shares, slice(first, len(values)))
        cells, more = self._cells, gain * (1 + 2 * UNIT)
        controls = (whole(average(u, self._half(width), first, self.periodic), self._centred) for width in WIDTHS)
        upper = -best(-reached(cells, control, r, more, counted) for control in controls)
        weighed = slice(first, self.counted - (cells.jumps and not self.periodic))
        if upper > LOST and np.abs(mu[weighed.stop :]).sum() > LOST * np.abs(mu).sum():
            _, mu = self._optimum(r.values, gain, shares, weighed)
        weights = (self._weights(mu, width, weighed) for width in WIDTHS if mu[weighed].any())
        lower = best(forced(cells, each, r, more, shares) for each in weights)
        return outward(scale * max(0.0, lower), scale * upper)

    def _weights(self, mu: np.ndarray, width: float, counted: slice) -> np.ndarray:
        """Averaged weights for :func:`experiments.physical_limits.certificates.forced`, none at the end of the span."""
        half = self._half(width)
        weights = average(mu, half, 0, periodic=True) if self.periodic else spread(mu, half, counted)
        return whole(weights / np.abs(weights).sum(), self._centred)

    def _half(self, width: float) -> int:
        """Cells to either side of one, of an average as wide as so many steps."""
        return int(width * self.fineness / 2)

    def _edges(self, first: int) -> np.ndarray:
        """Where the steps begin and end, in cells; from rest they are refined near ``first``."""
        whole = np.arange(self.steps + 1) * self.fineness
        if self.periodic:
            return whole
        parts = np.arange(self.steps * REFINED + 1) * self.part
        before, after = (steps * self.fineness for steps in NEAR)
        return np.union1d(whole, parts[(parts >= first - before) & (parts <= first + after)])

    def _optimum(
        self, r: np.ndarray, gain: float, shares: tuple[float, float], counted: slice
    ) -> tuple[np.ndarray, np.ndarray]:
        """Solve the program: u in every cell, as a share of the farther limit, and the weights of e at the cells' ends.

        The variables are the states at the steps' ends (but for the start from rest), u in the steps, the peak. A limit
        that is no whole number of grains, see :func:`experiments.physical_limits.certificates.whole`, is kept off by
        one and more.
        """
        off = GRAIN * (shares[1] - shares[0])
        low, high = shares[0] + off * (shares[0] != -1), shares[1] - off * (shares[1] != 1)
        chain, edges, grain = self._cells.chain, self._edges(counted.start), self.fineness // GRAINS
        n, lengths = len(chain.b), np.diff(edges)
        steps = len(lengths)
        within = np.array([0.5]) if self._cells.jumps else np.arange(SAMPLES) / SAMPLES
        seen, inside = np.repeat(np.arange(steps), len(within)), np.outer(lengths, within).ravel().astype(int)
        if not (self.periodic or self._cells.jumps):
            seen, inside = np.append(seen, steps - 1), np.append(inside, lengths[-1])
        sampled = edges[seen] + inside
        judged = (sampled >= counted.start) & (sampled < counted.stop)
        seen, inside, sampled = seen[judged], inside[judged], sampled[judged]
        output = gain * (chain.c @ self._flows[inside // grain] + np.append(np.zeros(n), chain.d))[:, None, :]

        over, k, above = self._flows[lengths // grain], np.arange(steps), n * steps + np.arange(len(seen))
        states = n * (steps + (not self.periodic))
        below, highest, unity = above + len(seen), n * steps + 2 * len(seen) + k, np.ones((steps, 1, 1))
        peak = np.full(len(seen), states + steps), np.full((len(seen), 1, 1), -1.0)
        blocks = [
            (n * k, n * (k + 1) % states, np.broadcast_to(np.eye(n), (steps, n, n))),
            (n * k, n * k, -over[:, :, :n]),
            (n * k, states + k, -over[:, :, n:]),
            (above, n * seen, output[:, :, :n]),
            (above, states + seen, output[:, :, n:]),
            (above, *peak),
            (below, n * seen, -output[:, :, :n]),
            (below, states + seen, -output[:, :, n:]),
            (below, *peak),
            (highest, states + k, unity),
            (highest + steps, states + k, -unity),
        ]
        matrix = _of_blocks(blocks)[:, 0 if self.periodic else n :]
        settings = clarabel.DefaultSettings()
        settings.verbose = False
        settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = SOLVED
        solution = clarabel.DefaultSolver(
            sparse.csc_matrix((matrix.shape[1], matrix.shape[1])),
            np.append(np.zeros(matrix.shape[1] - 1), 1.0),
            matrix,
            np.concatenate([np.zeros(n * steps), r[sampled], -r[sampled], np.full(steps, high), np.full(steps, -low)]),
            [clarabel.ZeroConeT(n * steps), clarabel.NonnegativeConeT(2 * len(seen) + 2 * steps)],
            settings,
        ).solve()
        if not (np.isfinite(solution.x).all() and np.isfinite(solution.z).all()):
            raise InputError(
                f"the linear program of the least error, of {matrix.shape[1]} unknowns, was not solved (the solver "
                f"says: {solution.status}); expected a plant whose poles and zeros differ less"
            )
        u, prices = np.clip(np.asarray(solution.x)[-1 - steps : -1], low, high), -np.asarray(solution.z)[n * steps :]
        weights = prices[: len(seen)] - prices[len(seen) : 2 * len(seen)]
        if self._centred:
            u, weights = u - u.mean(), weights - weights.mean()
            u = u / max(1.0, u.min() / low, u.max() / high)
        mu = np.zeros(len(r))
        mu[sampled] = weights
        return np.repeat(u, lengths), mu

    @cached_property
    def _flows(self) -> np.ndarray:
        """What becomes of the states in 0, 1 ... all grains of a step, by themselves and under u = 1, side by side."""
        chain = self._cells.chain
        n = len(chain.b)
        cell = np.block([[chain.flow, chain.pulse[:, None]], [np.zeros((1, n)), np.ones((1, 1))]])
        grain, flows = np.linalg.matrix_power(cell, self.fineness // GRAINS), [np.eye(n + 1)]
        for _ in range(GRAINS):
            flows.append(grain @ flows[-1])
        return np.array(flows)[:, :n]


def _of_blocks(blocks: Iterable[tuple[np.ndarray, np.ndarray, np.ndarray]]) -> sparse.csc_matrix:
    """The matrix of dense blocks: the rows (k,) and columns (k,) of their upper left entries, the blocks (k, n, m)."""
    rows, columns, values = [], [], []
    for first_row, first_column, block in blocks:
        _, n, m = block.shape
        rows.append(np.broadcast_to(first_row[:, None, None] + np.arange(n)[:, None], block.shape).ravel())
        columns.append(np.broadcast_to(first_column[:, None, None] + np.arange(m), block.shape).ravel())
        values.append(block.ravel())
    entries = np.concatenate(values)
    kept = entries != 0
    return sparse.csc_matrix((entries[kept], (np.concatenate(rows)[kept], np.concatenate(columns)[kept])))
