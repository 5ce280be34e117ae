"""The blocks of a controller as difference equations: Tustin's rule or a held input, dead times between samples."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from design.blocks.state_space import StateSpace, realize
from design.chapters_3_4.realisation import CoprimeForm
from identification.base.errors import InputError

METHODS = ("tustin", "exact")

MOST_LATE = 100_000  # samples of dead time
WHOLE = 1e-9  # of a sample: a dead time nearer than this to a whole number of samples is one


class SampledBlock(NamedTuple):
    """x[k+1] = A x[k] + b i[k], p[k] = C x[k] + d i[k], w[k] = sum over j < length of taps[j] p[k - first - j].

    Parameters
    ----------
    A, b
        Shapes (n, n), (n,); i is the one input.
    C, d
        Shapes (m, n), (m,): what each output's memory works on.
    first, length, taps
        Shapes (m,), (m,), (m, t): of each output. A dead time has its one tap, or two around its end.
    """

    A: np.ndarray
    b: np.ndarray
    C: np.ndarray
    d: np.ndarray
    first: np.ndarray
    length: np.ndarray
    taps: np.ndarray

    @property
    def at_once(self) -> np.ndarray:
        """What each output takes of the input of the same sample, shape (m,)."""
        return np.where(self.first == 0, self.taps[:, 0] * self.d, 0.0)


def split(delay_s: float, sample_time_s: float) -> tuple[int, float]:
    """A dead time as whole samples and the rest, a share of a sample in [0, 1).

    Raises
    ------
    InputError
        It is longer than :data:`MOST_LATE` samples.
    """
    samples = delay_s / sample_time_s
    if samples > MOST_LATE * (1 + WHOLE):
        raise InputError(
            f"the dead time with the input delay is {delay_s:.6g} s, {samples:.6g} samples at "
            f"{1 / sample_time_s:.6g} Hz; expected at most {MOST_LATE} samples"
        )
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
            C=np.ascontiguousarray(np.linalg.solve((np.eye(n) - half).T, system.C.T).T),
            d=system.d + system.C @ b / 2,
            first=whole,
            length=np.where(rest > 0, 2, 1),
            taps=np.column_stack([1 - rest, rest]),
        )
    A, b = held(system, sample_time_s)
    rows = [held(system, (1 - share) * sample_time_s) if share else (np.eye(n), np.zeros(n)) for share in rest]
    return SampledBlock(
        A=A,
        b=b,
        C=np.array([row @ ahead for row, (ahead, _) in zip(system.C, rows, strict=True)]).reshape(len(rest), n),
        d=np.array([row @ into for row, (_, into) in zip(system.C, rows, strict=True)]) + system.d,
        first=np.where(rest > 0, whole + 1, whole),
        length=np.ones(len(rest), dtype=int),
        taps=np.ones((len(rest), 1)),
    )


def held(system: StateSpace, length_s: float) -> tuple[np.ndarray, np.ndarray]:
    """What the state at one time and a standing input make of the state ``length_s`` seconds later.

    Returns
    -------
    ahead (n, n), into (n,)
        exp(A length_s), and the integral of exp(A t) b over 0 <= t <= length_s.
    """
    n = len(system.b)
    whole = _exponential(np.block([[system.A, system.b[:, None]], [np.zeros((1, n + 1))]]) * length_s)
    return np.ascontiguousarray(whole[:n, :n]), whole[:n, n].copy()


def sample_memory(form: CoprimeForm, sample_time_s: float, method: str) -> SampledBlock:
    """rest + through Phi of a controller's stable factors as difference equations, whose outputs are to be summed.

    Parameters
    ----------
    form
        See :class:`design.chapters_3_4.realisation.CoprimeForm`.
    sample_time_s, method
        As of :func:`sample_block`.

    Raises
    ------
    InputError
        As :func:`sample_block`.

    Notes
    -----
    Phi is a finite sum over the dead time, so that no rounding stays in it longer. By Tustin's rule its input is joined
    by straight lines, and the taps integrate the kernel against them. ``exact``: a kernel c exp(A tau) b weighs the
    integrals of exp(A sigma) b z(t - sigma) over one sample, which the state at its start and the held input give.
    """
    if not form.anchors:
        return sample_block(realize(form.rest, form.through), [0.0, form.delay_s], sample_time_s, method)
    whole, rest = split(form.delay_s, sample_time_s)
    system = realize(form.rest, form.through)
    A, b, c = form.kernel()
    rows = c @ _powers_of(_exponential(A * sample_time_s), whole + 1)  # c exp(A j T), j = 0 ... whole
    if method == "tustin":
        sampled = sample_block(system, [0.0, 0.0], sample_time_s, method)
        taps = np.zeros(whole + 2)
        one, last = (_against_lines(A, b, sample_time_s, share) for share in (1.0, rest))
        for j, row in enumerate(rows):
            near, far = one if j < whole else last
            taps[j : j + 2] += row @ near, row @ far
        table = np.zeros((2, whole + 2))
        table[0, 0], table[1] = 1.0, taps
        return sampled._replace(first=np.zeros(2, dtype=int), length=np.array([1, whole + 2]), taps=table)
    states, into = held(system, sample_time_s)
    n, q = len(system.b), len(b)
    integrals = _integrals(A, b, system, sample_time_s)
    ahead, beside = held(system, (1 - rest) * sample_time_s)
    last = _integrals(A, b, system, rest * sample_time_s) @ np.block(
        [[ahead, beside[:, None]], [np.zeros((1, n)), 1.0]]
    )
    read = np.vstack([np.append(system.C[0], system.d[0]), integrals, rows[-1] @ last])
    table = np.zeros((q + 2, max(whole, 1)))
    table[0, 0] = table[-1, 0] = 1.0
    table[1:-1, :whole] = rows[:whole].T
    return SampledBlock(
        A=states,
        b=into,
        C=np.ascontiguousarray(read[:, :n]),
        d=read[:, n].copy(),
        first=np.array([0, *[1] * q, whole + 1]),
        length=np.array([1, *[whole] * q, 1]),
        taps=table,
    )


def _exponential(matrix: np.ndarray) -> np.ndarray:
    from scipy.linalg import expm  # a sixth of a second, which only sampled runs need

    return np.asarray(expm(matrix))


def _powers_of(matrix: np.ndarray, count: int) -> np.ndarray:
    """1, matrix, matrix^2, ..., shape (count, q, q)."""
    found = [np.eye(len(matrix))]
    while len(found) < count:
        found.append(found[-1] @ matrix)
    return np.array(found)


def _against_lines(A: np.ndarray, b: np.ndarray, T: float, share: float) -> tuple[np.ndarray, np.ndarray]:
    """The integrals of exp(A sigma) b times 1 - sigma/T, and times sigma/T, over 0 <= sigma <= share T."""
    points, weights = np.polynomial.legendre.leggauss(12)
    sigma = share * T * (points + 1) / 2
    values = np.array([_exponential(A * each) @ b for each in sigma]) * (share * T * weights / 2)[:, None]
    return (1 - sigma / T) @ values, sigma / T @ values


def _integrals(A: np.ndarray, b: np.ndarray, system: StateSpace, length_s: float) -> np.ndarray:
    """What the state and the held input make of the integral of exp(A sigma) b z(length - sigma), shape (q, n + 1)."""
    q, n = len(b), len(system.b)
    whole = np.zeros((q + n + 1, q + n + 1))
    whole[:q, :q], whole[:q, q : q + n], whole[:q, -1] = A, np.outer(b, system.C[1]), b * system.d[1]
    whole[q : q + n, q : q + n], whole[q : q + n, -1] = system.A, system.b
    return _exponential(whole * length_s)[:q, q:]
