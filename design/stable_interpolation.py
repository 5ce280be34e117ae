"""The stable function Q: its interpolation conditions and the three designs of section 4.1 (4.1)-(4.7)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from design.block import Block
from identification.files import InputError


@dataclass(frozen=True)
class Conditions:
    """What Q must be at s = 0 and s = j omega, Thesis Eq. (4.4).

    Parameters
    ----------
    omega
        Angular frequency of the reference in rad/s.
    at_zero
        Q(0) = a (1 + a T_d).
    at_omega
        Q(j omega).
    """

    omega: float
    at_zero: float
    at_omega: complex


def conditions(omega: float, delay_s: float, a: float) -> Conditions:
    """The interpolation conditions (4.4), equivalent to (4.3) for C_0.

    Parameters
    ----------
    omega
        Angular frequency of the reference in rad/s, positive.
    delay_s
        T_d in seconds, not negative.
    a
        The parameter of N_p = 1/(s + a) and D_p = s/(s + a) in rad/s, positive.
    """
    if not (np.isfinite([omega, delay_s, a]).all() and omega > 0 and delay_s >= 0 and a > 0):
        raise InputError(f"omega = {omega:g}, T_d = {delay_s:g}, a = {a:g}; expected omega > 0, T_d >= 0 and a > 0")
    s = 1j * omega
    delayed = np.exp(-s * delay_s)
    at_omega = (s + a - a * delayed) * (s + a) / (s * delayed)
    return Conditions(omega, a * (1 + a * delay_s), complex(at_omega))


@dataclass(frozen=True)
class StableFunction:
    """Q(s) = (b s^2 + c s + d)/(s^2 + e s + f), Thesis Eq. (4.5); the other two designs are written so too."""

    b: float
    c: float
    d: float
    e: float
    f: float

    @property
    def numerator(self) -> np.ndarray:
        """Coefficients of b s^2 + c s + d, highest power first."""
        return np.array([self.b, self.c, self.d])

    @property
    def poles(self) -> tuple[complex, complex]:
        """Roots of s^2 + e s + f in rad/s."""
        half = -self.e / 2
        far = half + (-1 if half <= 0 else 1) * np.sqrt(complex(half**2 - self.f))
        return complex(far), complex(self.f / far)

    def block(self) -> Block:
        """Q as a block."""
        coefficients = np.trim_zeros(self.numerator, "f")
        return Block(coefficients[0], tuple(complex(root) for root in np.roots(coefficients)), self.poles)


def by_zeros(wanted: Conditions, e: float, f: float) -> StableFunction:
    """ "Designing the zeros of Q": e and f place the poles, the numerator interpolates, Thesis Eq. (4.5)-(4.7).

    Raises
    ------
    InputError
        e or f is not positive, so that Q would be unstable.
    """
    if not (np.isfinite([e, f]).all() and e > 0 and f > 0):
        raise InputError(f"e = {e:g} and f = {f:g}; expected both positive, or Q is unstable")
    s = 1j * wanted.omega
    value = (s**2 + e * s + f) * wanted.at_omega
    d = f * wanted.at_zero  # Eq. (4.6)
    return StableFunction(
        b=float((value.real - d) / -(wanted.omega**2)),  # Eq. (4.7)
        c=float(value.imag / wanted.omega),
        d=d,
        e=e,
        f=f,
    )


def lagrange(wanted: Conditions) -> StableFunction:
    """Lagrange interpolation with the thesis's denominator (s + 1)^2, section 4.1."""
    return by_zeros(wanted, e=2.0, f=1.0)


def by_poles(wanted: Conditions) -> StableFunction:
    """ "Designing the poles of Q": constant numerator, the denominator interpolates, section 4.1.

    Raises
    ------
    InputError
        The poles come out unstable. The thesis's free numerator constant cannot help: it cancels.
    """
    s = 1j * wanted.omega
    inverse = 1 / wanted.at_omega  # (d s^2 + e s + f)/b at s = j omega
    constant = 1 / wanted.at_zero
    d = (inverse.real - constant) / -(wanted.omega**2)
    e = inverse.imag / wanted.omega
    found = StableFunction(b=0.0, c=0.0, d=1 / d, e=e / d, f=constant / d)
    if not (found.e > 0 and found.f > 0):
        poles = ", ".join(f"{pole:.4g}" for pole in found.poles)
        raise InputError(
            f"designing the poles of Q gives the unstable poles {poles} at omega = {abs(s):g} rad/s; "
            "expected both in the left half plane (use the zeros of Q instead)"
        )
    return found
