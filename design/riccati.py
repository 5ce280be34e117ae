"""The two Riccati equations of the H-infinity problem: the controller for one gamma, or what forbids that gamma."""

from __future__ import annotations

import warnings
from dataclasses import dataclass

import numpy as np
from scipy.linalg import LinAlgError, eigh, eigvals, matrix_balance, schur, solve_continuous_lyapunov

from identification.files import InputError

NEWTON = 4  # steps at most from what the Schur form gives
RESIDUAL = 1e-6  # of a Riccati equation, relative to its terms
ROUNDING = 1e-12  # of X, relative to the cost |C1 x|^2 over one unit of time


class SynthesisError(InputError):
    """The synthesis found no controller, or one that its own closed loop does not confirm."""


@dataclass(frozen=True)
class Obstacle:
    """No stabilising controller brings the norm to ``gamma`` or below, and in ``reason`` why."""

    gamma: float
    reason: str


@dataclass(frozen=True)
class GeneralisedPlant:
    """[z; e] = [C1; C2] (sI - A)^-1 [B1 B2] + [D11 D12; 1 D22] [r; u] with D12 = [0; 1], see :func:`normalise`.

    Shapes: A (n, n), B1 and B2 (n, 1), C1 (2, n), C2 (1, n), D11 (2, 1). V (n, k) spans the antistable subspace of
    the output injection, on which the filter's equation is Z = Z_e - Z_z/gamma^2, Y = V Z^-1 V'. No gamma up to
    that of ``floor`` is feasible. u is in units of 1/u_scale.
    """

    A: np.ndarray
    B1: np.ndarray
    B2: np.ndarray
    C1: np.ndarray
    C2: np.ndarray
    D11: np.ndarray
    D22: float
    u_scale: float
    V: np.ndarray
    Z_e: np.ndarray
    Z_z: np.ndarray
    floor: Obstacle


@dataclass(frozen=True)
class Controller:
    """u = (C (sI - A)^-1 B + D) e of the plant that was normalised.

    Shapes: A (n, n), B (n, 1), C (1, n).
    """

    A: np.ndarray
    B: np.ndarray
    C: np.ndarray
    D: float


def normalise(
    A: np.ndarray, B: np.ndarray, C: np.ndarray, D11: np.ndarray, D12: np.ndarray, D22: float, known: Obstacle
) -> GeneralisedPlant:
    """Rotate z and scale u so that D12 = [0; 1], and find which gammas direct term and filter alone forbid.

    Parameters
    ----------
    A, B, C, D11, D12, D22
        Shapes (n, n), (n, 2), (3, n), (2, 1), (2, 1) and a number, of [z; e] = G [r; u]; r reaches e with gain 1.
    known
        An obstacle found by other means.

    Raises
    ------
    SynthesisError
        The filter's equation is singular to rounding.

    Notes
    -----
    r reaches e with gain 1, so that nothing drives the filter A Y + Y A' = Y (C2'C2 - C1'C1/gamma^2) Y but the
    antistable modes of A - B1 C2, the poles of G right of the axis. With A V = V Lambda there Y = V Z^-1 V', where
    Lambda' Z + Z Lambda = V'(C2'C2 - C1'C1/gamma^2) V. Y >= 0 fails below the gamma at which Z turns singular.
    """
    u_scale = float(np.linalg.norm(D12))
    low = D12[:, 0] / u_scale
    rotation = np.array([[low[1], -low[0]], [low[0], low[1]]])
    B1, B2, C1, C2, D11 = B[:, :1], B[:, 1:] / u_scale, rotation @ C[:2], C[2:], rotation @ D11

    T, V, count = schur(A - B1 @ C2, sort="rhp")
    V, T = V[:, :count], T[:count, :count]
    try:
        Z_e, Z_z = (_lyapunov(T.T, (output @ V).T @ (output @ V)) for output in (C2, C1 - D11 @ C2))
        forbidden = eigh(Z_z, Z_e, eigvals_only=True)
    except LinAlgError:
        raise SynthesisError("the filter's equation is singular: G has poles too near the axis or each other") from None
    direct = abs(float(D11[0, 0]))
    obstacles = [known, Obstacle(direct, f"S + T = 1 at infinite frequency costs {direct:.6g}")]
    if count:
        least = float(np.sqrt(forbidden[-1]))
        obstacles.append(Obstacle(least, f"T = 1 at the unstable poles of G costs {least:.6g}"))
    floor = max(obstacles, key=lambda obstacle: obstacle.gamma)
    return GeneralisedPlant(A, B1, B2, C1, C2, D11, D22, u_scale, V, Z_e, Z_z, floor)


