"""An actuator that moves no faster than a rate: where its output m leaves off following sat(u), and meets it again.

The modes of saturation, s = -1, 0 and 1, in which m = sat(u), are joined by those in which m rises or falls at the rate
toward sat(u), s + 3 and s - 3. Tracking ends where |u'| passes the rate or u jumps; slewing ends where m meets sat(u).
"""

from __future__ import annotations

import numpy as np

from experiments.engine.crossings import JUMP, first_exit, leaves_mode
from identification.base.arrays import Array
from identification.base.compiled import njit


@njit(nogil=True)
def direction(mode: int) -> int:
    """1 where the actuator rises at its rate, -1 where it falls, 0 where it tracks."""
    return 0 if abs(mode) < 2 else (1 if mode > 0 else -1)


@njit(nogil=True)
def leaves_actuator_mode(
    U: Array, degree: int, mode: int, on_limit: int, roots: int, stuck: bool, low: float, high: float, reach: float,
    m: float, slope: float, size: float,
) -> tuple[float, int, int, int]:  # fmt: skip
    """Where on (0, reach] the actuator leaves its mode, see :func:`experiments.engine.crossings.leaves_mode`.

    Parameters
    ----------
    U, degree, mode, on_limit, stuck, low, high, reach
        As there.
    roots
        Of slewing that has just begun, how many roots u - m has at tau = 0, which are divided out.
    m, slope
        The actuator's output at tau = 0, and how far it moves at most in a unit of tau; infinite without a rate limit.
    size
        Of u so far: a distance of u from m is a jump beyond a share JUMP of it.

    Returns
    -------
    tau, mode, limit, roots
        As there, and the roots just after.
    """
    side = direction(mode)
    s = mode - 3 * side
    best, entered, crossed = leaves_mode(U, degree, s, on_limit, stuck, low, high, reach)
    entered += 3 * side
    if np.isinf(slope):
        return best, entered, crossed, 0
    if side != 0:
        found, after, left = _meets(U, degree, s, side, roots, stuck, low, high, reach, m, slope, size)
        if found >= 0 and (best < 0 or found < best):
            return found, after, 0, left
        return best, entered, crossed, 0
    if s != 0:
        if best >= 0 and (crossed == 0 or -s * _rate(U, degree, best) > slope):  # u has jumped, or leaves too fast
            return best, -3 * s, crossed, abs(crossed)
        return best, entered, crossed, 0
    gap = min(max(U[0], low), high) - m
    if abs(gap) > JUMP * size:
        return 0.0, (3 if gap > 0 else -3), 0, 0
    left, g = 0, np.zeros(max(degree, 1))
    for side in (1, -1):
        for i in range(1, degree + 1):
            g[i - 1] = -side * i * U[i]
        g[0] += slope
        if stuck and g[0] <= 0:
            continue
        found = 0.0 if g[0] < 0 else first_exit(g, best if best >= 0 else reach)
        if found >= 0 and (best < 0 or found < best):
            jumped = -g[0] > JUMP * (slope + abs(U[min(degree, 1)]))  # u' has, beyond the rate
            best, entered, crossed, left = found, 3 * side, 0, (1 if jumped else 2)
    return best, entered, crossed, left


@njit(nogil=True)
def _meets(
    U: Array, degree: int, s: int, side: int, roots: int, stuck: bool, low: float, high: float, reach: float, m: float,
    slope: float, size: float,
) -> tuple[float, int, int]:  # fmt: skip
    """Where m, which moves up (side 1) or down (-1), meets sat(u), -1 if nowhere; the mode then, and its roots."""
    ahead = np.zeros(max(degree, roots, 1) + 1)  # of m, how far sat(u) is
    if s == 0:
        for i in range(degree + 1):
            ahead[i] = side * U[i]
    else:
        ahead[0] = side * (high if s == 1 else low)
    ahead[0] -= side * m
    ahead[1] -= slope
    for i in range(len(ahead) if roots > 0 else 0):
        ahead[i] = ahead[i + roots] if i + roots < len(ahead) else 0.0
    if stuck and -JUMP * size <= ahead[0] <= 0:
        return -1.0, 0, 0
    found = 0.0 if ahead[0] < 0 else first_exit(ahead, reach)
    if roots == 0 and -ahead[0] > JUMP * size:
        return found, s - 3 * side, 0  # u has jumped across m
    if s == 0 and found >= 0 and -side * _rate(U, degree, found) > slope:
        return found, -3 * side, 1
    return found, s, 0


@njit(nogil=True)
def place(U: Array, degree: int, mode: int, low: float, high: float, m: float, slope: float, tau: float) -> float:
    """The actuator's output at tau, for :func:`leaves_actuator_mode`."""
    if direction(mode) != 0:
        m += direction(mode) * slope * tau
    elif mode == 0:
        m = 0.0
        for i in range(degree, -1, -1):
            m = m * tau + U[i]
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
