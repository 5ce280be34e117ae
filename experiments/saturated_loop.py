"""What is simulated: a linear loop with dead times around one saturation."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Resets:
    """From outside, the first g states jump: at ``times_s[i]`` they take ``values[i]``.

    Parameters
    ----------
    times_s
        Shape (b,), increasing, positive.
    values
        Shape (b, g).
    """

    times_s: np.ndarray
    values: np.ndarray


NO_RESETS = Resets(np.zeros(0), np.zeros((0, 0)))


@dataclass(frozen=True)
class SaturatedLoop:
    """x' = A x + B m + D w, u = C x + E w, m = sat(u), w_j(t) = Z_j x(t - delays_j).

    Parameters
    ----------
    A, B, C
        Shapes (n, n), (n,), (n,). The reference is part of the state: it is generated, not sampled.
    D, E, Z, delays
        Shapes (n, k), (k,), (k, n), (k,); dead times in seconds, zero allowed. Before t = 0 every delayed
        signal has the value that it has at t = 0.
    x0
        Initial state (n,).
    outputs
        Name -> (row over x (n,), row over w (k,)).
    resets
        Of a reference that is generated piece by piece.
    """

    A: np.ndarray
    B: np.ndarray
    C: np.ndarray
    D: np.ndarray
    E: np.ndarray
    Z: np.ndarray
    delays: np.ndarray
    x0: np.ndarray
    outputs: Mapping[str, tuple[np.ndarray, np.ndarray]]
    resets: Resets = NO_RESETS
