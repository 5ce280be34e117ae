"""The Smith predictor based controller C_s and the anti-windup controller C_aw that equals it (3.1)-(3.31)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from design.blocks.block import Block, from_polynomial, polynomial
from design.blocks.inner_outer import inner_outer
from design.chapters_3_4.interpolate_Q import StableFunction
from identification.base.arrays import Complex
from identification.base.errors import InputError
from identification.model.plant import PlantModel


@dataclass(frozen=True)
class FreePart:
    """C_0 and the closed loop that it makes with 1/s.

    Parameters
    ----------
    Q
        Stable, Thesis Eq. (4.2).
    C_0
        Stabilises 1/s, Thesis Eq. (3.9) and (4.2).
    T_so
        (C_0/s)/(1 + C_0/s), Thesis Eq. (3.19); its poles are -a, -a and those of Q by construction.
    """

    Q: Block
    C_0: Block
    T_so: Block


def free_part(Q: StableFunction, a: float) -> FreePart:
    """C_0 and T_so from Q, Thesis Eq. (3.9), (4.2) and (3.19).

    Notes
    -----
    With Q = n/q, (4.2) is C_0 = (a (s + a) q + s n)/((s + a) q - n), and 1 + C_0/s has the numerator
    (s + a)^2 q over that denominator times s, so that T_so = (a (s + a) q + s n)/((s + a)^2 q): nothing cancels
    by subtraction. At the interpolation points, where C_0 is (3.3) and (3.4), T_so = exp(T_d s): (3.18) and (3.20).
    """
    shifted = np.polymul([1.0, a], Q.denominator)
    numerator = from_polynomial(np.polyadd(a * shifted, np.polymul([1.0, 0.0], Q.numerator)))
    denominator = from_polynomial(np.polysub(shifted, Q.numerator))
    poles = Block(1.0, (complex(-a), complex(-a), *Q.poles))
    return FreePart(Q.block(), numerator * denominator.inverse(), numerator * poles.inverse())


def free_part_of(T_so: Block, a: float) -> FreePart:
    """Q and C_0 of a T_so that meets the conditions (4.4) of a plant with one integrator, Thesis Eq. (3.9) and (4.2).

    Parameters
    ----------
    T_so
        With T_so(0) = 1, two poles at -a among others, and T_so(j omega) = exp(j omega T_d) at the reference.
    a
        In rad/s.

    Notes
    -----
    Q = ((s + a)^2 T_so - a (s + a))/s is stable, so that every such T_so is within Theorem 2.1.1.
    """
    poles = list(T_so.poles)
    for _ in range(2):
        poles.remove(complex(-a))
    q = polynomial(Block(1.0, tuple(poles)))
    n, D = polynomial(Block(T_so.gain, T_so.zeros)), np.polymul([1.0, 2 * a, a**2], q)
    # both vanish at s = 0 by the first condition
    over_s = np.asarray(np.polysub(D, n))[:-1]
    Q_numerator = np.asarray(np.polysub(n, a * np.polymul([1.0, a], q)))[:-1]
    return FreePart(
        Q=from_polynomial(Q_numerator) * Block(1.0, (), tuple(poles)),
        C_0=Block(T_so.gain, T_so.zeros) * from_polynomial(over_s).inverse(),
        T_so=T_so,
    )


def stabiliser(plant: PlantModel, T_so: Block, inverse_epsilon: float = 0.0) -> Block:
    """K = T_so/P_o, Thesis Eq. (3.29) with K_0 = s T_so and K_1 = 1/(K R_0) for one integrator.

    Parameters
    ----------
    plant
        P, of which P_o is the outer factor, see :func:`design.blocks.inner_outer.inner_outer`.
    T_so
        Stable.
    inverse_epsilon
        epsilon of R_eps^-1 = R_0^-1/(1 + epsilon s)^2 in seconds, Thesis Eq. (3.2); 0 is the exact inverse.

    Raises
    ------
    InputError
        epsilon is negative, or K comes out improper.
    """
    K = T_so * inner_outer(plant)[1].inverse() * _lag(inverse_epsilon)
    if K.relative_degree < 0:
        raise InputError(
            f"the plant has {plant.relative_degree} more poles than zeros and T_so only {T_so.relative_degree}, so the "
            f"controller is improper; expected {-K.relative_degree} more poles of T_so (--robust-level adds them)"
        )
    return K


def thesis_factors(plant: PlantModel, T_so: Block, inverse_epsilon: float = 0.0) -> tuple[Block, Block]:
    """K_0 = C_0/(1 + C_0/s) = s T_so and K_1 = 1/(K R_0) of a plant with one integrator, Thesis Eq. (3.26)-(3.28)."""
    over_s = Block(1.0, (), (0j,))
    return T_so * over_s.inverse(), inner_outer(plant)[1].inverse() * over_s * _lag(inverse_epsilon)


def _lag(epsilon: float) -> Block:
    if not (np.isfinite(epsilon) and epsilon >= 0):
        raise InputError(f"epsilon of the approximate inverse is {epsilon:g} s; expected 0 or more")
    return Block(1 / epsilon**2, (), (complex(-1 / epsilon),) * 2) if epsilon else Block(1.0)


def smith_controller(plant: PlantModel, C_0: Block, s: ArrayLike) -> Complex:
    """C_s = (1/(K R_0)) C_0/(1 + C_0 (1 - exp(-T_d s))/s), Thesis Eq. (3.2) with the exact R_0, at ``s`` (rad/s).

    It makes P C_s S_s exp(T_d s) = T_so, Eq. (3.22).
    """
    s = np.asarray(s, dtype=complex)
    flexible = plant.without_delay()(s) * s  # K R_0
    value = C_0(s)
    return np.asarray(value / flexible / (1 - value * np.expm1(-plant.delay_s * s) / s))


def anti_windup_controller(plant: PlantModel, K: Block, T_so: Block, s: ArrayLike) -> Complex:
    """C_aw = K/(1 - T_so exp(-T_d s)), Thesis Eq. (3.24) and (3.31), at ``s`` (rad/s)."""
    s = np.asarray(s, dtype=complex)
    return np.asarray(K(s) / (1 - T_so(s) * np.exp(-plant.delay_s * s)))


def anti_windup_theta1(theta1_tilde: Block, plant: PlantModel, T_so: Block, s: ArrayLike) -> Complex:
    """theta1 = theta1~ (1 + F) with F = -T_so exp(-T_d s), Thesis Eq. (3.30), at ``s`` (rad/s)."""
    s = np.asarray(s, dtype=complex)
    return np.asarray(theta1_tilde(s) * (1 - T_so(s) * np.exp(-plant.delay_s * s)))


def augmented_plant(plant: PlantModel, T_so: Block, s: ArrayLike) -> Complex:
    """G_A = P/(1 + F) with F = -T_so exp(-T_d s), Thesis section 3.3, at ``s`` (rad/s).

    One side of Eq. (2.9), G_A of (2.13), and what K meets in (3.13).
    """
    s = np.asarray(s, dtype=complex)
    return np.asarray(plant(s) / (1 - T_so(s) * np.exp(-plant.delay_s * s)))
