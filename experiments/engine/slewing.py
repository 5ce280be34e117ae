"""An actuator that moves no faster than a rate: where its output m leaves off following sat(u), and meets it again.

The modes of saturation, in which m = sat(u), are joined by two more: 2, in which m rises at the rate, and -2, in which
it falls. Tracking ends where |u'| passes the rate or u jumps; slewing ends where m meets u, or a limit.
"""

from __future__ import annotations

import numpy as np

from experiments.engine.crossings import JUMP, first_exit, leaves_mode
from identification.base.arrays import Array
from identification.base.compiled import njit


@njit(nogil=True)
def leaves_actuator_mode(
    U: Array, degree: int, mode: int, on: int, stuck: bool, low: float, high: float, reach: float, m: float,
    slope: float, size: float,
) -> tuple[float, int, int]:  # fmt: skip
    """Where on (0, reach] the actuator leaves its mode, see :func:`experiments.engine.crossings.leaves_mode`.

    Parameters
    ----------
    U, degree, mode, stuck, low, high, reach
        As there; the mode may be 2 or -2.
    on
        As there in the modes 0, 1 and -1. Of slewing, how many roots u - m has at tau = 0, which are divided out.
    m, slope
        The actuator's output at tau = 0, and how far it moves at most in a unit of tau; infinite without a rate limit.
    size
        Of u so far: a distance of u from m is a jump beyond a share JUMP of it.
    """
    if abs(mode) == 2:
        best, entered, crossed = _stops_slewing(U, degree, mode // 2, on, stuck, low, high, reach, m, slope, size)
        return best, entered, crossed
    best, entered, crossed = leaves_mode(U, degree, mode, on, stuck, low, high, reach)
    if np.isinf(slope):
        return best, entered, crossed
    gap = min(max(U[0], low), high) - m
    if mode == 0 and abs(gap) > JUMP * size:
        return 0.0, (2 if gap > 0 else -2), 0
    if mode != 0:
        if best >= 0:
            if crossed == 0:  # u has jumped from the limit
                return best, -2 * mode, 0
            if -mode * _rate(U, degree, best) > slope:
                return best, -2 * mode, 1
        return best, entered, crossed
    g = np.zeros(max(degree, 1))
    for side in (1, -1):
        for i in range(1, degree + 1):
            g[i - 1] = -side * i * U[i]
        g[0] += slope
        if stuck and g[0] <= 0:
            continue
        found = 0.0 if g[0] < 0 else first_exit(g, best if best >= 0 else reach)
        if found >= 0 and (best < 0 or found < best):
            bent = -g[0] > JUMP * (slope + abs(U[min(degree, 1)]))  # u' has jumped beyond the rate
            best, entered, crossed = found, 2 * side, (1 if bent else 2)
    return best, entered, crossed


@njit(nogil=True)
def _stops_slewing(
    U: Array, degree: int, side: int, roots: int, stuck: bool, low: float, high: float, reach: float, m: float,
    slope: float, size: float,
) -> tuple[float, int, int]:  # fmt: skip
    """Where m, which moves toward the upper (side 1) or the lower limit (-1), meets it or u."""
    limit = high if side == 1 else low
    at_limit = max(side * (limit - m) / slope, 0.0)
    ahead = np.zeros(max(degree, roots, 1) + 1)  # of m, how far u is
    for i in range(degree + 1):
        ahead[i] = side * U[i]
    ahead[0] -= side * m
    ahead[1] -= slope
    for i in range(len(ahead)):
        ahead[i] = ahead[i + roots] if i + roots < len(ahead) else 0.0
    if not (stuck and ahead[0] <= 0):
        found = 0.0 if ahead[0] < 0 else first_exit(ahead, min(reach, at_limit))
        if found >= 0:
            if roots == 0 and -ahead[0] > JUMP * size:
                return found, -2 * side, 0
            return (found, -2 * side, 1) if -side * _rate(U, degree, found) > slope else (found, 0, 0)
    return (at_limit, side, 0) if at_limit <= reach else (-1.0, 2 * side, 0)


@njit(nogil=True)
def place(U: Array, degree: int, mode: int, low: float, high: float, m: float, slope: float, tau: float) -> float:
    """The actuator's output at tau, for :func:`leaves_actuator_mode`."""
    if mode == 0:
        m = 0.0
        for i in range(degree, -1, -1):
            m = m * tau + U[i]
    elif abs(mode) == 2:
        m += mode // 2 * slope * tau
    else:
        m = high if mode == 1 else low
    return min(max(m, low), high)


@njit(nogil=True)
def _rate(U: Array, degree: int, tau: float) -> float:
    """The derivative of U at tau."""
    value = 0.0
    for i in range(degree, 0, -1):
        value = value * tau + i * U[i]
    return value
