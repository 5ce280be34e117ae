"""The fit of one test: competing first guesses, restarts, and the standard errors of the winner."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identification.files import InputError
from identification.frequency_response import FrequencyResponse
from identification.likelihood import Likely, log_jacobian, maximise, response_of, stacked
from identification.plant import Mode, PlantModel
from identification.start import guesses

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]

GUESSES = 4
RESTARTS = 8
GROWN = 2  # places tried for one more mode pair, of a grid of places and damping ratios
GROWN_PLACES = 50
GROWN_ZETAS = (0.02, 0.15)
GROWN_APART = 0.5  # largest first distance between the new zero and pole, in logarithms
PRUNED = 3  # ways tried to leave out a zero mode and a pole mode
COARSE, FINE = 1e-4, 1e-14  # least squares tolerance while guesses compete, and of the winner
MUCH_BETTER = 1.0  # deviance a line: the other test's residual is 40 % smaller
SAME = 1.0  # deviances closer than this are the same optimum
FIRST_FLOORS = (0.05, 0.002)  # of the median response, in the errors assumed before any are known
WORST = 0.5  # median distance over the response above which nothing was fitted
SINGULAR = 1e-13  # smallest eigenvalue of the scaled information matrix that can be inverted


class Undetermined(InputError):
    """The data do not determine the parameters of a model."""


@dataclass(frozen=True)
class OneFit:
    """The plant of one test.

    Parameters
    ----------
    name
        The test's.
    theta
        (4n + 2,) log |gain|, then log omega and log zeta of the zero modes and of the pole modes, each sorted by
        omega, then the delay in seconds.
    sign
        Of the gain.
    errors
        (4n + 2,) standard errors of theta from the noise of this test.
    floor, relative
        a and b of the noise E|error|^2 = a^2 + b^2 |P|^2, estimated; a in the response's unit.
    chi_square
        Squared residuals over their variance, per degree of freedom; near 1 because a and b are estimated.
    correlation
        Of neighbouring normalised residuals; 0 within 1/sqrt(lines) when they are noise.
    lines
        M, the number of frequencies.
    """

    name: str
    theta: Real
    sign: float
    errors: Real
    floor: float
    relative: float
    chi_square: float
    correlation: float
    lines: int

    @property
    def plant(self) -> PlantModel:
        """The test's own model."""
        return plant_from_theta(self.theta, self.sign)


def plant_from_theta(theta: Real, sign: float) -> PlantModel:
    """The plant of the parameters in :class:`OneFit`."""
    n = (theta.size - 2) // 4
    modes = [Mode(float(omega), float(zeta)) for omega, zeta in np.exp(theta[1:-1]).reshape(-1, 2)]
    return PlantModel(float(sign * np.exp(theta[0])), tuple(modes[:n]), tuple(modes[n:]), float(theta[-1]))


