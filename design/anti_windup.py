"""The anti-windup compensators theta1~ and theta2, and what judges them: f, Popov's line, theta2's stability."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from scipy.optimize import minimize_scalar

from design.block import Block, bound_block, plant_block
from design.frequency import frequency_grid, peak
from identification.files import InputError
from identification.model import IdentifiedModel, number
from identification.plant import AdditiveBound, PlantModel


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
        """theta2 = P (1 + theta1~), Thesis Eq. (2.18) and (3.30); its dead time is the plant's."""
        return plant_block(plant) * self.one_plus


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


def printed_form(numbers: Mapping[str, Any]) -> AntiWindup:
    """theta1~ of (2.23) from the members alpha, beta, gamma of an object; raises InputError as they are missing."""
    return second_order(number(numbers, "alpha"), number(numbers, "beta"), number(numbers, "gamma"))


def washout(bound: AdditiveBound, rate: float) -> AntiWindup:
    """The corrected theta1~, with theta1~(0) = -1 and a notch at the peak of W_a.

    1 + theta1~ = s (s^2 + 2 zeta omega s + omega^2) / ((s + rate)(s + omega)^2),

    omega and zeta being those of W_a's resonance: the zero at s = 0 takes the plant's integrator out of theta2, so that
    y_d dies away after the actuator has left saturation, and the notch cancels the resonance of the bound. A
    bound without resonance (zeta >= 1) has nothing to cancel: 1 + theta1~ = s/(s + rate).
    This is our choice within the class that theta1~(0) = -1 leaves; the thesis prints (2.23) only.

    Parameters
    ----------
    bound
        W_a.
    rate
        Decay rate in 1/s of y_d after saturation, positive.
    """
    if not (np.isfinite(rate) and rate > 0):
        raise InputError(f"the recovery rate is {rate:g}; expected a positive number of 1/s")
    omega, zeta = bound.resonance.omega, bound.resonance.zeta
    if zeta >= 1:
        return AntiWindup(Block(-rate, (), (complex(-rate),)), Block(1.0, (0j,), (complex(-rate),)))
    notch = bound.resonance.roots
    poles = (complex(-rate), complex(-omega), complex(-omega))
    # numerator - denominator = -((rate + 2 (1 - zeta) omega) s^2 + 2 omega rate s + rate omega^2)
    leading = rate + 2 * (1 - zeta) * omega
    zeros = np.roots([1.0, 2 * omega * rate / leading, rate * omega**2 / leading])
    return AntiWindup(
        theta1_tilde=Block(-leading, tuple(complex(zero) for zero in zeros), poles),
        one_plus=Block(1.0, (0j, *notch), poles),
    )


def uncertainty_cost(bound: AdditiveBound, one_plus: Block) -> tuple[float, float]:
    """f = ||W_a (1 + theta1~)||_inf of Thesis Eq. (2.19), and the frequency in rad/s where it is reached."""
    product = bound_block(bound) * one_plus
    return peak(lambda omega: np.abs(product(1j * omega)), product.zeros + product.poles)


def optimal_gamma(bound: AdditiveBound, alpha: float, beta: float) -> tuple[float, float]:
    """The gamma that minimises f(gamma) for given alpha and beta, and that minimum.

    f is convex in gamma, being the largest of |W_a + gamma W_a h| over omega, so that the minimum is global;
    gamma > -1 keeps the zeros of 1 + theta1~ in the open left half plane.
    """

    def cost(gamma: float) -> float:
        return uncertainty_cost(bound, second_order(alpha, beta, gamma).one_plus)[0]

    # Past twice the gamma that puts the zeros at W_a's peak, f grows with gamma.
    upper = 4 * (1 + bound.resonance.omega**2 * alpha * beta)
    found = minimize_scalar(cost, bounds=(-1.0, upper), method="bounded", options={"xatol": 1e-8 * upper})
    return float(found.x), float(found.fun)


def thesis_choice(bound: AdditiveBound) -> tuple[float, float, float]:
    """alpha, beta, gamma by the thesis's own procedure (section 2.4).

    alpha = 1/corner removes the zero of W_a; beta is the best of 2 alpha, alpha, alpha/2, alpha/4 (printed:
    1/10 ... 1/80, a coarse grid); gamma minimises f.
    """
    alpha = 1 / bound.corner
    candidates = [(optimal_gamma(bound, alpha, beta), beta) for beta in beta_grid(alpha)]
    (gamma, _), beta = min(candidates, key=lambda candidate: candidate[0][1])
    return alpha, beta, gamma


