"""The saturated loop with its exact dead time: one engine for every experiment."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_array

from experiments import taylor
from identification.files import InputError

MOST_STEPS = 2e7  # a few minutes


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


@dataclass(frozen=True)
class Run:
    """A simulated run at the sample times.

    Parameters
    ----------
    time_s
        Shape (s,).
    control, saturated_control
        u and sat(u), shape (s,).
    outputs
        Name -> samples (s,).
    events_s, modes
        Every time at which u crosses a limit, located to rounding, and the mode entered: 1 at the upper limit,
        -1 at the lower one, 0 unsaturated.
    """

    time_s: np.ndarray
    control: np.ndarray
    saturated_control: np.ndarray
    outputs: Mapping[str, np.ndarray]
    events_s: np.ndarray
    modes: np.ndarray


class DivergenceError(InputError):
    """A signal of the loop passed 1e100, at ``time_s`` seconds."""

    def __init__(self, time_s: float) -> None:
        super().__init__(f"the loop diverges: a signal passed 1e100 at t = {time_s:.6g} s")
        self.time_s = time_s


def simulate(loop: SaturatedLoop, limits: tuple[float, float], time_s: np.ndarray) -> Run:
    """Simulate a loop from t = 0.

    Parameters
    ----------
    loop
        See :class:`SaturatedLoop`.
    limits
        (sigma_1, sigma_2) of the saturation, sigma_1 < sigma_2, either may be infinite.
    time_s
        Increasing sample times (s,), the first at 0 or later; they do not influence the integration.

    Raises
    ------
    InputError
        The limits are not in order, the times not increasing, the run too long for
        its fastest time constant, or the control chatters past all bounds.
    DivergenceError
        The loop diverges.

    Notes
    -----
    Dead times are exact and events are located on the polynomials, see :mod:`experiments.taylor`. The step is
    set by the fastest eigenvalue of the loop, saturated or not, and by the shortest dead time; it is halved
    until the last term of every series is below 1e-11 of the largest value of its state.
    """
    low, high = limits
    if not low < high:
        raise InputError(f"the saturation limits are {low:g} and {high:g}; expected the lower one first")
    increasing = len(time_s) > 0 and time_s[0] >= 0 and time_s[-1] > 0 and np.all(np.diff(time_s) > 0)
    if not (increasing and np.all(np.isfinite(time_s))):
        raise InputError("the sample times are not increasing finite numbers from zero on that end after zero")
    loop = _without_zero_delays(loop)
    n, k = len(loop.x0), len(loop.delays)
    signals = np.array([np.concatenate([x, [0.0], w]) for x, w in loop.outputs.values()]).reshape(-1, n + 1 + k)
    read = [np.concatenate([loop.C, [0.0], loop.E]), *np.hstack([loop.Z, np.zeros((k, 1 + k))]), *signals]
    saturated_rows = _compressed(np.vstack([np.hstack([loop.A, loop.B[:, None], loop.D]), *read]))
    # what u - sat(u) drives is driven by zeros here, and not by rounding
    free_A, free_D = loop.A + np.outer(loop.B, loop.C), loop.D + np.outer(loop.B, loop.E)
    unsaturated_rows = _compressed(np.vstack([np.hstack([free_A, np.zeros((n, 1)), free_D]), *read]))
    fastest = max(np.abs(np.linalg.eigvals(matrix)).max() for matrix in (loop.A, free_A))
    horizon = float(time_s[-1])
    # three time constants of the fastest mode leave its last term, read REACH steps on, below the tolerance
    step = 3 / fastest if fastest > 0 else horizon
    if k:  # a whole number of steps in the shortest dead time: most delayed polynomials are read where they start
        shortest = float(loop.delays.min())
        step = shortest / np.ceil(shortest / step)
    if horizon / step > MOST_STEPS:
        raise InputError(
            f"the run needs {horizon / step:.3g} steps of {step:.3g} s, set by its shortest dead time or fastest pole; "
            f"expected at most {MOST_STEPS:.3g} (a shorter run, a dead time of zero, or a slower design)"
        )
    most_events = 4096
    for _ in range(40):
        values, events, modes, tail, status, end = taylor.integrate(
            *unsaturated_rows,
            *saturated_rows,
            loop.delays,
            loop.x0,
            float(low),
            float(high),
            horizon,
            step,
            time_s,
            most_events,
        )
        if status == taylor.CROWDED:
            most_events *= 8
        elif tail > 1e-11:
            step /= 2
        else:
            break
    if status == taylor.DIVERGED:
        raise DivergenceError(end)
    if status != taylor.COMPLETE or tail > 1e-11:
        raise InputError(f"the loop could not be integrated: {len(events)} events up to t = {end:.6g} s")
    return Run(
        time_s=time_s,
        control=values[:, 0],
        saturated_control=np.clip(values[:, 0], low, high),
        outputs={name: values[:, 1 + k] for k, name in enumerate(loop.outputs)},
        events_s=events,
        modes=modes,
    )


def _compressed(dense: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Row pointers, columns and values; unsigned, so that no index is tested for a count from the end."""
    matrix = csr_array(dense)
    return matrix.indptr.astype(np.uint32), matrix.indices.astype(np.uint32), matrix.data


def _without_zero_delays(loop: SaturatedLoop) -> SaturatedLoop:
    """The same loop with w_j = Z_j x substituted wherever the dead time is zero."""
    now, later = loop.delays == 0, loop.delays > 0
    return SaturatedLoop(
        A=loop.A + loop.D[:, now] @ loop.Z[now],
        B=loop.B,
        C=loop.C + loop.E[now] @ loop.Z[now],
        D=np.ascontiguousarray(loop.D[:, later]),
        E=np.ascontiguousarray(loop.E[later]),
        Z=np.ascontiguousarray(loop.Z[later]),
        delays=loop.delays[later],
        x0=loop.x0,
        outputs={name: (x + w[now] @ loop.Z[now], w[later]) for name, (x, w) in loop.outputs.items()},
    )
