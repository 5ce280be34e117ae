"""Where a polynomial first changes sign, and a control leaves its mode, without sampling; compiled with numba."""

from __future__ import annotations

import numpy as np

from identification.base.arrays import Array
from identification.base.compiled import njit

MOST = 60  # degree
JUMP = 1e-9  # a control that is further than this share beyond a limit has jumped there


def _binomials(order: int) -> np.ndarray:
    table = np.zeros((order + 1, order + 1))
    for n in range(order + 1):
        table[n, 0] = 1.0
        for k in range(1, n + 1):
            table[n, k] = table[n - 1, k - 1] + (table[n - 1, k] if k < n else 0.0)
    return table


BINOMIAL = _binomials(MOST)


@njit(nogil=True)
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


@njit(nogil=True)
def first_exit(g: Array, length: float) -> float:
    """The first tau in (0, length] where the polynomial g, positive at the start, becomes negative; -1 if none.

    Bernstein coefficients decide: without a sign change there is no root, with one there is exactly one, with
    more the interval is halved. Nothing is sampled, so that a grazing crossing does not fall between samples. That
    holds for the polynomial as it is represented, to the rounding of its Bernstein coefficients; a touch without
    crossing, or one narrower than 1e-12 of the step, is none.
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
    scaled, power = np.empty(n + 1), 1.0
    for i in range(n + 1):
        scaled[i] = g[i] * power / BINOMIAL[n, i]
        power *= length
    for j in range(n + 1):
        value = 0.0
        for i in range(j + 1):
            value += BINOMIAL[j, i] * scaled[i]
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
        for j in range(n + 1):
            stack[depth, j], stack[depth + 1, j] = b[j], first[j]
        left[depth], right[depth] = middle, hi
        left[depth + 1], right[depth + 1] = lo, middle
        depth += 2
    return -1.0


@njit(nogil=True)
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


@njit(nogil=True)
def leaves_mode(
    U: Array, degree: int, mode: int, on_limit: int, stuck: bool, low: float, high: float, reach: float
) -> tuple[float, int, int]:
    """Where on (0, reach] a control leaves its mode, the mode that it enters, and the limit on which it is then.

    Parameters
    ----------
    U, degree
        The control is sum U_i tau^i, i = 0 ... degree.
    mode, on_limit
        The present mode; the limit (1 upper, -1 lower, 0 none) on which u lies exactly, just after an event: that
        root at tau = 0 is divided out.
    stuck
        The loop keeps returning there without moving (u touches the limit tangentially): then it is let go.
    low, high
        The limits, may be infinite.
    reach
        End of the interval.

    Returns
    -------
    tau, mode, limit
        tau is -1 where the control stays in its mode.
    """
    best, entered, crossed = -1.0, mode, 0
    swing, power = 0.0, 1.0  # |u(tau) - u(0)| <= swing
    for i in range(1, degree + 1):
        power *= reach
        swing += abs(U[i]) * power
    if on_limit == 0 and ((mode == 1 and U[0] - high > swing) or (mode == -1 and low - U[0] > swing)):
        return best, entered, crossed
    if on_limit == 0 and mode == 0 and high - U[0] > swing and U[0] - low > swing:
        return best, entered, crossed
    g = np.zeros(degree + 1)
    for side in (1, -1):
        limit = high if side == 1 else low
        if np.isinf(limit) or (mode != 0 and mode != side):
            continue
        # positive inside the mode: side (limit - u) when unsaturated, side (u - limit) when saturated
        sign = -side if mode == 0 else side
        for i in range(degree + 1):
            g[i] = sign * U[i]
        g[0] -= sign * limit
        if on_limit == side:
            for i in range(degree):
                g[i] = g[i + 1]
            g[degree] = 0.0
            if stuck and g[0] <= 0:
                continue
        found = 0.0 if g[0] < 0 else first_exit(g, reach)
        if found >= 0 and (best < 0 or found < best):
            jumped = -g[0] > JUMP * (abs(limit) + abs(U[0]))
            best, entered, crossed = found, (side if mode == 0 else 0), (0 if jumped else side)
    return best, entered, crossed
