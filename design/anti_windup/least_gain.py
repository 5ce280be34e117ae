"""The anti-windups of least L2 gain from v, the control of the loop without saturation, to y_d, by linear matrix
inequalities.

With u = v - c x, y_d = c_d x and x' = A x + b u~, u~ = u - sat(u) meets u~ (k u - u~) >= 0 as long as the dead zone is
in the sector k: of every u for k = 1, of |u| <= L/(1 - k) below. V = x'Q^-1 x proves the gain gamma if

    dV/dt + y_d^2/gamma - gamma v^2 + (2/U) u~ (k (v - c x) - u~) < 0   for all (x, u~, v) but 0,

which in Q, U, Q times c and b times U is linear. A dead time of P delays y_d, which has the same norm.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from design.anti_windup.compensator import AntiWindup, from_one_plus
from design.blocks.block import Block, geometric_scale, plant_block
from design.blocks.state_space import StateSpace, realize
from design.choices import SECTOR
from identification.base.arrays import Real
from identification.base.errors import InputError
from identification.model.plant import PlantModel

SPARE = 1e-6  # of Q's scale, by which the inequality is strict


def weston_postlethwaite(plant: PlantModel, bandwidth: float) -> AntiWindup:
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
    block = plant_block(plant)
    if not block.poles:
        raise InputError("the plant has no pole, so that there are no coprime factors to choose")
    system, unit, k = _scaled(block), _unit(block), _sector(block)
    A, b, c = system.A, system.b[:, None], system.C
    import cvxpy as cp

    Q, L, U = cp.Variable((len(b), len(b)), symmetric=True), cp.Variable((1, len(b))), cp.Variable((1, 1))
    moved = A @ Q + b @ L
    radius = max(bandwidth, max(map(abs, block.poles))) / unit
    disk = cp.bmat([[radius * Q, moved], [moved.T, radius * Q]]) >> 0
    _least(Q, U, moved, b @ U, L, c @ Q, k, [disk], "Weston and Postlethwaite's anti-windup")
    F = np.linalg.solve(Q.value, L.value.T).T
    return from_one_plus(Block(1.0, block.poles, _roots(A + b @ F, unit)))


def static(plant: PlantModel, g: Block, poles: Sequence[complex], bandwidth: float) -> AntiWindup:
    """A constant gain from u~ to the controller's states: M = g (1 - c (sI - A)^-1 f), f the gain of least L2 gain.

    E. F. Mulder, M. V. Kothare and M. Morari, "Multivariable anti-windup controller synthesis using linear matrix
    inequalities", Automatica 37, 2001. A gain from u~ to the control itself scales u~, and changes nothing. The states
    with a dead time take the gain that keeps it out of M, :func:`design.anti_windup.other_anti_windups.observer`, and
    f goes to the others; so the inequality is exact for the loop with its dead time.

    Parameters
    ----------
    plant
        P; for the sector see :func:`weston_postlethwaite`.
    g
        M of f = 0; P g is stable.
    poles
        Of the states that f goes to, all stable, in rad/s.
    bandwidth
        In rad/s; no zero of 1 - c (sI - A)^-1 f lies beyond, or beyond the fastest of the poles.

    Raises
    ------
    InputError
        P g or a pole is not stable, or no gain is found.
    """
    block = plant_block(plant).without_delay()
    if not (block * g).is_stable or any(pole.real >= 0 for pole in poles):
        raise InputError(
            "the controller cancels the plant's pole with Re s >= 0, so that no gain to its states makes theta2 "
            "stable; expected an extended design"
        )
    if not poles:
        raise InputError("the controller has no states that a static anti-windup could drive")
    import cvxpy as cp

    unit, k = geometric_scale(block, g, Block(1.0, (), tuple(poles))), _sector(block)
    own = realize(Block(1.0, (), tuple(poles)).shifted(0.0))
    A_f, c_f = own.A.T / unit, own.b[None, :]  # the transpose: observable from one output, driven anywhere
    rest = realize(g, block * g)
    n, m = len(A_f), len(rest.b)
    b_r = rest.b[:, None]
    A = np.block([[A_f, np.zeros((n, m))], [-b_r @ c_f, rest.A / unit]])
    # M - 1 and y_d over the states (of f, of g and P g)
    c_u = np.hstack([-c_f, rest.C[:1]])
    c_d = np.hstack([np.zeros((1, n)), rest.C[1:]])
    Q, X, U = cp.Variable((n + m, n + m), symmetric=True), cp.Variable((n, 1)), cp.Variable((1, 1))
    driven = cp.vstack([X, b_r @ U]) if m else X
    _least(Q, U, A @ Q, driven, c_u @ Q, c_d @ Q, k, [], "the static anti-windup")
    f = X.value / U.value
    zeros = _roots(A_f - f @ c_f, unit)
    return from_one_plus(g * Block(1.0, zeros, tuple(poles)))
