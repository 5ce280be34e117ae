"""The mixed sensitivity problem as an interpolation problem of Nevanlinna and Pick, decided in ball arithmetic."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise

from flint import acb, arb, arb_poly, ctx

from design.blocks.ball import (
    Line,
    decided,
    from_roots,
    in_x,
    line,
    mirrored,
    negative_pivot,
    number,
    polynomial_roots,
    right_half_plane_roots,
    shared,
    squared,
)
from design.blocks.block import Block
from identification.base.errors import InputError


class SynthesisError(InputError):
    """The synthesis found no controller, or one that its own closed loop does not confirm."""


@dataclass(frozen=True)
class Obstacle:
    """No stabilising controller brings the norm to ``gamma`` or below, and in ``reason`` why."""

    gamma: float
    reason: str


@dataclass(frozen=True)
class Problem:
    """|| [W1 S; W2 T] || over Re s > -decay_rate, see :func:`design.hinf.mixed_sensitivity.mixed_sensitivity`.

    Notes
    -----
    With W1 = n_c n_1/(d_c d_1) and W2 = n_c n_2/(d_c d_2), n_c and d_c what they share, p~(s) = p(-s) and
    N = n_1 n_1~ d_2 d_2~ + n_2 n_2~ d_1 d_1~, the norm is at most gamma where on the axis, S being 1 - T,

        |N T - n_1 n_1~ d_2 d_2~|^2 |n_c|^2 <= |d_1 d_2 nu|^2,   nu nu~ = gamma^2 d_c d_c~ N - n_c n_c~ |n_1 n_2|^2,

    all polynomials without roots in the right half plane but N and what has a ~. So

        E = (N T - n_1 n_1~ d_2 d_2~) n_c/(d_1 d_2 nu)

    is stable with the norm 1 at most. A stable function E belongs to a T that a stabilising controller makes where
    T = 1 at the unstable poles of G, T = 0 at its unstable zeros, and N T = 0 at the right half plane's roots of N:

        E = n_c n_2 n_2~ d_1~/(d_2 nu) at the poles,   E = -n_c n_1 n_1~ d_2~/(d_1 nu) at the zeros and the roots.

    By Pick's theorem there is one if and only if the matrix (1 - e_k conj(e_l))/(s_k + conj(s_l)) of the points s_k
    and values e_k is not indefinite (J. B. Garnett, Bounded Analytic Functions, Academic Press 1981, chapter I). At a
    multiple pole or zero of G as many Taylor coefficients of E are known, and the matrix holds those of
    (1 - E(s) conj(E(t)))/(s + conj(t)) in s and conj(t). Below a gamma at which nu nu~ is negative somewhere on the
    axis there is none whatever the plant.
    """

    G: Block
    W1: Block
    W2: Block
    decay_rate: float


@dataclass(frozen=True)
class Setting:
    """The polynomials of :class:`Problem` in x, squares of moduli as polynomials in x^2, and where E is known."""

    line: Line
    d1: arb_poly
    d2: arb_poly
    nc: arb_poly
    n1_squared: arb_poly
    n2_squared: arb_poly
    dc_squared: arb_poly
    N: arb_poly
    poles: tuple[acb, ...]
    zeros: tuple[acb, ...]
    roots: tuple[acb, ...]

    @property
    def points(self) -> tuple[acb, ...]:
        """All points of the right half plane where E is known, each as often in a row as it is multiple."""
        return self.poles + self.zeros + self.roots


@lru_cache(maxsize=16)
def setting_of(problem: Problem, bits: int) -> Setting:
    """The setting at a precision of ``bits``, which is that of the context."""
    x = line(problem.decay_rate, problem.G, problem.W1, problem.W2)
    nc, n1, n2 = shared(problem.W1.zeros, problem.W2.zeros)
    dc, d1, d2 = shared(problem.W1.poles, problem.W2.poles)
    n1_squared = x.gain(problem.W1) ** 2 * squared(x.hurwitz(n1))
    n2_squared = x.gain(problem.W2) ** 2 * squared(x.hurwitz(n2))
    N = n1_squared * squared(x.hurwitz(d2)) + n2_squared * squared(x.hurwitz(d1))
    poles, zeros = (
        tuple(
            each
            for root in dict.fromkeys(roots)
            for point in x.points([root])
            if point.real > 0
            for both in _pair(point)
            for each in [both] * roots.count(root)
        )
        for roots in (problem.G.poles, problem.G.zeros)
    )
    roots = tuple(right_half_plane_roots(polynomial_roots(N)))
    return Setting(
        x,
        x.hurwitz(d1),
        x.hurwitz(d2),
        x.hurwitz(nc),
        n1_squared,
        n2_squared,
        squared(x.hurwitz(dc)),
        N,
        poles,
        zeros,
        roots,
    )


def _pair(root: acb) -> tuple[acb, ...]:
    return (root,) if root.imag == 0 else (root, root.conjugate())


def is_feasible(problem: Problem, gamma: float) -> Obstacle | bool:
    """Whether a stabilising controller brings the norm below gamma: True, the proof that none does, or False.

    Parameters
    ----------
    problem
        What is minimised.
    gamma
        Bound on the norm, positive.

    Returns
    -------
    Obstacle or bool
        False where the highest precision decides nothing. The obstacle's gamma is the given one or a greater one.
    """
    answer = decided(lambda: _judge(setting_of(problem, ctx.prec), problem, gamma))
    return False if answer is None else answer


def _judge(setting: Setting, problem: Problem, gamma: float) -> Obstacle | bool:
    level = level_of(setting, gamma)
    squares = polynomial_roots(level)
    obstacle = _single_point(setting, problem, gamma, level, squares)
    if obstacle is not None:
        return obstacle
    points = setting.points
    pivot = negative_pivot(pick_matrix(points, values_of(setting, nu_of(level, squares))))
    if pivot is None:
        return True
    return Obstacle(
        gamma,
        f"no stable T meets the {len(points)} interpolation conditions: a pivot of Pick's matrix is {pivot:.3g} times "
        "the diagonal element",
    )


def _single_point(
    setting: Setting, problem: Problem, gamma: float, level: arb_poly, squares: Sequence[acb]
) -> Obstacle | None:
    """What S and T cost at one point of the closed half plane, where that is more than gamma."""
    top = level.degree()
    if (-1) ** top * level[top] < 0:
        constant = level_of(setting, 0.0)[top] / (level - level_of(setting, 0.0))[top] * -(arb(gamma) ** 2)
        return _costs(constant.sqrt(), "S + T = 1 at infinite frequency")
    crossings = sorted(float((-root.real).sqrt()) for root in squares if root.imag == 0 > root.real)
    if crossings:  # simple roots: the level is negative between two of them, or before the first
        omegas = [
            setting.line.unit * omega
            for omega in (crossings[0] / 2, *(math.sqrt(low * high) for low, high in pairwise(crossings)))
        ]
        moduli = [
            tuple(_modulus(weight, complex(-problem.decay_rate, omega)) for weight in (problem.W1, problem.W2))
            for omega in omegas
        ]
        costs = [first * second / (first**2 + second**2).sqrt() for first, second in moduli]
        cost, omega = max(zip(costs, omegas, strict=True), key=lambda pair: float(pair[0]))
        if cost > gamma:
            return _costs(cost, f"S + T = 1 at {omega:.4g} rad/s")
    for weight, roots, said in (
        (problem.W2, problem.G.poles, "T = 1 at the pole"),
        (problem.W1, problem.G.zeros, "S = 1 at the zero"),
    ):
        for root in roots:
            if number(root).real + arb(problem.decay_rate) >= 0 and (cost := _modulus(weight, root)) > gamma:
                return _costs(cost, f"{said} {root if root.imag else root.real:.4g} of G")
    return None


def _costs(cost: arb, said: str) -> Obstacle:
    return Obstacle(math.nextafter(float(cost.lower()), 0.0), f"{said} costs {float(cost):.6g}")


def level_of(setting: Setting, gamma: float) -> arb_poly:
    """nu nu~ as a polynomial in x^2."""
    return arb(gamma) ** 2 * setting.dc_squared * setting.N - (
        squared(setting.nc) * setting.n1_squared * setting.n2_squared
    )


def _modulus(weight: Block, s: complex) -> arb:
    """|weight(s)|."""
    value = acb(weight.gain)
    for root in weight.zeros:
        value *= number(s) - number(root)
    for root in weight.poles:
        value /= number(s) - number(root)
    return abs(value)


def nu_of(level: arb_poly, squares: Sequence[acb]) -> arb_poly:
    """The polynomial nu without roots in the right half plane; ``squares`` are the roots of the level."""
    roots = [acb(-root.real, root.imag) for root in right_half_plane_roots(squares) if not root.imag < 0]
    return abs(level[level.degree()]).sqrt() * from_roots(roots)


def values_of(setting: Setting, nu: arb_poly) -> list[acb]:
    """E at the points; where a point is repeated, its next Taylor coefficients."""
    d1, d2, nc = setting.d1, setting.d2, setting.nc
    at_poles = nc * in_x(setting.n2_squared) * mirrored(d1), d2 * nu
    elsewhere = -nc * in_x(setting.n1_squared) * mirrored(d2), d1 * nu
    values: list[acb] = []
    for k, (s, order) in enumerate(zip(setting.points, orders_of(setting.points), strict=True)):
        above, below = at_poles if k < len(setting.poles) else elsewhere
        known = sum((values[k - i] * _coefficient(below, s, i) for i in range(1, order + 1)), acb(0))
        values.append((_coefficient(above, s, order) - known) / below(s))
    return values


def _coefficient(polynomial: arb_poly, s: acb, order: int) -> acb:
    """Of (x - s)^order."""
    for _ in range(order):
        polynomial = polynomial.derivative()
    return polynomial(s) / math.factorial(order)


def orders_of(points: Sequence[acb]) -> list[int]:
    """How many equal ones stand directly before each point."""
    orders: list[int] = []
    for k, s in enumerate(points):
        orders.append(orders[-1] + 1 if k and s == points[k - 1] else 0)
    return orders


def pick_matrix(points: Sequence[acb], values: Sequence[acb]) -> list[list[acb]]:
    """Pick's matrix, shape (n, n), of points and values (n,), see :class:`Problem`."""
    conditions = list(zip(points, values, orders_of(points), strict=True))
    rows: list[list[acb]] = []  # up to the diagonal: the matrix is Hermitian
    for k, (s, e, order) in enumerate(conditions):
        row: list[acb] = []
        for t, f, other in conditions[: k + 1]:
            entry = (0 if order or other else 1) - e * f.conjugate()
            if order:
                entry -= rows[k - 1][len(row)] if len(row) < k else row[-1].conjugate()
            if other:
                entry -= row[-1]
            row.append(entry / (s + t.conjugate()))
        rows.append(row)
    return [row + [below[k].conjugate() for below in rows[k + 1 :]] for k, row in enumerate(rows)]
