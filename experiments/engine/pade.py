"""A loop with its dead times replaced by Pade approximations, as the thesis simulates it: for comparison only."""

from __future__ import annotations

from math import comb, factorial

import numpy as np

from design.blocks.block import Block
from design.blocks.state_space import block_diagonal, realize
from experiments.engine.saturated_loop import SaturatedLoop
from identification.base.errors import InputError


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
        Without dead times; the approximations' states follow the loop's own.
    """
    if loop.direct is not None and loop.direct.any():
        raise InputError("a delayed signal jumps with the actuator; expected a plant with more poles than zeros")
    n = len(loop.x0)
    filters = {k: realize(pade_block(delay, order)) for k, delay in enumerate(loop.delays) if delay > 0}
    extra = order * len(filters)
    A = block_diagonal(loop.A, *(part.A for part in filters.values()))
    Z = np.hstack([loop.Z, np.zeros((len(loop.delays), extra))])
    # w_k = row_k x for the extended state
    rows = Z.copy()
    for position, (k, part) in enumerate(filters.items()):
        place = slice(n + position * order, n + (position + 1) * order)
        A[place, :n] = np.outer(part.b, loop.Z[k])
        rows[k] *= part.d[0]
        rows[k, place] = part.C[0]
    pad = np.zeros(extra)
    A[:n] += loop.D @ rows
    return SaturatedLoop(
        A=A,
        B=np.concatenate([loop.B, pad]),
        C=np.concatenate([loop.C, pad]) + loop.E @ rows,
        D=np.zeros((n + extra, 0)),
        E=np.zeros(0),
        Z=np.zeros((0, n + extra)),
        delays=np.zeros(0),
        x0=np.concatenate([loop.x0, pad]),
        B_limits=None if loop.B_limits is None else np.concatenate([loop.B_limits, pad]),
        outputs={name: (np.concatenate([x, pad]) + w @ rows, np.zeros(0)) for name, (x, w) in loop.outputs.items()},
    )