class ScaledTest:
    """One test in units where its frequencies and its response are of order 1, so that units cannot matter."""

    def __init__(self, test: FrequencyResponse) -> None:
        self.name = test.name
        self.centre = float(np.sqrt(test.omega[0] * test.omega[-1]))
        self.level = float(np.median(np.abs(test.response))) or float(np.max(np.abs(test.response)))
        self.omega = test.omega / self.centre
        self.response = test.response / self.level
        self.excitation = np.ones_like(self.omega) if test.excitation is None else test.excitation

    def fit(self, modes: int, simpler: Likely | None = None) -> Likely:
        """The likeliest of several guesses, which may build on a fit with one mode pair less.

        Stops early when two guesses lead to the same optimum.
        """
        best: Likely | None = None
        for theta, sigma in self._starts(modes, simpler):
            found = self._maximise(theta, sigma)
            agree = best is not None and abs(found.deviance - best.deviance) < SAME
            if best is None or found.deviance < best.deviance:
                best = found
            if agree:
                break
        assert best is not None
        return best

    def _starts(self, modes: int, simpler: Likely | None) -> Iterator[tuple[Real, Real]]:
        """First parameters and the errors' sigma to begin with, the most promising first; costly ones come late."""
        grown = [] if simpler is None else [(theta, self._sigma(simpler)) for theta in self._grow(simpler)]
        for floor in FIRST_FLOORS:
            sigma = self._first_sigma(floor)
            for guess in guesses(self.omega, self.response, sigma, modes, GUESSES):
                yield np.concatenate([[0.0], guess]), sigma
                if grown:
                    yield grown.pop(0)

    def _grow(self, simpler: Likely) -> list[Real]:
        """Parameters with one more mode pair, a zero and a pole close together where that explains most residual.

        A zero mode over an equal pole mode is 1. Moved apart a little, they multiply the model by 1 + d1 g1
        + d2 g2 with g the derivatives of the mode's logarithm; d is fitted to the residual for each place
        and damping of a grid.
        """
        sigma = self._sigma(simpler)
        residual = simpler.sign * self._residual(simpler) / sigma
        model = response_of(simpler.theta, self.omega) / sigma
        known = model[:, None] * log_jacobian(simpler.theta, self.omega)
        basis, _ = np.linalg.qr(stacked(known).T)
        places, zetas = np.meshgrid(np.geomspace(self.omega[0], self.omega[-1], GROWN_PLACES), GROWN_ZETAS)
        x = 1j * self.omega[:, None] / places.ravel()
        damping = 2 * zetas.ravel() * x
        factor = model[:, None] / (1 + damping + x * x)
        rows = np.stack([stacked(-(damping + 2 * x * x) * factor), stacked(damping * factor)], axis=1)
        inside = np.einsum("cim,mb->cib", rows, basis)
        gram = np.einsum("cim,cjm->cij", rows, rows) - np.einsum("cib,cjb->cij", inside, inside)
        gram += 1e-9 * np.trace(gram, axis1=1, axis2=2)[:, None, None] * np.eye(2)
        seen = np.einsum("cim,m->ci", rows, residual.view(float)) - inside @ (residual.view(float) @ basis)
        apart = np.linalg.solve(gram, seen[..., None])[..., 0]
        zeros, poles = np.split(simpler.theta[1:-1], 2)
        starts = []
        for i in np.argsort(np.sum(seen * apart, axis=1))[::-1][:GROWN]:
            mode = np.log([places.flat[i], zetas.flat[i]])
            half = np.clip(apart[i], -GROWN_APART, GROWN_APART) / 2
            starts.append(
                np.concatenate([simpler.theta[:1], zeros, mode + half, poles, mode - half, simpler.theta[-1:]])
            )
        return starts

    def restart(self, so_far: Likely, rng: np.random.Generator) -> Likely:
        """The likeliest of ``so_far`` and of random modes within the band."""
        sigma = self._sigma(so_far)
        best = so_far
        low, high = np.log(self.omega[0]), np.log(self.omega[-1])
        pairs = (so_far.theta.size - 2) // 2
        for _ in range(RESTARTS):
            modes = np.column_stack([rng.uniform(low, high, pairs), rng.uniform(np.log(0.003), np.log(0.7), pairs)])
            delay = so_far.theta[-1] * rng.uniform(0.5, 1.5)
            found = self._maximise(np.concatenate([[0.0], modes.ravel(), [delay]]), sigma)
            best = min(best, found, key=lambda likely: likely.deviance)
        return best

    def adopt(self, so_far: Likely, other: ScaledTest, theirs: Likely) -> Likely:
        """The likelier of ``so_far`` and what the parameters of a much better fitted test lead to."""
        if so_far.deviance / self.omega.size < theirs.deviance / other.omega.size + MUCH_BETTER:
            return so_far
        theta = self._shift(other.to_physical(theirs.theta), -np.log(self.centre), -np.log(self.level), self.centre)
        found = self._maximise(theta, self._first_sigma(FIRST_FLOORS[0]))
        return min(so_far, found, key=lambda likely: likely.deviance)

    def prune(self, so_far: Likely, richer: Likely) -> Likely:
        """The likelier of ``so_far`` and what a fit with one more mode pair leads to without its least needed pair."""
        n = (richer.theta.size - 2) // 4
        modes = richer.theta[1:-1].reshape(2, n, 2)
        s = 1j * self.omega[:, None]
        factors = np.log([1 + (2 * np.exp(m[:, 1]) + s / np.exp(m[:, 0])) * s / np.exp(m[:, 0]) for m in modes])
        effect = np.median(np.abs(factors[0][:, :, None] - factors[1][:, None, :]), axis=0)
        best = so_far
        for flat in np.argsort(effect, axis=None)[:PRUNED]:
            zero, pole = np.unravel_index(flat, effect.shape)
            kept = np.concatenate([np.delete(modes[0], zero, axis=0), np.delete(modes[1], pole, axis=0)])
            theta = np.concatenate([[0.0], kept.ravel(), richer.theta[-1:]])
            best = min(best, self._maximise(theta, self._sigma(richer)), key=lambda likely: likely.deviance)
        return best

    def correlation(self, likely: Likely) -> float:
        """Of neighbouring residuals, each over its standard deviation."""
        r = self._residual(likely) / self._sigma(likely)
        power = float(np.sum(np.abs(r) ** 2))
        return float(abs(np.vdot(r[1:], r[:-1])) / power) if power > 0 else 0.0

    def finish(self, likely: Likely) -> OneFit:
        """Polish the fit and give its parameters and their standard errors in physical units.

        Raises
        ------
        InputError
            The model is nowhere near the data, or the data leave a parameter undetermined.
        """
        likely = self._maximise(likely.theta, self._sigma(likely), FINE)
        n = (likely.theta.size - 2) // 4
        distance = float(np.median(np.abs(self._residual(likely)) / np.maximum(np.abs(self.response), 1e-300)))
        if distance > WORST:
            raise InputError(
                f"{self.name}: no stable minimum phase plant with an integrator and {n} mode pairs fits (median "
                f"distance {100 * distance:.0f} % of the response); expected at most {100 * WORST:.0f} %"
            )
        sigma = self._sigma(likely)
        model = response_of(likely.theta, self.omega) / sigma
        rows = stacked(model[:, None] * log_jacobian(likely.theta, self.omega))
        information = 2 * rows @ rows.T
        scale = 1 / np.sqrt(np.diag(information))
        values, vectors = np.linalg.eigh(information * scale[:, None] * scale)
        if not values[0] > SINGULAR:
            raise Undetermined(
                f"{self.name}: the data do not determine {n} mode pairs; expected fewer modes or more lines"
            )
        freedom = 2 * self.omega.size - likely.theta.size
        covariance = np.sum(vectors**2 / values, axis=1) * scale**2 * 2 * self.omega.size / freedom
        order = _sorted(likely.theta)
        errors = np.sqrt(covariance)[order]
        errors[-1] /= self.centre
        return OneFit(
            name=self.name,
            theta=self.to_physical(likely.theta)[order],
            sign=likely.sign,
            errors=errors,
            floor=likely.floor * self.level,
            relative=likely.relative,
            chi_square=2 * float(np.sum(np.abs(self._residual(likely) / sigma) ** 2)) / freedom,
            correlation=self.correlation(likely),
            lines=self.omega.size,
        )

    def to_physical(self, theta: Real) -> Real:
        """Parameters in physical units from scaled ones."""
        return self._shift(theta, np.log(self.centre), np.log(self.level), 1 / self.centre)

    @staticmethod
    def _shift(theta: Real, log_centre: float, log_level: float, delay_unit: float) -> Real:
        moved = theta.copy()
        moved[0] += log_centre + log_level
        moved[1:-1:2] += log_centre
        moved[-1] *= delay_unit
        return moved

    def _maximise(self, theta: Real, sigma: Real, tolerance: float = COARSE) -> Likely:
        return maximise(self.omega, self.response, self.excitation, theta, sigma, tolerance=tolerance)

    def _residual(self, likely: Likely) -> Complex:
        return self.response - likely.sign * response_of(likely.theta, self.omega)

    def _first_sigma(self, floor: float) -> Real:
        return np.asarray(np.sqrt((np.abs(self.response) ** 2 + floor**2) * self.excitation))

    def _sigma(self, likely: Likely) -> Real:
        power = np.abs(response_of(likely.theta, self.omega)) ** 2
        return np.sqrt((likely.floor**2 + likely.relative**2 * power) * self.excitation)


def _sorted(theta: Real) -> NDArray[np.intp]:
    """The order of theta's entries that sorts zero modes and pole modes by omega."""
    modes = np.arange(1, theta.size - 1).reshape(2, -1, 2)
    by_omega = np.argsort(theta[modes[..., 0]], axis=1)
    return np.concatenate([[0], np.take_along_axis(modes, by_omega[..., None], axis=1).ravel(), [theta.size - 1]])
