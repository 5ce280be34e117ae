"""An envelope -> a W_a of order n that covers residuals with nearly the least largest excess and then little mean."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from scipy.optimize import Bounds, minimize

from identification.base.arrays import Flags, Real, Whole
from identification.bound.least_excess import least_largest_excess
from identification.bound.shape import NEARBY, OUTSIDE, Shape
from identification.model.additive_bound import AdditiveBound
from identification.model.plant import PlantModel

ALLOWANCE = 0.05  # share of the least largest excess that is given away for a smaller mean
BINS = 200  # equal in log frequency, each with one point to begin with and one more a round where it is needed
DISTANCE = float(np.log1p(ALLOWANCE) / np.log(OUTSIDE / NEARBY) ** 2)  # a root at OUTSIDE costs ALLOWANCE of the mean
ROUNDS = 12
BITS = 24  # of what is fitted
TIGHT = 1e-3  # share by which W_a may miss a residual or exceed the largest excess in between
ANGLES = 128  # equal ones on the circle that a mode draws in the complex plane, whose own peak they miss by 0.01 %
PROGRAMS = 40  # linear ones for a start
ITERATIONS = 100
PRECISION = 1e-7  # in the logarithm of the excess

Band = tuple[float, float]
"""Its edges in rad/s."""


@dataclass(frozen=True)
class Points:
    """Where W_a is fitted.

    Parameters
    ----------
    omega
        (K,) rad/s, increasing.
    residual
        (K,) of tests, and levels given, that |W_a| has to cover, output unit per input unit; 0 asks for nothing.
    least
        (K,) that |W_a| is to reach besides: the residual, or more where nothing was measured between two lines.
    envelope
        (K,) over which the excess counts, positive and at least the others.
    """

    omega: Real
    residual: Real
    least: Real
    envelope: Real

    def of(self, index: Whole | Flags) -> Points:
        """Some of the points."""
        return Points(*(getattr(self, each.name)[index] for each in fields(self)))

    def joined(self, other: Points) -> Points:
        """Both, in increasing frequency."""
        _, first = np.unique(np.concatenate([self.omega, other.omega]), return_index=True)
        names = [each.name for each in fields(self)]
        return Points(*(np.concatenate([getattr(self, name), getattr(other, name)])[first] for name in names))


def tightest(
    seen: Points, probe: Callable[[AdditiveBound], Points], band: Band, order: int
) -> tuple[AdditiveBound, float]:
    """The W_a of :func:`fit_bound` for more points than that could take at once, and a proved limit to tightness.

    Parameters
    ----------
    seen
        All that has to be covered.
    probe
        What else has to be covered where a bound has its own peaks and notches.
    band
        Both edges are among the frequencies seen. Of what lies outside all is fitted from the start.
    order
        n, the number of poles.

    Returns
    -------
    AdditiveBound, float
        The bound, which may miss residuals by TIGHT (or more after ROUNDS), and the ratio to the envelope below which
        the largest of no W_a of this order is.

    Notes
    -----
    Exchange as in Remez's algorithm: fit the largest residual of each bin, add the worst point of each bin where the
    bound misses a residual or exceeds the largest excess of the points fitted, and fit again. What is proved for
    fewer points holds for all.
    """
    first = _largest(seen.omega, seen.residual, band)
    chosen = seen.of(np.union1d(first, np.flatnonzero((seen.omega <= band[0]) | (seen.omega >= band[1]))))
    for _ in range(ROUNDS):
        bound = fit_bound(chosen, band, order)
        every = seen.joined(probe(bound))
        magnitude, fitted = np.abs(bound(1j * every.omega)), np.abs(bound(1j * chosen.omega))
        worst = np.maximum(every.least / magnitude, magnitude / every.envelope / np.max(fitted / chosen.envelope))
        missing = _largest(every.omega, worst, band)
        missing = missing[worst[missing] > 1 + TIGHT]
        if not missing.size:
            break
        chosen = chosen.joined(every.of(missing))
    asked = chosen.of((chosen.residual > 0) | within(chosen.omega, band))
    return bound, least_largest_excess(asked.omega, asked.residual, asked.envelope, order).proved


def fit_bound(points: Points, band: Band, order: int) -> AdditiveBound:
    """A W_a of an order that covers the points tightly, with the least gain that does.

    Parameters
    ----------
    points
        The residuals and their envelope.
    band
        Where the mean counts; both edges are among the points.
    order
        n, the number of poles; there are n - 1 zeros.

    Notes
    -----
    All is computed over the highest frequency of the band and the largest residual, and to BITS, so that units do not
    matter: in others the same numbers are fitted, but for what rounding has moved across a half of the last bit.

    :func:`identification.bound.least_excess.least_largest_excess` comes near the least largest excess there is and
    gives its roots. From these, moved to where poles and zeros may be, two searches in the logarithms of gain,
    frequencies and dampings (sequential quadratic programming, which finds local minima): for the least largest excess
    again, now of an admissible W_a, then for the least mean over log frequency of the log excess within ALLOWANCE of
    it. One frequency may decide the largest excess, such as a deep notch of the envelope, and leave the rest of W_a
    free: on six tests of one plant and for order 2, the bound of least largest excess has a needle of zeta = 0.007
    beside the residuals' peak, and 5 % above that the mean no longer gains (zeta = 0.028).
    """
    unit, size = band[1], float(points.least.max())
    omega, least, envelope = (_rounded(of) for of in (points.omega / unit, points.least / size, points.envelope / size))
    ideal = least_largest_excess(omega, least, envelope, order, PROGRAMS)
    shape = Shape(order, float(_rounded(np.array([band[0] / unit]))[0]), 1.0)
    inside, weight = within(points.omega, band), np.zeros(omega.size)
    weight[inside] = shares(np.log(omega[inside]))
    log_envelope, seen = np.log(envelope), least > 0
    log_least = np.log(least[seen])

    def covering(theta: Real) -> tuple[Real, float]:
        """Parameters within their bounds whose gain just covers, and their largest log excess."""
        theta = shape.damped(theta)
        theta[0] += np.max(log_least - shape.log(theta, omega)[seen])
        return theta, float(np.max(shape.log(theta, omega) - log_envelope))

    def mean(theta: Real) -> float:
        return float(weight @ (shape.log(theta, omega) - log_envelope)) + DISTANCE * shape.distance(theta)[0]

    def slack(theta: Real, largest: float) -> Real:
        log = shape.log(theta, omega)
        return np.concatenate([log[seen] - log_least, largest + log_envelope - log, shape.damping(theta)[0]])

    def slack_slope(theta: Real) -> Real:
        slope = shape.slope(theta, omega)
        return np.vstack([slope[seen], -slope, shape.damping(theta)[1]])

    theta, largest = covering(shape.parameters(ideal.zeros, ideal.poles))
    relaxes = np.concatenate([np.zeros(seen.sum()), np.ones(omega.size), np.zeros(shape.damping(theta)[0].size)])
    found = _search(
        lambda p: float(p[-1]),
        lambda p: np.eye(p.size)[-1],
        np.append(theta, largest),
        np.vstack([shape.bounds, [-np.inf, np.inf]]),
        lambda p: slack(p[:-1], p[-1]),
        lambda p: np.column_stack([slack_slope(p[:-1]), relaxes]),
    )
    theta, largest = min((theta, largest), covering(found[:-1]), key=lambda pair: pair[1])
    limit = largest + np.log1p(ALLOWANCE)
    flatter, its_largest = covering(
        _search(
            mean,
            lambda p: weight @ shape.slope(p, omega) + DISTANCE * shape.distance(p)[1],
            theta,
            shape.bounds,
            lambda p: slack(p, limit),
            slack_slope,
        )
    )
    if its_largest <= limit + TIGHT and mean(flatter) < mean(theta):
        theta = flatter
    return shape.bound(theta, unit, size)


def within(omega: Real, band: Band) -> Flags:
    """Whether each frequency (M,) lies in the band."""
    return np.asarray((omega >= band[0]) & (omega <= band[1]))


def shares(x: Real) -> Real:
    """(K,) weights of the mean over increasing ``x`` (K,) of what is linear between its values."""
    half = np.diff(x) / 2 / (x[-1] - x[0])
    return np.asarray(np.append(half, 0.0) + np.append(0.0, half))


def resonances(*models: PlantModel | AdditiveBound) -> Real:
    """Frequencies (M,) in rad/s about each mode, at equal angles of 1 + j (omega/omega_0 - omega_0/omega)/(2 zeta)."""
    angles = (np.arange(ANGLES) + 0.5) / ANGLES * np.pi - np.pi / 2
    modes = [mode for model in models for mode in (*model.zero_modes, *model.pole_modes)]
    return np.concatenate(
        [np.empty(0), *(mode.omega * np.exp(np.arcsinh(mode.zeta * np.tan(angles))) for mode in modes)]
    )


def _largest(omega: Real, values: Real, band: Band) -> Whole:
    """Where the largest value of each bin is, and of what is below and above; those that hold nothing are left out."""
    bins = np.linspace(0.0, np.log(band[1] / band[0]), BINS + 1)[1:-1]
    where = np.searchsorted(bins, np.log(omega / band[0]), side="right")
    where[omega < band[0]], where[omega > band[1]] = -1, BINS
    order = np.lexsort((values, where))
    return np.asarray(order[np.append(np.diff(where[order]) > 0, True)])


def _rounded(values: Real) -> Real:
    mantissa, exponent = np.frexp(values)
    return np.asarray(np.ldexp(np.round(np.ldexp(mantissa, BITS)), exponent - BITS))


def _search(
    cost: Callable[[Real], float],
    cost_slope: Callable[[Real], Real],
    start: Real,
    bounds: Real,
    slack: Callable[[Real], Real],
    slack_slope: Callable[[Real], Real],
) -> Real:
    """A local minimum of the cost where no slack is negative, both nearly."""
    constraint: Any = {"type": "ineq", "fun": slack, "jac": slack_slope}
    found = minimize(
        cost,
        start,
        jac=cost_slope,
        bounds=Bounds(*bounds.T),
        constraints=constraint,
        method="SLSQP",
        options={"maxiter": ITERATIONS, "ftol": PRECISION},
    )
    return np.asarray(found.x)
