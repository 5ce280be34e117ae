"""Maximum likelihood fit of one response from one first guess: parameters, noise and how likely."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from identification.base.arrays import Complex, Real
from identification.fitting.first_guess import BAND, LEAST_ZETA, most_zeta
from identification.fitting.least_squares import least_squares, response_of
from identification.model.pulse_response import aliases
from identification.model.structure import Structure

ALTERNATIONS = 4
ALIAS_TURNS = 12  # aliases change with the parameters, less at every turn
RATIOS = 20.0  # of floor and relative error at the median response: logarithm of the largest
GAIN = 20.0  # the gain is sought up to this factor's logarithm from the one that fits the guess
CLOSEST = 1e-8  # no relative error below this is believed: files do not carry more digits
NEWTON = 12  # steps for the scale of soft-L1 errors
CONVERGED = 1e-8  # relative change of that scale, whose square is the next one's
HELD = 500_000  # numbers of the grid's lines at a time


@dataclass(frozen=True)
class Likely:
    """A fit in scaled frequency and response.

    Parameters
    ----------
    structure
        Of the plant.
    theta
        The parameters that :class:`identification.model.structure.Structure` describes.
    sign
        Of the gain.
    floor, relative
        a and b in scale^2 = (a^2 + b^2 |P|^2) times the excitation's factor; scale^2 is E|error|^2 for Gaussian
        errors.
    deviance
        -2 log likelihood.
    """

    structure: Structure
    theta: Real
    sign: float
    floor: float
    relative: float
    deviance: float


def noise_levels(error: Real, power: Real, excitation: Real, soft: bool = False) -> tuple[float, float, float]:
    """Maximum likelihood a^2 and b^2 of scale^2 = (a^2 + b^2 power) excitation from (M,) squared errors.

    Parameters
    ----------
    error, power
        |error|^2 and |P|^2.
    excitation
        How scale^2 goes from line to line besides.
    soft
        For z = |error|^2/scale^2 the density is exp(-2 (sqrt(1 + z) - 1))/(3/2 pi scale^2), the likelihood whose
        logarithm is the soft-L1 loss, instead of the Gaussian exp(-z)/(pi scale^2).

    Returns
    -------
    tuple
        a^2, b^2 and the deviance, but for a constant of the data.

    Notes
    -----
    The common factor follows from the ratio a^2/b^2, in closed form for Gaussian errors; the ratio is searched for on
    a grid twice refined, since the likelihood can have an optimum at either end besides the one within.
    """
    typical = float(np.median(power))
    q = error / excitation
    log_ratio, half_width = 0.0, RATIOS
    for points in (25, 9, 9):
        grid = log_ratio + np.linspace(-half_width, half_width, points)
        parts = np.array_split(grid, min(points, 1 + points * power.size // HELD))
        factor, deviance = np.concatenate([_deviances(part, q, power, typical, soft) for part in parts], axis=1)
        best = int(np.argmin(deviance))
        log_ratio, half_width = float(grid[best]), 2 * half_width / (points - 1)
    shared = 2 * float(np.sum(np.log(excitation)))
    return float(factor[best] * np.exp(log_ratio)), float(factor[best] / typical), float(deviance[best]) + shared


def _deviances(grid: Real, q: Real, power: Real, typical: float, soft: bool) -> Real:
    """The likeliest common factor and the deviance (2, G) for each of the logarithms (G,) of the ratio."""
    shape = np.exp(grid)[:, None] + power / typical
    scaled = q / shape
    least = CLOSEST**2 * typical
    factor = np.maximum(np.mean(scaled, axis=1), least)
    if soft:
        factor = _soft_factor(scaled, factor, least)
    z = scaled / factor[:, None]
    loss = 2 * z / (1 + np.sqrt(1 + z)) + np.log(1.5) if soft else z
    return np.array([factor, 2 * np.sum(np.log(factor[:, None] * shape) + loss, axis=1)])


def _soft_factor(scaled: Real, factor: Real, least: float) -> Real:
    """Zero of mean(z/sqrt(1 + z)) - 1, z = scaled/factor, by Newton's method in log factor, row by row."""
    for _ in range(NEWTON):
        z = scaled / factor[:, None]
        share = z / np.sqrt(1 + z)
        excess = share.mean(axis=1) - 1
        slope = (share * (0.5 + 0.5 / (1 + z))).mean(axis=1)
        step = np.clip(excess / np.maximum(slope, np.finfo(float).tiny), -1.0, 1.0)
        factor = np.maximum(factor * np.exp(step), least)
        if np.max(np.abs(step)) < CONVERGED:
            break
    return factor


