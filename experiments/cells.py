"""A linear plant on equal cells of time, without error: what it makes of an input, and the adjoint of that."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.linalg import expm
from scipy.signal import fftconvolve

from design.realization import StateSpace


@dataclass(frozen=True)
class Cells:
    """The response of a plant from rest, or its periodic one.

    Parameters
    ----------
    plant
        Strictly proper, without dead time; its only poles on the imaginary axis are at zero.
    cell_s, count
        Length of a cell in seconds, and how many make the span or the period.
    periodic
        Whether input and output are periodic.
    centred
        Whether a periodic input has the mean zero, as it must have under a plant with a pole at zero; the mean
        of the output is then free.
    """

    plant: StateSpace
    cell_s: float
    count: int
    periodic: bool
    centred: bool

    def output(self, u: np.ndarray) -> np.ndarray:
        """y at the cells' ends, shape (count + 1,), or (count,) if periodic, for u (count,), constant in each cell."""
        if self.periodic:
            return np.roll(np.fft.irfft(np.fft.rfft(u) * np.fft.rfft(self._pulse), self.count), 1)
        return np.append(0.0, fftconvolve(u, self._pulse)[: self.count])

    def correlation(self, mu: np.ndarray, derivative: int = 0) -> tuple[np.ndarray, np.ndarray]:
        """sum_j mu_j g(t_j - t) at both ends of every cell, from within, g the response to an impulse.

        Parameters
        ----------
        mu
            Weights at the cells' ends, of the shape of :meth:`output`.
        derivative
            Which derivative of g to take instead of g.

        Returns
        -------
        left, right
            Shape (count,). At t_j, where g jumps, each end has the value on its own side.
        """
        M, row, start = self._impulse
        row = row @ np.linalg.matrix_power(M, derivative)
        g = self._samples(row, start, len(mu))
        if self.periodic:
            before_next = row @ expm(M * self.cell_s * self.count) @ start
            at = np.fft.irfft(np.fft.rfft(mu) * np.conj(np.fft.rfft(g)), self.count)
            return at - mu * (g[0] - before_next), np.roll(at, -1)
        at = fftconvolve(mu[::-1], g)[: len(mu)][::-1]
        return at[:-1] - mu[:-1] * g[0], at[1:]

    def integrals(self, mu: np.ndarray) -> np.ndarray:
        """The integrals over every cell, shape (count,), of the sum that :meth:`correlation` has at its ends."""
        if self.periodic:
            return np.roll(np.fft.irfft(np.fft.rfft(mu) * np.conj(np.fft.rfft(self._pulse)), self.count), -1)
        return fftconvolve(mu[:0:-1], self._pulse)[: self.count][::-1]

    @cached_property
    def _impulse(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """M, row and z of the response row exp(M t) z to an impulse; if periodic, to one in every period.

        Where the input has the mean zero, the impulses' own mean is taken off them.
        """
        A, b, c = self.plant.A, self.plant.b, self.plant.C[0]
        if not self.periodic:
            return A, c, b
        n, period_s = len(b), self.cell_s * self.count
        M = np.zeros((n + 1, n + 1))
        M[:n, :n], M[:n, n] = A, -b / period_s if self.centred else 0.0
        over = expm(M * period_s)
        # a pole at zero leaves a constant free, which drops out: the shortest start is taken
        start = np.linalg.lstsq(np.eye(n) - over[:n, :n], b + over[:n, n], rcond=1e-9)[0]
        return M, np.append(c, 0.0), np.append(start, 1.0)

    @cached_property
    def _pulse(self) -> np.ndarray:
        """The response to 1 in the first cell, at the later end of that and of every following cell."""
        M, row, start = self._impulse
        return self._samples(row, integral(M, self.cell_s) @ start, self.count)

    def _samples(self, row: np.ndarray, start: np.ndarray, count: int) -> np.ndarray:
        """row exp(M t) start for t = 0, cell_s, ..., by blocks."""
        M = self._impulse[0]
        width = int(np.ceil(np.sqrt(count)))
        states, rows = np.empty((width, len(start))), np.empty((width, len(start)))
        step, leap = expm(M * self.cell_s), expm(M * self.cell_s * width)
        for k in range(width):
            states[k], start = start, step @ start
            rows[k], row = row, row @ leap
        return (rows @ states.T).ravel()[:count]


def integral(matrix: np.ndarray, span_s: float) -> np.ndarray:
    """The integral of exp(M t) from 0 to ``span_s`` for M of shape (n, n)."""
    n = len(matrix)
    return np.asarray(expm(span_s * np.block([[matrix, np.eye(n)], [np.zeros((n, 2 * n))]]))[:n, n:])


def absolute_integral(left: np.ndarray, right: np.ndarray) -> np.ndarray:
    """The integrals of |chord from left to right| over intervals of length 1, shape (n,) as the ends have."""
    size = np.abs(left) + np.abs(right)
    crossing = left * right < 0
    return np.where(crossing, (left**2 + right**2) / np.where(crossing, size, 1.0), size) / 2
