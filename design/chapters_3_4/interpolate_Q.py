"""The stable function Q: its interpolation conditions and the three designs of section 4.1 (4.1)-(4.7)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from design.blocks.block import Block
from identification.base.errors import InputError


@dataclass(frozen=True)
class Conditions:
    """What Q must be at s = 0 and at the frequencies of the reference, Thesis Eq. (4.4).

    Parameters
    ----------
    a
        The parameter of N_p = 1/(s + a) and D_p = s/(s + a) in rad/s.
    delay_s
        T_d in seconds.
    omegas
        Angular frequencies of the reference in rad/s, positive and increasing; none for a constant.
    at_zero
        Q(0) = a (1 + a T_d).
    at_omegas
        Q(j omega), shape (len(omegas),).
    """

    a: float
    delay_s: float
    omegas: tuple[float, ...]
    at_zero: float
    at_omegas: tuple[complex, ...]

    @property
    def degree(self) -> int:
        """The least degree of Q: the number of conditions less one, a complex one counted twice (section 4.1)."""
        return 2 * len(self.omegas)


def conditions(omegas: Sequence[float], delay_s: float, a: float) -> Conditions:
    """The interpolation conditions (4.4), equivalent to (4.3) for C_0, for any number of frequencies.

    Parameters
    ----------
    omegas
        Angular frequencies of the reference in rad/s, not negative, no two the same. 0 is a constant, whose condition
        holds always.
    delay_s
        T_d in seconds, not negative.
    a
        The parameter of N_p = 1/(s + a) and D_p = s/(s + a) in rad/s, positive.

    Raises
    ------
    InputError
        A number is out of its range.
    """
    if not (np.isfinite([*omegas, delay_s, a]).all() and min(omegas, default=0) >= 0 and delay_s >= 0 and a > 0):
        raise InputError(
            f"omega = {', '.join(f'{omega:g}' for omega in omegas)}, T_d = {delay_s:g}, a = {a:g}; "
            "expected omega >= 0, T_d >= 0 and a > 0"
        )
    require_each_once(omegas)
    positive = tuple(float(omega) for omega in sorted(omegas) if omega > 0)
    at_omegas = wanted_at(np.array(positive), delay_s, a)
    return Conditions(a, delay_s, positive, a * (1 + a * delay_s), tuple(complex(value) for value in at_omegas))


def wanted_at(omega: np.ndarray, delay_s: float, a: float | np.ndarray) -> np.ndarray:
    """What Q(j omega) must be at positive frequencies in rad/s, Thesis Eq. (4.4); shape (n,)."""
    s = 1j * omega
    delayed = np.exp(-s * delay_s)
    return np.asarray((s + a - a * delayed) * (s + a) / (s * delayed))


def require_each_once(omegas: Sequence[float]) -> None:
    """Refuse a reference that has a frequency twice."""
    if len(set(omegas)) < len(omegas):
        raise InputError(
            f"the reference has the frequencies {', '.join(f'{omega:g}' for omega in omegas)} rad/s; expected each once"
        )


@dataclass(frozen=True)
class StableFunction:
    """Q(s) = numerator/denominator, Thesis Eq. (4.5); all designs are written so.

    Parameters
    ----------
    numerator
        Real coefficients, highest power first.
    poles
        In rad/s, stable.
    """

    numerator: tuple[float, ...]
    poles: tuple[complex, ...]

    @property
    def denominator(self) -> np.ndarray:
        """Real coefficients, highest power first, of the monic denominator."""
        return np.atleast_1d(np.real(np.poly(self.poles)))

    def block(self) -> Block:
        """Q as a block."""
        coefficients = np.trim_zeros(np.array(self.numerator), "f")
        return Block(coefficients[0], tuple(complex(root) for root in np.roots(coefficients)), self.poles)


def by_zeros(wanted: Conditions, pairs: Sequence[tuple[float, float]]) -> StableFunction:
    """ "Designing the zeros of Q": the denominator is chosen, the numerator interpolates, Eq. (4.5)-(4.7), Table 4.2.

    Parameters
    ----------
    wanted
        What Q must be.
    pairs
        e and f of each factor s^2 + e s + f of the denominator: as many as the reference has frequencies.

    Raises
    ------
    InputError
        There are not as many, or an e or f is not positive, so that Q would be unstable.
    """
    poles = poles_of(wanted.omegas, pairs)
    q = np.atleast_1d(np.real(np.poly(poles)))
    s = 1j * np.array(wanted.omegas)
    values = np.polyval(q, s) * np.array(wanted.at_omegas)
    return StableFunction(_through(wanted.omegas, q[-1] * wanted.at_zero, values), poles)


def poles_of(omegas: Sequence[float], pairs: Sequence[tuple[float, float]]) -> tuple[complex, ...]:
    """The roots of s^2 + e s + f, in rad/s, a pair for each sinusoid; raises InputError as :func:`by_zeros` does."""
    if len(pairs) != len(omegas):
        raise InputError(
            f"the reference has {len(omegas)} frequencies above 0 and there are {len(pairs)} pairs e, f; "
            "expected a pair for each"
        )
    for e, f in pairs:
        if not (np.isfinite([e, f]).all() and e > 0 and f > 0):
            raise InputError(f"e = {e:g} and f = {f:g}; expected both positive, or Q is unstable")
    poles: list[complex] = []
    for e, f in pairs:
        far = -e / 2 - np.sqrt(complex((e / 2) ** 2 - f))
        poles += [complex(far), complex(f / far)]
    return tuple(poles)


def lagrange(wanted: Conditions) -> StableFunction:
    """Lagrange interpolation with the thesis's denominator (s + 1)^(n - 1), section 4.1."""
    return by_zeros(wanted, [(2.0, 1.0)] * len(wanted.omegas))


