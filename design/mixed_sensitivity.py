"""The H-infinity mixed sensitivity problem (2.8): two Riccati equations, bisection, the norm recomputed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import LinAlgError, eigvals, schur, solve_continuous_are, solve_continuous_lyapunov

from design.block import Block, geometric_scale
from design.closed_loop import closed_loop_norm, closed_loop_poles
from design.factorisation import balance, to_block, without
from design.realization import realize
from identification.files import InputError

SUBOPTIMALITY = 0.01  # the controller is the central one this far above the least feasible gamma
TOLERANCE = 1e-4  # of the bisection, relative


class SynthesisError(InputError):
    """The synthesis found no controller, or one that its own closed loop does not confirm."""


@dataclass(frozen=True)
class Synthesis:
    """A stabilising controller with a prescribed decay rate, and what can be said about the optimum.

    Parameters
    ----------
    K
        Controller, u = K (r - y), strictly proper when W1 is.
    gamma_lower
        No stabilising controller reaches a smaller norm (2.8), whatever its decay rate.
    gamma
        The norm (2.8) that ``K`` reaches, recomputed from the closed loop's frequency response.
    decay_rate
        In 1/s; every closed-loop pole lies left of -decay_rate.
    gamma_line_lower, gamma_line
        The same pair on the line Re s = -decay_rate, where ``K`` is optimal within 1 %.
    closed_loop_poles
        In rad/s.
    """

    K: Block
    gamma_lower: float
    gamma: float
    decay_rate: float
    gamma_line_lower: float
    gamma_line: float
    closed_loop_poles: tuple[complex, ...]


@dataclass(frozen=True)
class _GeneralisedPlant:
    """[z; e] = [C1; C2] (sI - A)^-1 [B1 B2] + [D11 D12; 1 D22] [r; u] with time in units of 1/q."""

    A: np.ndarray
    B1: np.ndarray
    B2: np.ndarray
    C1: np.ndarray
    C2: np.ndarray
    D11: np.ndarray
    D12: np.ndarray
    D22: float
    q: float


def mixed_sensitivity(G: Block, W1: Block, W2: Block, decay_rate: float) -> Synthesis:
    """Minimise || [W1 S; W2 T] ||_inf over the controllers that stabilise G with a decay rate, Thesis Eq. (2.8).

    Parameters
    ----------
    G
        Proper plant without dead time; poles on the imaginary axis are allowed.
    W1
        Performance weight, proper, its poles left of -decay_rate.
    W2
        Robustness weight such that W2 G is biproper and, apart from the poles of G, has its poles left of
        -decay_rate. W2 itself may be improper.
    decay_rate
        In 1/s, positive.

    Raises
    ------
    InputError
        A weight is of the wrong degree or its poles lie too far to the right.
    SynthesisError
        No controller was found, or its recomputed norm contradicts the Riccati solution by more than 1 %.

    Notes
    -----
    The infimum of (2.8) is no design when G has poles on the axis, as the internal model puts them there: it is
    approached by controllers that cancel those poles, the closed loop's slowest pole going to the axis with
    them. So the norm is minimised over the larger half plane Re s > -decay_rate, which is (2.8) for
    G(s - decay_rate) and the weights moved likewise. No pole is left on the axis, the rank conditions of the
    two-Riccati solution hold, and nothing has to be regularised. Moving the axis the other way gives the
    problem in Re s > +delta, whose optimum is a lower bound for (2.8), because a function that is analytic and
    bounded by gamma in a half plane is so in every smaller one.

    Formulas: K. Glover and J. C. Doyle, Systems & Control Letters 11 (1988) 167-172, for one exogenous input.
    """
    _check(G, W1, W2, decay_rate)
    moved = G.shifted(-decay_rate), W1.shifted(-decay_rate), W2.shifted(-decay_rate)
    problem = _assemble(*moved)
    line_lower, feasible = _bisect(problem)
    K = _controller(problem, feasible, moved[1].poles)
    line = closed_loop_norm(*moved, K)
    K = K.shifted(decay_rate)
    poles = closed_loop_poles(G, K)
    if not line <= (1 + SUBOPTIMALITY) * (1 + 2 * TOLERANCE) * 1.01 * line_lower:
        raise SynthesisError(
            f"the synthesised controller reaches {line:.6g} where the Riccati equations claim {line_lower:.6g}"
        )
    slowest = max(pole.real for pole in poles)
    if slowest > -decay_rate * (1 - 1e-3):
        raise SynthesisError(f"a closed-loop pole lies at Re s = {slowest:.6g}, right of {-decay_rate:.6g}")
    lower, _ = _bisect(_assemble(*(block.shifted(0.01 * decay_rate) for block in (G, W1, W2))))
    return Synthesis(K, lower, closed_loop_norm(G, W1, W2, K), decay_rate, line_lower, line, poles)


def _check(G: Block, W1: Block, W2: Block, decay_rate: float) -> None:
    if not (np.isfinite(decay_rate) and decay_rate > 0):
        raise InputError(f"the decay rate is {decay_rate:g}; expected a positive number of 1/s")
    if G.delay_s or G.relative_degree < 0:
        raise InputError("the mixed sensitivity problem needs a proper plant without dead time")
    if W1.relative_degree < 0 or (W2 * G).relative_degree != 0:
        raise InputError("the mixed sensitivity problem needs a proper W1 and a biproper W2 G")
    own = [pole for pole in W1.poles + (W2 * G).poles if pole not in G.poles]
    if own and max(pole.real for pole in own) >= -decay_rate:
        raise InputError(
            f"a weight has a pole at Re s = {max(pole.real for pole in own):g}; "
            f"expected all of them left of -{decay_rate:g}, the decay rate asked for"
        )


def _assemble(G: Block, W1: Block, W2: Block) -> _GeneralisedPlant:
    """State space of the map from (r, u) to (W1 e, W2 y, e), e = r - y, time scaled by the roots' mean."""
    q = geometric_scale(G, W1, W2 * G)
    g, w = realize(G, W2 * G), realize(W1)
    n, m = len(g.b), len(w.b)
    Cg, Dg = g.C[0], g.d[0]
    A = np.block([[g.A, np.zeros((n, m))], [-np.outer(w.b, Cg), w.A]])
    D12 = np.array([[-w.d[0] * Dg], [g.d[1]]])
    B = np.stack([np.concatenate([np.zeros(n), w.b]), np.concatenate([g.b, -w.b * Dg])], axis=1)
    C = np.block([[-w.d[0] * Cg, w.C[0]], [g.C[1], np.zeros(m)], [-Cg, np.zeros(m)]])
    rho = np.linalg.norm(D12)
    t = balance(A / q, B / q / [1.0, rho], C)
    return _GeneralisedPlant(
        A=A / q / t[:, None] * t,
        B1=B[:, :1] / q / t[:, None],
        B2=B[:, 1:] / q / t[:, None],
        C1=C[:2] * t,
        C2=C[2:] * t,
        D11=np.array([[w.d[0]], [0.0]]),
        D12=D12,
        D22=-Dg,
        q=q,
    )


