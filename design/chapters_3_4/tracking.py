"""What T = T_so T_si must be for tracking and internal stability, and the T_so that is so with chosen poles."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from math import comb, factorial

import numpy as np
from flint import acb, acb_mat, arb, arb_poly

from design.blocks.ball import decided, number, polynomial_roots
from design.blocks.block import Block, plant_block
from design.blocks.inner_outer import inner_outer
from design.chapters_3_4.interpolate_Q import require_each_once
from identification.base.arrays import Complex, Real
from identification.base.errors import InputError
from identification.model.plant import PlantModel

Taylor = Callable[[acb, int], list[acb]]
"""From a point and a number of terms to the Taylor coefficients of a function there, the value first."""


@dataclass(frozen=True)
class TrackingConditions:
    """The interpolation conditions on T_so: T = 1 at every point below, as often as is said.

    Parameters
    ----------
    T_si
        The plant's inner factor with its dead time, see :func:`design.blocks.inner_outer.inner_outer`.
    at_zero
        How many derivatives of 1 - T vanish at s = 0, the value being the first: one for each integrator of the plant
        and one more, so that a constant disturbance at the plant's input leaves no error. It includes constants, and
        ramps for a plant with an integrator.
    zeros_at_zero
        How many zeros T_so has at s = 0: those of the plant.
    omegas
        Angular frequencies of the reference in rad/s, positive and increasing.
    unstable
        The plant's poles in Re s > 0, rad/s.
    """

    T_si: Block
    at_zero: int
    zeros_at_zero: int
    omegas: tuple[float, ...]
    unstable: tuple[complex, ...]

    @property
    def points(self) -> list[tuple[complex, int]]:
        """Every point with its multiplicity; conjugate points are both named."""
        waves = [(complex(0, sign * omega), 1) for omega in self.omegas for sign in (1, -1)]
        poles = [(pole, self.unstable.count(pole)) for pole in dict.fromkeys(self.unstable)]
        return ([(0j, self.at_zero)] if self.at_zero else []) + waves + poles

    @property
    def count(self) -> int:
        """How many real conditions there are, and so how many coefficients n has."""
        return self.at_zero + 2 * len(self.omegas) + len(self.unstable)


def tracking_conditions(
    plant: PlantModel, omegas: tuple[float, ...], integral_action: bool = True
) -> TrackingConditions:
    """The conditions of a plant and a reference, which generalise Thesis Eq. (4.4).

    Parameters
    ----------
    plant
        P.
    omegas
        Angular frequencies of the reference in rad/s, no two the same; 0 is a constant.
    integral_action
        Whether 1 - T has at s = 0 one zero more than the plant has integrators.

    Raises
    ------
    InputError
        A frequency is negative, not finite or given twice; the reference is a constant and the plant has a zero at
        s = 0; or it is a sinusoid at which the plant has an undamped zero.
    """
    if not omegas or not (np.isfinite(omegas).all() and min(omegas) >= 0):
        raise InputError(
            f"the frequencies of the reference are {', '.join(f'{omega:g}' for omega in omegas) or 'none'} rad/s; "
            "expected one or more, none negative"
        )
    require_each_once(omegas)
    if plant.integrators < 0 and 0 in omegas:
        raise InputError(
            f"the plant has {-plant.integrators} zero(s) at s = 0, so that no bounded control holds a constant "
            "reference; expected frequencies above 0"
        )
    for omega in omegas:
        if omega and complex(0, omega) in plant_block(plant).zeros:
            raise InputError(
                f"the plant has a zero at the reference's frequency {omega:g} rad/s; expected another frequency"
            )
    one_more = plant.integrators >= 0 and (integral_action or 0 in omegas)
    return TrackingConditions(
        T_si=inner_outer(plant)[0],
        at_zero=max(plant.integrators, 0) + one_more,
        zeros_at_zero=max(0, -plant.integrators),
        omegas=tuple(float(omega) for omega in sorted(omegas) if omega > 0),
        unstable=plant.unstable_poles,
    )


def outer_part(wanted: TrackingConditions, poles: Sequence[complex]) -> Block:
    """T_so = s^zeros n(s)/D(s) with n of least degree that meets the conditions, D(s) = prod(s - pole).

    Parameters
    ----------
    wanted
        The conditions; n has as many coefficients as there are conditions.
    poles
        Of T_so in rad/s, stable; conjugates of each other where they are complex.

    Raises
    ------
    InputError
        Two points are so near each other that rounding errors exceed the coefficients of n.

    Notes
    -----
    n(s) = D(s)/(s^zeros T_si(s)) at every point, with as many derivatives as the point asks for: a linear system, which
    is solved in ball arithmetic, so that no accuracy is lost however far the points lie apart. The zeros of n are
    rounded to doubles at the end.
    """
    unit = 2.0 ** round(float(np.log2(np.mean(np.abs(poles)))))
    n = decided(lambda: factored(interpolating(wanted.points, partial(_target, wanted, poles), unit), unit))
    if n is None:
        raise InputError("rounding errors exceed the numerator of T_so; expected frequencies farther apart")
    return Block(n.gain, n.zeros + (0j,) * wanted.zeros_at_zero, tuple(poles))


def interpolating(points: Sequence[tuple[complex, int]], taylor: Taylor, unit: float) -> list[arb]:
    """The real polynomial of least degree with given Taylor coefficients at points.

    Parameters
    ----------
    points
        Each with its multiplicity; conjugate points are both named.
    taylor
        Of what it is to meet at the points.
    unit
        The polynomial is one in s/unit.

    Returns
    -------
    list
        Its coefficients, as many as the multiplicities add up to, the lowest power first.
    """
    count = sum(multiplicity for _, multiplicity in points)
    rows, values, scale = [], [], arb(unit)
    for point, multiplicity in points:
        series = taylor(number(point), multiplicity)
        for j in range(multiplicity):
            rows.append(powers(number(point) / scale, j, count))
            values.append([series[j] * scale**j])
    found = acb_mat(rows).solve(acb_mat(values))
    return [found[k, 0].real for k in range(count)]


def factored(coefficients: Sequence[arb], unit: float) -> Block:
    """The polynomial in s/unit with these coefficients, the lowest power first, as a block."""
    known = list(coefficients)
    while len(known) > 1 and known[-1].contains(0):
        known.pop()  # it is of lower degree
    zeros = tuple(complex(root * arb(unit)) for root in polynomial_roots(arb_poly(known)))
    return Block(float(known[-1] / arb(unit) ** (len(known) - 1)), zeros)


def powers(z: acb, j: int, count: int) -> list[acb]:
    """The j-th Taylor coefficient at z of 1, x, x^2, ..."""
    return [comb(k, j) * z ** (k - j) if k >= j else acb(0) for k in range(count)]


def taylor_times(series: list[acb], block: Block, point: acb) -> list[acb]:
    """The first Taylor coefficients at a point of a function times a block without dead time, from the function's."""
    series = [arb(block.gain) * term for term in series]
    for root in block.zeros:
        series = _times(series, point - number(root))
    for root in block.poles:
        series = _over(series, point - number(root))
    return series


