"""The least largest excess of |W_a| of order n over an envelope: nearly reached, and bounded from below with proof."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import linprog

from identification.base.arrays import Complex, Real
from identification.bound.level_certificate import excludes

STEP = 1e-3  # share by which each linear program lowers the largest excess, or shows that nothing can
LONGER = 3.0  # times the step before, where rounding kept a program from doing either
PROGRAMS = 100
TOLERANCE = 1e-9  # of the linear programs, whose rows are of order 1
REFINEMENTS = 3
KEPT = 1e-3  # share of the polynomials before, so that the new ones stay positive in spite of TOLERANCE
FAINT = 0.01  # share of the envelope below which a residual asks for nothing here
SMALLEST = 1e-6  # a D below this share of its neighbourhood's, or |W_a|^2 of its limit, sets no scale for its row
NEIGHBOURS = 41  # points in a neighbourhood
FAR = np.append(np.geomspace(2.0, 1e3, 10), np.inf)  # times the outermost frequencies: not negative there either
EPS = np.finfo(float).eps


@dataclass(frozen=True)
class LeastExcess:
    """The magnitude found, |W_a|^2 = N(omega^2)/D(omega^2), and what is proved.

    Parameters
    ----------
    zeros, poles
        (n - 1,) and (n,) roots of N and D in omega^2, (rad/s)^2, as they come out: on the axis, or far outside.
    proved
        No W_a of this order that covers the residuals has a smaller largest excess at these frequencies, all roundings
        included; 0 says nothing.
    """

    zeros: Complex
    poles: Complex
    proved: float


def least_largest_excess(
    omega: Real, residual: Real, envelope: Real, order: int, programs: int = PROGRAMS
) -> LeastExcess:
    """Among all W_a of an order with |W_a| >= residual, one whose largest ratio to the envelope is nearly the least.

    Parameters
    ----------
    omega
        (K,) rad/s, increasing.
    residual, envelope
        (K,) in one unit. The envelope is positive and at least the residual; a residual of 0 asks for nothing.
    order
        n, the number of poles; there are n - 1 zeros.
    programs
        Most linear programs that are solved; each order takes some four for a proof.

    Notes
    -----
    In x = omega^2 every |W_a|^2 is a ratio N/D of two polynomials that are positive for x > 0, and every such ratio
    is the |W_a|^2 of one stable minimum-phase W_a (spectral factorisation). N >= residual^2 D and
    N <= t^2 envelope^2 D are linear in the coefficients for a given t: the problem is quasi-convex, without local
    minima, and needs no choice of starts. Each step is one of the differential correction algorithm (Barrodale,
    Powell and Roberts, SIAM J. Numer. Anal. 9, 1972) with a t lower by STEP than the one reached: the least u with
    N/envelope^2 - t^2 D <= u D_before. When u > 0 no W_a reaches t, as the program's multipliers prove
    (:func:`identification.bound.level_certificate.excludes`); otherwise the new N/D comes nearer to it.

    That N and D are positive is asked at the points and at FAR frequencies only. This admits more than the W_a: the
    roots may lie on the axis. Polynomials are in y = (x - x0)/(x + x0), which maps
    0 to infinity onto -1 to 1; N has the factor 1 - y, which makes it one degree smaller.
    """
    half = float(np.sqrt(omega[-1] / omega[0]))  # of the band, from its centre; in ratios no unit is rounded
    centre = omega[0] * half
    y = _mapped(omega / centre)
    far = _mapped(np.concatenate([1 / half / FAR, half * FAR]))
    seen = residual > FAINT * envelope
    largest = envelope.max()
    asked, allowed = (np.where(seen, residual, 0.0) / largest) ** 2, (envelope / largest) ** 2
    powers = (1 + (omega / centre) ** 2) ** order  # from N and D in y to those in omega^2

    def covering(top: Real, bottom: Real) -> tuple[Real, float]:
        """N scaled so that it just covers, and the largest square of the excess."""
        top = top * np.max(asked[seen] * bottom[seen] / top[seen])
        return top, float(np.max(top / bottom / allowed))

    zeros, poles = np.full(order - 1, -(centre**2) + 0j), np.full(order, -(centre**2) + 0j)
    bottom = np.ones(y.size)
    top, reached = covering(1 - y, bottom)
    step, proved = STEP, float(np.any(residual >= envelope))
    for _ in range(programs):
        target = reached / (1 + step) ** 2
        if target <= 1:
            break
        nearby = _largest_nearby(bottom)
        before = np.maximum(bottom, SMALLEST * nearby)
        most = target * allowed * before
        least = np.where(seen, top, most)
        over = _Orthonormal(y, (1 - y) / most, (y - 1) / least, far, order - 1)
        under = _Orthonormal(y, -1 / before, asked / least, far, order)
        weight = before / nearby / y.size
        u, a, d, lower, upper = _program(over, under, weight)
        # half of u is spent on upper so that rounding leaves no N without a positive sum
        lower, upper = lower / least / powers, (upper + u / 2 * weight) / most / powers
        ratio = float(np.sqrt(target))
        if u > 0 and excludes(omega, np.where(seen, residual, 0.0), ratio * envelope, lower, upper, order):
            proved = ratio * (1 - 4 * EPS)
            break
        a = (1 - KEPT) * a + KEPT * np.append(top / most, -top / least) @ over.rows
        d = (1 - KEPT) * d + KEPT * np.append(-bottom / before, asked * bottom / least) @ under.rows
        new_top, new_bottom = over.limits @ a * most, -under.limits @ d * before
        if np.isfinite(u) and new_bottom.min() > 0 and new_top[seen].min() > 0:
            new_top, excess = covering(new_top, new_bottom)
            if excess < reached:
                zeros, poles = (centre**2 * basis.roots(c) for basis, c in ((over, a), (under, d)))
                top, bottom, reached, step = new_top, new_bottom, excess, STEP
                continue
        step *= LONGER
    return LeastExcess(zeros, poles, proved)


class _Orthonormal:
    """Polynomials in y of degree 0, 1, ..., orthonormal over weighted points, and their values elsewhere.

    By Arnoldi's process (Brubeck, Nakatsukasa and Trefethen, SIAM Rev. 63, 2021), which stays accurate however much
    the weights differ.

    Parameters
    ----------
    y
        (K,) points, each of which counts twice.
    upper, lower
        (K,) weights of the rows that limit |W_a| from above and from below.
    far
        (F,) other points.
    degree
        The highest.
    """

    def __init__(self, y: Real, upper: Real, lower: Real, far: Real, degree: int) -> None:
        y, weight = np.append(y, y), np.append(upper, lower)
        size = np.linalg.norm(weight)
        self.rows, self.far = (np.column_stack([start / size]) for start in (weight, np.ones(far.size)))
        self.recurrence = np.zeros((degree + 1, degree))
        for k in range(degree):
            here, there = y * self.rows[:, k], far * self.far[:, k]
            for _ in range(2):
                part = here @ self.rows
                here, there = here - self.rows @ part, there - self.far @ part
                self.recurrence[: k + 1, k] += part
            size = self.recurrence[k + 1, k] = np.linalg.norm(here)
            self.rows, self.far = np.column_stack([self.rows, here / size]), np.column_stack([self.far, there / size])

    @property
    def limits(self) -> Real:
        """(K, degree + 1) the rows weighted by ``upper``."""
        return self.rows[: len(self.rows) // 2]

    def roots(self, coefficients: Real) -> Complex:
        """(degree,) roots in x/x0 of the polynomial with these coefficients (degree + 1,)."""
        matrix = self.recurrence[:-1].copy()
        if matrix.size:
            leading = max(abs(coefficients[-1]), EPS * np.abs(coefficients).max()) * np.sign(coefficients[-1] or 1)
            matrix[:, -1] -= self.recurrence[-1, -1] / leading * coefficients[:-1]
        y = np.linalg.eigvals(matrix).astype(complex)
        return np.asarray((1 + y) / np.where(y == 1, EPS, 1 - y), dtype=complex)


def _program(over: _Orthonormal, under: _Orthonormal, weight: Real) -> tuple[float, Real, Real, Real, Real]:
    """The least u, the coefficients of N and D that reach it, D of weighted sum 1, and the rows' multipliers.

    The multipliers are those from below, then those from above. All is NaN where the solver gives up.
    """
    rows, n = over.rows.shape
    matrix = np.zeros((rows + 2 * len(over.far), 2 * n + 2))
    matrix[:rows, :n], matrix[:rows, n:-1] = over.rows, under.rows
    matrix[: rows // 2, -1] = -1
    matrix[rows : rows + len(over.far), :n] = -over.far / np.abs(over.far).max(axis=1, keepdims=True)
    matrix[rows + len(over.far) :, n:-1] = -under.far / np.abs(under.far).max(axis=1, keepdims=True)
    one = np.append(np.zeros(n), -weight @ under.limits)
    found = linprog(
        np.eye(2 * n + 2)[-1],
        A_ub=matrix,
        b_ub=np.zeros(len(matrix)),
        A_eq=np.append(one, 0.0)[None],
        b_eq=[1.0],
        bounds=(None, None),
        method="highs-ds",
        options={"primal_feasibility_tolerance": TOLERANCE, "dual_feasibility_tolerance": TOLERANCE},
    )
    if found.status != 0:
        unknown = np.full(rows, np.nan)
        return np.nan, unknown[:n], unknown[: n + 1], unknown[: rows // 2], unknown[: rows // 2]
    x, multipliers = np.asarray(found.x), np.maximum(-np.asarray(found.ineqlin.marginals), 0.0)
    for _ in range(REFINEMENTS):  # of sum multipliers row = u one, which the solver meets to TOLERANCE only
        shares = (matrix[:, :-1] * multipliers[:, None]).T
        change = np.linalg.lstsq(shares, x[-1] * one - shares.sum(axis=1))[0]
        multipliers *= np.maximum(1 + change, 0.0)
    return float(x[-1]), x[:n], x[n:-1], multipliers[rows // 2 : rows], multipliers[: rows // 2]


def _largest_nearby(values: Real) -> Real:
    """The largest of each of (K,) positive values and its NEIGHBOURS."""
    around = np.lib.stride_tricks.sliding_window_view(np.pad(values, NEIGHBOURS // 2), NEIGHBOURS)
    return np.asarray(around.max(axis=1))


def _mapped(relative: Real) -> Real:
    """y from omega/sqrt(x0); infinity goes to 1."""
    return 1 - 2 / (1 + relative**2)
