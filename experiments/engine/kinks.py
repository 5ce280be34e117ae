"""The mesh of a run: the images of kinks in order, and polynomials read from elsewhere than where they start."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from experiments.engine.crossings import MOST

Array = NDArray[Any]


FACTORIAL = np.array([math.factorial(i) for i in range(MOST + 1)], dtype=float)
INVERSE = 1 / FACTORIAL


@njit(cache=True, nogil=True, fastmath={"contract", "reassoc"})
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


@njit(cache=True, nogil=True)
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


@njit(cache=True, nogil=True)
def gap(
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
