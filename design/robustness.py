"""Margins of a loop with its exact dead time, and whether the additive bound guarantees its stability."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from design.block import bound_block, plant_block
from design.contract import Design
from design.coprime import Real, evaluate
from design.quasi_polynomial import DelayLoop, asymptotic_omega, normalised, roots_right_of, trace
from identification.files import InputError
from identification.plant import AdditiveBound, Complex, PlantModel

Function = Callable[[Real], Complex]  # of omega (n,) in rad/s
Response = Callable[[Real], Real]

LARGEST = 1e3  # gain factors beyond it, or below 1/LARGEST, count as none
BISECTIONS = 70  # halvings, or cuts by the golden section, that refine a crossing or a peak


class Margin(NamedTuple):
    """A margin or peak and the frequency in rad/s where it is reached; None where the loop has no such limit."""

    value: float
    omega: float | None


@dataclass(frozen=True)
class Margins:
    """What a loop tolerates, each limit alone, with L = P C and negative feedback.

    Parameters
    ----------
    gain_down, gain_up
        The loop stays stable while the gain is multiplied by a factor between these; 0 and inf without a limit
        within a factor of LARGEST.
    phase_deg
        The least rotation of L, forward or back, that makes the loop unstable, in degrees; inf without a limit.
    delay_least_s, delay_greatest_s
        The loop stays stable for true dead times of the plant between these around its own, the controller being
        kept as it is; 0 and inf without a limit.
    modulus
        min |1 + L| = 1/||S||.
    T_peak
        ||T||, T = L/(1 + L).
    W_a_C_S
        || W_a C S ||: below 1 every plant P + Delta, Delta stable and |Delta| < |W_a|, is stabilised.
    hidden
        Hidden roots that are not in the open left half plane, see :class:`DelayLoop`; no margin sees them.
    """

    gain_down: Margin
    gain_up: Margin
    phase_deg: Margin
    delay_least_s: Margin
    delay_greatest_s: Margin
    modulus: Margin
    T_peak: Margin
    W_a_C_S: Margin
    hidden: tuple[complex, ...]

    @property
    def is_guaranteed(self) -> bool:
        """Whether the additive bound guarantees robust stability."""
        return self.W_a_C_S.value < 1


def delay_loop(design: Design, plant: PlantModel) -> DelayLoop:
    """A design's controller, Thesis Eq. (3.10) or (3.31), with any plant and its dead time.

    Notes
    -----
    Chapter 2, C = K A/Lambda, hides every pole of the plant. A disturbance at the plant's input excites them; s = 0
    is among them, so that y drifts. Chapters 3 and 4, K = s T_so A/(s B), hide every pole of the plant, every zero
    (the control rings with it) and the poles of T_so. There s = 0 is seen neither from the reference nor from the
    plant's input, as 1 - T_so exp(-T_d s) is zero there twice; but in the controller as drawn a disturbance of its
    inner loop, or initial states of K or T_so, leave a constant offset in y for ever.
    """
    forward, feedback = design.controller_parts()
    return DelayLoop(plant_block(plant), forward, feedback, design.loop_plant.delay_s)


def margins_of(loop: DelayLoop, bound: AdditiveBound) -> Margins:
    """All margins of a stable loop, with the exact dead times.

    Parameters
    ----------
    loop
        Its plant is the nominal one.
    bound
        W_a, the additive bound on what the plant may differ by.

    Raises
    ------
    InputError
        The loop is not stable or a root is on the imaginary axis, so that it has no margins.

    Notes
    -----
    With L = b/a, a and b from :func:`normalised`, both finite on the axis, a loop k e^(-j phi) e^(-j omega tau) L
    has a root at j omega where a + k e^(-j phi) e^(-j omega tau) b = 0. The frequencies where that has a solution
    in k, phi or tau alone are zeros of Im(b/a) and of |b| - |a|. They and the peaks are looked for between the
    points of :func:`trace` for a, b, a + b and, also where |L| is negligible, the numerator of W_a C S.
    """
    delay_s = loop.plant.delay_s
    outside = tuple(root for root in loop.hidden if root.real >= 0)
    unstable = roots_right_of(loop, 0.0) + sum(root.real > 0 for root in outside)
    if unstable:
        raise InputError(f"the loop has {unstable} roots in the right half plane; margins are those of a stable loop")
    first, second, third = normalised(loop, 0.0)
    control = (loop.forward * first * bound_block(bound),)
    top = asymptotic_omega(loop, 0.0, 1 / LARGEST)
    omega = trace([(first, second), (third,), (first, second, third)], 0.0, top)
    fastest = max(abs(root) for root in control[0].zeros + control[0].poles)
    omega = np.union1d(omega, trace([control], 0.0, max(top, 10 * fastest)))

    def a(omega: Real) -> Complex:
        return evaluate((first, second), 1j * omega)[0]

    def b(omega: Real) -> Complex:
        return evaluate((third,), 1j * omega)[0]

    def closed(numerator: Function) -> Response:
        return lambda omega: np.abs(numerator(omega) / (a(omega) + b(omega)))

    def sine(omega: Real) -> Real:
        product = b(omega) * np.conj(a(omega))
        return np.asarray(np.imag(product) / np.maximum(np.abs(product), np.finfo(float).tiny))

    def excess(omega: Real) -> Real:
        numerator, denominator = np.abs(b(omega)), np.abs(a(omega))
        return np.asarray((numerator - denominator) / (numerator + denominator))

    turned = _zeros(sine, omega)
    with np.errstate(divide="ignore"):
        factors = np.abs(a(turned)) / np.abs(b(turned))
    opposite = np.real(b(turned) * np.conj(a(turned))) < 0
    down, up = opposite & (factors < 1) & (factors > 1 / LARGEST), opposite & (factors > 1) & (factors < LARGEST)

    crossed = _zeros(excess, omega)
    phase = np.angle(-b(crossed) * np.conj(a(crossed)))
    greater = delay_s + np.mod(phase, 2 * np.pi) / crossed
    less = delay_s - np.mod(-phase, 2 * np.pi) / crossed
    causal = less >= 0

    S = _peak(closed(a), omega)
    return Margins(
        gain_down=_largest(factors[down], turned[down], 0.0),
        gain_up=_least(factors[up], turned[up]),
        phase_deg=_least(np.degrees(np.abs(phase)), crossed),
        delay_least_s=_largest(less[causal], crossed[causal], 0.0),
        delay_greatest_s=_least(greater, crossed),
        modulus=Margin(1 / S.value, S.omega),
        T_peak=_peak(closed(b), omega),
        W_a_C_S=_peak(closed(lambda omega: evaluate(control, 1j * omega)[0]), omega),
        hidden=outside,
    )


def responses(loop: DelayLoop, omega: Real) -> tuple[Complex, Complex]:
    """S and C S of a loop at frequencies omega (n,) in rad/s, its dead times exact; finite at the poles of C.

    Of an extended design S is S_aw of Thesis Eq. (3.25).
    """
    s = 1j * omega
    inner = 1 - loop.feedback(s) * np.exp(-loop.delay_s * s)
    returned = inner + loop.plant(s) * loop.forward(s)
    return np.asarray(inner / returned), np.asarray(loop.forward(s) / returned)


def tracking_floor(plant: PlantModel, bound: AdditiveBound, omegas: ArrayLike) -> float:
    """A lower bound on ||W_a C S|| of every controller that follows a reference of these frequencies perfectly.

    Parameters
    ----------
    plant
        The nominal one.
    bound
        W_a.
    omegas
        Frequencies of the reference in rad/s, shape (n,), n > 0; 0 for a constant.

    Returns
    -------
    float
        The largest |W_a/P|: T(j omega) = 1 means C S = T/P = 1/P there, however C is made.

    Raises
    ------
    InputError
        There is no frequency, or one is negative or not finite.
    """
    at = np.asarray(omegas, dtype=float)
    if at.size == 0 or not np.all(np.isfinite(at) & (at >= 0)):
        raise InputError(f"the reference has the frequencies {at.tolist()} rad/s; expected one or more, none negative")
    inverse = plant_block(plant).without_delay().inverse()
    return float(np.max(np.abs((bound_block(bound) * inverse)(1j * at))))


def _least(values: Real, omega: Real) -> Margin:
    """The least of these values and its frequency; inf when there is none."""
    if not len(values):
        return Margin(float("inf"), None)
    best = int(np.argmin(values))
    return Margin(float(values[best]), float(omega[best]))


def _largest(values: Real, omega: Real, otherwise: float) -> Margin:
    """The largest of these values and its frequency; ``otherwise`` when there is none."""
    least = _least(-values, omega)
    return Margin(otherwise if least.omega is None else -least.value, least.omega)


def _minima(function: Response, left: Real, right: Real) -> Real:
    """Where the function is least between each pair of bounds, by trisection of all at once."""
    for _ in range(BISECTIONS):
        step = (right - left) * (3 - np.sqrt(5)) / 2
        lower = function(left + step) < function(right - step)
        left, right = np.where(lower, left, left + step), np.where(lower, right - step, right)
    return np.asarray((left + right) / 2)


def _zeros(function: Response, omega: Real) -> Real:
    """Zeros of a function whose extremes the points ``omega`` resolve; two between neighbours are found too."""
    values = function(omega)
    sign, distance = np.sign(values), np.abs(values)
    dips = 1 + np.flatnonzero((distance[1:-1] <= distance[:-2]) & (distance[1:-1] <= distance[2:]))
    extremes = _minima(lambda at: sign[dips] * function(at), omega[dips - 1], omega[dips + 1])
    points = np.union1d(omega, extremes)
    values = function(points)
    changes = np.flatnonzero(values[:-1] * values[1:] <= 0)
    left, right, sign = points[changes], points[changes + 1], np.sign(values[changes])
    for _ in range(BISECTIONS):
        middle = (left + right) / 2
        same = np.sign(function(middle)) == sign
        left, right = np.where(same, middle, left), np.where(same, right, middle)
    return np.asarray(left)


def _peak(magnitude: Response, omega: Real) -> Margin:
    """The largest value on 0 <= omega <= infinity; every local maximum of the points is refined."""
    far = 1e6 * omega[-1]  # stands for infinity, many decades above every root
    values = magnitude(omega)
    tops = 1 + np.flatnonzero((values[1:-1] >= values[:-2]) & (values[1:-1] >= values[2:]))
    refined = _minima(lambda at: -magnitude(at), omega[tops - 1], omega[tops + 1])
    at = np.concatenate([omega, refined, [far]])
    values = np.nan_to_num(magnitude(at), nan=np.inf)
    best = int(np.argmax(values))
    return Margin(float(values[best]), float(at[best]) if at[best] < far else float("inf"))
