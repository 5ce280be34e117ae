"""The closed loop of G and K: its poles, and a bound on the norm (2.8), from the factors' roots in ball arithmetic."""

from __future__ import annotations

from itertools import pairwise

from flint import arb

from design.blocks.ball import UndecidedError, decided, line, polynomial_roots, reflected, shared, squared
from design.blocks.block import Block
from identification.base.errors import InputError

MARGIN = 1e-9  # of the bound over the highest value found, relative


def closed_loop_norm(G: Block, W1: Block, W2: Block, K: Block, decay_rate: float = 0.0) -> float:
    """The least upper bound on || [W1 S; W2 T] || over Re s > -decay_rate, at most 2e-9 of itself above the norm.

    Parameters
    ----------
    G, W1, W2, K
        Without dead time; M = [W1 S; W2 T] is proper and has its poles left of -decay_rate.
    decay_rate
        In 1/s.

    Raises
    ------
    InputError
        1 + G K is zero at infinite frequency, or rounding errors are too large for the norm.

    Notes
    -----
    At a level above the norm, level^2 |denominator|^2 - |numerator|^2, a polynomial in omega^2, has no positive root.
    Where it has some, the level rises to the highest value between two of them (S. Boyd and V. Balakrishnan, Systems
    & Control Letters 15 (1990) 1-7). The last level is proved.
    """
    L = G * K
    first, second = W1 * Block(1.0, L.poles), W2 * Block(1.0, L.zeros)  # W1 S, W2 T without characteristic and gain
    _, zeros1, poles1 = reflected(first.zeros, first.poles, decay_rate)
    common, own1, own2 = shared(poles1, second.poles)

    def bound() -> float:
        x = line(decay_rate, G, W1, W2, K)
        characteristic = x.polynomial(L.poles) + x.gain(L) * x.polynomial(L.zeros)
        numerator = squared(x.gain(W1) * x.polynomial((*zeros1, *own2)))
        numerator += squared(x.gain(W2) * x.gain(L) * x.polynomial((*second.zeros, *own1)))
        denominator = squared(x.polynomial((*common, *own1, *own2)) * characteristic)
        if numerator.degree() > denominator.degree():
            raise InputError("1 + G K is zero at infinite frequency; expected a well-posed loop")
        level = _ratio(numerator[denominator.degree()], denominator[denominator.degree()])
        squares = [arb(0), *(-(abs(root) ** 2).mid() for root in x.points((*L.poles, *first.poles, *second.poles)))]
        while squares:  # -omega^2 at which the level is tried
            level = max([level, *(_ratio(numerator(square), denominator(square)) for square in squares)], key=float)
            level = (level * (1 + arb(MARGIN))).mid()
            polynomial = level**2 * denominator - numerator
            crossings = [root.real for root in polynomial_roots(polynomial) if root.imag == 0 and root.real < 0]
            crossings.sort(key=float)
            squares = [-(low * high).sqrt().mid() for low, high in pairwise(crossings)]
        if not polynomial(arb(0)) > 0:
            raise UndecidedError("the norm at omega = 0 may exceed the level")
        return float(level * (1 + arb(MARGIN)))

    found = decided(bound)
    if found is None:
        raise InputError(
            "rounding errors are too large for the closed loop's norm; expected W1 S and W2 T that vary with frequency"
        )
    return found


def _ratio(numerator: arb, denominator: arb) -> arb:
    """The modulus from the squares of its numerator and denominator."""
    if denominator.contains(0):
        raise UndecidedError("a denominator may be zero")
    return abs(numerator / denominator).sqrt()


def closed_loop_poles(G: Block, K: Block) -> tuple[complex, ...]:
    """Roots in rad/s of 1 + G K, including what cancels between the factors (internal stability, as in Eq. (3.15)).

    Raises
    ------
    InputError
        1 + G K vanishes at infinite frequency: the loop is not well posed; or rounding errors are too large for a pole.
    """
    cancelled, zeros, poles = shared((*G.zeros, *K.zeros), (*G.poles, *K.poles))
    L = Block(G.gain * K.gain, tuple(zeros), tuple(poles))

    def roots() -> list[complex]:
        x = line(0.0, G, K)
        characteristic = x.polynomial(L.poles) + x.gain(L) * x.polynomial(L.zeros)
        if characteristic.degree() < max(len(poles), len(zeros)):
            raise InputError("1 + G K is zero at infinite frequency; expected a well-posed loop")
        return [x.back(root) for root in polynomial_roots(characteristic)]

    found = decided(roots)
    if found is None:
        raise InputError(
            "rounding errors are too large for the closed loop's poles; expected them distinct and away from 0"
        )
    return (*cancelled, *found)