@dataclass(frozen=True)
class Lines:
    """What was measured in one test.

    Parameters
    ----------
    omega, response, excitation
        (M,) frequencies, response, and how the errors' scale^2 goes from line to line besides the noise levels.
    held_s
        Sampling interval of a held input, whose response has aliases of the plant on it; None without.
    """

    omega: Real
    response: Complex
    excitation: Real
    held_s: float | None = None

    def aliases(self, structure: Structure, theta: Real, sign: float) -> Complex | float:
        """What the plant of theta adds to its own response at the lines."""
        if self.held_s is None:
            return 0.0
        return aliases(structure.plant(theta, sign), self.held_s, self.omega)


def maximise(
    lines: Lines,
    structure: Structure,
    theta: Real,
    sigma: Real,
    *,
    soft: bool,
    tolerance: float,
    to_beat: float = np.inf,
) -> Likely:
    """Bounded least squares from ``theta`` with the errors' sigma (M,), then noise, aliases and parameters in turn.

    ``tolerance`` is the relative change of the cost at which a turn ends. A fit that is not on the way to a deviance
    below ``to_beat`` is given up. The gain in ``theta`` is not used.
    """
    omega, response = lines.omega, lines.response
    theta, sign = _with_gain(omega, response, sigma, structure, theta)
    lower, upper = _bounds(omega, structure, theta)
    best: Likely | None = None
    theta = np.clip(theta, lower, upper)
    response = lines.response - lines.aliases(structure, theta, sign)
    for _ in range(ALTERNATIONS if lines.held_s is None else ALIAS_TURNS):
        theta = least_squares(
            structure, theta, omega, sign * response, sigma, (lower, upper), soft=soft, tolerance=tolerance
        )
        model = response_of(structure, theta, omega)
        response = lines.response - lines.aliases(structure, theta, sign)
        power, error = np.abs(model) ** 2, np.abs(sign * response - model) ** 2
        a2, b2, deviance = noise_levels(error, power, lines.excitation, soft)
        if best is not None and deviance > best.deviance - 1e-3:
            break
        gained = float(omega.size) if best is None else best.deviance - deviance
        best = Likely(structure, theta, sign, float(np.sqrt(a2)), float(np.sqrt(b2)), deviance)
        if deviance - gained > to_beat:
            break
        sigma = np.sqrt((a2 + b2 * power) * lines.excitation)
    assert best is not None
    return best


def maximise_together(
    parts: Sequence[Lines],
    structure: Structure,
    theta: Real,
    sign: float,
    *,
    soft: bool,
    tolerance: float,
) -> tuple[Real, float]:
    """One theta for several responses in the same units, each with its own noise: theta and the deviance.

    Parameters
    ----------
    parts
        The tests.
    theta
        Where to start; the gain counts.
    """
    omega = np.concatenate([lines.omega for lines in parts])
    lower, upper = _bounds(omega, structure, theta)
    for _ in range(ALTERNATIONS if all(lines.held_s is None for lines in parts) else ALIAS_TURNS):
        sigmas, responses, deviance = [], [], 0.0
        for lines in parts:
            model = response_of(structure, theta, lines.omega)
            responses.append(lines.response - lines.aliases(structure, theta, sign))
            power = np.abs(model) ** 2
            a2, b2, share = noise_levels(np.abs(sign * responses[-1] - model) ** 2, power, lines.excitation, soft)
            sigmas.append(np.sqrt((a2 + b2 * power) * lines.excitation))
            deviance += share
        response: Complex = np.concatenate(responses)
        sigma, start = np.concatenate(sigmas), np.clip(theta, lower, upper)
        theta = least_squares(
            structure, start, omega, sign * response, sigma, (lower, upper), soft=soft, tolerance=tolerance
        )
    return theta, deviance


def _bounds(omega: Real, structure: Structure, theta: Real) -> tuple[Real, Real]:
    frequency = structure.frequencies()
    lower = np.where(frequency, np.log(omega.min() / BAND), np.log(LEAST_ZETA))
    upper = np.where(frequency, np.log(omega.max() * BAND), np.log(most_zeta(omega)))
    lower[0], upper[0] = theta[0] - GAIN, theta[0] + GAIN
    lower[-1], upper[-1] = 0.0, np.inf if structure.delayed else 0.0
    return lower, upper


def _with_gain(omega: Real, response: Complex, sigma: Real, structure: Structure, theta: Real) -> tuple[Real, float]:
    """Theta with the gain that fits best, and its sign."""
    shape = response_of(structure, np.concatenate([[0.0], theta[1:]]), omega) / sigma
    gain = float(np.vdot(shape, response / sigma).real / np.vdot(shape, shape).real)
    gain = gain if gain != 0 else 1.0
    return np.concatenate([[np.log(abs(gain))], theta[1:]]), float(np.sign(gain))