def _bisect(plant: _GeneralisedPlant) -> tuple[float, float]:
    """Greatest gamma found infeasible and least found feasible, within TOLERANCE of each other."""
    high = 1.0
    while _central(plant, high) is None:
        high *= 4
        if high > 1e12:
            raise SynthesisError("the mixed sensitivity problem has no feasible gamma")
    low = high / 4
    while _central(plant, low) is not None:
        high, low = low, low / 4
        if low < 1e-12:
            raise SynthesisError("the mixed sensitivity problem is feasible for every gamma: W1 S or W2 T can vanish")
    while high > (1 + TOLERANCE) * low:
        middle = float(np.sqrt(high * low))
        if _central(plant, middle) is None:
            low = middle
        else:
            high = middle
    return low, high


def _controller(plant: _GeneralisedPlant, feasible: float, cancelling: tuple[complex, ...]) -> Block:
    """The central controller SUBOPTIMALITY above a feasible gamma, without the poles that cancel."""
    controller = _central(plant, feasible * (1 + SUBOPTIMALITY))
    if controller is None:
        raise SynthesisError("the feasibility of the mixed sensitivity problem is not monotonic in gamma")
    return without(to_block(*controller, plant.q), cancelling)


def _central(plant: _GeneralisedPlant, gamma: float) -> tuple[np.ndarray, np.ndarray, np.ndarray, float] | None:
    """The central controller (A, B, C, D) for this gamma, or None when the problem is infeasible."""
    rho = float(np.linalg.norm(plant.D12))
    # rotate z so that D12 = rho [0; 1], and scale u by rho
    low = plant.D12[:, 0] / rho
    rotation = np.array([[low[1], -low[0]], [low[0], low[1]]])
    A, B1, B2, C2 = plant.A, plant.B1, plant.B2 / rho, plant.C2
    C1, D11 = rotation @ plant.C1, rotation @ plant.D11
    d1, d2 = float(D11[0, 0]), float(D11[1, 0])
    if gamma <= abs(d1):
        return None

    # full information: u = u' - C12 x - d2 w leaves z2 = u' and takes the large cross term out by hand
    C11, C12 = C1[:1], C1[1:]
    X, F = _riccati(A - B2 @ C12, np.hstack([B1 - B2 * d2, B2]), C11, np.array([[d1, 0.0]]), gamma)
    # output injection: r reaches e with gain 1, so that nothing drives the filter but the unstable poles of G
    Y = _filter_riccati(A - B1 @ C2, C1 - D11 @ C2, C2, gamma)
    if X is None or F is None or Y is None or np.max(np.abs(eigvals(X @ Y))) >= gamma**2:
        return None

    F1 = F[:1]
    F2 = F[1:] - C12 - d2 * F1
    # L = -(B1 D.1' + Y C') R~^-1 with R~ = T diag(-gamma^2, -gamma^2, 1) T', T = [I D11; 0 1]
    L1 = Y @ (C1 - D11 @ C2).T / gamma**2
    L2 = -(B1 + Y @ C2.T) - L1 @ D11
    L12 = L1[:, 1:]
    D_hat21 = np.sqrt(1 - (d1 / gamma) ** 2)
    Z = np.linalg.inv(np.eye(len(A)) - Y @ X / gamma**2)
    B_hat2 = Z @ (B2 + L12)
    C_hat2 = -D_hat21 * (C2 + F1)
    B_hat1 = -Z @ L2 - B_hat2 * d2
    C_hat1 = F2 - d2 / D_hat21 * C_hat2
    A_hat = A + B1 @ F1 + B2 @ F2 + B_hat1 @ C_hat2 / D_hat21
    # undo the scaling of u and the loop shift that removed D22
    C_K, D_K = C_hat1 / rho, -d2 / rho
    loop = 1 / (1 + D_K * plant.D22)
    return (
        A_hat - loop * plant.D22 * B_hat1 @ C_K,
        B_hat1 * loop,
        C_K * loop,
        D_K * loop,
    )


