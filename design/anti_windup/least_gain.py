"""The anti-windups of least L2 gain from v, the control of the loop without saturation, to y_d, by linear matrix
inequalities.

With u = v - c x, y_d = c_d x + d u~ and x' = A x + b u~, u~ = u - sat(u) meets u~ (k u - u~) >= 0 as long as the dead
zone is in the sector k: of every u for k = 1, of |u| <= L/(1 - k) below. V = x'Q^-1 x proves the gain gamma if

    dV/dt + y_d^2/gamma - gamma v^2 + (2/U) u~ (k (v - c x) - u~) < 0   for all (x, u~, v) but 0,

which in Q, U, Q times c and b times U is linear. A dead time of P delays y_d, which has the same norm.
"""

from __future__ import annotations

import contextlib
import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from design.anti_windup.compensator import AntiWindup, from_one_plus
from design.blocks.block import Block, geometric_scale, plant_block
from design.blocks.state_space import StateSpace, realize
from design.choices import SECTOR
from identification.base.arrays import Real
from identification.base.errors import InputError
from identification.model.plant import PlantModel

ROUNDING = 1e-6  # of the inequality's largest eigenvalue, by which the solver may miss it
SPARE = 1e-3  # of the gain, with which the inequality has to hold

Shaped = Any
"""A cvxpy expression or variable, which is imported only where it is solved for."""


@dataclass(frozen=True)
class LeastGain:
    """What the inequality gave.

    Parameters
    ----------
    kind
        theta1~.
    gain
        gamma, in output units per input unit: what was found, to the solver's tolerance, not proved.
    sector
        k for which it holds.
    """

    kind: AntiWindup
    gain: float
    sector: float


def weston_postlethwaite(plant: PlantModel, bandwidth: float) -> LeastGain:
    """P = N M^-1 with M = F (sI - A - b F)^-1 b + 1 of full order: the F whose gain is least.

    P. F. Weston and I. Postlethwaite, "Linear conditioning for systems containing saturating actuators", Automatica
    36, 2000; M. C. Turner and I. Postlethwaite, "A new perspective on static and low order anti-windup synthesis",
    International Journal of Control 77, 2004.

    Parameters
    ----------
    plant
        P; of a stable one the sector is 1, else :data:`design.choices.SECTOR`, since the gain over all u is infinite.
    bandwidth
        In rad/s: no pole of M lies beyond, or beyond the plant's fastest. Without a bound the gain of K/s has no least
        value: with M = s/(s + b) it is |K| k/(b (1 - k)).

    Raises
    ------
    InputError
        No F is found.
    """
    block = plant_block(plant).without_delay()
    if not block.poles:
        raise InputError("the plant has no pole; expected one or more, since the method chooses coprime factors")
    import cvxpy as cp

    unit = geometric_scale(block)
    system = realize(block)
    A, b, c = _in_unit(system, unit)
    Q, L, U = cp.Variable((len(b), len(b)), symmetric=True), cp.Variable((1, len(b))), cp.Variable((1, 1))
    moved = A @ Q + b @ L
    radius = max(bandwidth, *map(abs, block.poles)) / unit
    disk = cp.bmat([[radius * Q, moved], [moved.T, radius * Q]]) >> 0
    k = _sector(block)
    gain = _solve(Q, U, moved, b @ U, -L, c @ Q + system.d[0] * L, system.d[0] * U, k, [disk])
    F = np.linalg.solve(Q.value, L.value.T).T
    return LeastGain(from_one_plus(Block(1.0, block.poles, _eigenvalues(A + b @ F, unit))), gain, k)