def _target(wanted: TrackingConditions, poles: Sequence[complex], point: acb, terms: int) -> list[acb]:
    """The first Taylor coefficients of D/(s^zeros T_si) at a point."""
    T_si = wanted.T_si
    delay = arb(T_si.delay_s)
    late = (delay * point).exp() / arb(T_si.gain)
    series = [late * delay**k / factorial(k) for k in range(terms)]
    inverse = Block(1.0, (*poles, *T_si.poles), (*T_si.zeros, *(0j,) * wanted.zeros_at_zero))
    return taylor_times(series, inverse, point)


def _times(series: list[acb], value: acb) -> list[acb]:
    """The series times value + x."""
    return [value * series[k] + (series[k - 1] if k else acb(0)) for k in range(len(series))]


def _over(series: list[acb], value: acb) -> list[acb]:
    """The series over value + x."""
    quotient: list[acb] = []
    for k, term in enumerate(series):
        quotient.append((term - (quotient[k - 1] if k else acb(0))) / value)
    return quotient


class RolledOff:
    """|T_so| and |1 - T| at frequencies for poles that are chosen but for a roll-off, T_so/(1 + s/rate)^order.

    Parameters
    ----------
    wanted, poles
        As for :func:`outer_part`; the roll-off comes in addition.

    Notes
    -----
    n is linear in its values at the points: n(s) = sum_i values_i basis_i(s), and no pole enters the basis polynomials.
    """

    def __init__(self, wanted: TrackingConditions, poles: Sequence[complex]) -> None:
        self.wanted, self.poles = wanted, np.array(poles)
        self.unit = float(np.mean(np.abs(self.poles)))
        rows = []
        self._series: list[tuple[complex, Complex]] = []
        for point, multiplicity in wanted.points:
            series = _target(wanted, poles, number(point), multiplicity)
            self._series.append((point, np.array([complex(term) for term in series])))
            rows += [powers(number(point) / self.unit, j, wanted.count) for j in range(multiplicity)]
        inverse = acb_mat(rows).inv()
        count = range(wanted.count)
        self._basis = np.array([[complex(inverse[k, i]) for i in count] for k in count])

    def T_so(self, omega: Real, rate: Real, order: int) -> Complex:
        """T_so at frequencies (n,) in rad/s for rates (m,) in rad/s, shape (m, n)."""
        values = np.concatenate([self._rolled(*each, rate, order) for each in self._series], axis=1)
        s = 1j * np.asarray(omega)
        basis = np.stack([(s / self.unit) ** k for k in range(self.wanted.count)], axis=1) @ self._basis
        fixed = s**self.wanted.zeros_at_zero / np.prod(s[:, None] - self.poles, axis=1)
        found, factor = (values @ basis.T) * fixed, 1 / (1 + s / rate[:, None])
        for _ in range(order):  # numpy raises complex numbers to powers by their logarithms
            found *= factor
        return np.asarray(found)

    def _rolled(self, point: complex, series: Complex, rate: Real, order: int) -> Complex:
        """The Taylor coefficients of the target with the roll-off, (m, terms), in powers of (s - point)/unit."""
        terms = len(series)
        factor = [
            comb(order, j) * (1 + point / rate) ** (order - j) / rate**j if j <= order else 0 * rate
            for j in range(terms)
        ]
        found = [sum(series[k - j] * factor[j] for j in range(k + 1)) * self.unit**k for k in range(terms)]
        return np.stack(found, axis=1)
