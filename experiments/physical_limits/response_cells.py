"""A linear plant on equal cells of time: states under an input, costates of weights, and what either may err by.

States and costates are computed in floating point by whatever is fast. Their defect is the part of a step that the
plant's exact flow does not explain; it is bounded, rounding included, and so is what it makes of all that follows.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from typing import Literal

import numpy as np

from experiments.physical_limits.exact_chain import TINY, Chain, chain, positive_exponential
from identification.base.compiled import njit
from identification.base.errors import InputError
from identification.model.plant import PlantModel

UNIT = 2.0**-52  # twice what one rounding changes
SPARE = 1 + 1e-6  # for the rounding of the bounds themselves, sums of up to 1e8 numbers that are not negative


@dataclass(frozen=True)
class Cells:
    """A plant, without its dead time, over a number of cells.

    Parameters
    ----------
    plant
        With a pole.
    cell_s, count
        Length of a cell in seconds, and how many make the span or the period.
    start
        "rest": the states are 0 at first. "periodic": they are the same at both ends; under a plant that integrates
        the input then has the mean zero, and the last integrator an offset that counts for nothing. "ever": the
        input began long ago, and an integrator, one at most, has such an offset.
    """

    plant: PlantModel
    cell_s: Fraction
    count: int
    start: Literal["rest", "periodic", "ever"]

    @cached_property
    def chain(self) -> Chain:
        """The plant in units of a cell."""
        return chain(self.plant, self.cell_s, self.count)

    @property
    def stable(self) -> int:
        """How many states are not integrators; they come first."""
        return len(self.chain.b) - max(0, self.plant.integrators)

    def states(self, u: np.ndarray) -> np.ndarray:
        """x at the cells' ends, shape (count + 1, n), for u (count,), constant in each cell."""
        return self._driven(u[:, None] * self.chain.pulse, np.zeros(len(self.chain.b)))

    def costates(self, mu: np.ndarray) -> np.ndarray:
        """p_k with p_k = p_{k+1} exp(A) + mu_k c, shape (count + 1, n), for weights mu at the cells' ends.

        mu has the shape (count + 1,), if periodic (count,). Then sum mu_k y(t_k) is the sum of the integrals of
        p_{k+1} exp(A (t_{k+1} - t)) b u(t), time in cells, and of p_0 x_0 where x does not start from rest.

        Where y may jump, mu_k is the weight of y's mean in the cell that begins at t_k, and c what x has in that.
        """
        weighted = mu[::-1, None] * self._seen
        if self.start == "periodic":
            p = self._driven(weighted, np.zeros(len(self.chain.b)), adjoint=True)
        else:
            p = self._driven(weighted[1:], weighted[0], adjoint=True)
        return np.ascontiguousarray(p[::-1])

    def state_defects(self, u: np.ndarray, x: np.ndarray) -> np.ndarray:
        """Bounds of |x_{k+1} - exp(A) x_k - pulse u_k| for the numbers x of :meth:`states`, shape (n,), over all k."""
        flow, pulse = self.chain.flow, self.chain.pulse
        largest, _ = defects(flow, x[:-1], x[1:], u[:, None] * pulse, self._roundings)
        return np.asarray(largest * SPARE + TINY)

    def costate_defects(self, mu: np.ndarray, p: np.ndarray) -> np.ndarray:
        """The sums over k of bounds of |p_k - p_{k+1} exp(A) - mu_k c|, shape (n,)."""
        flow, c = self.chain.flow, self._seen
        following = p[1:] if self.start == "periodic" else np.vstack([p[1:], np.zeros(len(c))])
        p = p[:-1] if self.start == "periodic" else p
        _, total = defects(np.ascontiguousarray(flow.T), following, p, mu[:, None] * c, self._roundings)
        return np.asarray(total * SPARE + len(p) * TINY)

    @property
    def jumps(self) -> bool:
        """Whether y jumps where u does."""
        return self.chain.d != 0

    @property
    def _seen(self) -> np.ndarray:
        """What a weight is of, for each state; shape (n,)."""
        return self.chain.mean[:-1] if self.jumps else self.chain.c

    @property
    def _roundings(self) -> float:
        """What a sum of products of a state, or of numbers that were rounded once, errs by at most, as a share."""
        return (len(self.chain.b) + 6) * UNIT

    def reach(self, inputs: np.ndarray) -> np.ndarray:
        """Bounds of |x_k| for all k under x_{k+1} = exp(A) x_k + w_k with |w_k| <= ``inputs``, shape (n,).

        The offsets that count for nothing are left out. Raises InputError where the plant is so slow beside the
        span, or turns so often in it, that rounding leaves no bound.
        """
        total = self._total
        if self.start == "rest":
            return np.asarray(total @ inputs * SPARE)
        stable, n = self.stable, len(inputs)
        bound = np.zeros(n)
        bound[:stable] = self._settled @ (total[:stable, :stable] @ inputs[:stable]) * SPARE
        flow = np.abs(self.chain.flow)
        # An integrator's state is within half the way that it can go in all cells from that at any time of a period;
        # where the next one is periodic too, its mean over the cells is known from what drives that.
        share = 0.5 if self.start == "periodic" else 1.0
        for k in range(stable, n):
            bound[k] = share * self.count * (flow[k, :k] @ bound[:k] + inputs[k]) * SPARE
            if k + 1 < n and self.start == "periodic":
                bound[k] += (flow[k + 1, :k] @ bound[:k] + inputs[k + 1]) / flow[k + 1, k] * SPARE
        return bound

    @cached_property
    def within(self) -> np.ndarray:
        """Bounds of exp(A t), 0 <= t <= 1, entry by entry."""
        return positive_exponential(self.chain.A * (1 + UNIT))

    @cached_property
    def _powers(self) -> np.ndarray:
        """exp(A j) for j = 0 ... width, in floating point, shape (width + 1, n, n)."""
        width, flow = int(np.ceil(np.sqrt(self.count))), self.chain.flow
        powers = np.empty((width + 1, *flow.shape))
        powers[0] = np.eye(len(flow))
        for j in range(width):
            powers[j + 1] = flow @ powers[j]
        return powers

    @cached_property
    def _leaps(self) -> np.ndarray:
        """exp(A width i) in floating point for i = 0 ... blocks, the least number of blocks that hold all cells."""
        width = len(self._powers) - 1
        leaps = np.empty((-(-self.count // width) + 1, *self.chain.flow.shape))
        leaps[0] = np.eye(len(self.chain.b))
        for i in range(len(leaps) - 1):
            leaps[i + 1] = self._powers[width] @ leaps[i]
        return leaps

    @cached_property
    def _errors(self) -> tuple[float, float]:
        """Bounds of the norm of what :attr:`_powers` and :attr:`_leaps` lack of the true ones."""
        inner = self._lacking(self._powers, self.chain.flow, 0.0)
        return inner, self._lacking(self._leaps, self._powers[-1], inner)

    def _lacking(self, powers: np.ndarray, step: np.ndarray, error: float) -> float:
        """The bound for powers F_j of a step that is known up to an error.

        With F_{j+1} = step F_j + D_j and s the sum of the norms of D_j, no power of the step is larger than
        max |F_j|/(1 - s), and what F_j lacks is at most s times that.
        """
        sizes = np.abs(powers)
        norms = sizes.sum(axis=2).max(axis=1)
        rounded = self._roundings * (np.abs(step) @ sizes[:-1]).sum(axis=2).max(axis=1)
        s = float((rounded + error * norms[:-1]).sum()) * SPARE + len(powers) * TINY
        if not s < 0.5:
            raise InputError("the plant oscillates too often in the span; expected slower poles or a shorter span")
        return s * float(norms.max()) / (1 - s) * SPARE

    @cached_property
    def _total(self) -> np.ndarray:
        """A bound of the sum of |exp(A m)|, m = 0 ... count - 1, entry by entry."""
        inner, outer = (
            np.abs(powers[:-1]).sum(axis=0) + (len(powers) - 1) * error
            for powers, error in zip((self._powers, self._leaps), self._errors, strict=True)
        )
        return np.asarray(outer @ inner * SPARE)

    @cached_property
    def _settled(self) -> np.ndarray:
        """A bound of |(1 - exp(A count))^-1| of the stable states, entry by entry: the sum over all periods."""
        block, j = divmod(self.count, len(self._powers) - 1)
        whole, rest, stable = self._leaps[block], self._powers[j], slice(0, self.stable)
        if not self.stable:
            return np.zeros((0, 0))
        inner, outer = self._errors
        error = outer * _norm(rest) + _norm(whole) * inner + outer * inner
        error += self._roundings * (1 + _norm(np.abs(whole) @ np.abs(rest)))
        lacking = (np.eye(len(whole)) - whole @ rest)[stable, stable]
        inverse = np.linalg.pinv(lacking)
        doubt = _norm(np.eye(self.stable) - inverse @ lacking)
        doubt += _norm(inverse) * (error + self._roundings * (1 + _norm(lacking))) * SPARE
        if not doubt < 0.5:
            raise InputError(
                "a pole of the plant is too slow; expected one that decays by more than 1e-9 of itself in a period, or "
                "a pole at zero"
            )
        return np.asarray(np.abs(inverse) + _norm(inverse) * doubt / (1 - doubt))

    def _driven(self, inputs: np.ndarray, first: np.ndarray, adjoint: bool = False) -> np.ndarray:
        """x_{k+1} = exp(A) x_k + inputs_k, or with exp(A)^T, in floating point; shape (count + 1, n).

        Where it is periodic, it starts from where it ends; else from ``first``.
        """
        flow = np.ascontiguousarray(self.chain.flow.T if adjoint else self.chain.flow)
        x: np.ndarray = driven(flow, inputs, first)
        if self.start == "periodic":
            lacking = np.eye(len(flow)) - np.linalg.matrix_power(flow, len(inputs))
            x = driven(flow, inputs, self._returning(lacking, x[-1], adjoint))
            x[-1] = x[0]
        return x

    def _returning(self, lacking: np.ndarray, end: np.ndarray, adjoint: bool) -> np.ndarray:
        """x with lacking x = end. Of integrators one component is free, taken as 0, and one equation follows."""
        n, kept = len(end), np.arange(len(end))
        follows, free = (n - 1, self.stable) if adjoint else (self.stable, n - 1)
        x = np.zeros(n)
        if self.plant.integrators > 0:
            x[kept != free] = np.linalg.lstsq(lacking[kept != follows][:, kept != free], end[kept != follows])[0]
        else:
            x[:] = np.linalg.lstsq(lacking, end)[0]
        return x


@njit()
def driven(flow: np.ndarray, inputs: np.ndarray, first: np.ndarray) -> np.ndarray:
    """x_0 = ``first``, x_{k+1} = flow x_k + inputs_k, shape (count + 1, n), for ``inputs`` of the shape (count, n)."""
    count, n = inputs.shape
    x = np.empty((count + 1, n))
    for i in range(n):
        x[0, i] = first[i]
    for k in range(count):
        for i in range(n):
            total = inputs[k, i]
            for j in range(n):
                total += flow[i, j] * x[k, j]
            x[k + 1, i] = total
    return x


@njit()
def defects(
    flow: np.ndarray, x: np.ndarray, y: np.ndarray, inputs: np.ndarray, share: float
) -> tuple[np.ndarray, np.ndarray]:
    """The largest and the sum of |y_k - flow x_k - inputs_k| and of a share of the sizes in it, each of shape (n,)."""
    count, n = x.shape
    largest, total = np.zeros(n), np.zeros(n)
    for k in range(count):
        for i in range(n):
            defect, size = y[k, i] - inputs[k, i], abs(y[k, i]) + abs(inputs[k, i])
            for j in range(n):
                part = flow[i, j] * x[k, j]
                defect -= part
                size += abs(part)
            found = abs(defect) + share * size
            largest[i] = max(largest[i], found)
            total[i] += found
    return largest, total


def _norm(matrix: np.ndarray) -> float:
    """The largest sum of sizes in a row; 0 of nothing."""
    return float(np.abs(matrix).sum(axis=1).max()) if matrix.size else 0.0
