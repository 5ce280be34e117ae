"""A loop of one saturation and delayed signals by the classical Runge-Kutta method with a fixed step.

    x' = A x + B m + D w + R r(t),   u = C x + E w + F r(t),   m = sat(u),   w_j(t) = Z_j x(t - delay_j),

w = 0 before the first delay is over. Delayed signals between the mesh points are cubic Hermite interpolants of the
values and slopes on the mesh.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from benchmarks.referee.factors import Real


@njit(cache=True)
def _slope(
    A: Real, B: Real, D: Real, R: Real, C: Real, E: Real, F: float, x: Real, w: Real, r: float, low: float, high: float,
    into: Real,
) -> float:  # fmt: skip
    """Put x' into ``into`` and return u."""
    n, k = D.shape
    u = F * r
    for i in range(n):
        u += C[i] * x[i]
    for j in range(k):
        u += E[j] * w[j]
    m = min(max(u, low), high)
    for i in range(n):
        value = B[i] * m + R[i] * r
        for j in range(n):
            value += A[i, j] * x[j]
        for j in range(k):
            value += D[i, j] * w[j]
        into[i] = value
    return u


@njit(cache=True)
def _delayed(values: Real, slopes: Real, delays: Real, step: float, time: float, into: Real) -> None:
    """Put w at a time into ``into``."""
    for j in range(len(delays)):
        place = (time - delays[j]) / step
        near = np.rint(place)
        if abs(place - near) < 1e-7:  # a mesh point to rounding
            place = near
        if place <= 0:
            into[j] = values[j, 0] if place == 0 else 0.0
            continue
        k = int(place)
        x = place - k
        if x == 0:
            into[j] = values[j, k]
            continue
        a, b, p, q = values[j, k], values[j, k + 1], step * slopes[j, k], step * slopes[j, k + 1]
        into[j] = a + x * (p + x * (3 * (b - a) - 2 * p - q + x * (2 * (a - b) + p + q)))


@njit(cache=True)
def run(
    A: Real, B: Real, D: Real, R: Real, C: Real, E: Real, F: float, Z: Real, delays: Real, step: float, r: Real,
    low: float, high: float, read: Real,
) -> tuple[Real, Real]:  # fmt: skip
    """u, and what ``read`` takes of x and of the first of w, on the mesh; r (2 n + 1,) at its points and between."""
    n, k, steps = len(B), len(delays), (len(r) - 1) // 2
    x, trial, w = np.zeros(n), np.zeros(n), np.zeros(k)
    k1, k2, k3, k4 = np.zeros(n), np.zeros(n), np.zeros(n), np.zeros(n)
    values, slopes = np.zeros((k, steps + 1)), np.zeros((k, steps + 1))
    u, y = np.zeros(steps + 1), np.zeros(steps + 1)
    for s in range(steps + 1):
        time = s * step
        for j in range(k):
            values[j, s] = 0.0
            for i in range(n):
                values[j, s] += Z[j, i] * x[i]
        _delayed(values, slopes, delays, step, time, w)
        u[s] = _slope(A, B, D, R, C, E, F, x, w, r[2 * s], low, high, k1)
        for i in range(n):
            y[s] += read[i] * x[i]
        if k > 0:
            y[s] += read[n] * w[0]
        for j in range(k):
            for i in range(n):
                slopes[j, s] += Z[j, i] * k1[i]
        if s == steps or not abs(u[s]) < 1e150:
            break
        _delayed(values, slopes, delays, step, time + step / 2, w)
        for i in range(n):
            trial[i] = x[i] + step / 2 * k1[i]
        _slope(A, B, D, R, C, E, F, trial, w, r[2 * s + 1], low, high, k2)
        for i in range(n):
            trial[i] = x[i] + step / 2 * k2[i]
        _slope(A, B, D, R, C, E, F, trial, w, r[2 * s + 1], low, high, k3)
        _delayed(values, slopes, delays, step, time + step, w)
        for i in range(n):
            trial[i] = x[i] + step * k3[i]
        _slope(A, B, D, R, C, E, F, trial, w, r[2 * s + 2], low, high, k4)
        for i in range(n):
            x[i] += step / 6 * (k1[i] + 2 * k2[i] + 2 * k3[i] + k4[i])
    return u, y
