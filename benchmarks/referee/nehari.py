"""The optimum of (2.8) by Nehari's theorem with rational functions in high precision, no Riccati equation anywhere.

With T = 1 - S and D = |W1|^2 + |W2|^2 on the axis, D = W~ W with W stable and minimum phase, the norm is at most gamma
where |W T - W1~ W1/W~|^2 <= V~ V/D, V~ V = gamma^2 D - |W1 W2|^2, V stable and minimum phase too; that is

    |E - X| <= 1,   E = W1~ W1 W/(W~ V),   X = W^2 T/V.

X is any stable function with X(p) = W^2/V (p), T = 1, at the unstable poles p of G; G has no unstable zeros. With B the
Blaschke product of these poles, gamma can be reached when the antistable part of (E - X)/B, which has the poles of
1/W~ and those p, has a Hankel norm of at most 1 (Francis, A Course in H-infinity Control Theory, 1987, chapter 8).
On the axis itself T = 1 costs |W2|, which no controller evades, and nothing else.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import mpmath
import numpy as np

from benchmarks.referee.factors import Factors, unit
from benchmarks.referee.peaks import supremum
from benchmarks.referee.winding import around

DIGITS = 40  # to begin with; doubled until twice as many say the same
mp = mpmath.mp
Polynomial = list[mpmath.mpc]  # highest power first


def optimum(G: Factors, W1: Factors, W2: Factors, guess: float) -> float:
    """inf ||[W1 S; W2 T]|| over the controllers that stabilise G, which has no zeros right of the axis.

    Parameters
    ----------
    G
        Its unstable poles are simple; poles on the axis are allowed.
    W1, W2
        Without poles on the axis or right of it.
    guess
        Something of the size of the answer.
    """
    digits = DIGITS
    while True:
        found, distance = _optimum(G, W1, W2, guess, digits)
        again = _problem(G, W1, W2, 2 * digits)
        with mpmath.workdps(2 * digits):
            if abs(again.distance(found) - distance) < 1e-9 * max(1.0, distance):
                return found
        digits *= 2


def _problem(G: Factors, W1: Factors, W2: Factors, digits: int) -> _Problem:
    q = unit(G, W1, W2)
    with mpmath.workdps(digits):
        unstable = tuple(mp.mpc(p) / q for p in G.poles if p.real > 1e-9 * abs(p))
        return _Problem(unstable, _scaled(W1, q), _scaled(W2, q))


def _optimum(G: Factors, W1: Factors, W2: Factors, guess: float, digits: int) -> tuple[float, float]:
    """The optimum with so many digits, and the distance there."""
    problem, q = _problem(G, W1, W2, digits), unit(G, W1, W2)
    with mpmath.workdps(digits):
        on_axis = [abs(complex(W2(np.array(p)))) for p in G.poles if abs(p.real) <= 1e-9 * abs(p)]
        omega = around((*W1.zeros, *W1.poles, *W2.zeros, *W2.poles), q)

        def pointwise(at: np.ndarray) -> np.ndarray:
            first, second = np.abs(W1(1j * at)), np.abs(W2(1j * at))
            return first * second / np.hypot(first, second)

        floor = max(supremum(pointwise, omega)[0], *on_axis, 0.0)
        low = floor * (1 + 1e-8)
        if problem.distance(low) <= 1:
            return low, problem.distance(low)
        high = max(guess, 1.001 * low)
        while problem.distance(high) > 1:
            low, high = high, 1.5 * high
        value_low, value_high = (np.log(problem.distance(end)) for end in (low, high))
        for _ in range(60):  # Illinois's method on log distance over log gamma
            a, b = np.log(low), np.log(high)
            if b - a < 1e-9:
                break
            middle = float(np.exp((a * value_high - b * value_low) / (value_high - value_low)))
            value = np.log(problem.distance(middle))
            if abs(value) < 1e-9:
                return middle, problem.distance(middle)
            if value > 0:
                low, value_low, value_high = middle, value, value_high / 2
            else:
                high, value_high, value_low = middle, value, value_low / 2
        found = float(np.sqrt(low * high))
        return found, problem.distance(found)


def _scaled(of: Factors, q: float) -> tuple[mpmath.mpf, list[mpmath.mpc], list[mpmath.mpc]]:
    """Gain, zeros and poles in the variable s/q."""
    gain = mp.mpf(of.gain) * mp.mpf(q) ** (len(of.zeros) - len(of.poles))
    return gain, [mp.mpc(z) / q for z in of.zeros], [mp.mpc(p) / q for p in of.poles]


def _expanded(roots: list[mpmath.mpc]) -> Polynomial:
    """prod(s - root)."""
    found = [mp.mpc(1)]
    for root in roots:
        found = [a - root * b for a, b in zip([*found, mp.mpc(0)], [mp.mpc(0), *found], strict=True)]
    return found


def _times(first: Polynomial, second: Polynomial) -> Polynomial:
    found = [mp.mpc(0)] * (len(first) + len(second) - 1)
    for i, a in enumerate(first):
        for j, b in enumerate(second):
            found[i + j] += a * b
    return found


def _plus(first: Polynomial, second: Polynomial, factor: mpmath.mpf) -> Polynomial:
    length = max(len(first), len(second))
    padded = [[mp.mpc(0)] * (length - len(each)) + each for each in (first, second)]
    return [a + factor * b for a, b in zip(*padded, strict=True)]


def _even(roots: list[mpmath.mpc]) -> Polynomial:
    """prod(s - root) prod(-s - root) = prod(root^2 - s^2), as a polynomial in x = s^2."""
    return [mp.mpf((-1) ** len(roots)) * c for c in _expanded([root**2 for root in roots])]


def _at(roots: list[mpmath.mpc], s: mpmath.mpc) -> mpmath.mpc:
    return mp.fprod([s - root for root in roots])


def _factor(even: Polynomial) -> tuple[mpmath.mpf, list[mpmath.mpc]]:
    """Gain and the roots left of the axis of a spectral factor of a polynomial in x = s^2, positive on the axis."""
    while abs(even[0]) <= mp.mpf(10) ** (-mp.dps / 2) * max(abs(c) for c in even):
        even = even[1:]
    squares = mp.polyroots([c.real for c in even], maxsteps=500, extraprec=4 * mp.dps) if len(even) > 1 else []
    roots = [mp.sqrt(x) for x in squares]
    return mp.sqrt(abs(even[0])), [root if root.real < 0 else -root for root in roots]


@dataclass(frozen=True)
class _Problem:
    """The distance that :func:`optimum` makes 1, in the variable s/q."""

    unstable: tuple[mpmath.mpc, ...]
    W1: tuple[mpmath.mpf, list[mpmath.mpc], list[mpmath.mpc]]
    W2: tuple[mpmath.mpf, list[mpmath.mpc], list[mpmath.mpc]]

    @cached_property
    def _first(self) -> tuple[Polynomial, Polynomial]:
        """N = D |d1 d2|^2 and |W1 W2|^2 |d1 d2|^2, W1 = n1/d1, W2 = n2/d2, in x = s^2."""
        (g1, n1, d1), (g2, n2, d2) = self.W1, self.W2
        one = _times([g1**2 * c for c in _even(n1)], _even(d2))
        two = _times([g2**2 * c for c in _even(n2)], _even(d1))
        return _plus(one, two, mp.mpf(1)), [(g1 * g2) ** 2 * c for c in _times(_even(n1), _even(n2))]

    @cached_property
    def _W(self) -> tuple[mpmath.mpf, list[mpmath.mpc]]:
        return _factor(self._first[0])

    def distance(self, gamma: float) -> float:
        """The Hankel norm at this gamma."""
        N, product = self._first
        (kappa, w), (lamda, v) = self._W, _factor(_plus([mp.mpf(gamma) ** 2 * c for c in N], product, mp.mpf(-1)))
        (g1, n1, d1), (_, _, d2) = self.W1, self.W2
        mirrored = [-root for root in w]  # zeros of W~; prod(-s - w) = (-1)^n prod(s - mirrored)

        def E(s: mpmath.mpc, without: int | None = None) -> mpmath.mpc:
            """E, or its residue at a simple pole ``mirrored[without]``."""
            above = g1**2 * _at(n1, s) * _at(n1, -s) * _at(d2, -s) * _at(w, s)
            rest = mirrored if without is None else mirrored[:without] + mirrored[without + 1 :]
            return above * (-1) ** len(w) / (_at(d1, s) * _at(rest, s) * lamda * _at(v, s))

        def blaschke(s: mpmath.mpc, without: int | None = None) -> mpmath.mpc:
            value = mp.mpc(1)
            for k, p in enumerate(self.unstable):
                value *= (1 if k == without else s - p) / (s + mp.conj(p))
            return value

        poles, residues = list(mirrored), [E(p, k) / blaschke(p) for k, p in enumerate(mirrored)]
        for k, p in enumerate(self.unstable):
            X = kappa**2 * _at(w, p) ** 2 / (lamda * _at(v, p) * _at(d1, p) * _at(d2, p))
            poles.append(p)
            residues.append((E(p) - X) / blaschke(p, k))
        return _hankel_norm(poles, residues)


def _hankel_norm(poles: list[mpmath.mpc], residues: list[mpmath.mpc]) -> float:
    """Of sum residue/(s - pole), all poles simple and right of the axis: the root of the largest eigenvalue of P Q."""
    n = len(poles)
    P, Q = mp.matrix(n, n), mp.matrix(n, n)
    for i in range(n):
        for j in range(n):
            P[i, j] = residues[i] * mp.conj(residues[j]) / (poles[i] + mp.conj(poles[j]))
            Q[i, j] = 1 / (mp.conj(poles[i]) + poles[j])
    between = _cholesky(Q).H * _cholesky(P)
    return float(np.linalg.norm(np.array(between.tolist(), dtype=complex), 2))


def _cholesky(H: mpmath.matrix) -> mpmath.matrix:
    """L with L L^H = H; pivots that rounding makes negative count as 0."""
    n = H.rows
    L = mp.matrix(n, n)
    for j in range(n):
        pivot = (H[j, j] - mp.fsum([abs(L[j, k]) ** 2 for k in range(j)])).real
        if pivot <= 0:
            continue
        L[j, j] = mp.sqrt(pivot)
        for i in range(j + 1, n):
            L[i, j] = (H[i, j] - mp.fsum([L[i, k] * mp.conj(L[j, k]) for k in range(j)])) / L[j, j]
    return L
