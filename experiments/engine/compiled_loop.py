"""A saturated loop -> the arrays that the integrator takes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from experiments.engine.brief_dead_times import DERIVATIVES, derived, with_brief
from experiments.engine.saturated_loop import SaturatedLoop
from experiments.engine.step_table import Rows, Tables, compressed, tabulate, whole_lanes
from identification.base.errors import InputError

FURTHEST = 4.0  # fastest root times step: the terms of a series grow to exp of it, and two digits are lost


class CompiledLoop(NamedTuple):
    """What :func:`experiments.engine.integrator.integrate` takes of a loop, whatever its limits and its samples.

    Parameters
    ----------
    rows
        Over (x (n,), m, w (k,)), modes one after the other, each of n rows, a row of u, k rows of what is delayed and
        o rows of what is watched: [A + B C, 0, D + B E], the loop without saturation, [C 0 E], [Z 0 0], [. 0 0], and
        where a signal has m itself in it, that of the mode; then the same of the saturated loop, with n rows [A B D];
        and where the actuator has a rate limit the same while it slews, u between the limits and beyond: the last two
        states are the rate and the actuator's output, and the constant is sat(u). All that again for each of ``brief``,
        with its dead times and those below taken for the present, see :mod:`experiments.engine.brief_dead_times`.
    tables
        Of these, see :class:`experiments.engine.step_table.Tables`, for the signals u, Z x and what is watched.
    delays, brief, x0
        Shapes (k,), (b,), (n,); delays positive, and those of them, increasing, that do not set the step.
    derived
        Shape (tables, k, k, derivatives): what the brief dead times have of the others' signals.
    step
        The tables', in seconds, not more than any dead time that is not brief.
    groups, reads, lags
        Shapes (g + 1,), (watched,), (g,): groups[i] ... groups[i + 1] - 1 of what is watched is sampled lags[i] seconds
        earlier, and is the signal reads[i] of the tables; the first lag is zero.
    reading
        Shape (outputs, watched): makes the loop's outputs of what is watched.
    """

    rows: Rows
    tables: Tables
    delays: np.ndarray
    brief: np.ndarray
    x0: np.ndarray
    derived: np.ndarray
    step: float
    groups: np.ndarray
    reads: np.ndarray
    lags: np.ndarray
    reading: np.ndarray


def compile_loop(
    loop: SaturatedLoop,
    most_step: float = np.inf,
    idle_step: float = 1.0,
    slews: bool = False,
) -> CompiledLoop:
    """Merge the delayed signals that enter the loop alike, choose the step, and tabulate it.

    The step is set by the fastest eigenvalue of the loop, saturated or not, and by the shortest dead time that is not
    brief, of which it is a whole part: then most delayed polynomials are read where they start. It is halved until all
    series end. Where nothing sets a step, ``idle_step`` seconds are one. ``slews`` says that the last two states are
    those of an actuator with a rate limit.
    """
    now, direct = loop.delays == 0, _direct(loop)
    if np.any(loop.E[now] @ direct[now] != 0):
        raise InputError("the control depends on itself without delay, an algebraic loop; expected a dead time in it")
    A, C = loop.A + loop.D[:, now] @ loop.Z[now], loop.C + loop.E[now] @ loop.Z[now]
    of_m, of_now, of_u = (loop.D[:, now] @ direct[now]).T
    A, B, by_u = A + np.outer(of_u, C), loop.B + of_m + of_now, np.outer(of_u, loop.E)
    D, E, Z, direct, delays = _merged(replace(loop, D=loop.D + by_u), direct)
    n, k = len(loop.x0), len(delays)
    watched, watched_direct, groups, lags, reading = _watched(loop)
    # what u - sat(u) drives is driven by zeros in the loop without saturation, and not by rounding
    free_A, free_D = A + np.outer(B, C), D + np.outer(B, E)
    rows, reads = _each_once(np.hstack([Z, direct]), np.hstack([watched, watched_direct]))
    u, signals, (of_m, of_limited, of_u) = np.concatenate([C, [0.0], E]), rows[:, :n], rows[:, n:].T

    def mode(A: np.ndarray, constant: np.ndarray, D: np.ndarray, m: np.ndarray, limited: np.ndarray) -> np.ndarray:
        """Where m and sat(u) are rows over (x, the constant, w)."""
        read = np.hstack([signals, np.zeros((len(signals), 1 + k))]) + np.outer(of_m, m)
        read += np.outer(of_limited, limited) + np.outer(of_u, u)
        return np.vstack([np.hstack([A, constant[:, None], D]), u, read])

    units = np.eye(n + 1 + k)
    modes = [mode(free_A, np.zeros(n), free_D, u, u), mode(A, B, D, units[n], units[n])]
    if slews:
        m, knows = np.eye(n)[-1], (np.zeros(n) if loop.B_limits is None else loop.B_limits) + of_now
        moved = A + np.outer(B - knows, m) + np.outer(m, np.eye(n)[-2])
        free_A, free_D = moved + np.outer(knows, C), D + np.outer(knows, E)
        modes += [
            mode(free_A, np.zeros(n), free_D, units[n - 1], u),
            mode(moved, knows, D, units[n - 1], units[n]),
        ]

    every, presents, brief, fastest = with_brief(modes, n, delays)
    setting = delays[delays > brief.max(initial=0.0)]
    step = min(FURTHEST / fastest if fastest > 0 else np.inf, most_step)
    if len(setting) > 0:
        step = setting.min() / max(np.ceil(setting.min() / step), 1.0)
    elif np.isinf(step):
        step = idle_step  # of integrators alone, whose series end by themselves
    while True:
        # without delayed signals where all are a function of the present
        late = [0 if i >= len(modes) * len(np.unique(delays)) else k for i in range(len(every))]
        tabulated = [
            tabulate(compressed(rows[:, : n + 1 + own]), n, own, step) for rows, own in zip(every, late, strict=True)
        ]
        if all(degree >= 0 for _, degree in tabulated):
            break
        step /= 2
    rest = np.zeros((len(every), k, k, DERIVATIVES + 1))
    for i, S in enumerate(presents):
        rest[len(modes) + i] = derived(n, delays <= brief[i // len(modes)], S, delays, step)
    return CompiledLoop(
        rows=compressed(np.vstack(every)),
        tables=Tables(*(_stacked(alike) for alike in zip(*(tables for tables, _ in tabulated), strict=True))),
        delays=delays,
        brief=brief,
        x0=loop.x0,
        derived=rest,
        step=step,
        groups=groups,
        reads=1 + reads,
        lags=lags,
        reading=reading,
    )


def _direct(loop: SaturatedLoop) -> np.ndarray:
    return np.zeros((len(loop.delays), 3)) if loop.direct is None else loop.direct


def _merged(loop: SaturatedLoop, direct: np.ndarray) -> tuple[np.ndarray, ...]:
    """D, E, Z, direct and the dead times of what drives the loop late, one signal for all that enter it alike."""
    entering: dict[bytes, list[int]] = {}
    for j in range(len(loop.delays)):
        if loop.delays[j] > 0 and (direct[j].any() or loop.Z[j].any()) and (loop.E[j] != 0 or loop.D[:, j].any()):
            alike = np.array([loop.delays[j], loop.E[j], *loop.D[:, j]]) + 0.0  # of -0 and 0 one
            entering.setdefault(alike.tobytes(), []).append(j)
    first = [alike[0] for alike in entering.values()]
    Z = np.array([loop.Z[alike].sum(axis=0) for alike in entering.values()]).reshape(len(first), len(loop.x0))
    summed = np.array([direct[alike].sum(axis=0) for alike in entering.values()]).reshape(len(first), 3)
    return loop.D[:, first], loop.E[first], Z, summed, loop.delays[first].astype(float)


def _watched(loop: SaturatedLoop) -> tuple[np.ndarray, ...]:
    """What the outputs are made of: rows over x and direct, where each group begins, its lag, and the outputs' rows."""
    direct_of = _direct(loop)
    used = [
        j
        for j in range(len(loop.delays))
        if (loop.Z[j].any() or direct_of[j].any()) and any(w[j] != 0 for _, w in loop.outputs.values())
    ]
    lags = sorted({0.0, *(float(loop.delays[j]) for j in used)})
    rows: list[np.ndarray] = []
    direct: list[np.ndarray] = []
    groups, own, delayed = [0], {}, {}
    for lag in lags:
        if lag == 0:
            for name, (x, _) in loop.outputs.items():
                if x.any():
                    own[name] = len(rows)
                    rows.append(x)
                    direct.append(np.zeros(3))
        for j in used:
            if loop.delays[j] == lag:
                delayed[j] = len(rows)
                rows.append(loop.Z[j])
                direct.append(direct_of[j])
        groups.append(len(rows))
    reading = np.zeros((len(loop.outputs), len(rows)))
    for into, (name, (_, w)) in zip(reading, loop.outputs.items(), strict=True):
        if name in own:
            into[own[name]] = 1.0
        for j in used:
            into[delayed[j]] += w[j]
    states = np.array(rows).reshape(len(rows), len(loop.x0))
    return states, np.array(direct).reshape(len(rows), 3), np.array(groups), np.array(lags), reading


def _each_once(delayed: np.ndarray, watched: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The rows that are delayed, those of what is watched that are not among them, and which of all is watched."""
    rows, reads = list(delayed), []
    for row in watched:
        alike = [i for i, other in enumerate(rows) if np.array_equal(other, row)]
        reads.append(alike[0] if alike else len(rows))
        rows += [] if alike else [row]
    return np.array(rows).reshape(len(rows), watched.shape[1]), np.array(reads, dtype=np.int64)


def _stacked(tables: Sequence[np.ndarray]) -> np.ndarray:
    """Tables on one another, filled with zeros to one size and to whole lanes."""
    rows, columns = np.max([table.shape for table in tables], axis=0)
    stack = np.zeros((len(tables), rows, whole_lanes(columns)))
    for into, table in zip(stack, tables, strict=True):
        into[: table.shape[0], : table.shape[1]] = table
    return stack
