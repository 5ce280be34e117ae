"""The compiled steps of a sampled loop: the computer's equations, the actuator, the plant by series."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from experiments.drive.difference_equations import SampledBlock
from experiments.engine.watched import REACHED, STOP
from identification.base.arrays import Array
from identification.base.compiled import njit

MOST = 1e100  # times the limits, or without limits of a state: beyond it a loop diverges
ENORMOUS = 1e250  # a state with which no run goes on, whatever the limits
NEGLIGIBLE = 1e-17  # of the last term of a series, relative to the largest state


class Series(NamedTuple):
    """The plant x' = A x + b i, y = c x, as the series of its state is summed.

    Parameters
    ----------
    A, b, c
        Shapes (n, n), (n,), (n,); without the dead time.
    norm
        Of A and b side by side, in 1/s: a series converges at once over less than 1/norm.
    late, read
        A command issued at t_k moves the plant on [t_k, t_k + T) of its own, late time, whose state ``read`` seconds
        into that interval is sampled ``late`` + 1 samples after t_k.
    """

    A: Array
    b: Array
    c: Array
    norm: float
    late: int
    read: float


class Actuator(NamedTuple):
    """Limits, distance of the levels (0 is none) with the lowest and the highest in quanta, and slew a second."""

    low: float
    high: float
    quantum: float
    lowest: float
    highest: float
    slew: float


@njit(nogil=True)
def _dot(a: Array, b: Array) -> float:
    value = 0.0
    for i in range(len(a)):
        value += a[i] * b[i]
    return value


@njit(nogil=True)
def _row(A: Array, i: int, x: Array) -> float:
    """Row i of A times x."""
    value = 0.0
    for j in range(A.shape[1]):
        value += A[i, j] * x[j]
    return value


@njit(nogil=True)
def _step(A: Array, b: Array, x: Array, following: Array, given: float, most: float) -> bool:
    """Replace x by A x + b given; whether all of it stays below ``most``. ``following`` is room for it."""
    small = True
    for i in range(len(x)):
        following[i] = _row(A, i, x) + b[i] * given
        small = small and abs(following[i]) < most
    for i in range(len(x)):
        x[i] = following[i]
    return small


@njit(nogil=True)
def _carry(
    A: Array, b: Array, norm: float, x: Array, term: Array, following: Array, level: float, slope: float, length: float
) -> None:
    """Carry x' = A x + b (level + slope t) over a length of time by its Taylor series, of which two terms need room."""
    if length <= 0:
        return
    pieces = max(1, int(np.ceil(norm * length)))
    step = length / pieces
    for _ in range(pieces):
        for j in range(len(x)):
            term[j] = x[j]
        i, size = 0, 1.0
        while size > NEGLIGIBLE:  # at most 19 terms: norm * step <= 1
            given = level if i == 0 else (slope * step if i == 1 else 0.0)
            i += 1
            factor = step / i
            for j in range(len(x)):
                following[j] = factor * (_row(A, j, term) + b[j] * given)
            for j in range(len(x)):
                term[j] = following[j]
                x[j] += following[j]
            size *= norm * factor
        level += slope * step


@njit(nogil=True)
def _move(
    A: Array, b: Array, norm: float, x: Array, term: Array, following: Array,
    start: float, command: float, slew: float, since: float, until: float,
) -> None:  # fmt: skip
    """Carry the plant from ``since`` to ``until``, seconds after the actuator left ``start`` for ``command``."""
    arrival = abs(command - start) / slew
    if since < arrival:
        slope = slew if command > start else -slew
        _carry(A, b, norm, x, term, following, start + slope * since, slope, min(arrival, until) - since)
    _carry(A, b, norm, x, term, following, command, 0.0, until - max(arrival, since))


@njit(nogil=True)
def _given_out(actuator: Actuator, control: float) -> float:
    """The control saturated and rounded."""
    command = min(max(control, actuator.low), actuator.high)
    if actuator.quantum > 0:
        command = actuator.quantum * min(max(np.rint(command / actuator.quantum), actuator.lowest), actuator.highest)
    return command


@njit(nogil=True)
def _late(block: SampledBlock, output: int, p: Array, k: int) -> float:
    """What the memory of an output gives of p at sample k."""
    value, last = 0.0, k - block.first[output]
    for j in range(min(block.length[output], last + 1)):
        value += block.taps[output, j] * p[last - j]
    return value


