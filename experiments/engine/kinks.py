"""The mesh of a run: the images of kinks in order, and polynomials read from elsewhere than where they start."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from experiments.engine.crossings import MOST
from identification.base.arrays import Array
from identification.base.compiled import njit

BEYOND = 0.5  # of a step: how far beyond its end, where no kink is, the polynomial of a cut step is read

NODES = np.cos(math.pi * (np.arange(24, 0, -1) - 0.5) / 24)  # of Chebyshev, upwards
TO_SERIES = np.cos(np.outer(np.arange(24), np.arccos(NODES))) / np.where(np.arange(24) > 0, 12.0, 24.0)[:, None]
TO_POWERS = np.zeros((24, 24))
for _i in range(24):
    TO_POWERS[_i, : _i + 1] = np.polynomial.chebyshev.cheb2poly(np.eye(24)[_i])[: _i + 1]

FACTORIAL = np.array([math.factorial(i) for i in range(MOST + 1)], dtype=float)
INVERSE = 1 / FACTORIAL


class Past(NamedTuple):
    """The sources of the delayed signals, one polynomial a step, the step p at p % room; and the mesh to come.

    Parameters
    ----------
    starts, lates, aheads, degrees, history
        Shapes (room,), and (room, k, most + 1) of the coefficients: a step starts at ``starts`` + ``lates`` seconds,
        and its polynomials ``aheads`` steps later: where it is twice as long as others, in its middle.
    rest
        Shape (k,): the sources before zero.
    queue
        Shape (room,): the images of kinks in order.
    """

    starts: Array
    lates: Array
    aheads: Array
    degrees: Array
    history: Array
    rest: Array
    queue: Array


@njit(nogil=True, fastmath={"contract", "reassoc"})
def shift(c: Array, degree: int, delta: float, work: Array) -> None:
    """Replace the coefficients of p(tau) by those of p(tau + delta): m! c_m = sum_q (m + q)! c_{m+q} delta^q/q!.

    ``work`` is (2, degree + 1) or larger.
    """
    power = 1.0
    for i in range(degree + 1):
        work[0, i] = FACTORIAL[i] * c[i]
        work[1, i] = power * INVERSE[i]
        power *= delta
    for m in range(degree + 1):
        value = 0.0
        for q in range(degree + 1 - m):
            value += work[0, m + q] * work[1, q]
        c[m] = value * INVERSE[m]


@njit(nogil=True)
def insert(queue: Array, queued: int, t: float, near: float) -> int:
    """Insert a time into the sorted queue, unless one is ``near`` it already; its new length."""
    k = queued
    while k > 0 and queue[k - 1] > t:
        k -= 1
    if (k > 0 and t - queue[k - 1] <= near) or (k < queued and queue[k] - t <= near):
        return queued
    for q in range(queued, k, -1):
        queue[q] = queue[q - 1]
    queue[k] = t
    return queued + 1


@njit(nogil=True)
def largest_difference(
    left: Array, left_degree: int, moved: float, right: Array, right_degree: int, radius: float, work: Array
) -> float:
    """The most that two polynomials differ within ``radius`` steps of where the right one starts.

    ``left`` starts ``moved`` steps before; it is changed.
    """
    shift(left, left_degree, moved, work)
    most, power = 0.0, 1.0
    for i in range(max(left_degree, right_degree) + 1):
        difference = left[i] if i <= left_degree else 0.0
        if i <= right_degree:
            difference -= right[i]
        most += abs(difference) * power
        power *= radius
    return most


@njit(nogil=True)
def images(
    past: Past, pieces: int, queued: int, delays: Array, brief: Array, step: float, negligible: Array, W: Array,
    work: Array,
) -> int:  # fmt: skip
    """Queue the images of a kink at the start of the latest step, which is number ``pieces``; the queue's new length.

    None is where the two sides of the kink agree to what is ``negligible`` (1 + k,), as far as they are read.
    """
    starts, lates, aheads, degrees, history, rest, queue = past
    this, left = pieces & (len(starts) - 1), (pieces - 1) & (len(starts) - 1)
    t = starts[this]
    for j in range(len(delays)):
        W[0], before, moved = rest[j], 0, 0.0
        if pieces > 0:
            before = degrees[left]
            moved = (t - starts[left] + (lates[this] - lates[left])) / step - aheads[left]
            for i in range(before + 1):
                W[i] = history[left, j, i]
        read = delays[j] / step if brief[j] else BEYOND
        if largest_difference(W, before, moved, history[this, j], degrees[this], read, work) > negligible[1 + j]:
            queued = insert(queue, queued, t + delays[j], 1e-13 * (step + t))
    return queued


@njit(nogil=True)
def drop(queue: Array, queued: int, until: float) -> int:
    """Drop the times up to one from the sorted queue; its new length."""
    passed = 0
    while passed < queued and queue[passed] <= until:
        passed += 1
    if passed > 0:
        queued -= passed
        for q in range(queued):
            queue[q] = queue[q + passed]
    return queued


@njit(nogil=True)
def across(
    starts: Array, lates: Array, aheads: Array, degrees: Array, history: Array, rest: Array, j: int, piece: int,
    pieces: int, start: float, late: float, step: float, negligible: float, work: Array, W: Array,
) -> int:  # fmt: skip
    """Fill W with one polynomial for two steps of a past signal, from ``start`` + ``late`` on and about their middle.

    It interpolates the pieces in Chebyshev's nodes, and its series is cut off where it is ``negligible``. Returns its
    degree, or -1 where the series does not become so: the past has a kink there. ``piece`` is one near the start.
    """
    wrap = len(starts) - 1
    while piece > 0 and starts[piece & wrap] > start:
        piece -= 1
    for m in range(len(NODES)):
        at = start + (1.0 + NODES[m]) * step
        while piece + 1 < pieces and starts[(piece + 1) & wrap] <= at:
            piece += 1
        this = piece & wrap
        value = rest[j]
        if at >= 0:
            tau = (start - starts[this] + (late - lates[this])) / step + (1.0 + NODES[m] - aheads[this])
            value = 0.0
            for i in range(degrees[this], -1, -1):
                value = value * tau + history[this, j, i]
        work[0, m] = value
    degree = 0
    for i in range(len(NODES)):
        work[1, i] = 0.0
        for m in range(len(NODES)):
            work[1, i] += TO_SERIES[i, m] * work[0, m]
        if abs(work[1, i]) > negligible:
            degree = i
    for power in range(degree + 1):
        W[power] = 0.0
        for i in range(power, degree + 1):
            W[power] += work[1, i] * TO_POWERS[i, power]
    return degree if degree < len(NODES) - 3 else -1


@njit(nogil=True)
def read_piece(
    starts: Array, lates: Array, aheads: Array, radii: Array, degrees: Array, history: Array, j: int, piece: int,
    start: float, late: float, delay: float, t_next: float, step: float, work: Array, W: Array,
) -> tuple[int, float]:  # fmt: skip
    """Fill W with a piece of the past, seen from ``start``; its degree, and ``t_next`` or where the piece ends."""
    end = starts[piece] + (aheads[piece] + radii[piece]) * step + delay
    if end < t_next - 1e-9 * step:
        t_next = end
    degree = int(degrees[piece])
    for i in range(degree + 1):
        W[i] = history[piece, j, i]
    moved = start - starts[piece] + (late - lates[piece]) - aheads[piece] * step
    if abs(moved) > 4e-16 * (step + start + delay):  # else the same time, to rounding
        shift(W, degree, moved / step, work)
    return degree, t_next
