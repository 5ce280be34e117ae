"""State space -> block: poles, zeros refined on the transfer function itself, known cancellations taken out."""

from __future__ import annotations

import numpy as np
from scipy.linalg import LinAlgError, eigvals
from scipy.optimize import linear_sum_assignment

from design.block import Block
from design.frequency import frequency_grid
from identification.files import InputError


def balance(A: np.ndarray, B: np.ndarray, C: np.ndarray) -> np.ndarray:
    """Diagonal t (n,) such that in x = t z the rows of [A B] and the columns of [A; C] are of like size."""
    t = np.ones(len(A))
    off = np.abs(A - np.diag(np.diag(A)))
    for _ in range(20):
        for k in range(len(A)):
            row = np.sum(off[k] * t) / t[k] + np.sum(np.abs(B[k])) / t[k]
            column = np.sum(off[:, k] / t) * t[k] + np.sum(np.abs(C[:, k])) * t[k]
            if row > 0 and column > 0:
                t[k] *= np.sqrt(row / column)
    return t


def to_block(A: np.ndarray, B: np.ndarray, C: np.ndarray, D: float, q: float) -> Block:
    """Zeros, poles and gain of a single-input single-output state space whose time unit is 1/q."""
    t = balance(A, B, C)
    A, B, C = A / t[:, None] * t, B / t[:, None], C * t
    poles = eigvals(A)
    n = len(A)
    pencil = np.block([[A, B], [C, np.array([[D]])]])
    zeros = eigvals(pencil, np.diag([1.0] * n + [0.0]))
    zeros = zeros[np.isfinite(zeros) & (np.abs(zeros) < 1e9 * max(1.0, float(np.abs(poles).max())))]
    zeros = _refine(A, B[:, 0], C[0], D, zeros, poles)
    at = 1.7 * float(np.abs(poles).max())  # right of every pole
    value = float((C @ np.linalg.solve(at * np.eye(n) - A, B)).item() + D)
    gain = value * np.real(np.prod(at - poles)) / np.real(np.prod(at - zeros))
    return Block(gain * q ** (n - len(zeros)), tuple(zeros * q), tuple(poles * q))


def _refine(A: np.ndarray, b: np.ndarray, c: np.ndarray, d: float, zeros: np.ndarray, poles: np.ndarray) -> np.ndarray:
    """Zeros of d + c (sI - A)^-1 b by Ehrlich and Aberth's iteration on the transfer function itself.

    The pencil's eigenvalues are exact for a matrix near the given one; zeros that nearly cancel poles move far
    under such a change, while the transfer function there is known to rounding.
    """
    # real starts could not leave the axis in pairs
    z = zeros + 1e-3 * np.abs(zeros) * 1j * (-1.0) ** np.arange(len(zeros)) * (zeros.imag == 0)
    identity = np.eye(len(b))
    for _ in range(100):
        resolvent = z[:, None, None] * identity - A
        try:
            state = np.linalg.solve(resolvent, np.broadcast_to(b.astype(complex), (len(z), len(b)))[..., None])
            slope = -np.linalg.solve(resolvent, state)[..., 0] @ c
        except LinAlgError:  # a zero on a pole: nothing left to gain
            break
        value = d + state[..., 0] @ c
        others = np.subtract.outer(z, z)
        np.fill_diagonal(others, np.inf)
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            # logarithmic derivative of the numerator, value * prod(z - poles), less that of the other zeros
            newton = slope / value + np.sum(1 / np.subtract.outer(z, poles), axis=1) - np.sum(1 / others, axis=1)
            step = 1 / newton
        step = np.where(np.isfinite(step), step, 0.0)
        step *= np.minimum(1.0, 0.5 * np.abs(z) / np.maximum(np.abs(step), 1e-300))
        z = z - step
        if np.max(np.abs(step) / np.abs(z)) < 1e-10:
            break
    return _closed_under_conjugation(z)


def _closed_under_conjugation(roots: np.ndarray) -> np.ndarray:
    """Roots with rounding taken out: real, or in exact conjugate pairs."""
    row, column = linear_sum_assignment(np.abs(np.subtract.outer(roots, roots.conj())))
    mean = (roots[row] + roots[column].conj()) / 2
    mean[row == column] = mean[row == column].real
    upper = mean[mean.imag > 0]
    paired = np.concatenate([mean[mean.imag == 0], upper, upper.conj()])
    if len(paired) != len(roots):
        raise InputError("the controller's zeros are not closed under conjugation")
    return paired


def without(block: Block, poles: tuple[complex, ...]) -> Block:
    """Cancel these poles against the zeros nearest to them, if the response stays as it is within 1e-3.

    The optimal controller has zeros at the mirror images of the poles of G in the axis and has the poles of
    W1. Where W1 has its poles at the mirror images both cancel, but for rounding. Everything that is said of
    the controller afterwards is computed from what remains.
    """
    if not poles or len(block.zeros) < len(poles):
        return block
    zeros = np.array(block.zeros)
    _, near_zeros = linear_sum_assignment(np.abs(np.subtract.outer(np.array(poles), zeros)))
    _, near_poles = linear_sum_assignment(np.abs(np.subtract.outer(np.array(poles), np.array(block.poles))))
    try:
        smaller = Block(
            block.gain,
            tuple(np.delete(zeros, near_zeros)),
            tuple(np.delete(np.array(block.poles), near_poles)),
        )
    except InputError:  # not closed under conjugation: these were no cancellations
        return block
    s = 1j * frequency_grid(block.zeros + block.poles, per_decade=20)
    return smaller if np.max(np.abs(smaller(s) / block(s) - 1)) < 1e-3 else block
