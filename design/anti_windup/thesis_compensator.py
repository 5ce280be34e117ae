"""The printed theta1~ (2.23) of least f: by the thesis's own procedure, and by a search over alpha, beta and gamma."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.optimize import minimize, minimize_scalar

from design.anti_windup.compensator import second_order, uncertainty_cost
from design.blocks.block import bound_block
from design.blocks.frequency_peak import frequency_grid, searched_norm
from identification.model.additive_bound import AdditiveBound

MOST = 50  # parabolas; some five are enough
EXCHANGED = 1e-9  # by which the square of the least f exceeds its lower bound, relative


def optimal_gamma(bound: AdditiveBound, alpha: float, beta: float) -> tuple[float, float]:
    """The gamma that minimises f(gamma) for given alpha and beta, to about 1e-8, and f there.

    f is convex in gamma, being the largest of |W_a + gamma W_a h| over omega, so that a local minimum is the minimum;
    gamma > -1 keeps the zeros of 1 + theta1~ in the open left half plane. The search takes norms from a refined grid;
    the f that is returned is proved as :func:`design.anti_windup.compensator.uncertainty_cost` says.
    """
    W_a = bound_block(bound)

    def cost(gamma: float) -> float:
        return searched_norm(W_a * second_order(alpha, beta, gamma).one_plus)[0]

    gamma, _ = _minimise(cost, _first_gamma(bound, alpha, beta), 1e-8)
    return gamma, uncertainty_cost(bound, second_order(alpha, beta, gamma).one_plus)[0]


def _first_gamma(bound: AdditiveBound, alpha: float, beta: float) -> float:
    """Four times the gamma that puts the zeros of 1 + theta1~ at W_a's resonance: where to look first."""
    return 4 * (1 + bound.resonance.omega**2 * alpha * beta)


def _minimise(cost: Callable[[float], float], upper: float, tolerance: float) -> tuple[float, float]:
    """The gamma > -1 that minimises a convex cost, and the minimum; ``upper`` grows until the minimum is inside."""
    while True:
        found = minimize_scalar(cost, bounds=(-1.0, upper), method="bounded", options={"xatol": tolerance * upper})
        if found.x < 0.9 * upper:
            return float(found.x), float(found.fun)
        upper *= 4


def _exchanged(highest: Callable[[float], tuple[complex, complex]], gamma: float) -> tuple[float, float]:
    """The gamma >= -1 of the least largest |w + gamma v| over omega, and that; ``highest`` gives w and v where it lies.

    Each |w + gamma v|^2 is a parabola in gamma, below which no largest one falls. Where the highest of those known is
    lowest the next is asked for, until it is no higher or there are :data:`MOST`; ``gamma`` is the first.
    """
    squares, best, least = np.empty((0, 3)), gamma, np.inf
    for _ in range(MOST):
        w, v = highest(gamma)
        if abs(w + gamma * v) < least:
            best, least = gamma, abs(w + gamma * v)
        squares = np.vstack([squares, [abs(v) ** 2, 2 * (w * v.conjugate()).real, abs(w) ** 2]])
        gamma, below = _lowest(squares)
        if least**2 <= below * (1 + EXCHANGED):
            break
    return best, least


def _lowest(squares: np.ndarray) -> tuple[float, float]:
    """Where, at -1 or above, the highest of parabolas is lowest, and how high it is; coefficients of shape (n, 3)."""
    i, j = np.triu_indices(len(squares), 1)
    slopes = np.column_stack([np.zeros(len(squares)), 2 * squares[:, 0], squares[:, 1]])
    a, b, c = np.vstack([squares[i] - squares[j], slopes]).T
    with np.errstate(divide="ignore", invalid="ignore"):
        q = -(b + np.copysign(np.sqrt(b**2 - 4 * a * c), b)) / 2
        roots = np.concatenate([[-1.0], q / a, c / q])
    gammas = roots[np.isfinite(roots) & (roots >= -1)]
    heights = (squares[:, :1] * gammas**2 + squares[:, 1:2] * gammas + squares[:, 2:]).max(axis=0)
    k = int(np.argmin(heights))
    return float(gammas[k]), float(heights[k])


