"""The Smith predictor based controller C_s and the anti-windup controller C_aw that equals it (3.1)-(3.31)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from design.blocks.block import (
    Block,
    from_polynomial,
    plant_denominator,
    plant_numerator,
    polynomial,
    require_thesis_class,
)
from design.chapters_3_4.interpolate_Q import Conditions, StableFunction, poles_of, polynomial_through
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


def rolled_off(wanted: Conditions, pairs: Sequence[tuple[float, float]], rate: float, order: int) -> FreePart:
    """The design by the zeros of Q with a T_so that rolls off beyond a rate: more poles, the same conditions.

        T_so = n(s)/((s + a)^2 q(s) (1 + s/rate)^order),   n of degree 2 k + 1 for k frequencies.

    Parameters
    ----------
    wanted
        What Q must be, and a.
    pairs
        e and f of the factors of q, as in :func:`design.chapters_3_4.interpolate_Q.by_zeros`.
    rate
        In rad/s, positive.
    order
        Number of additional poles; 0 is the design of the thesis.

    Raises
    ------
    InputError
        A number is out of its range.

    Notes
    -----
    The thesis's T_so has one pole more than zeros, so that K = s T_so/(K R_0) does not roll off at all. (4.4) says
    T_so(0) = 1, T_so'(0) = T_d and T_so(j omega) = exp(j omega T_d): 2 k + 2 real conditions, as many as n has
    coefficients, whatever the denominator. Q = ((s + a)^2 T_so - a (s + a))/s is then stable, so that this is
    within Theorem 2.1.1.
    """
    if not (np.isfinite(rate) and rate > 0):
        raise InputError(f"the roll-off begins at {rate:g} rad/s; expected a positive number")
    a, delay_s, s = wanted.a, wanted.delay_s, 1j * np.array(wanted.omegas)
    poles = Block(rate**-order, (*poles_of(wanted, pairs), *(complex(-rate),) * order))
    q = polynomial(poles)
    D = np.polymul([1.0, 2 * a, a**2], q)
    values = np.polyval(D, s) * np.exp(s * delay_s)
    points = np.append(0.0, -np.square(wanted.omegas))
    even = polynomial_through(points, np.append(D[-1], values.real))
    odd = polynomial_through(points, np.append(D[-2] + delay_s * D[-1], values.imag / np.array(wanted.omegas)))
    n = np.zeros(2 * len(points))
    n[0::2], n[1::2] = odd, even
    # both vanish at s = 0 by the first condition
    over_s = np.asarray(np.polysub(D, n))[:-1]
    Q_numerator = np.asarray(np.polysub(n, a * np.polymul([1.0, a], q)))[:-1]
    numerator = from_polynomial(n)
    return FreePart(
        Q=from_polynomial(Q_numerator) * poles.inverse(),
        C_0=numerator * from_polynomial(over_s).inverse(),
        T_so=numerator * Block(1.0, (), (complex(-a), complex(-a))) * poles.inverse(),
    )


def stabiliser(plant: PlantModel, T_so: Block, inverse_epsilon: float = 0.0) -> tuple[Block, Block, Block]:
    """K_0 = C_0/(1 + C_0/s) = s T_so, K_1 = 1/(K R_0) and K = K_0 K_1, Thesis Eq. (3.26)-(3.29).

    Parameters
    ----------
    plant
        One integrator; beside it as many zeros as poles, or fewer where T_so or ``inverse_epsilon`` rolls off.
    T_so
        See :class:`FreePart`.
    inverse_epsilon
        epsilon of R_eps^-1 = R_0^-1/(1 + epsilon s)^2 in seconds, Thesis Eq. (3.2); 0 is the exact inverse.

    Raises
    ------
    InputError
        epsilon is negative, the plant is not of the class, or K comes out improper.
    """
    if not (np.isfinite(inverse_epsilon) and inverse_epsilon >= 0):
        raise InputError(f"epsilon of the approximate inverse is {inverse_epsilon:g} s; expected 0 or more")
    lag = (complex(-1 / inverse_epsilon),) * 2 if inverse_epsilon else ()
    require_thesis_class(plant, T_so.relative_degree - 1 + len(lag))
    s = Block(1.0, (0j,))
    K_0 = s * T_so
    inverse = plant_denominator(plant) * s.inverse() * plant_numerator(plant).inverse()
    K_1 = inverse * Block(float(np.prod(np.abs(lag))), (), lag)
    return K_0, K_1, K_0 * K_1


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
