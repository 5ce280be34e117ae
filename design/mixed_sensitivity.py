"""The H-infinity mixed sensitivity problem (2.8): two Riccati equations, bisection, the norm recomputed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from design.block import Block, geometric_scale
from design.closed_loop import closed_loop_norm, closed_loop_poles
from design.factorisation import balance, to_block, without
from design.frequency import peak
from design.realization import realize
from design.riccati import Controller, GeneralisedPlant, Obstacle, SynthesisError, central_controller, normalise
from identification.files import InputError

SUBOPTIMALITY = 0.01  # the controller is the central one this far above the least feasible gamma
TOLERANCE = 1e-4  # of the bisection, relative
TIGHT = 0.01  # the infimum is known when lower and upper are this near, relative


@dataclass(frozen=True)
class Synthesis:
    """A stabilising controller with a prescribed decay rate, and what can be said about the optimum.

    Parameters
    ----------
    K
        Controller, u = K (r - y), strictly proper when W1 is.
    gamma_lower
        No stabilising controller reaches a smaller norm (2.8), whatever its decay rate.
    reason
        Why: the test that fails at ``gamma_lower``, with its margin.
    gamma
        The norm (2.8) that ``K`` reaches, recomputed from the closed loop's frequency response.
    decay_rate
        In 1/s; every closed-loop pole lies left of -decay_rate.
    gamma_line_lower, line_reason, gamma_line
        The same three on the line Re s = -decay_rate, where ``K`` is optimal within 1 %.
    closed_loop_poles
        In rad/s.
    """

    K: Block
    gamma_lower: float
    reason: str
    gamma: float
    decay_rate: float
    gamma_line_lower: float
    line_reason: str
    gamma_line: float
    closed_loop_poles: tuple[complex, ...]


@dataclass(frozen=True)
class Infimum:
    """An interval that holds the infimum of (2.8) over all stabilising controllers.

    Parameters
    ----------
    lower, reason
        No stabilising controller reaches a smaller norm, and the test that fails there.
    upper
        The norm of a controller that stabilises, recomputed from the closed loop's frequency response.
    decay_rate
        In 1/s, down to which the synthesis was driven; 0 when G has no poles on the axis.
    """

    lower: float
    reason: str
    upper: float
    decay_rate: float


def mixed_sensitivity(G: Block, W1: Block, W2: Block, decay_rate: float) -> Synthesis:
    """Minimise || [W1 S; W2 T] ||_inf over the controllers that stabilise G with a decay rate, Thesis Eq. (2.8).

    Parameters
    ----------
    G
        Proper plant without dead time; poles on the imaginary axis are allowed with a positive decay rate.
    W1
        Performance weight, proper, its poles left of -decay_rate.
    W2
        Robustness weight such that W2 G is biproper and, apart from the poles of G, has its poles left of
        -decay_rate. W2 itself may be improper.
    decay_rate
        In 1/s, not negative. With 0 it is (2.8) itself that is solved, and the two bounds on it are those on the
        line.

    Raises
    ------
    InputError
        A weight is zero, of the wrong degree, or its poles lie too far to the right; or G has a pole on the line
        Re s = -decay_rate.
    SynthesisError
        No controller was found, or its recomputed norm contradicts the Riccati solution by more than 1 %, or
        rounding leaves the optimum uncertain by more than that.

    Notes
    -----
    The infimum of (2.8) is no design when G has poles on the axis, as the internal model puts them there: it is
    approached by controllers that cancel those poles, the closed loop's slowest pole going to the axis with
    them. So the norm is minimised over the larger half plane Re s > -decay_rate, which is (2.8) for
    G(s - decay_rate) and the weights moved likewise. No pole is left on the axis, the rank conditions of the
    two-Riccati solution hold, and nothing has to be regularised. Moving the axis the other way gives the
    problem in Re s > +delta, whose optimum is a lower bound for (2.8), because a function that is analytic and
    bounded by gamma in a half plane is so in every smaller one. Where G has no poles on the axis delta is 0.
    """
    return _synthesise(G, W1, W2, decay_rate, SUBOPTIMALITY)


def infimum(G: Block, W1: Block, W2: Block, decay_rate: float) -> Infimum:
    """Bracket the infimum of (2.8) by driving the decay rate down from the given one, the weights as they are.

    Parameters
    ----------
    G, W1, W2, decay_rate
        As for :func:`mixed_sensitivity`; the decay rate in 1/s is halved until the bounds agree to 1 %.

    Returns
    -------
    Infimum
        Wider than 1 % when rounding stops the synthesis first; ``decay_rate`` then says how far it got.

    Raises
    ------
    InputError, SynthesisError
        As :func:`mixed_sensitivity`, for the given decay rate.
    """
    if not _on_line(G, 0.0):
        exact = _synthesise(G, W1, W2, 0.0, SUBOPTIMALITY / 10)
        return Infimum(exact.gamma_lower, exact.reason, exact.gamma, 0.0)
    found = _synthesise(G, W1, W2, decay_rate, SUBOPTIMALITY / 10)
    best = Infimum(found.gamma_lower, found.reason, found.gamma, decay_rate)
    while best.upper > (1 + TIGHT) * best.lower:
        decay_rate /= 2
        try:
            found = _synthesise(G, W1, W2, decay_rate, SUBOPTIMALITY / 10)
        except SynthesisError:
            break
        lower, reason = max((best.lower, best.reason), (found.gamma_lower, found.reason))
        best = Infimum(lower, reason, min(best.upper, found.gamma), decay_rate)
    return best


def _synthesise(G: Block, W1: Block, W2: Block, decay_rate: float, suboptimality: float) -> Synthesis:
    _check(G, W1, W2, decay_rate)
    moved = G.shifted(-decay_rate), W1.shifted(-decay_rate), W2.shifted(-decay_rate)
    plant, q = generalised_plant(*moved)
    line_bound, feasible = _bisect(plant)
    claimed = feasible * (1 + suboptimality)
    controller = central_controller(plant, claimed)
    if not isinstance(controller, Controller):
        raise SynthesisError("the feasibility of the mixed sensitivity problem is not monotonic in gamma")
    K = without(to_block(controller.A, controller.B, controller.C, controller.D, q), moved[1].poles)
    line = closed_loop_norm(*moved, K)
    K = K.shifted(decay_rate)
    poles = closed_loop_poles(G, K)
    if not 0.99 * line_bound.gamma <= line <= 1.01 * claimed:
        raise SynthesisError(
            f"the synthesised controller reaches {line:.6g} where the Riccati equations claim {claimed:.6g}"
        )
    if feasible > 1.01 * line_bound.gamma:
        raise SynthesisError(
            f"the optimum lies between {line_bound.gamma:.6g} and {feasible:.6g}, and rounding hides where"
        )
    slowest = max(pole.real for pole in poles)
    if slowest >= -decay_rate * (1 - 1e-3):
        raise SynthesisError(f"a closed-loop pole lies at Re s = {slowest:.6g}, right of {0 - decay_rate:.6g}")
    if decay_rate == 0:
        bound, norm = line_bound, line
    else:
        delta = 0.01 * decay_rate if _on_line(G, 0.0) else 0.0
        bound, _ = _bisect(generalised_plant(*(block.shifted(delta) for block in (G, W1, W2)))[0])
        for pole in _on_line(G, 0.0):  # there every stabilising controller makes T = 1
            cost = float(np.abs(W2(pole)))
            if cost > bound.gamma:
                bound = Obstacle(cost, f"T = 1 at the pole {pole:.4g} of G costs {cost:.6g}")
        norm = closed_loop_norm(G, W1, W2, K)
    return Synthesis(K, bound.gamma, bound.reason, norm, decay_rate, line_bound.gamma, line_bound.reason, line, poles)


def _check(G: Block, W1: Block, W2: Block, decay_rate: float) -> None:
    if not (np.isfinite(decay_rate) and decay_rate >= 0):
        raise InputError(f"the decay rate is {decay_rate:g}; expected a number of 1/s that is not negative")
    if G.delay_s or G.relative_degree < 0:
        raise InputError("the mixed sensitivity problem needs a proper plant without dead time")
    if W1.relative_degree < 0 or (W2 * G).relative_degree != 0:
        raise InputError("the mixed sensitivity problem needs a proper W1 and a biproper W2 G")
    if 0 in (G.gain, W1.gain, W2.gain) or not G.poles + W1.poles:
        raise InputError("the mixed sensitivity problem needs dynamics in G or W1, and neither these nor W2 zero")
    if _on_line(G, decay_rate):
        raise InputError(
            f"G has a pole on the line Re s = {0 - decay_rate:g}, on which the norm would be taken; "
            "expected a decay rate that keeps clear of it"
        )
    own = [pole for pole in W1.poles + (W2 * G).poles if pole not in G.poles]
    if own and max(pole.real for pole in own) >= -decay_rate:
        raise InputError(
            f"a weight has a pole at Re s = {max(pole.real for pole in own):g}; "
            f"expected all of them left of {0 - decay_rate:g}, minus the decay rate asked for"
        )


def _on_line(G: Block, decay_rate: float) -> list[complex]:
    """The poles of G that to rounding have the real part -decay_rate."""
    return [pole for pole in G.poles if abs(pole.real + decay_rate) <= 1e-9 * abs(pole)]


def generalised_plant(G: Block, W1: Block, W2: Block) -> tuple[GeneralisedPlant, float]:
    """The map from (r, u) to (W1 e, W2 y, e), e = r - y, in state space, and its unit of frequency in rad/s.

    Parameters
    ----------
    G, W1, W2
        As for :func:`mixed_sensitivity`, moved so that the norm is taken on the imaginary axis.

    Returns
    -------
    plant, q
        Time in ``plant`` is in units of 1/q.

    Raises
    ------
    InputError
        G, W1 or W2 G is improper.
    SynthesisError
        The poles of G lie too near the axis or each other.
    """
    q = geometric_scale(G, W1, W2 * G)
    g, w = realize(G, W2 * G), realize(W1)
    n, m = len(g.b), len(w.b)
    Cg, Dg = g.C[0], g.d[0]
    A = np.block([[g.A, np.zeros((n, m))], [-np.outer(w.b, Cg), w.A]])
    D12 = np.array([[-w.d[0] * Dg], [g.d[1]]])
    B = np.stack([np.concatenate([np.zeros(n), w.b]), np.concatenate([g.b, -w.b * Dg])], axis=1)
    C = np.block([[-w.d[0] * Cg, w.C[0]], [g.C[1], np.zeros(m)], [-Cg, np.zeros(m)]])
    t = balance(A / q, B / q / [1.0, np.linalg.norm(D12)], C)
    plant = normalise(
        A / q / t[:, None] * t,
        B / q / t[:, None],
        C * t,
        np.array([[w.d[0]], [0.0]]),
        D12,
        -Dg,
        _weights_alone(W1, W2),
    )
    return plant, q


def _weights_alone(W1: Block, W2: Block) -> Obstacle:
    """What S + T = 1 costs at one frequency, whatever the plant: |W1 W2|/sqrt(|W1|^2 + |W2|^2).

    At this gamma a pair of eigenvalues of the Hamiltonian of X meets on the axis; below it they stay there.
    """

    def least(omega: np.ndarray) -> np.ndarray:
        first, second = np.abs(W1(1j * omega)), np.abs(W2(1j * omega))
        return first * second / np.hypot(first, second)

    gamma, omega = peak(least, W1.zeros + W1.poles + W2.zeros + W2.poles)
    return Obstacle(gamma, f"S + T = 1 at {omega:.4g} rad/s costs {gamma:.6g}")


def _bisect(plant: GeneralisedPlant) -> tuple[Obstacle, float]:
    """The greatest gamma proved infeasible and the least found feasible, within TOLERANCE where rounding lets them."""

    def feasible(gamma: float) -> bool:
        return isinstance(central_controller(plant, gamma), Controller)

    high = 1.0
    while not feasible(high):
        high *= 4
        if high > 1e12:
            raise SynthesisError("the mixed sensitivity problem has no feasible gamma")
    low = high / 4
    while feasible(low):
        high, low = low, low / 4
    while high > (1 + TOLERANCE) * low:
        middle = float(np.sqrt(high * low))
        low, high = (low, middle) if feasible(middle) else (middle, high)
    # not feasible is not yet proved infeasible; the floor is
    step = 1 + TOLERANCE
    while not isinstance(proof := central_controller(plant, low), Obstacle):
        low, step = low / step, step**2
    return proof, high