def by_poles(wanted: Conditions) -> StableFunction:
    """ "Designing the poles of Q": constant numerator, the denominator interpolates, section 4.1.

    Raises
    ------
    InputError
        The poles come out unstable. The thesis's free numerator constant cannot help: it cancels.
    """
    denominator = _through(wanted.omegas, 1 / wanted.at_zero, 1 / np.array(wanted.at_omegas))
    poles = np.roots(denominator)
    if len(poles) < wanted.degree or not np.all(poles.real < 0):
        said = ", ".join(f"{pole:.4g}" for pole in poles)
        raise InputError(
            f"designing the poles of Q gives the unstable poles {said} at omega = "
            f"{', '.join(f'{omega:g}' for omega in wanted.omegas)} rad/s; expected all in the left half plane (use the "
            "zeros of Q instead)"
        )
    return StableFunction((float(1 / denominator[0]),), tuple(complex(pole) for pole in poles))


def _through(omegas: tuple[float, ...], at_zero: float, values: np.ndarray) -> tuple[float, ...]:
    """The real polynomial of least degree with p(0) = at_zero and p(j omega_i) = values_i, highest power first.

    Its even part is a polynomial in s^2 = -omega^2 through at_zero and Re values, its odd part s times one through
    Im values/omega: for one frequency these are the printed formulas (4.6) and (4.7).
    """
    omega = np.array(omegas)
    even = polynomial_through(np.append(0.0, -(omega**2)), np.append(at_zero, values.real))
    odd = polynomial_through(-(omega**2), values.imag / omega)
    coefficients = np.zeros(2 * len(omega) + 1)
    coefficients[0::2], coefficients[1::2] = even[::-1], odd[::-1]
    return tuple(float(coefficient) for coefficient in coefficients[::-1])


def polynomial_through(points: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Coefficients, highest power first, of the polynomial of degree n - 1 through n real points (n,), (n,)."""
    scale = float(np.max(np.abs(points), initial=0.0)) or 1.0
    n = len(points)
    scaled = np.linalg.solve(np.vander(points / scale, n), values) if n else np.empty(0)
    return np.asarray(scaled / scale ** np.arange(n - 1, -1, -1))
