"""The Smith predictor based controller C_s and the anti-windup controller C_aw that equals it (3.1)-(3.31)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from design.block import Block, from_polynomial, plant_denominator, plant_numerator, require_thesis_class
from design.stable_interpolation import StableFunction
from identification.plant import Complex, PlantModel


@dataclass(frozen=True)
class FreePart:
    """C_0 and the closed loop that it makes with 1/s.

    Parameters
    ----------
    C_0
        Stabilises 1/s, Thesis Eq. (3.9) and (4.2).
    T_so
        (C_0/s)/(1 + C_0/s), Thesis Eq. (3.19); its poles are -a, -a and those of Q by construction.
    """

    C_0: Block
    T_so: Block


def bezout(a: float) -> tuple[Block, Block, Block, Block]:
    """N_p, D_p, X, Y of 1/s with N_p X + D_p Y = 1, Thesis Eq. (3.7)-(3.8): 1/(s+a), s/(s+a), a, 1."""
    pole = (complex(-a),)
    return Block(1.0, (), pole), Block(1.0, (0j,), pole), Block(a), Block(1.0)


def free_part(Q: StableFunction, a: float) -> FreePart:
    """C_0 and T_so from Q, Thesis Eq. (4.2) and (3.19).

    Notes
    -----
    With Q = n/q, (4.2) is C_0 = (a (s + a) q + s n)/((s + a) q - n), and 1 + C_0/s has the numerator
    (s + a)^2 q over that denominator times s, so that T_so = (a (s + a) q + s n)/((s + a)^2 q): nothing cancels
    by subtraction. At the interpolation points T_so = exp(T_d s).
    """
    q = np.array([1.0, Q.e, Q.f])
    shifted = np.polymul([1.0, a], q)
    numerator = from_polynomial(np.polyadd(a * shifted, np.polymul([1.0, 0.0], Q.numerator)))
    denominator = from_polynomial(np.polysub(shifted, Q.numerator))
    poles = Block(1.0, (complex(-a), complex(-a), *Q.poles))
    return FreePart(C_0=numerator * denominator.inverse(), T_so=numerator * poles.inverse())


def stabiliser(plant: PlantModel, T_so: Block) -> tuple[Block, Block, Block]:
    """K_0 = C_0/(1 + C_0/s) = s T_so, K_1 = 1/(K R_0) and K = K_0 K_1, Thesis Eq. (3.26)-(3.29).

    Raises
    ------
    InputError
        The plant is not of the class (2.20), so that K_1 would be improper.
    """
    require_thesis_class(plant)
    s = Block(1.0, (0j,))
    K_0 = s * T_so
    K_1 = plant_denominator(plant) * s.inverse() * plant_numerator(plant).inverse()
    return K_0, K_1, K_0 * K_1


def smith_controller(plant: PlantModel, C_0: Block, s: ArrayLike) -> Complex:
    """C_s = (1/(K R_0)) C_0/(1 + C_0 (1 - exp(-T_d s))/s), Thesis Eq. (3.2) with the exact R_0, at ``s`` (rad/s)."""
    s = np.asarray(s, dtype=complex)
    flexible = plant.without_delay()(s) * s  # K R_0
    value = C_0(s)
    return np.asarray(value / flexible / (1 - value * np.expm1(-plant.delay_s * s) / s))


def anti_windup_controller(plant: PlantModel, K: Block, T_so: Block, s: ArrayLike) -> Complex:
    """C_aw = K/(1 - T_so exp(-T_d s)), Thesis Eq. (3.31), at ``s`` (rad/s)."""
    s = np.asarray(s, dtype=complex)
    return np.asarray(K(s) / (1 - T_so(s) * np.exp(-plant.delay_s * s)))


def anti_windup_theta1(theta1_tilde: Block, plant: PlantModel, T_so: Block, s: ArrayLike) -> Complex:
    """theta1 = theta1~ (1 + F) with F = -T_so exp(-T_d s), Thesis Eq. (3.30), at ``s`` (rad/s)."""
    s = np.asarray(s, dtype=complex)
    return np.asarray(theta1_tilde(s) * (1 - T_so(s) * np.exp(-plant.delay_s * s)))


def augmented_plant(plant: PlantModel, T_so: Block, s: ArrayLike) -> Complex:
    """G_A = P/(1 + F) with F = -T_so exp(-T_d s), Thesis section 3.3, at ``s`` (rad/s)."""
    s = np.asarray(s, dtype=complex)
    return np.asarray(plant(s) / (1 - T_so(s) * np.exp(-plant.delay_s * s)))
