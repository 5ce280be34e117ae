"""A loop with its dead times replaced by Pade approximations, as the thesis simulates it: for comparison only."""

from __future__ import annotations

import control
import numpy as np
from scipy.linalg import block_diag

from experiments.closed_loop import SaturatedLoop


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
    n = len(loop.x0)
    filters = []
    for delay in loop.delays:
        # in units of the dead time the coefficients are of order one
        numerator, denominator = control.pade(1.0, order)
        unit = control.ss(control.tf(numerator, denominator))
        filters.append((unit.A / (delay or 1.0), unit.B[:, 0] / (delay or 1.0), unit.C[0], unit.D[0, 0], delay))
    late = [k for k, delay in enumerate(loop.delays) if delay > 0]
    extra = order * len(late)
    A = block_diag(loop.A, *(filters[k][0] for k in late))
    Z = np.hstack([loop.Z, np.zeros((len(loop.delays), extra))])
    # w_k = row_k x for the extended state
    rows = Z.copy()
    for position, k in enumerate(late):
        place = slice(n + position * order, n + (position + 1) * order)
        _, b, c, d, _ = filters[k]
        A[place, :n] = np.outer(b, loop.Z[k])
        rows[k] *= d
        rows[k, place] = c
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
        outputs={name: (np.concatenate([x, pad]) + w @ rows, np.zeros(0)) for name, (x, w) in loop.outputs.items()},
    )