def static(plant: PlantModel, g: Block, poles: Sequence[complex]) -> LeastGain:
    """A constant gain from u~ to the controller's states: M = g (1 - c (sI - A)^-1 f), f the gain of least L2 gain.

    E. F. Mulder, M. V. Kothare and M. Morari, "Multivariable anti-windup controller synthesis using linear matrix
    inequalities", Automatica 37, 2001. A gain from u~ to the control itself only scales u~. The states with a dead time
    take the gain that keeps it out of M, that of :func:`design.anti_windup.other_anti_windups.observer`, and f goes to
    the others: so the inequality is exact for the loop with its dead time.

    Parameters
    ----------
    plant
        P; for the sector see :func:`weston_postlethwaite`.
    g
        M of f = 0.
    poles
        Of the states that f goes to, in rad/s.

    Raises
    ------
    InputError
        P g or a pole is not stable, or no gain is found.
    """
    block = plant_block(plant).without_delay()
    own = Block(1.0, (), tuple(poles))
    if not ((block * g).is_stable and own.is_stable and poles):
        raise InputError(
            "the controller cancels the plant's poles with Re s >= 0, so that no static anti-windup makes theta2 stable"
            "; expected an extended design"
        )
    import cvxpy as cp

    unit = geometric_scale(block, g, own)
    A, b, _ = _in_unit(realize(own), unit)
    A_f, c_f = A.T, b.T  # every f gives another numerator
    rest = realize(g, block * g)
    A_g, b_g, c_g = _in_unit(rest, unit)
    n, m = len(A_f), len(A_g)
    full = np.block([[A_f, np.zeros((n, m))], [-b_g @ c_f, A_g]])
    Q, X, U = cp.Variable((n + m, n + m), symmetric=True), cp.Variable((n, 1)), cp.Variable((1, 1))
    theta1_tilde, y_d = np.hstack([-c_f, c_g[:1]]), np.hstack([-rest.d[1] * c_f, c_g[1:]])
    k = _sector(block)
    gain = _solve(Q, U, full @ Q, cp.vstack([X, b_g @ U]), -theta1_tilde @ Q, y_d @ Q, rest.d[1] * U, k, [])
    zeros = _eigenvalues(A_f + X.value @ c_f / U.value, unit)
    return LeastGain(from_one_plus(g * Block(1.0, zeros, tuple(poles))), gain, k)


def _in_unit(system: StateSpace, unit: float) -> tuple[Real, Real, Real]:
    """A, b (n, 1) and C with the time in 1/unit seconds."""
    return system.A / unit, system.b[:, None] / unit, system.C


def _sector(block: Block) -> float:
    return 1.0 if block.is_stable else SECTOR


def _eigenvalues(A: Real, unit: float) -> tuple[complex, ...]:
    return tuple(complex(root) * unit for root in np.linalg.eigvals(A))


def _solve(
    Q: Shaped,
    U: Shaped,
    AQ: Shaped,
    bU: Shaped,
    minus_cQ: Shaped,
    y_dQ: Shaped,
    y_dU: Shaped,
    k: float,
    more: list[Shaped],
) -> float:
    """Give Q and U their values, and return the gain.

    Raises
    ------
    InputError
        The solver finds none, or what it finds does not meet the inequality.
    """
    import cvxpy as cp

    gain, one, none = cp.Variable((1, 1)), np.eye(1), np.zeros((Q.shape[0], 1))
    inequality = cp.bmat(
        [
            [AQ + AQ.T, bU + k * minus_cQ.T, none, y_dQ.T],
            [bU.T + k * minus_cQ, -2 * U, k * one, y_dU],
            [none.T, k * one, -gain, 0 * one],
            [y_dQ, y_dU, 0 * one, -gain],
        ]
    )
    problem = cp.Problem(cp.Minimize(gain[0, 0]), [inequality << 0, Q >> 0, *more])
    quiet = warnings.catch_warnings(action="ignore", category=UserWarning)  # of a solution that may be inaccurate
    with quiet, contextlib.suppress(cp.SolverError):  # the status says either
        problem.solve(solver=cp.CLARABEL)
    if problem.status not in (cp.OPTIMAL, cp.OPTIMAL_INACCURATE):
        raise InputError(f"the linear matrix inequality has no solution for the sector {k:g} ({problem.status})")
    found = float(gain.value[0, 0])
    gain.value = (1 + SPARE) * gain.value
    sizes = np.concatenate([np.diag(Q.value), U.value.ravel(), gain.value.ravel(), gain.value.ravel()])
    size = np.sqrt(np.maximum(sizes, np.finfo(float).tiny))
    eigenvalues = np.linalg.eigvalsh(inequality.value / np.outer(size, size))
    if not (eigenvalues[-1] <= ROUNDING * -eigenvalues[0] and np.linalg.eigvalsh(Q.value)[0] > 0):
        raise InputError(f"the linear matrix inequality is solved too inaccurately for the sector {k:g}")
    return found
