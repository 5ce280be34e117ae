"""A saturated loop -> the arrays that the integrator takes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from experiments.engine.saturated_loop import SaturatedLoop
from experiments.engine.step_table import Rows, Tables, compressed, tabulate, whole_lanes

FURTHEST = 4.0  # fastest root times step: the terms of a series grow to exp of it, and two digits are lost
BRIEF = 0.01  # a dead time shorter than so much of the fastest root's time constant is no longer than a step


class CompiledLoop(NamedTuple):
    """What :func:`experiments.engine.integrator.integrate` takes of a loop, whatever its limits and its samples.

    Parameters
    ----------
    unsaturated
        Over (x (n,), m, w (k,)): n rows [A + B C, 0, D + B E], the loop without saturation, a row [C 0 E], k rows
        [Z 0 0], and o rows [. 0 0] of what is watched.
    saturated
        The same with n rows [A B D].
    slewing, stopped
        The same of an actuator with a rate limit while it slews, u between the limits and beyond: the last two states
        are the rate and the actuator's output, and the constant is sat(u). Otherwise not used.
    tables
        Of these, see :class:`experiments.engine.step_table.Tables`, for the signals u, Z x and what is watched.
    delays, brief, x0
        Shapes (k,), (k,), (n,); delays positive. Where ``brief``, the loop is that with a dead time of zero, and w_j
        stands for what the dead time changes, Z_j x(t - h_j) - Z_j x(t).
    step
        The tables', in seconds, not more than any dead time that is not brief.
    groups, lags
        Shapes (g + 1,), (g,): groups[i] ... groups[i + 1] - 1 of what is watched is sampled lags[i] seconds earlier;
        the first lag is zero.
    reading
        Shape (outputs, watched): makes the loop's outputs of what is watched.
    """

    unsaturated: Rows
    saturated: Rows
    slewing: Rows
    stopped: Rows
    tables: Tables
    delays: np.ndarray
    brief: np.ndarray
    x0: np.ndarray
    step: float
    groups: np.ndarray
    lags: np.ndarray
    reading: np.ndarray


def compile_loop(
    loop: SaturatedLoop,
    most_step: float = np.inf,
    most_brief: float = BRIEF,
    idle_step: float = 1.0,
    slews: bool = False,
) -> CompiledLoop:
    """Merge the delayed signals that enter the loop alike, choose the step, and tabulate it.

    The step is set by the fastest eigenvalue of the loop, saturated or not, and by the shortest dead time that is not
    brief, of which it is a whole part: then most delayed polynomials are read where they start. It is halved until all
    series end. A dead time is brief up to ``most_brief`` time constants of the fastest eigenvalue: the loop is taken
    without it, and what it changes is found in each step. Where nothing sets a step, ``idle_step`` seconds are one.
    ``slews`` says that the last two states are those of an actuator with a rate limit.
    """
    now = loop.delays == 0
    A, C = loop.A + loop.D[:, now] @ loop.Z[now], loop.C + loop.E[now] @ loop.Z[now]
    D, E, Z, delays = _merged(loop)
    brief = delays * max(_fastest(A, loop.B, C), _fastest(A + D @ Z, loop.B, C + E @ Z)) <= most_brief
    A, C = A + D[:, brief] @ Z[brief], C + E[brief] @ Z[brief]
    n, k = len(loop.x0), len(delays)
    watched, groups, lags, reading = _watched(loop)
    # what u - sat(u) drives is driven by zeros in the loop without saturation, and not by rounding
    free_A, free_D = A + np.outer(loop.B, C), D + np.outer(loop.B, E)
    states = np.vstack([Z, watched])
    read = [np.concatenate([C, [0.0], E]), *np.hstack([states, np.zeros((len(states), 1 + k))])]
    unsaturated = compressed(np.vstack([np.hstack([free_A, np.zeros((n, 1)), free_D]), *read]))
    saturated = compressed(np.vstack([np.hstack([A, loop.B[:, None], D]), *read]))
    modes = [unsaturated, saturated]
    if slews:
        m, knows = np.eye(n)[-1], np.zeros(n) if loop.B_limits is None else loop.B_limits
        moved = A + np.outer(loop.B - knows, m) + np.outer(m, np.eye(n)[-2])
        free_A, free_D = moved + np.outer(knows, C), D + np.outer(knows, E)
        modes.append(compressed(np.vstack([np.hstack([free_A, np.zeros((n, 1)), free_D]), *read])))
        modes.append(compressed(np.vstack([np.hstack([moved, knows[:, None], D]), *read])))

    fastest = _fastest(A, loop.B, C)
    step = min(FURTHEST / fastest if fastest > 0 else np.inf, most_step)
    if not brief.all():
        shortest = float(delays[~brief].min())
        step = shortest / max(np.ceil(shortest / step), 1.0)
    elif np.isinf(step):
        step = idle_step  # of integrators alone, whose series end by themselves
    while True:
        tabulated = [tabulate(rows, n, k, step) for rows in modes]
        if all(degree >= 0 for _, degree in tabulated):
            break
        step /= 2
    return CompiledLoop(
        unsaturated=unsaturated,
        saturated=saturated,
        slewing=modes[-2],
        stopped=modes[-1],
        tables=Tables(*(_stacked(alike) for alike in zip(*(tables for tables, _ in tabulated), strict=True))),
        delays=delays,
        brief=brief,
        x0=loop.x0,
        step=step,
        groups=groups,
        lags=lags,
        reading=reading,
    )


def _fastest(A: np.ndarray, B: np.ndarray, C: np.ndarray) -> float:
    """The largest modulus of an eigenvalue of the loop, saturated (A) or not (A + B C), in rad/s."""
    return max(float(np.abs(np.linalg.eigvals(matrix)).max()) for matrix in (A, A + np.outer(B, C)))


def _merged(loop: SaturatedLoop) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """D, E, Z and the dead times of the delayed signals that drive the loop, one for all that enter it alike."""
    entering: dict[bytes, list[int]] = {}
    for j in range(len(loop.delays)):
        if loop.delays[j] > 0 and loop.Z[j].any() and (loop.E[j] != 0 or loop.D[:, j].any()):
            alike = np.array([loop.delays[j], loop.E[j], *loop.D[:, j]]) + 0.0  # of -0 and 0 one
            entering.setdefault(alike.tobytes(), []).append(j)
    first = [alike[0] for alike in entering.values()]
    Z = np.array([loop.Z[alike].sum(axis=0) for alike in entering.values()]).reshape(len(first), len(loop.x0))
    return loop.D[:, first], loop.E[first], Z, loop.delays[first]


def _watched(loop: SaturatedLoop) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """What the outputs are made of: rows over x, where each group of them begins, its lag, and the outputs' rows."""
    used = [j for j in range(len(loop.delays)) if any(w[j] != 0 for _, w in loop.outputs.values())]
    lags = sorted({0.0, *(float(loop.delays[j]) for j in used)})
    rows: list[np.ndarray] = []
    groups, own, delayed = [0], {}, {}
    for lag in lags:
        if lag == 0:
            for name, (x, _) in loop.outputs.items():
                if x.any():
                    own[name] = len(rows)
                    rows.append(x)
        for j in used:
            if loop.delays[j] == lag:
                delayed[j] = len(rows)
                rows.append(loop.Z[j])
        groups.append(len(rows))
    reading = np.zeros((len(loop.outputs), len(rows)))
    for into, (name, (_, w)) in zip(reading, loop.outputs.items(), strict=True):
        if name in own:
            into[own[name]] = 1.0
        for j in used:
            into[delayed[j]] += w[j]
    return np.array(rows).reshape(len(rows), len(loop.x0)), np.array(groups), np.array(lags), reading


def _stacked(tables: Sequence[np.ndarray]) -> np.ndarray:
    """Tables on one another, filled with zeros to one size and to whole lanes."""
    rows, columns = np.max([table.shape for table in tables], axis=0)
    stack = np.zeros((len(tables), rows, whole_lanes(columns)))
    for into, table in zip(stack, tables, strict=True):
        into[: table.shape[0], : table.shape[1]] = table
    return stack