def _riccati(
    A: np.ndarray, B: np.ndarray, C: np.ndarray, D: np.ndarray, gamma: float
) -> tuple[np.ndarray, np.ndarray] | tuple[None, None]:
    """Stabilising X >= 0 and feedback F = -R^-1 (D'C + B'X), or (None, None) when there are none.

    The game is x' = A x + B [w; u] with the cost |C x + D [w; u]|^2 + u^2 - gamma^2 w^2.
    """
    R = D.T @ D + np.diag([-(gamma**2), 1.0])
    try:
        X = solve_continuous_are(A, B, C.T @ C, R, s=C.T @ D)
    except (LinAlgError, ValueError):
        return None, None
    F = -np.linalg.solve(R, D.T @ C + B.T @ X)
    # with eigenvalues on the axis the solver splits them by rounding and returns what solves nothing
    terms = (A.T @ X + X @ A, (X @ B + C.T @ D) @ F, C.T @ C)
    residual = np.abs(sum(terms)).max()
    values = np.linalg.eigvalsh((X + X.T) / 2)
    if (
        residual > 1e-6 * sum(np.abs(term).max() for term in terms)
        or np.max(eigvals(A + B @ F).real) >= 0
        or values[0] < -1e-7 * values[-1]
    ):
        return None, None
    return X, F


def _filter_riccati(A: np.ndarray, C1: np.ndarray, C2: np.ndarray, gamma: float) -> np.ndarray | None:
    """Stabilising Y >= 0 of A Y + Y A' = Y (C2'C2 - C1'C1/gamma^2) Y, or None when there is none.

    Without a constant term Y lives on the antistable subspace of A, V: Y = V Z^-1 V' where
    Lambda' Z + Z Lambda = V'(C2'C2 - C1'C1/gamma^2)V and A V = V Lambda.
    """
    T, V, count = schur(A, sort="rhp")
    V = V[:, :count]
    if not count:
        return np.zeros_like(A)
    weight = V.T @ (C2.T @ C2 - C1.T @ C1 / gamma**2) @ V
    Z = solve_continuous_lyapunov(T[:count, :count].T, weight)
    Z = (Z + Z.T) / 2
    if np.linalg.eigvalsh(Z)[0] <= 0:
        return None
    return V @ np.linalg.solve(Z, V.T)
