"""The blocks of a controller as difference equations: Tustin's rule or a held input, dead times between samples."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from design.blocks.state_space import StateSpace
from identification.base.errors import InputError

METHODS = ("tustin", "exact")

WHOLE = 1e-9  # of a sample: a dead time nearer than this to a whole number of samples is one


class SampledBlock(NamedTuple):
    """x[k+1] = A x[k] + b i[k], p[k] = C x[k] + d i[k], w[k] = now p[k - whole] + before p[k - whole - 1].

    Parameters
    ----------
    A, b
        Shapes (n, n), (n,); i is the one input.
    C, d
        Shapes (m, n), (m,): what each output's dead time works on.
    whole, now, before
        Shape (m,): whole samples of each dead time, and what it takes of the two samples around its end.
    """

    A: np.ndarray
    b: np.ndarray
    C: np.ndarray
    d: np.ndarray
    whole: np.ndarray
    now: np.ndarray
    before: np.ndarray


def split(delay_s: float, sample_time_s: float) -> tuple[int, float]:
    """A dead time as whole samples and the rest, a share of a sample in [0, 1)."""
    samples = delay_s / sample_time_s
    whole = math.floor(samples + WHOLE)
    rest = samples - whole
    return whole, rest if rest > WHOLE else 0.0


def sample_block(system: StateSpace, delays_s: Sequence[float], sample_time_s: float, method: str) -> SampledBlock:
    """A block with dead times behind its outputs as the difference equations of a computer.

    Parameters
    ----------
    system
        One input, m outputs.
    delays_s
        Of the m outputs in seconds, not negative.
    sample_time_s
        T_s, positive.
    method
        ``tustin``: H(z) = H(s) at s = 2/T_s (z - 1)/(z + 1). ``exact``: the block's response to an input that
        stands still between the samples (zero-order hold), exact at the samples.

    Raises
    ------
    InputError
        Another method, or a pole at 2/T_s, which Tustin's rule sends to infinity.

    Notes
    -----
    A dead time h = (whole + rest) T_s with 0 < rest < 1 reads its block between samples. Of a held input the state
    (1 - rest) T_s after a sample is known exactly (the modified z-transform), and so is what is read. Tustin's
    rule joins the samples of the input by straight lines; so does what is read here, (1 - rest) p[k - whole] +
    rest p[k - whole - 1], with an error of order T_s^2 that is Tustin's own order. An all-pass filter would keep the
    magnitude instead, but has its own order's error in the phase and a transient.
    """
    if method not in METHODS:
        raise InputError(f"the method is '{method}'; expected {' or '.join(METHODS)}")
    n = len(system.b)
    parts = [split(delay_s, sample_time_s) for delay_s in delays_s]
    whole, rest = np.array([part[0] for part in parts]), np.array([part[1] for part in parts])
    if method == "tustin":
        if n and np.abs(1 - np.linalg.eigvals(system.A) * sample_time_s / 2).min() < 1e-12:
            raise InputError(
                f"the controller has a pole at {2 / sample_time_s:.6g} rad/s, twice the rate, where Tustin's rule is "
                "infinite; expected another rate, or the method exact"
            )
        half = system.A * sample_time_s / 2
        b = np.linalg.solve(np.eye(n) - half, system.b * sample_time_s)
        return SampledBlock(
            A=np.linalg.solve(np.eye(n) - half, np.eye(n) + half),
            b=b,
            C=np.linalg.solve((np.eye(n) - half).T, system.C.T).T,
            d=system.d + system.C @ b / 2,
            whole=whole,
            now=1 - rest,
            before=rest,
        )
    A, b = _held(system, sample_time_s)
    rows = [_held(system, (1 - share) * sample_time_s) if share else (np.eye(n), np.zeros(n)) for share in rest]
    return SampledBlock(
        A=A,
        b=b,
        C=np.array([row @ ahead for row, (ahead, _) in zip(system.C, rows, strict=True)]).reshape(len(rest), n),
        d=np.array([row @ into for row, (_, into) in zip(system.C, rows, strict=True)]) + system.d,
        whole=whole,
        now=np.where(rest > 0, 0.0, 1.0),
        before=np.where(rest > 0, 1.0, 0.0),
    )


def _held(system: StateSpace, length_s: float) -> tuple[np.ndarray, np.ndarray]:
    """exp(A t) and the integral of exp(A t) b over 0 <= t <= length_s."""
    n = len(system.b)
    from scipy.linalg import expm  # a sixth of a second, which only sampled runs need

    whole = expm(np.block([[system.A, system.b[:, None]], [np.zeros((1, n + 1))]]) * length_s)
    return np.ascontiguousarray(whole[:n, :n]), whole[:n, n].copy()
