"""Dead times below a step: what comes out of them is, in a loop without kinks, a linear function of the present.

    x'(t) = A x + B m + D w        r(t) = R x + R_m m + R_w w        w_j(t) = r_j(t - h_j)

Where no kink lies within the dead times before t, and after what a kink has left has died away, the loop is on the
slow modes of its characteristic equation, as many as it has states: x' = F x + G m. There w = S x + S_m m, with

    S = (R + R_w S) exp(-F h),    F = A + D S,

which a few iterations find from S = R: each is closer than the last one by some h |fastest root|. Delayed signals v of
longer dead times are known polynomials; S then has columns for them and for their derivatives, of which h |fastest
root| makes the higher ones negligible.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from experiments.engine.crossings import MOST

BRIEF = 2.0  # time constants of the fastest root: longer dead times set the step, which is 4 at most
DERIVATIVES = 16  # of a signal that comes out of a longer dead time
TRIALS = 60
ROUNDING = 1e-15  # of the terms that make an entry


def with_brief(
    modes: Sequence[np.ndarray], n: int, delays: np.ndarray
) -> tuple[list[np.ndarray], list[np.ndarray], np.ndarray, float]:
    """The modes, and again with the shortest dead time taken for the present, with the two shortest, and so on.

    Parameters
    ----------
    modes
        Each as ``rows`` of :func:`present_of`, followed by rows of what is watched.
    n, delays
        As there.

    Returns
    -------
    every, presents, brief, fastest
        All modes, in which S x + S_m m stands for w, the columns of w are for the rest of S; the S of all but the
        first ``modes``; the dead times that are brief, increasing, (b,); the largest modulus of an eigenvalue in rad/s.
    """
    every, fastest = list(modes), _fastest(modes, n)
    presents: list[np.ndarray] = []
    brief: list[float] = []
    for h in np.unique(delays):
        if h * fastest > BRIEF:
            break
        present = [S for rows in modes if (S := present_of(rows, n, delays, delays <= h)) is not None]
        if len(present) < len(modes):
            break
        level = [rows.copy() for rows in modes]
        for rows, S in zip(level, present, strict=True):
            rows[:, : n + 1] += rows[:, n + 1 :][:, delays <= h] @ S[:, : n + 1]
        fastest = max(fastest, _fastest(level, n))
        if h * fastest > BRIEF:
            break
        every, presents, brief = every + level, presents + present, [*brief, float(h)]
    return every, presents, np.array(brief), fastest


def _fastest(modes: Sequence[np.ndarray], n: int) -> float:
    return max(float(np.abs(np.linalg.eigvals(rows[:n, :n])).max()) for rows in modes[:2])  # slewing adds zeros


@np.errstate(over="ignore", invalid="ignore")  # where it does not settle, it may leave all bounds
def present_of(rows: np.ndarray, n: int, delays: np.ndarray, brief: np.ndarray) -> np.ndarray | None:
    """S, what comes out of the brief dead times as a function of (x, m, v, T v', T^2 v'', ...); T is the longest.

    Parameters
    ----------
    rows
        Over (x (n,), m, w (k,)): n rows of x', u, then the k signals that are delayed.
    n, delays, brief
        The number of states; the dead times in seconds (k,), and which of them are brief.

    Returns
    -------
    S
        Shape (brief, n + 1 + (DERIVATIVES + 1) others); None where the iteration does not settle.
    """
    others, k = int(np.count_nonzero(~brief)), len(delays)
    h, size = delays[brief][:, None], n + 1 + others * (DERIVATIVES + 1)
    known, D = np.zeros((n + 1 + k, size)), rows[: n + 1 + k, n + 1 :][:, brief]
    known[:, : n + 1] = rows[: n + 1 + k, : n + 1]
    known[:, n + 1 : n + 1 + others] = rows[: n + 1 + k, n + 1 :][:, ~brief]
    F = np.zeros((size, size))
    F[n + 1 : size - others, n + 1 + others :] = np.eye(others * DERIVATIVES) / h.max()
    read, of_itself = known[n + 1 :][brief], D[n + 1 :][brief]
    S = read
    for _ in range(TRIALS):
        F[:n] = known[:n] + D[:n] @ S
        speeds = np.abs(F)
        term = read + of_itself @ S
        found, made = term, np.abs(term)
        for p in range(1, MOST + 1):
            parts = h / p * (np.abs(term) @ speeds)
            term = -h / p * (term @ F)
            found, made = found + term, made + parts
            if np.all(parts <= 0.1 * ROUNDING * made):
                break
        else:
            return None
        if not np.isfinite(made).all():
            return None
        if np.all(np.abs(found - S) <= ROUNDING * made):
            return np.asarray(found)
        S = found
    return None


def derived(n: int, brief: np.ndarray, S: np.ndarray, delays: np.ndarray, step: float) -> np.ndarray:
    """The rest of S, shape (k, k, DERIVATIVES + 1): [j, q, i] times the derivative i of w_q by tau is part of w_j."""
    k, others = len(brief), int(np.count_nonzero(~brief))
    rest = np.zeros((k, k, DERIVATIVES + 1))
    by_order = S[:, n + 1 :].reshape(len(S), DERIVATIVES + 1, others)
    powers = (delays[brief].max() / step) ** np.arange(DERIVATIVES + 1.0)
    rest[np.ix_(brief, ~brief)] = np.moveaxis(by_order, 1, 2) * powers
    return rest