@njit(nogil=True)
def run(
    forward: SampledBlock, feedback: SampledBlock, theta: SampledBlock, around: float, resolution: float,
    plant: Series, actuator: Actuator, T: float, r: Array, watch: Array,
) -> tuple[Array, Array, Array, Array, int]:  # fmt: skip
    """y, u, commands, the actuator's place as each command is issued (s,), and how many samples were reached.

    ``forward`` maps e to v, ``feedback`` v to what is fed back to it, the sum of its outputs, and ``theta`` u_tilde to
    what u gives up and to y_d; ``around`` is what ``feedback`` takes of v at once; v is a whole
    multiple of a ``resolution`` that is not 0. ``watch`` is that of
    :func:`experiments.engine.watched.watched`: the samples reached, and whether to stop there.
    """
    # out of the tuples, into which a look costs as much as an addition
    A_K, b_K, c_K, d_K = forward.A, forward.b, forward.C[0], forward.d[0]
    A_T, b_T, C_T, d_T = feedback.A, feedback.b, feedback.C, feedback.d
    A_w, b_w, C_w, d_w = theta.A, theta.b, theta.C, theta.d
    A, b, c, norm, late, read = plant
    s = len(r)
    y, u, command, start = np.zeros(s), np.zeros(s), np.zeros(s), np.zeros(s)
    p_T, p_w = np.zeros((len(d_T), s)), np.zeros(s)  # of feedback, and theta2 u_tilde, before their memories
    x, x_K, x_T, x_w = np.zeros(len(b)), np.zeros(len(b_K)), np.zeros(len(b_T)), np.zeros(len(b_w))
    term, following = np.empty(len(b)), np.empty(max(len(b), len(b_K), len(b_T), len(b_w)))
    direct = theta.taps[1, 0] * d_w[1] if theta.first[1] == 0 else 0.0
    through = d_K * direct / (1 - around)  # u_tilde -> y_d -> v
    low, high, slew = actuator.low, actuator.high, actuator.slew
    limit = max(abs(low) if np.isfinite(low) else 0.0, abs(high) if np.isfinite(high) else 0.0)
    most_u, most_x = (MOST * limit, ENORMOUS) if limit > 0 else (MOST, MOST)
    place = _given_out(actuator, 0.0)
    for k in range(s):
        watch[REACHED] = k
        if watch[STOP] != 0.0:
            return y, u, command, start, k
        p_w[k] = _row(C_w, 1, x_w)
        e = r[k] - y[k] - _late(theta, 1, p_w, k)
        v = _dot(c_K, x_K) + d_K * e
        for o in range(len(d_T)):
            p_T[o, k] = _row(C_T, o, x_T)
            v += _late(feedback, o, p_T[o], k)
        v /= 1 - around
        if resolution > 0:
            v = resolution * np.floor(v / resolution)
        u_0 = v - _row(C_w, 0, x_w)
        u_tilde = (u_0 - min(max(u_0, low), high)) / (1 + d_w[0] + through)
        v -= through * u_tilde
        e -= direct * u_tilde
        u[k] = u_0 - (d_w[0] + through) * u_tilde
        for o in range(len(d_T)):
            p_T[o, k] += d_T[o] * v
        p_w[k] += d_w[1] * u_tilde
        command[k], start[k] = _given_out(actuator, u[k]), place

        _move(A, b, norm, x, term, following, place, command[k], slew, 0.0, read)
        if k + late + 1 < s:
            y[k + late + 1] = _dot(c, x)
        _move(A, b, norm, x, term, following, place, command[k], slew, read, T)
        way = command[k] - place
        place = command[k] if abs(way) <= slew * T else place + np.sign(way) * slew * T
        small = _step(A_K, b_K, x_K, following, e, most_x)
        small = _step(A_T, b_T, x_T, following, v, most_x) and small
        small = _step(A_w, b_w, x_w, following, u_tilde, most_x) and small
        for i in range(len(x)):
            small = small and abs(x[i]) < most_x
        if not (small and abs(u[k]) < most_u):
            return y, u, command, start, k
    return y, u, command, start, s
