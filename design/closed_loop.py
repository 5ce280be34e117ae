"""The closed loop of G and K: its poles, and the norm (2.8) from the factors themselves, which checks the synthesis."""

from __future__ import annotations

import numpy as np
from scipy.linalg import block_diag, eigvals

from design.block import Block, geometric_scale
from design.frequency import peak
from design.realization import realize
from identification.files import InputError


def closed_loop_norm(G: Block, W1: Block, W2: Block, K: Block) -> float:
    """|| [W1 S; W2 T] ||_inf from the factors' frequency responses, independent of any state space."""
    GK, W2G = G * K, W2 * G

    def magnitude(omega: np.ndarray) -> np.ndarray:
        s = 1j * omega
        S = 1 / (1 + GK(s))
        return np.hypot(np.abs(W1(s) * S), np.abs(W2G(s) * K(s) * S))

    roots = GK.zeros + GK.poles + W1.poles + W2G.zeros + W2G.poles
    return peak(magnitude, roots + closed_loop_poles(G, K))[0]


def closed_loop_poles(G: Block, K: Block) -> tuple[complex, ...]:
    """Roots in rad/s of 1 + G K, including what cancels between the factors (internal stability, as in Eq. (3.15)).

    Raises
    ------
    InputError
        1 + G K vanishes at infinite frequency: the loop is not well posed.
    """
    q = geometric_scale(G, K)
    g, k = realize(G), realize(K)
    through = 1 + g.d[0] * k.d[0]
    if through == 0:
        raise InputError("1 + G K is zero at infinite frequency: the loop is not well posed")
    # e = -(C_g x_g + d_g u), u = C_k x_k + d_k e
    e = -np.concatenate([g.C[0], g.d[0] * k.C[0]]) / through
    u = np.concatenate([-k.d[0] * g.C[0], k.C[0]]) / through
    A = block_diag(g.A, k.A) + np.vstack([np.outer(g.b, u), np.outer(k.b, e)])
    return tuple(complex(pole) for pole in eigvals(A / q) * q)