def central_controller(plant: GeneralisedPlant, gamma: float) -> Controller | Obstacle | None:
    """The central controller for this gamma, or a proof that there is none, or None where rounding decides.

    Parameters
    ----------
    plant
        As :func:`normalise` makes it.
    gamma
        Bound on the H-infinity norm from r to z.

    Returns
    -------
    Controller, Obstacle or None
        An obstacle's gamma is the given one.

    Notes
    -----
    An obstacle is proved by numbers whose error is known. The Riccati solution X is checked by its residual, and
    the Newton step that would remove the residual tells how far X is off; a test counts as failed when it fails by
    more than that step changes.

    K. Glover and J. C. Doyle, Systems & Control Letters 11 (1988) 167-172, for one exogenous input.
    """
    if gamma <= plant.floor.gamma:
        return Obstacle(gamma, plant.floor.reason)
    try:
        return _central_controller(plant, gamma)
    except LinAlgError:
        return None


def _central_controller(plant: GeneralisedPlant, gamma: float) -> Controller | Obstacle | None:
    rounding = ROUNDING * float(np.linalg.norm(plant.C1, 2)) ** 2
    solution = _riccati(hamiltonian(plant, gamma), rounding)
    if solution is None:
        return None
    X, error = solution
    values = np.linalg.eigvalsh(X)
    if values[0] < -np.linalg.norm(error, 2) - rounding:
        return Obstacle(gamma, f"no state feedback reaches it, its X has the eigenvalue {values[0]:.3g}")
    Z = plant.Z_e - plant.Z_z / gamma**2
    if len(Z):
        radius, other = (eigh(plant.V.T @ near @ plant.V, Z, eigvals_only=True)[-1] for near in (X, X - error))
        if radius - abs(radius - other) >= gamma**2:
            return Obstacle(gamma, f"spectral radius of X Y is {radius / gamma**2:.7g} gamma^2")
        if radius >= gamma**2:
            return None

    B1, B2, C1, C2, D11 = plant.B1, plant.B2, plant.C1, plant.C2, plant.D11
    _, B_X, C_X, d1, d2 = _game(plant)
    # the worst r and the best u' of the game
    F1 = (d1 * C_X + B_X.T @ X) / (gamma**2 - d1**2)
    F2 = -B2.T @ X - C1[1:] - d2 * F1
    Y = plant.V @ np.linalg.solve(Z, plant.V.T)
    # L = -(B1 D.1' + Y C') R~^-1 with R~ = T diag(-gamma^2, -gamma^2, 1) T', T = [I D11; 0 1]
    L1 = Y @ (C1 - D11 @ C2).T / gamma**2
    L2 = -(B1 + Y @ C2.T) - L1 @ D11
    L12 = L1[:, 1:]
    D_hat21 = np.sqrt(1 - (d1 / gamma) ** 2)
    coupled = np.linalg.inv(np.eye(len(X)) - Y @ X / gamma**2)
    B_hat2 = coupled @ (B2 + L12)
    C_hat2 = -D_hat21 * (C2 + F1)
    B_hat1 = -coupled @ L2 - B_hat2 * d2
    C_hat1 = F2 - d2 / D_hat21 * C_hat2
    A_hat = plant.A + B1 @ F1 + B2 @ F2 + B_hat1 @ C_hat2 / D_hat21
    # undo the scaling of u and the loop shift that removed D22
    C_K, D_K = C_hat1 / plant.u_scale, -d2 / plant.u_scale
    loop = 1 / (1 + D_K * plant.D22)
    return Controller(A_hat - loop * plant.D22 * B_hat1 @ C_K, B_hat1 * loop, C_K * loop, D_K * loop)


