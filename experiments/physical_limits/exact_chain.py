"""A plant as a chain of sections in exact arithmetic, and its flow over a cell of time to the last bit of a float."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from identification.base.errors import InputError
from identification.model.modes import Mode
from identification.model.plant import PlantModel

BITS = 512  # after the point of the integers in which the flow is computed
LARGEST = 64  # most of the flow's norm that these bits are enough for
TINY = 2.0**-300  # bounds what is lost in these integers

Row = list[Fraction]


@dataclass(frozen=True)
class Chain:
    """x' = A x + b u, y = c x + d u of a plant without its dead time, time counted in cells.

    Every number is the exact one of the plant's own parameters rounded once: it is off by at most 2^-53 of itself
    and :data:`TINY`.

    Parameters
    ----------
    A, b, c, d
        Shapes (n, n), (n,), (n,), (). The poles at zero come last, and what drives a state comes before it.
    flow
        exp(A), shape (n, n).
    impulse
        ``impulse[p, end]`` = A^p exp(A end) b for p = 0 ... 7 and end = 0, 1; shape (8, 2, n).
    pulse
        The integral of exp(A t) b over a cell, shape (n,).
    output
        ``output[p, end]`` = (c, d) M^p exp(M end), M the matrix of (x, u) with u' = 0; shape (8, 2, n + 1).
    mean
        The integral of y over a cell at whose beginning (x, u) is 1, entry by entry; shape (n + 1,).
    """

    A: np.ndarray
    b: np.ndarray
    c: np.ndarray
    d: float
    flow: np.ndarray
    impulse: np.ndarray
    pulse: np.ndarray
    output: np.ndarray
    mean: np.ndarray


def chain(plant: PlantModel, cell_s: Fraction, count: int) -> Chain:
    """Realise a plant as a chain 1/d_1 -> 1/d_2 -> ..., its dead time left out.

    Parameters
    ----------
    plant
        With a pole.
    cell_s
        Length of a cell in seconds.
    count
        How many cells are looked at: a sinusoid once in them, or at a pole, makes states of at most about 1.

    Raises
    ------
    InputError
        A pole is too fast for the cell.

    Notes
    -----
    The fastest section leads, so that no fast mode is fed through slow ones, which would leave it tiny. With q the
    chain's end, the output is N(d/dt) q, and d/dt of a row r of states is r A as long as r b = 0, which holds up to
    the plant's own relative degree: so c = q N(A), in fractions without error. With as many zeros as poles the last
    of these r b is not 0, and its share of N is d.
    """
    A, b, end = _sections(plant, cell_s)
    row = [Fraction(plant.gain) * cell_s**plant.integrators * (k == end) for k in range(len(b))]
    d = Fraction(0)
    for _ in range(-plant.integrators):
        d, row = _dot(row, b), _times(row, A)
    for rate in plant.real_zeros:
        speed = Fraction(rate) * cell_s
        d, row = _dot(row, b) / speed, _sum(row, [x / speed for x in _times(row, A)])
    for mode in plant.zero_modes:
        omega, first = Fraction(mode.omega) * cell_s, _times(row, A)
        second = [x / omega**2 for x in _times(first, A)]
        d, row = _dot(first, b) / omega**2, _sum(row, [2 * Fraction(mode.zeta) * x / omega for x in first], second)
    size = _sizes(_floats(A), _floats(b), count)
    n = len(b)
    A = [[A[i][k] * size[k] / size[i] for k in range(n)] for i in range(n)]
    b, c = [b[i] / size[i] for i in range(n)], [row[i] * size[i] for i in range(n)]
    lead, none = Fraction(2) ** int(np.frexp(max(abs(float(x)) for x in [*c, d]))[1]), Fraction(0)
    line = [*(x / lead for x in c), d / lead, none]
    generator = _integers([*([*row, x, none] for row, x in zip(A, b, strict=True)), [none] * (n + 2), line])
    flow = _exponential(generator)
    starts = [_integers([*b, none, none]), _integers(line)]
    impulse, output = [], []
    for ends in zip((starts[0], (flow @ starts[0]) >> BITS), (starts[1], (starts[1] @ flow) >> BITS), strict=True):
        column, answer = ends
        columns, lines = [], []
        for _ in range(8):
            columns.append(_rounded(column)[:n])
            lines.append(_rounded(answer)[: n + 1] * float(lead))
            column, answer = (generator @ column) >> BITS, (answer @ generator) >> BITS
        impulse.append(columns)
        output.append(lines)
    exp = _rounded(flow)
    return Chain(
        _floats(A),
        _floats(b),
        _floats(c),
        float(d),
        exp[:n, :n],
        np.swapaxes(np.array(impulse), 0, 1),
        exp[:n, n],
        np.swapaxes(np.array(output), 0, 1),
        exp[n + 1, : n + 1] * float(lead),
    )


def fastest(plant: PlantModel) -> float:
    """The size of the fastest pole in rad/s."""
    return max([0.0, *plant.real_poles, *(abs(root) for mode in plant.pole_modes for root in mode.roots)])


def _sections(plant: PlantModel, cell_s: Fraction) -> tuple[list[Row], Row, int]:
    """A, b and the index of the end of the chain; every section is 1 at s = 0, and an integrator counts cells."""
    sections = [*plant.pole_modes, *(Mode(rate, 1.0) for rate in plant.real_poles)]
    real = [False] * len(plant.pole_modes) + [True] * len(plant.real_poles)
    order = sorted(range(len(sections)), key=lambda k: (-sections[k].omega, k))
    n = 2 * len(plant.pole_modes) + len(plant.real_poles) + max(0, plant.integrators)
    A, b, source, at = [[Fraction(0)] * n for _ in range(n)], [Fraction(0)] * n, -1, 0

    def driven(entry: int, gain: Fraction) -> None:
        if source < 0:
            b[entry] = gain
        else:
            A[entry][source] = gain

    for k in order:
        speed = Fraction(sections[k].omega) * cell_s
        if real[k]:
            A[at][at] = -speed
            driven(at, speed)
        else:
            A[at][at + 1], A[at + 1][at] = speed, -speed
            A[at + 1][at + 1] = -2 * Fraction(sections[k].zeta) * speed
            driven(at + 1, speed)
        source, at = at, at + (1 if real[k] else 2)
    for _ in range(plant.integrators):
        driven(at, Fraction(1))
        source, at = at, at + 1
    return A, b, source


def _sizes(A: np.ndarray, b: np.ndarray, count: int) -> list[Fraction]:
    """Powers of two near the greatest states under u = sin(omega t), omega once in all cells or at a pole."""
    slowest = 2 * np.pi / count
    omegas = np.append(slowest, np.abs(np.linalg.eigvals(A)).clip(min=slowest))
    size = np.max([np.abs(np.linalg.solve(1j * omega * np.eye(len(b)) - A, b)) for omega in omegas], axis=0)
    return [Fraction(2) ** int(exponent) for exponent in np.frexp(size)[1]]


def _exponential(generator: np.ndarray) -> np.ndarray:
    """exp by its series in integers, to the last bit: some 300 rounded products, each amplified by exp(64) at most."""
    norm = float(np.abs(_rounded(generator)).sum(axis=1).max())
    if norm > LARGEST:
        raise InputError(
            f"the plant's states change by up to {norm:.3g} times their size in a cell; expected slower poles"
        )
    term = total = _integers([[Fraction(int(i == k)) for k in range(len(generator))] for i in range(len(generator))])
    k = 0
    while np.abs(term).max() > 1:
        k += 1
        term = ((term @ generator) >> BITS) // k
        total = total + term
    return total


def positive_exponential(matrix: np.ndarray) -> np.ndarray:
    """An upper bound of exp(|matrix|), entry by entry, shape (n, n): nothing cancels, so that no digit is lost.

    The series of |matrix|/2^k, of a norm up to 1, leaves less than 1e-20 after 30 terms; it is squared k times.
    """
    size = np.abs(matrix)
    halvings = max(0, int(np.ceil(np.log2(max(size.sum(axis=1).max(), 1.0)))))
    term = total = np.eye(len(matrix))
    for k in range(1, 30):
        term = term @ (size / 2**halvings) / k
        total = total + term
    return np.asarray(np.linalg.matrix_power(total + 1e-20, 2**halvings) * (1 + 1e-6))


def _times(row: Row, A: Sequence[Row]) -> Row:
    return [
        sum((row[i] * A[i][k] for i in range(len(row)) if row[i] and A[i][k]), Fraction(0)) for k in range(len(row))
    ]


def _dot(row: Row, column: Row) -> Fraction:
    return sum((x * y for x, y in zip(row, column, strict=True)), Fraction(0))


def _sum(*rows: Row) -> Row:
    return [sum(entries, Fraction(0)) for entries in zip(*rows, strict=True)]


def _floats(values: Iterable[object]) -> np.ndarray:
    return np.array(list(values), dtype=float)


def _integers(values: object) -> np.ndarray:
    fixed = np.vectorize(lambda value: round(value * 2**BITS), otypes=[object])
    return np.asarray(fixed(np.array(values, dtype=object)))


def _rounded(values: np.ndarray) -> np.ndarray:
    return np.asarray(np.vectorize(lambda value: value / 2**BITS, otypes=[float])(values))
