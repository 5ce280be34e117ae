"""Blocks -> state space: a chain of first and second order sections, one a pole or pole pair, shared by all outputs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from design.blocks.block import Block, geometric_scale, polynomial
from identification.base.errors import InputError


@dataclass(frozen=True)
class StateSpace:
    """x' = A x + b u, y = C x + d u with one input.

    Shapes: A (n, n), b (n,), C (p, n), d (p,).
    """

    A: np.ndarray
    b: np.ndarray
    C: np.ndarray
    d: np.ndarray


def block_diagonal(*matrices: np.ndarray) -> np.ndarray:
    """The square matrices along a diagonal, zeros elsewhere: scipy's, without the sixth of a second of its import."""
    edges = np.cumsum([0, *(len(matrix) for matrix in matrices)])
    full = np.zeros((edges[-1], edges[-1]))
    for matrix, first, end in zip(matrices, edges[:-1], edges[1:], strict=True):
        full[first:end, first:end] = matrix
    return full


def realize(*blocks: Block) -> StateSpace:
    """Realise proper blocks that share one input; poles that they have in common are shared states.

    Parameters
    ----------
    blocks
        Proper blocks. Their dead times are left out: a loop keeps them exact, outside the states.

    Returns
    -------
    StateSpace
        One output a block; minimal when no block has cancelling roots.

    Raises
    ------
    InputError
        A block is improper.

    Notes
    -----
    With the common denominator split into sections d_1(s) ... d_k(s), division with remainder, last section
    first, brings every numerator into Newton's form

        N/(d_1 ... d_k) = c + r_1/d_1 + r_2/(d_1 d_2) + ... + r_k/(d_1 ... d_k),   deg r_i < deg d_i,

    so that the states of the chain u -> 1/d_1 -> 1/d_2 -> ... carry all outputs. Unlike a companion form every
    section keeps its own time scale; unlike partial fractions repeated poles need no special case. The
    arithmetic runs in x = s/q with q the geometric mean of the roots. The first block's poles lead the chain,
    so that it does not see the sections that only others need; within a block the fastest leads, so that no
    fast mode is fed through slow ones, which would leave it tiny.
    """
    for block in blocks:
        if block.relative_degree < 0:
            raise InputError(f"a block with {len(block.zeros)} zeros and {len(block.poles)} poles is improper")
    q = geometric_scale(*blocks)
    poles = _common_poles(blocks)
    sections = _sections(poles)
    A, b = np.zeros((len(poles), len(poles))), np.zeros(len(poles))
    divisors: list[np.ndarray] = []
    weights: list[list[float]] = []  # x_0 = weight[0] u/(d_1...d_i), x_1 = weight[1] x u/(d_1...d_i)
    chain_gain, first = 1.0, 0
    source = -1  # the state that drives the next section
    for section in sections:
        p = section[0] / q
        speed = abs(p) or 1.0
        if len(section) == 1:  # x_0' = p x_0 + speed w
            entry = first
            A[first, first] = p.real
            chain_gain *= speed
            weights.append([chain_gain])
            divisors.append(np.array([1.0, -p.real]))
        else:  # x_0' = speed x_1,  x_1' = -speed x_0 + 2 Re(p) x_1 + speed w
            entry = first + 1
            A[first, entry], A[entry, first], A[entry, entry] = speed, -speed, 2 * p.real
            chain_gain *= speed**2
            weights.append([chain_gain, chain_gain / speed])
            divisors.append(np.array([1.0, -2 * p.real, speed**2]))
        if first == 0:
            b[entry] = speed
        else:
            A[entry, source] = speed
        source, first = first, first + len(section)

    C, d = np.zeros((len(blocks), len(poles))), np.zeros(len(blocks))
    for row, block in enumerate(blocks):
        missing = list(poles)
        for pole in block.poles:
            missing.remove(pole)
        quotient = polynomial(Block(block.gain, block.zeros + tuple(missing)), q) / q ** len(poles)
        column = len(poles)
        for divisor, weight in zip(reversed(divisors), reversed(weights), strict=True):
            quotient, remainder = _divide(quotient, divisor)
            column -= len(weight)
            for power, coefficient in enumerate(reversed(remainder)):
                C[row, column + power] = coefficient / weight[power]
        d[row] = quotient[-1]
    return StateSpace(q * A, q * b, C, d)


def _divide(dividend: np.ndarray, divisor: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Quotient and remainder of polynomials (highest power first), the divisor monic.

    numpy.polydiv takes leading coefficients below 1e-8 for zero; here they may be all there is.
    """
    degree = len(divisor) - 1
    work = np.concatenate([np.zeros(max(0, len(divisor) - len(dividend))), dividend])
    steps = len(work) - degree
    for k in range(steps):
        work[k + 1 : k + 1 + degree] -= work[k] * divisor[1:]
    return work[:steps], work[steps:]


def _common_poles(blocks: Sequence[Block]) -> tuple[complex, ...]:
    """The least multiset of poles that holds every block's: those of the first block first, each fastest first."""
    common: list[complex] = []
    for block in blocks:
        spare = list(common)
        for pole in sorted(block.poles, key=lambda pole: (-abs(pole), pole.real, abs(pole.imag), pole.imag)):
            if pole in spare:
                spare.remove(pole)
            else:
                common.append(pole)
    return tuple(common)


def _sections(poles: Sequence[complex]) -> list[tuple[complex, ...]]:
    """Split poles, of which conjugates are neighbours, into conjugate pairs and single real poles."""
    sections: list[tuple[complex, ...]] = []
    k = 0
    while k < len(poles):
        width = 1 if poles[k].imag == 0 else 2
        sections.append(tuple(poles[k : k + width]))
        k += width
    return sections
