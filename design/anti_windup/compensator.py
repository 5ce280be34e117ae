"""The anti-windup compensators theta1~ and theta2 (2.16)-(2.18), (2.23), and their cost f (2.19)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from design.blocks.block import Block, bound_block, from_polynomial, geometric_scale, plant_block, polynomial
from design.blocks.frequency_peak import block_norm
from identification.base.errors import InputError
from identification.base.json_object import member
from identification.model.additive_bound import AdditiveBound
from identification.model.plant import PlantModel

AT_ZERO = 1e-9  # |1 + theta1~(0)| below this, relative to what it is the difference of, is rounding


@dataclass(frozen=True)
class AntiWindup:
    """theta1~ with 1 + theta1~ beside it, each factored, so that their roots are known without subtraction.

    Parameters
    ----------
    theta1_tilde
        Strictly proper and stable.
    one_plus
        1 + theta1~, with the same poles.
    """

    theta1_tilde: Block
    one_plus: Block

    def theta2(self, plant: PlantModel) -> Block:
        """theta2 = P (1 + theta1~), Thesis Eq. (2.18), (3.30); for P, (2.11); its dead time is the plant's."""
        return self.deviation(plant_block(plant), self.one_plus)

    def deviation(self, plant: Block, one_plus: Block) -> Block:
        """From u_tilde to y_d, for the plant and 1 + theta1~ in any time, such as their sampled ones."""
        return plant * one_plus

    def to_dict(self) -> dict[str, Any]:
        """Both blocks as design.json holds them."""
        return {"theta1_tilde": self.theta1_tilde.to_dict(), "one_plus": self.one_plus.to_dict()}

    @classmethod
    def from_dict(cls, content: Mapping[str, Any]) -> AntiWindup:
        """Read what :meth:`to_dict` writes.

        Raises
        ------
        InputError
            A block is missing or of the wrong form, or theta1~ is not strictly proper and stable, or the other
            block is not 1 + theta1~.
        """
        found = cls(*(Block.from_dict(member(content, name)) for name in ("theta1_tilde", "one_plus")))
        _require_strictly_proper_and_stable(found.theta1_tilde)
        # right of every pole, at points that no root is special to
        s = 1.7 * geometric_scale(Block(1.0, found.one_plus.poles)) * np.array([0.3, 1.0, 3.0 + 2.0j])
        difference = found.one_plus(s) - 1 - found.theta1_tilde(s)
        if not np.all(np.abs(difference) <= 1e-6 * (1 + np.abs(found.theta1_tilde(s)))):
            raise InputError("the block 'one_plus' is not 1 + theta1_tilde")
        return found


def anti_windup(theta1_tilde: Block) -> AntiWindup:
    """theta1~ of any order, with the zeros of 1 + theta1~ computed.

    Parameters
    ----------
    theta1_tilde
        Strictly proper and stable, without dead time.

    Raises
    ------
    InputError
        It is not.

    Notes
    -----
    A zero of 1 + theta1~ at s = 0 that only rounding moves is put there: it decides whether theta2 has the
    plant's integrator.
    """
    _require_strictly_proper_and_stable(theta1_tilde)
    return AntiWindup(theta1_tilde, plus_one(theta1_tilde))


def plus_one(block: Block) -> Block:
    """1 + a strictly proper block without dead time; a zero that only rounding moves from s = 0 is put there."""
    q = geometric_scale(Block(1.0, block.poles))
    denominator = polynomial(Block(1.0, block.poles), q)
    numerator = polynomial(Block(block.gain, block.zeros), q)
    total = np.polyadd(denominator, numerator)
    size = np.polyadd(np.abs(denominator), np.abs(numerator))
    at_zero = 0
    while abs(total[-1]) <= AT_ZERO * size[len(total) - 1]:
        total, at_zero = total[:-1], at_zero + 1
    return Block(1.0, from_polynomial(total, q).zeros + (0j,) * at_zero, block.poles)


def from_one_plus(one_plus: Block) -> AntiWindup:
    """theta1~ from 1 + theta1~, its numerator by subtraction of two monic polynomials.

    Parameters
    ----------
    one_plus
        Stable, with as many zeros as poles and the gain 1, without dead time.

    Raises
    ------
    InputError
        It is not.
    """
    if one_plus.relative_degree or one_plus.gain != 1 or not one_plus.is_stable or one_plus.delay_s:
        raise InputError(
            "1 + theta1~ is unstable, has a dead time or differs from 1 at infinite frequency; expected none of these"
        )
    q = geometric_scale(Block(1.0, one_plus.poles))
    numerator, denominator = (polynomial(Block(1.0, roots), q) for roots in (one_plus.zeros, one_plus.poles))
    return AntiWindup(from_polynomial(numerator - denominator, q) * Block(1.0, (), one_plus.poles), one_plus)


def _require_strictly_proper_and_stable(theta1_tilde: Block) -> None:
    if theta1_tilde.gain == 0 and not theta1_tilde.poles:
        return
    if theta1_tilde.relative_degree < 1 or not theta1_tilde.is_stable or theta1_tilde.delay_s:
        raise InputError(
            f"theta1~ has {len(theta1_tilde.zeros)} zeros and the poles "
            f"{', '.join(f'{pole:.4g}' for pole in theta1_tilde.poles) or 'none'}; expected a strictly proper "
            "and stable one without dead time"
        )


def second_order(alpha: float, beta: float, gamma: float) -> AntiWindup:
    """theta1~ = gamma / ((1 + alpha s)(1 + beta s)), Thesis Eq. (2.23).

    Parameters
    ----------
    alpha, beta
        Time constants in seconds, positive.
    gamma
        Gain at s = 0. The zeros of 1 + theta1~ have the product (1 + gamma)/(alpha beta).

    Raises
    ------
    InputError
        alpha or beta is not positive, or a number is not finite.
    """
    if not (np.isfinite([alpha, beta, gamma]).all() and alpha > 0 and beta > 0):
        raise InputError(f"alpha = {alpha:g}, beta = {beta:g}, gamma = {gamma:g}; expected alpha > 0 and beta > 0")
    poles = (complex(-1 / alpha), complex(-1 / beta))
    # s^2 + (1/alpha + 1/beta) s + (1 + gamma)/(alpha beta)
    half_sum, product = (1 / alpha + 1 / beta) / 2, (1 + gamma) / (alpha * beta)
    far = -half_sum - np.sqrt(complex(half_sum**2 - product))
    near = product / far
    return AntiWindup(
        theta1_tilde=Block(gamma / (alpha * beta), (), poles),
        one_plus=Block(1.0, (complex(far), complex(near)), poles),
    )


def uncertainty_cost(bound: AdditiveBound, one_plus: Block) -> tuple[float, float]:
    """f = ||W_a (1 + theta1~)||_inf of Thesis Eq. (2.19), and where in rad/s it is reached; infinite: as omega grows.

    The norm exceeds f by 1e-9 of it at most, which :func:`design.blocks.frequency_peak.block_norm` proves.
    """
    return block_norm(bound_block(bound) * one_plus)
