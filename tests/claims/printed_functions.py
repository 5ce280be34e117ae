"""The transfer functions exactly as the thesis prints them, with the error that their digits allow."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from experiments.thesis.claims.printed_number import read_number

Coefficient = str | int | float  # printed digits, or a number that was chosen and so is exact


class Noise(str):
    """A printed coefficient that is rounding noise of Matlab's arithmetic: it stands for an exact 0."""


@dataclass(frozen=True)
class PrintedFunction:
    """gain * prod(zeros) / prod(poles), each factor a polynomial given by its coefficients, highest power first."""

    gain: Coefficient
    zeros: tuple[tuple[Coefficient, ...], ...]
    poles: tuple[tuple[Coefficient, ...], ...]

    def __call__(self, s: np.ndarray) -> np.ndarray:
        value = np.full(s.shape, _value(self.gain), dtype=complex)
        for factor in self.zeros:
            value = value * np.polyval([_value(c) for c in factor], s)
        for factor in self.poles:
            value = value / np.polyval([_value(c) for c in factor], s)
        return value

    def allowance(self, s: np.ndarray) -> np.ndarray:
        """The largest |H/printed - 1| of any H whose coefficients round to the printed ones; inf where unbounded.

        A factor p + dp with |dp| <= sum of half_unit_k |s|^k lies within 1 +- delta of p, delta = |dp|/|p|.
        """
        up = np.full(s.shape, 1 + _half_unit(self.gain) / abs(_value(self.gain)))
        for factor in self.zeros:
            up = up * (1 + _delta(factor, s))
        for factor in self.poles:
            room = 1 - _delta(factor, s)
            up = np.where(room > 0, up / np.where(room > 0, room, 1.0), np.inf)
        return up - 1


def _value(coefficient: Coefficient) -> float:
    return read_number(coefficient).value if isinstance(coefficient, str) else float(coefficient)


def _half_unit(coefficient: Coefficient) -> float:
    if not isinstance(coefficient, str):
        return 0.0
    number = read_number(coefficient)
    return abs(number.value) if isinstance(coefficient, Noise) else number.half_unit


def _delta(factor: tuple[Coefficient, ...], s: np.ndarray) -> np.ndarray:
    return np.polyval([_half_unit(c) for c in factor], np.abs(s)) / np.abs(np.polyval([_value(c) for c in factor], s))


S = (1, 0)
EPSILON = (1, 0, 1e-4)
N1, N1_UP = (1, "2.8", "3.062e4"), (1, "2.8", "3.063e4")
N2 = (1, "74.4", "8.649e5")
D1 = (1, "11", "7.952e4")
D2 = (1, "201.6", "9.216e5")
FREE = ((1, "0.6618"), (1, "2.352", "2.359"))
POLES = ((1, 4), (1, 4), (1, 1), (1, 1))

G_A_2 = PrintedFunction("2.68e-10", (N1, N2), (EPSILON, (1, 0, "2.467")))
THETA1 = PrintedFunction(
    "5.687e15",
    ((1, Noise("1.629e-12"), 1e-4), (1, Noise("-1.02e-10"), "2.467")),
    (S, (1, 40), (1, 20), D1, D2),
)
THETA2 = PrintedFunction("19.659", (N1, (1, 60, "7.84e4"), N2), (S, (1, 40), (1, 20), D1, D2))
C0 = PrintedFunction("10.25", FREE, ((1, "-0.06176"), (1, "-0.1879", "2.098")))
F = PrintedFunction("-10.25", FREE, POLES)
K0 = PrintedFunction("10.25", (S, *FREE), POLES)
K1 = PrintedFunction("0.050867", (D1, D2), (N1_UP, N2))
G_A_4 = PrintedFunction("19.659", (*POLES, N1_UP), (S, S, S, (1, Noise("-5.348e-12"), "2.25"), D1))
C_AW = PrintedFunction("0.52137", (*FREE, D1), (S, (1, 0, "2.25"), N1))
FAST_PAIR = PrintedFunction(1, (N2,), (D2,))