@dataclass(frozen=True)
class Judgement:
    """What (2.19) and Theorem 2.3.1 say of one theta1~.

    Parameters
    ----------
    f
        ||W_a (1 + theta1~)||_inf.
    f_omega
        Frequency in rad/s where it is reached.
    popov_sector
        Largest sector k that Popov's condition allows; None when it allows every one.
    theta2_stable
        Whether theta2 is stable, which the proof of Theorem 2.3.1 needs: with (2.23) the plant's integrator
        stays in theta2 unless gamma = -1.
    theta1_tilde_at_zero
        theta1~(0); -1 is what removes the integrator from theta2.
    """

    f: float
    f_omega: float
    popov_sector: float | None
    theta2_stable: bool
    theta1_tilde_at_zero: float


def describe(model: IdentifiedModel, anti_windup: AntiWindup) -> Judgement:
    """Judge one anti-windup compensator for a plant and its bound."""
    f, f_omega = uncertainty_cost(model.additive_bound, anti_windup.one_plus)
    sector, _ = popov_sector(anti_windup.theta1_tilde)
    return Judgement(
        f=f,
        f_omega=f_omega,
        popov_sector=sector if np.isfinite(sector) else None,
        theta2_stable=anti_windup.theta2(model.plant).is_stable,
        theta1_tilde_at_zero=float(anti_windup.theta1_tilde(0j).real),
    )


def compensators(model: IdentifiedModel, rate: float) -> dict[str, dict[str, Any]]:
    """The ``anti_windup`` member of design.json: parameters and judgement of both compensators.

    Parameters
    ----------
    model
        Plant and W_a.
    rate
        Of the corrected compensator in 1/s, see :func:`washout`.
    """
    alpha, beta, gamma = thesis_choice(model.additive_bound)
    thesis = describe(model, second_order(alpha, beta, gamma))
    corrected = describe(model, washout(model.additive_bound, rate))
    return {
        "thesis": {"alpha": alpha, "beta": beta, "gamma": gamma} | asdict(thesis),
        "corrected": {"rate": rate} | asdict(corrected),
    }


def beta_grid(alpha: float) -> tuple[float, ...]:
    """The values of beta that Fig. 2.10 compares, as multiples of alpha."""
    return 2 * alpha, alpha, alpha / 2, alpha / 4


def popov_sector(theta1_tilde: Block) -> tuple[float, float]:
    """The largest sector k for which Popov's condition holds, and the multiplier that proves it.

    Condition ii of Theorem 2.3.1: Re (1 + j m omega) theta1~(j omega) + 1/k > 0 for all omega and some m > 0.

    Returns
    -------
    k, multiplier
        The condition holds for every sector below k; k is infinite when the left side without 1/k is never
        negative. A dead zone lies in a sector below 1 for bounded signals and reaches 1 only as u grows without
        bound, so that k = 1, which theta1~(0) = -1 implies, is the boundary case. The multiplier is in seconds.
    """
    grid = frequency_grid(theta1_tilde.zeros + theta1_tilde.poles)
    values = theta1_tilde(1j * grid)
    at_zero = float(theta1_tilde(0j).real)

    def lowest(multiplier: float) -> float:
        return min(at_zero, float(np.min(values.real - multiplier * grid * values.imag)))

    time_constants = [1 / abs(pole) for pole in theta1_tilde.poles]
    trials = np.geomspace(1e-3 * min(time_constants), 1e3 * max(time_constants), 200)
    heights = [lowest(trial) for trial in trials]
    k = int(np.argmax(heights))
    found = minimize_scalar(
        lambda multiplier: -lowest(multiplier),
        bounds=(trials[max(k - 1, 0)], trials[min(k + 1, len(trials) - 1)]),
        method="bounded",
    )
    height, multiplier = max((heights[k], float(trials[k])), (float(-found.fun), float(found.x)))
    return (float("inf") if height >= 0 else -1 / height), multiplier
