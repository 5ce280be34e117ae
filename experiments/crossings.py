"""The first sign change of a polynomial on an interval, found without sampling; compiled with numba."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

Array = NDArray[Any]
MOST = 40  # degree


def _binomials(order: int) -> np.ndarray:
    table = np.zeros((order + 1, order + 1))
    for n in range(order + 1):
        table[n, 0] = 1.0
        for k in range(1, n + 1):
            table[n, k] = table[n - 1, k - 1] + (table[n - 1, k] if k < n else 0.0)
    return table


BINOMIAL = _binomials(MOST)


@njit(cache=True)
def _sign_changes(b: Array) -> int:
    """Sign changes in a sequence, zeros left out."""
    changes, last = 0, 0
    for value in b:
        sign = 1 if value > 0 else (-1 if value < 0 else 0)
        if sign != 0:
            if last != 0 and sign != last:
                changes += 1
            last = sign
    return changes


@njit(cache=True)
def first_exit(g: Array, length: float) -> float:
    """The first tau in (0, length] where the polynomial g, positive at the start, becomes negative; -1 if none.

    Bernstein coefficients decide: without a sign change there is no root, with one there is exactly one, with
    more the interval is halved. Nothing is sampled, so that a grazing crossing cannot fall between samples; a
    touch without crossing, or one narrower than 1e-12 of the step, is none.
    """
    n = len(g) - 1
    slack = g[0]
    power = 1.0
    for i in range(1, n + 1):
        power *= length
        slack -= abs(g[i]) * power
    if slack > 0:
        return -1.0
    stack = np.empty((64, n + 1))
    left = np.empty(64)
    right = np.empty(64)
    for j in range(n + 1):
        value, power = 0.0, 1.0
        for i in range(j + 1):
            value += BINOMIAL[j, i] / BINOMIAL[n, i] * g[i] * power
            power *= length
        stack[0, j] = value
    left[0], right[0] = 0.0, length
    depth = 1
    while depth > 0:
        depth -= 1
        b = stack[depth].copy()
        lo, hi = left[depth], right[depth]
        changes = _sign_changes(b)
        if changes == 0:
            if b[0] < 0 or b[n] < 0:
                return lo
            continue
        if changes == 1 and b[0] >= 0 and b[n] <= 0:
            return _root(g, lo, hi)
        if hi - lo < 1e-12 * length:
            if b[n] < 0:
                return lo
            continue
        first = np.empty(n + 1)
        for level in range(n + 1):
            first[level] = b[0]
            for j in range(n - level):
                b[j] = 0.5 * (b[j] + b[j + 1])
        # de Casteljau leaves the second half in b
        middle = 0.5 * (lo + hi)
        stack[depth] = b
        left[depth], right[depth] = middle, hi
        stack[depth + 1] = first
        left[depth + 1], right[depth + 1] = lo, middle
        depth += 2
    return -1.0


@njit(cache=True)
def _root(g: Array, lo: float, hi: float) -> float:
    """The root of g in [lo, hi], g(lo) >= 0 >= g(hi): Newton kept inside a shrinking bracket."""
    tau = 0.5 * (lo + hi)
    for _ in range(200):
        value, slope = 0.0, 0.0
        for i in range(len(g) - 1, -1, -1):
            slope = slope * tau + value
            value = value * tau + g[i]
        if value > 0:
            lo = tau
        else:
            hi = tau
        following = tau - value / slope if slope != 0 else 0.5 * (lo + hi)
        if not (lo < following < hi):
            following = 0.5 * (lo + hi)
        if abs(following - tau) <= 1e-16 * (1 + abs(tau)) or hi - lo <= 1e-16:
            return following
        tau = following
    return tau
