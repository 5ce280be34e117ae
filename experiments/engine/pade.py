"""A loop with its dead times replaced by Pade approximations, as the thesis simulates it: for comparison only."""

from __future__ import annotations

from math import comb, factorial

import numpy as np

from design.blocks.block import Block
from design.blocks.state_space import block_diagonal, realize
from experiments.engine.saturated_loop import SaturatedLoop


def pade_block(delay_s: float, order: int) -> Block:
    """The Pade approximation of exp(-delay_s s), of equal degrees: N(-s)/N(s) for a positive dead time."""
    # in units of the dead time the coefficients are of order one
    falling = [comb(order, k) * factorial(2 * order - k) // factorial(order) for k in range(order, -1, -1)]
    poles = np.roots(falling) / delay_s
    return Block((-1.0) ** order, tuple(-poles), tuple(poles))


def with_pade(loop: SaturatedLoop, order: int) -> SaturatedLoop:
    """Replace every dead time by its Pade approximation of equal degrees (section 4.2: second order).

    Parameters
    ----------
    loop
        A loop whose delayed signals are zero before t = 0.
    order
        Degree of numerator and denominator, positive.

    Returns
    -------
    SaturatedLoop
        With dead times of zero; the approximations' states follow the loop's own.
    """
    n, k = len(loop.x0), len(loop.delays)
    direct = np.zeros((k, 3)) if loop.direct is None else loop.direct
    filters = {j: realize(pade_block(delay, order)) for j, delay in enumerate(loop.delays) if delay > 0}
    extra = order * len(filters)
    A = block_diagonal(loop.A, *(part.A for part in filters.values()))
    B, D = np.append(loop.B, np.zeros(extra)), np.vstack([loop.D, np.zeros((extra, k))])
    Z, at_once = np.hstack([loop.Z, np.zeros((k, extra))]), direct.copy()
    for position, (j, part) in enumerate(filters.items()):
        place = slice(n + position * order, n + (position + 1) * order)
        of_limited, of_u = direct[j, 0] + direct[j, 1], direct[j, 2]
        A[place, :n] = np.outer(part.b, loop.Z[j] + of_u * loop.C)
        D[place] = np.outer(part.b, of_u * loop.E)
        B[place] = part.b * of_limited
        Z[j] *= part.d[0]
        Z[j, place] = part.C[0]
        at_once[j] *= part.d[0]
    pad = np.zeros(extra)
    return SaturatedLoop(
        A=A,
        B=B,
        C=np.append(loop.C, pad),
        D=D,
        E=loop.E,
        Z=Z,
        delays=np.zeros(k),
        x0=np.append(loop.x0, pad),
        B_limits=None if loop.B_limits is None else np.append(loop.B_limits, pad),
        outputs={name: (np.append(x, pad), w) for name, (x, w) in loop.outputs.items()},
        direct=None if loop.direct is None else at_once,
    )