def _lyapunov(A: np.ndarray, Q: np.ndarray) -> np.ndarray:
    """X of A X + X A' = Q, symmetric; raises LinAlgError where A and -A' nearly share an eigenvalue."""
    with warnings.catch_warnings():
        warnings.simplefilter("error", RuntimeWarning)
        try:
            X = solve_continuous_lyapunov(A, Q)
        except RuntimeWarning as warning:
            raise LinAlgError(str(warning)) from None
    return (X + X.T) / 2


def hamiltonian(plant: GeneralisedPlant, gamma: float) -> np.ndarray:
    """The Hamiltonian, shape (2 n, 2 n), of the Riccati equation of X, A_F'X + X A_F - X S X + Q = 0.

    X belongs to the game of x' = A_X x + B_X r + B2 u' with the cost |C x + d r|^2 + u'^2 - gamma^2 r^2, which is
    left when u = u' - C12 x - d2 r has made z2 = u'. Full information: the filter is not in it. gamma exceeds |d|.
    """
    A, B, C, d, _ = _game(plant)
    weight = gamma**2 - d**2
    A_F = A + B @ C * (d / weight)
    S = plant.B2 @ plant.B2.T - B @ B.T / weight
    Q = C.T @ C * (gamma**2 / weight)
    return np.block([[A_F, -S], [-Q, -A_F.T]])


def _game(plant: GeneralisedPlant) -> tuple[np.ndarray, np.ndarray, np.ndarray, float, float]:
    """A_X, B_X, C, d and d2 of the game that X belongs to."""
    d1, d2 = float(plant.D11[0, 0]), float(plant.D11[1, 0])
    return plant.A - plant.B2 @ plant.C1[1:], plant.B1 - plant.B2 * d2, plant.C1[:1], d1, d2


def _riccati(H: np.ndarray, rounding: float) -> tuple[np.ndarray, np.ndarray] | None:
    """Stabilising solution X of the Riccati equation with the Hamiltonian H, and the Newton step from it.

    ``rounding`` is what a zero in the equation may be. The invariant subspace is that of H as it is or, where it does
    not give a solution, of H with states times t and costates over t, so that rows and columns are of like size. None
    when eigenvalues lie on the axis, or when what was found does not solve the equation.
    """
    n = len(H) // 2
    _, (scale, _) = matrix_balance(np.abs(H), permute=False, separate=True)
    balanced = np.exp2(np.round(np.log2(scale[:n] / scale[n:]) / 2))
    A, S, Q = H[:n, :n], -H[:n, n:], -H[n:, :n]
    for t in (np.ones(n), balanced):
        weights = np.concatenate([t, 1 / t])
        _, U, count = schur(H * weights / weights[:, None], sort="lhp")
        if count != n:
            continue
        X = np.linalg.solve(U[:n, :n].T, U[n:, :n].T) / np.outer(t, t)
        X = (X + X.T) / 2
        for _ in range(NEWTON):
            terms = np.stack([A.T @ X + X @ A, -X @ S @ X, Q])
            residual, closed = terms.sum(axis=0), A - S @ X
            if np.max(eigvals(closed).real) >= 0:
                break
            step = _lyapunov(closed.T, residual)
            if np.abs(residual).max() <= RESIDUAL * np.abs(terms).max(axis=(1, 2)).sum() + rounding:
                return X, step
            X = X - step
    return None