def thesis_choice(bound: AdditiveBound) -> tuple[float, float, float]:
    """alpha, beta, gamma by the thesis's own procedure (section 2.4).

    alpha = 1/corner removes the zero of W_a; beta is the best of 2 alpha, alpha, alpha/2, alpha/4 (printed:
    1/10 ... 1/80, a coarse grid); gamma minimises f.
    """
    alpha = 1 / bound.corner
    candidates = [(optimal_gamma(bound, alpha, beta), beta) for beta in beta_grid(alpha)]
    (gamma, _), beta = min(candidates, key=lambda candidate: candidate[0][1])
    return alpha, beta, gamma


def beta_grid(alpha: float) -> tuple[float, ...]:
    """The values of beta that our Fig. 2.10 compares, as multiples of alpha; the thesis does not name its own."""
    return 2 * alpha, alpha, alpha / 2, alpha / 4


def least_f(bound: AdditiveBound, bandwidth: float) -> tuple[float, float, float, float]:
    """The least f found of (2.23) over alpha, beta and gamma together, no pole of theta1~ beyond a bandwidth.

    Parameters
    ----------
    bound
        W_a.
    bandwidth
        In rad/s; alpha and beta are at least 1/bandwidth.

    Returns
    -------
    alpha, beta, gamma, f
        alpha >= beta, in seconds.

    Notes
    -----
    Without a bandwidth there is no optimum where W_a is strictly proper: with alpha, beta -> 0 and gamma -> -1 theta1~
    tends to -1 at every frequency where W_a is not small, and f to 0.

    For given alpha and beta f is convex in gamma, see :func:`optimal_gamma`. Over the two time constants it is
    not, so that a grid from 1/bandwidth to a hundred times the period of W_a's resonance gives the starts. f is
    minimised from the two best on fixed frequencies, and from what that gives on all. That no other alpha and beta are
    better is not proved; f belongs to the three numbers that are returned, as
    :func:`design.anti_windup.compensator.uncertainty_cost` says.
    """
    W_a = bound_block(bound)
    omega = frequency_grid(W_a.zeros + W_a.poles, per_decade=30)
    s, values = 1j * omega, W_a(1j * omega)
    ends = 1 / bandwidth, max(100 / bound.resonance.omega, 100 / bandwidth)

    def on_grid(alpha: float, beta: float) -> float:
        slopes = values / ((1 + alpha * s) * (1 + beta * s))

        def highest(gamma: float) -> tuple[complex, complex]:
            k = int(np.argmax(np.abs(values + gamma * slopes)))
            return complex(values[k]), complex(slopes[k])

        return _exchanged(highest, _first_gamma(bound, alpha, beta) / 4)[1]

    def rough(logarithms: np.ndarray) -> float:
        alpha, beta = np.exp(logarithms)
        return on_grid(float(alpha), float(beta))

    def located(alpha: float, beta: float) -> tuple[float, float]:
        def highest(gamma: float) -> tuple[complex, complex]:
            _, at = searched_norm(W_a * second_order(alpha, beta, gamma).one_plus)
            if not np.isfinite(at):
                return complex(W_a.gain), 0j
            value = complex(W_a(1j * at))
            return value, value / ((1 + 1j * alpha * at) * (1 + 1j * beta * at))

        return _exchanged(highest, _first_gamma(bound, alpha, beta) / 4)

    def polish(cost: Callable[[np.ndarray], float], start: np.ndarray, size: float, most: int) -> np.ndarray:
        limits = [(float(np.log(ends[0])), float(np.log(ends[1])))] * 2
        simplex = np.clip(start + size * np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]), *limits[0])

        def logarithm(logarithms: np.ndarray) -> float:  # the unit of W_a does not count
            return float(np.log(cost(logarithms)))

        found = minimize(
            logarithm,
            start,
            method="Nelder-Mead",
            bounds=limits,
            options={"maxfev": most, "initial_simplex": simplex, "xatol": 1e-7, "fatol": 1e-10},
        )
        return np.asarray(found.x)

    constants = np.geomspace(*ends, 16)
    starts = sorted((on_grid(alpha, beta), alpha, beta) for alpha in constants for beta in constants if beta <= alpha)
    found = [polish(rough, np.log(start[1:]), -0.1, 200) for start in starts[:2]]
    best = polish(lambda logarithms: located(*np.exp(logarithms))[1], min(found, key=rough), -0.002, 100)
    beta, alpha = sorted(float(constant) for constant in np.exp(best))
    gamma, _ = located(alpha, beta)
    return alpha, beta, gamma, uncertainty_cost(bound, second_order(alpha, beta, gamma).one_plus)[0]
