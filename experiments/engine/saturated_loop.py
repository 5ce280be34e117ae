"""What is simulated: a linear loop with dead times around one saturation."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from identification.base.errors import InputError


@dataclass(frozen=True)
class Resets:
    """From outside, the first g states jump: at ``times_s[i]`` they take ``values[i]``.

    Parameters
    ----------
    times_s
        Shape (b,), increasing, positive.
    values
        Shape (b, g); where NaN, a state goes on.
    """

    times_s: np.ndarray
    values: np.ndarray

    def __post_init__(self) -> None:
        times_s, values = self.times_s, self.values
        if times_s.ndim != 1 or values.ndim != 2 or len(times_s) != len(values):
            raise InputError(f"the resets have shapes {times_s.shape}, {values.shape}; expected (b,) and (b, g)")
        if not np.isfinite(times_s).all() or np.isinf(values).any():
            raise InputError("the resets are not finite; expected finite times and values")
        if np.any(np.diff(times_s, prepend=0.0) <= 0):
            raise InputError("the times of the resets do not increase from zero on; expected increasing positive times")


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

    def __post_init__(self) -> None:
        for name in ("A", "B", "C", "D", "E", "Z", "x0"):
            if not np.isfinite(getattr(self, name)).all():
                raise InputError(f"{name} of the loop is not finite; expected finite numbers")
        for name, (x, w) in self.outputs.items():
            if not (np.isfinite(x).all() and np.isfinite(w).all()):
                raise InputError(f"the loop's output {name} is not finite; expected finite rows")
        if not (np.isfinite(self.delays).all() and np.all(self.delays >= 0)):
            raise InputError(f"the loop's dead times are {self.delays.tolist()} s; expected finite ones, not negative")


def with_actuator(loop: SaturatedLoop, start: float) -> SaturatedLoop:
    """Append a state to a loop, the output of an actuator with a rate limit, which moves nothing by itself."""
    return replace(
        loop,
        A=np.pad(loop.A, (0, 1)),
        B=np.append(loop.B, 0.0),
        C=np.append(loop.C, 0.0),
        D=np.pad(loop.D, ((0, 1), (0, 0))),
        Z=np.pad(loop.Z, ((0, 0), (0, 1))),
        x0=np.append(loop.x0, start),
        outputs={name: (np.append(x, 0.0), w) for name, (x, w) in loop.outputs.items()},
    )
