"""A saturated loop -> the arrays that the integrator takes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from experiments.propagator import LANES, Rows, compressed, tabulate
from experiments.saturated_loop import SaturatedLoop

FURTHEST = 4.0  # fastest root times step: the terms of a series grow to exp of it, and two digits are lost
MARGIN = 1.5  # see integrate; 1 where there is one dead time


@dataclass(frozen=True)
class CompiledLoop:
    """What :func:`experiments.taylor.integrate` takes of a loop, whatever its limits and its samples.

    Parameters
    ----------
    unsaturated, saturated, ends, polynomials, delays, x0, step, margin, groups
        As there.
    lags
        Shape (g,): how much earlier each group is sampled, in seconds; zero first.
    reading
        Shape (outputs, watched): makes the loop's outputs of what is watched.
    """

    unsaturated: Rows
    saturated: Rows
    ends: np.ndarray
    polynomials: np.ndarray
    delays: np.ndarray
    x0: np.ndarray
    step: float
    margin: float
    groups: np.ndarray
    lags: np.ndarray
    reading: np.ndarray


def compile_loop(loop: SaturatedLoop, most_step: float = np.inf) -> CompiledLoop:
    """Merge the delayed signals that enter the loop alike, choose the step, and tabulate it.

    The step is set by the fastest eigenvalue of the loop, saturated or not, and by the shortest dead time, of which it
    is a whole part: then most delayed polynomials are read where they start. It is halved until all series end.
    """
    now = loop.delays == 0
    A, C = loop.A + loop.D[:, now] @ loop.Z[now], loop.C + loop.E[now] @ loop.Z[now]
    D, E, Z, delays = _merged(loop)
    n, k = len(loop.x0), len(delays)
    watched, groups, lags, reading = _watched(loop)
    # what u - sat(u) drives is driven by zeros in the loop without saturation, and not by rounding
    free_A, free_D = A + np.outer(loop.B, C), D + np.outer(loop.B, E)
    states = np.vstack([Z, watched])
    read = [np.concatenate([C, [0.0], E]), *np.hstack([states, np.zeros((len(states), 1 + k))])]
    unsaturated = compressed(np.vstack([np.hstack([free_A, np.zeros((n, 1)), free_D]), *read]))
    saturated = compressed(np.vstack([np.hstack([A, loop.B[:, None], D]), *read]))

    fastest = max(np.abs(np.linalg.eigvals(matrix)).max() for matrix in (A, free_A))
    margin = MARGIN if len(set(delays)) > 1 else 1.0
    step = min(FURTHEST / (margin * fastest) if fastest > 0 else 1.0, most_step)
    if k:
        shortest = float(delays.min())
        step = shortest / np.ceil(shortest / step)
    while True:
        tables = [tabulate(rows, n, k, step, margin) for rows in (unsaturated, saturated)]
        if all(degree >= 0 for _, _, degree in tables):
            break
        step /= 2
    return CompiledLoop(
        unsaturated=unsaturated,
        saturated=saturated,
        ends=_stacked([ends for ends, _, _ in tables]),
        polynomials=_stacked([polynomials for _, polynomials, _ in tables]),
        delays=delays,
        x0=loop.x0,
        step=step,
        margin=margin,
        groups=groups,
        lags=lags,
        reading=reading,
    )


def _merged(loop: SaturatedLoop) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """D, E, Z and the dead times of the delayed signals that drive the loop, one for all that enter it alike."""
    drives = (loop.delays > 0) & loop.Z.any(axis=1) & (loop.D.any(axis=0) | (loop.E != 0))
    keys = np.vstack([loop.delays, loop.E, loop.D])[:, drives]
    entering, place = np.unique(keys, axis=1, return_inverse=True)
    Z = np.zeros((entering.shape[1], len(loop.x0)))
    np.add.at(Z, place.reshape(-1), loop.Z[drives])
    return entering[2:], entering[1], Z, entering[0]


def _watched(loop: SaturatedLoop) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """What the outputs are made of: rows over x, where each group of them begins, its lag, and the outputs' rows."""
    rows_x = np.array([x for x, _ in loop.outputs.values()]).reshape(len(loop.outputs), len(loop.x0))
    rows_w = np.array([w for _, w in loop.outputs.values()]).reshape(len(loop.outputs), len(loop.delays))
    own, place = np.unique(rows_x, axis=0, return_inverse=True)
    lags = np.unique(np.append(loop.delays[rows_w.any(axis=0)], 0.0))
    delayed = [np.flatnonzero((loop.delays == lag) & rows_w.any(axis=0)) for lag in lags]
    rows = np.vstack([own, *(loop.Z[chosen] for chosen in delayed)])
    reading = np.hstack([np.eye(len(own))[place.reshape(-1)], *(rows_w[:, chosen] for chosen in delayed)])
    counts = [len(own) + len(delayed[0]), *(len(chosen) for chosen in delayed[1:])]
    return rows, np.cumsum([0, *counts]), lags, reading


def _stacked(tables: list[np.ndarray]) -> np.ndarray:
    """Tables on one another, filled with zeros to one size and to whole lanes."""
    rows, columns = np.max([table.shape for table in tables], axis=0)
    stack = np.zeros((len(tables), rows, -(-columns // LANES) * LANES))
    for into, table in zip(stack, tables, strict=True):
        into[: table.shape[0], : table.shape[1]] = table
    return stack
