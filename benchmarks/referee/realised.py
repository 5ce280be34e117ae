"""A transfer function as a chain of second order sections, each with its own two zeros: the referee's state space."""

from __future__ import annotations

import numpy as np

from benchmarks.referee.factors import Factors, Real, unit

System = tuple[Real, Real, Real, float]  # A (n, n), b (n,), c (n,), d


def realised(of: Factors) -> System:
    """x' = A x + b i, o = c x + d i with the transfer function ``of``, which is proper."""
    below, above = _grouped(of.poles), _grouped(of.zeros)
    singles = [group for group in above if len(group) == 1]
    pairs = [group for group in above if len(group) == 2]
    A, b, c, d = np.zeros((0, 0)), np.zeros(0), np.zeros(0), 1.0
    for group in sorted(below, key=len, reverse=True):
        room = len(group)
        if room == 2 and pairs:
            zeros = pairs.pop(0)
        else:
            zeros = singles.pop() if singles and (room == 1 or not pairs) and _last(below, group, singles) else ()
        A, b, c, d = _chained((A, b, c, d), _section(zeros, group, unit(of)))
    assert not [*singles, *pairs], "a transfer function is improper"
    return A, b, of.gain * c, of.gain * d


def _last(below: list[tuple[complex, ...]], group: tuple[complex, ...], singles: list[tuple[complex, ...]]) -> bool:
    """Whether a single zero goes here: to the single pole if there is one."""
    return len(group) == 1 or not any(len(other) == 1 for other in below)


def _grouped(roots: tuple[complex, ...]) -> list[tuple[complex, ...]]:
    """Conjugate pairs, pairs of real roots, and one real root if their number is odd; the slowest first."""
    pairs = [(root, root.conjugate()) for root in roots if root.imag > 0]
    real = sorted((complex(root) for root in roots if root.imag == 0), key=abs)
    pairs += [(real[k], real[k + 1]) for k in range(0, len(real) - 1, 2)]
    pairs.sort(key=lambda pair: abs(pair[0] * pair[1]))
    return [*pairs, *([(real[-1],)] if len(real) % 2 else [])]


def _section(zeros: tuple[complex, ...], poles: tuple[complex, ...], q: float) -> System:
    """prod(s - zero)/prod(s - pole), real, of order 1 or 2, its states of like size."""
    above = np.real(np.poly(zeros)) if zeros else np.ones(1)
    below = np.atleast_1d(np.real(np.poly(poles)))
    above = np.concatenate([np.zeros(len(below) - len(above)), np.atleast_1d(above)])
    rest = above[1:] - above[0] * below[1:]
    if len(poles) == 1:
        size = abs(below[1]) or q
        return np.array([[-below[1]]]), np.array([size]), np.array([rest[0] / size]), float(above[0])
    size = float(np.sqrt(abs(below[2]))) or abs(below[1]) or q
    A = np.array([[0.0, size], [-below[2] / size, -below[1]]])
    return A, np.array([0.0, size]), np.array([rest[1] / size**2, rest[0] / size]), float(above[0])


def _chained(first: System, second: System) -> System:
    """The second driven by the first."""
    (A1, b1, c1, d1), (A2, b2, c2, d2) = first, second
    A = np.block([[A1, np.zeros((len(A1), len(A2)))], [np.outer(b2, c1), A2]])
    return A, np.concatenate([b1, b2 * d1]), np.concatenate([d2 * c1, c2]), d1 * d2
