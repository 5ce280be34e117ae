"""The mesh of a run: the images of kinks in order, and polynomials read from elsewhere than where they start."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from experiments.engine.crossings import MOST
from identification.base.arrays import Array
from identification.base.compiled import njit

BEYOND = 0.5  # of a step: how far beyond its end, where no kink is, the polynomial of a cut step is read

FACTORIAL = np.array([math.factorial(i) for i in range(MOST + 1)], dtype=float)
INVERSE = 1 / FACTORIAL


class Past(NamedTuple):
    """The sources of the delayed signals, one polynomial a step, the step p at p % room; and the mesh to come.

    Parameters
    ----------
    starts, lates, degrees, history
        Shapes (room,), and (room, k, most + 1) of the coefficients: a step starts at ``starts`` + ``lates`` seconds.
    rest
        Shape (k,): the sources before zero.
    queue
        Shape (room,): the images of kinks in order.
    """

    starts: Array
    lates: Array
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
    past: Past, pieces: int, queued: int, delays: Array, present: float, brief: float, step: float, negligible: Array,
    W: Array, work: Array,
) -> int:  # fmt: skip
    """Queue the images of a kink at the start of the latest step, which is number ``pieces``; the queue's new length.

    None is where the two sides of the kink agree to what is ``negligible`` (1 + k,), as far as they are read, and none
    of what is delayed by ``present`` or less, which is a function of the present already.
    """
    this, queue = pieces & (len(past.starts) - 1), past.queue
    t = past.starts[this]
    for j in range(len(delays)):
        if delays[j] <= present:
            continue
        before, moved = recalled(past, pieces - 1, j, t, past.lates[this], step, W)
        read = delays[j] / step if delays[j] <= brief else BEYOND
        right, degree = past.history[this, j], past.degrees[this]
        if largest_difference(W, before, moved, right, degree, read, work) > negligible[1 + j]:
            queued = insert(queue, queued, t + delays[j], 1e-13 * (step + t))
    return queued


@njit(nogil=True)
def recalled(past: Past, number: int, j: int, t: float, late: float, step: float, W: Array) -> tuple[int, float]:
    """Fill W with a source in a step; its degree, and how many steps before the time t + late it starts."""
    if number < 0:
        W[0] = past.rest[j]
        return 0, 0.0
    piece = number & (len(past.starts) - 1)
    for i in range(past.degrees[piece] + 1):
        W[i] = past.history[piece, j, i]
    return past.degrees[piece], (t - past.starts[piece] + (late - past.lates[piece])) / step


@njit(nogil=True)
def agrees(
    past: Past, pieces: int, delays: Array, present: float, t: float, late: float, step: float, P: Array, degree: int,
    negligible: Array, W: Array, work: Array,
) -> bool:  # fmt: skip
    """Whether the sources of dead times up to ``present`` were, in the last dead time, what P (1 + k, .) says.

    The polynomials P start at t + late, before which are ``pieces`` steps; to what is ``negligible`` (1 + k,).
    """
    for j in range(len(delays)):
        if not 1e-13 * (step + t) < delays[j] <= present:
            continue
        number, reached = pieces, 0.0
        while number >= 0 and reached < delays[j] * (1 - 1e-9):
            number -= 1
            before, moved = recalled(past, number, j, t, late, step, W)
            if largest_difference(W, before, moved, P[1 + j], degree, delays[j] / step, work) > negligible[1 + j]:
                return False
            reached = moved * step
    return True


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
