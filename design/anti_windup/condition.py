"""What M = 1 + theta1~ has to meet on the imaginary axis: as rows of a linear program, and as a proof for given roots.

A condition is Re(turn M) weight >= least at every frequency, for one or two factors ``turn`` of modulus 1.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from flint import fmpq_poly

from design.anti_windup.compensator import AntiWindup
from design.anti_windup.popov import meets_circle_criterion
from design.blocks.block import Block
from design.blocks.frequency_peak import block_norm, frequency_grid, peak, refined_maxima
from design.blocks.positivity import exact, not_positive_at, popov_polynomial, squared_magnitude
from identification.base.arrays import Complex, Real
from identification.base.errors import InputError

MARGIN = 2e-4  # by which a condition is tightened at most, relative: what lies between the frequencies
FINE = 2000  # frequencies a decade of a searched condition
REACHED = 0.5  # |W_a C S| at which x/(1 - x) is 1 and no M is left
BETWEEN = 8  # frequencies of x between two of a linear program


@dataclass(frozen=True)
class Sector:
    """The circle criterion: Re theta1~ + 1/k > 0.

    Parameters
    ----------
    k
        Between 0 and 1: with limits +-L the dead zone lies in the sector as long as |u| <= L/(1 - k).

    Raises InputError for another k.
    """

    k: float
    is_scaled = False
    tighter = ()

    def __post_init__(self) -> None:
        if not 0 < self.k < 1:
            raise InputError(f"the sector is {self.k:g}; expected 0 < sector < 1")

    def __str__(self) -> str:
        return f"the sector {self.k:g}"

    @property
    def least(self) -> float:
        """The least Re M, with the margin."""
        return 1 - (1 - min(MARGIN, (1 - self.k) / 2)) / self.k

    def turns(self, omega: Real) -> Complex:
        """Shape (1, n): one factor, 1."""
        return np.ones((1, len(omega)), dtype=complex)

    def holds(self, kind: AntiWindup) -> bool:
        """Whether the condition without its margin holds, in exact arithmetic."""
        return meets_circle_criterion(kind.theta1_tilde, self.k)


@dataclass(frozen=True)
class Robustness:
    """x = |W_a C S| of the loop without saturation.

    Parameters
    ----------
    magnitude
        x as a function of omega in rad/s, (n,) -> (n,).
    roots
        Poles and zeros in rad/s that shape it.
    rational
        W_a C S where it is rational with known roots, else None.
    """

    magnitude: Callable[[Real], Real]
    roots: tuple[complex, ...]
    rational: Block | None = None

    @property
    def largest(self) -> tuple[float, float]:
        """The largest x and its frequency in rad/s; proved where W_a C S is rational, else searched."""
        return peak(self.magnitude, self.roots) if self.rational is None else block_norm(self.rational)

    def loss(self, omega: Real) -> Real:
        """x/(1 - x), how far the uncertainty may turn what multiplies M; infinite from x = 1 on."""
        x = self.magnitude(omega)
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.asarray(np.where(x < 1, x / (1 - x), np.inf))


@dataclass(frozen=True)
class PositiveReal:
    """Re M > 0 at every omega > 0; with a robustness Re M > |M| x/(1 - x), so that it holds for every plant within W_a.

    Parameters
    ----------
    robustness
        x; None for the model alone.

    Raises InputError where x reaches 1/2: there the condition leaves no M.

    Notes
    -----
    Re M >= |M| sin(phi) is the cone |arg M| <= 90 degrees - phi, that is Re(M exp(+-j phi)) >= 0, both linear in the
    numerator of M. With M(0) = 0 the left sides fall like omega^2 as omega -> 0; they are multiplied by
    |1 + rate/(j omega)|^2, so that the row there says something.
    """

    robustness: Robustness | None = None
    is_scaled = True
    least = MARGIN
    tighter = (1e-3, 5e-3, 2e-2)  # further margins, tried in turn where M falls below 0 between two frequencies

    def __post_init__(self) -> None:
        if self.robustness is not None:
            x, omega = self.robustness.largest
            if x >= REACHED:
                raise InputError(
                    f"|W_a C S| reaches {x:.4g} at {omega:.4g} rad/s; expected less than 1/2 for a robust guarantee"
                )

    def __str__(self) -> str:
        return "Re M > 0" if self.robustness is None else "Re M > |M| x/(1 - x), x = |W_a C S|,"

    def turns(self, omega: Real) -> Complex:
        """Shape (1, n) or (2, n): exp(+-j phi), phi the largest from the frequency before to the one behind."""
        if self.robustness is None:
            return np.ones((1, len(omega)), dtype=complex)
        places = np.arange(len(omega) * BETWEEN - BETWEEN + 1) / BETWEEN
        loss = self.robustness.loss(np.exp(np.interp(places, np.arange(len(omega)), np.log(omega))))
        padded = np.concatenate([np.zeros(BETWEEN), loss, np.zeros(BETWEEN)])
        largest = np.lib.stride_tricks.sliding_window_view(padded, 2 * BETWEEN + 1)[::BETWEEN].max(axis=1)
        turn = np.exp(1j * np.arcsin(largest))
        return np.stack([turn, turn.conj()])

    def holds(self, kind: AntiWindup) -> bool:
        """Whether the condition without its margin holds.

        In exact arithmetic for the model alone, and where W_a C S is rational; else on a fine grid whose minima are
        refined.
        """
        if not is_positive_real(kind.one_plus):
            return False
        if self.robustness is None:
            return True
        return self._is_met_on_a_grid(kind.one_plus, self.robustness) and (
            self.robustness.rational is None or _is_robust(kind.one_plus, self.robustness.rational)
        )

    @staticmethod
    def _is_met_on_a_grid(M: Block, robustness: Robustness) -> bool:
        def excess(omega: Real) -> Real:
            value = M(1j * omega)
            return np.asarray(robustness.loss(omega) - value.real / np.abs(value))

        omega = frequency_grid((*M.zeros, *M.poles, *robustness.roots), FINE)
        return bool(refined_maxima(excess, omega, excess(omega))[1].max() < 0)


Condition = Sector | PositiveReal


def is_positive_real(M: Block) -> bool:
    """Whether a stable M is positive real with Re M(j omega) > 0 for all omega but 0, M(0) = 0 at most simple; exactly.

    Re M |d|^2 is a polynomial in x = omega^2; a zero of M at s = 0 is its root at x = 0, which is divided out.
    """
    if not M.is_stable or M.zeros.count(0j) > 1:
        return False
    return not_positive_at(popov_polynomial(M, 0.0).right_shift(M.zeros.count(0j))) is None


def _is_robust(M: Block, W_a_C_S: Block) -> bool:
    """Whether Re M > |M| x/(1 - x) for x = |W_a C S| < 1/2 and a positive real M, in exact arithmetic.

    With r = Re M, m = |M| and R = x^2 this is r^2 (1 + R) - m^2 R > 2 r^2 x. Left and right are squared: no root is
    left, and both conditions are polynomials in omega^2.
    """
    real, modulus = popov_polynomial(M, 0.0), squared_magnitude(M.zeros)
    poles = squared_magnitude(M.poles)
    above = exact(W_a_C_S.gain) ** 2 * squared_magnitude(W_a_C_S.zeros)
    below = squared_magnitude(W_a_C_S.poles)
    left = real**2 * (below + above) - modulus * poles * above
    difference = left**2 - 4 * real**4 * above * below
    return all(not_positive_at(_without_root_at_zero(each)) is None for each in (left, difference))


def _without_root_at_zero(polynomial: fmpq_poly) -> fmpq_poly:
    return polynomial.right_shift(next((k for k, value in enumerate(polynomial.coeffs()) if value), 0))
