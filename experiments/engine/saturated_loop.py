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
    """x' = A x + B m + D w, u = C x + E w, m = sat(u), w_j(t) = (Z_j x + direct_j (m, sat(u), u))(t - delays_j).

    Of an actuator with a rate limit m is its output, and x' = A x + (B - B_limits) m + B_limits sat(u) + D w.

    Parameters
    ----------
    A, B, C
        Shapes (n, n), (n,), (n,). The reference is part of the state: it is generated, not sampled.
    D, E, Z, delays
        Shapes (n, k), (k,), (k, n), (k,); dead times in seconds, zero allowed. Before t = 0 every delayed
        signal has the value that it has at t = 0 with m = 0, or at the limit next to it.
    x0
        Initial state (n,).
    outputs
        Name -> (row over x (n,), row over w (k,)).
    resets
        Of a reference that is generated piece by piece.
    B_limits
        Shape (n,): the part of B that follows sat(u) at once, and not a slower actuator; zeros unless given.
    direct
        Shape (k, 3): what the delayed signals have of m, of sat(u), which is m but for a rate limit, and of u; zeros
        unless given.
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
    B_limits: np.ndarray | None = None
    direct: np.ndarray | None = None

    def __post_init__(self) -> None:
        for name in ("A", "B", "C", "D", "E", "Z", "x0"):
            if not np.isfinite(getattr(self, name)).all():
                raise InputError(f"{name} of the loop is not finite; expected finite numbers")
        for name, (x, w) in self.outputs.items():
            if not (np.isfinite(x).all() and np.isfinite(w).all()):
                raise InputError(f"the loop's output {name} is not finite; expected finite rows")
        if not (np.isfinite(self.delays).all() and np.all(self.delays >= 0)):
            raise InputError(f"the loop's dead times are {self.delays.tolist()} s; expected finite ones, not negative")


def with_actuator(loop: SaturatedLoop) -> SaturatedLoop:
    """Append the states of an actuator with a rate limit, its rate and its output, which move nothing by themselves."""
    return replace(
        loop,
        A=np.pad(loop.A, (0, 2)),
        B=np.pad(loop.B, (0, 2)),
        C=np.pad(loop.C, (0, 2)),
        D=np.pad(loop.D, ((0, 2), (0, 0))),
        Z=np.pad(loop.Z, ((0, 0), (0, 2))),
        x0=np.append(loop.x0, [0.0, 0.0]),
        outputs={name: (np.pad(x, (0, 2)), w) for name, (x, w) in loop.outputs.items()},
        B_limits=None if loop.B_limits is None else np.pad(loop.B_limits, (0, 2)),
    )
