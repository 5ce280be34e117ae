"""The fit of one test: competing first guesses, random restarts, and the standard errors of the winner."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace
from functools import cached_property

import numpy as np

from identification.base.arrays import Complex, Real
from identification.base.errors import InputError
from identification.fitting.dead_time import MORE_TURNS, likely_delays, same_turn, tells_turns, turn_of
from identification.fitting.first_guess import guesses
from identification.fitting.least_squares import information, response_of
from identification.fitting.likelihood import Likely, Lines, maximise
from identification.fitting.neighbouring_structures import grown
from identification.fitting.one_fit import OneFit
from identification.model.structure import Structure
from identification.sweeps.response import FrequencyResponse

GUESSES = 4
RESTARTS = 8
GROWN = 2  # places tried for one more mode pair, of a grid of places and damping ratios
PURSUED = 2  # first guesses that are pursued of those ranked
COARSE, FINE = 1e-4, 1e-14  # least squares tolerance while guesses compete, and of the winner
ALIKE = 0.5  # deviance a line: two tests with residuals within 30 % are explained alike
SAME = 1.0  # deviances closer than this are the same optimum
FIRST_FLOORS = (0.05, 0.002)  # of the median response, in the errors assumed before any are known
WORST = 0.5  # median distance over the response above which nothing was fitted
ROUNDING = 1e-7  # errors below are the file's digits
SINGULAR = 1e-13  # smallest eigenvalue of the scaled information matrix that can be inverted


class Undetermined(InputError):
    """The data do not determine the parameters of a model."""


class Misfit(InputError):
    """A model is nowhere near the data."""


class ScaledTest:
    """One test in units where its frequencies and its response are of order 1, so that units cannot matter."""

    def __init__(self, test: FrequencyResponse, soft: bool) -> None:
        self.name = test.name
        self.soft = soft
        self.centre = float(np.sqrt(test.omega[0] * test.omega[-1]))
        self.level = float(np.median(np.abs(test.response))) or float(np.max(np.abs(test.response)))
        self.omega = test.omega / self.centre
        excitation = np.ones_like(self.omega) if test.excitation is None else test.excitation
        held_s = test.record.sampling_s * self.centre if test.record is not None and test.record.held else None
        self.lines = Lines(self.omega, test.response / self.level, excitation, held_s)

    @cached_property
    def likely_delays(self) -> Real:
        """The dead times, in units of its own, near one of which that of the test lies."""
        return likely_delays(self.omega, self.lines.response)

    def fit(self, structure: Structure, simpler: Likely | None, to_beat: float) -> Likely:
        """The likeliest of several guesses, which may build on a fit with one zero mode and pole mode less.

        Stops early when two guesses lead to the same optimum, or a few stay far above the deviance ``to_beat``.
        """
        best: Likely | None = None
        for tried, (theta, sigma) in enumerate(self._starts(structure, simpler), 1):
            found = self._maximise(structure, theta, sigma, to_beat=to_beat)
            agree = best is not None and abs(found.deviance - best.deviance) < SAME
            if best is None or found.deviance < best.deviance:
                best = found
            if agree or (tried >= GUESSES and best.deviance > to_beat + ALIKE * self.omega.size):
                break
        assert best is not None
        return best

    def _starts(self, structure: Structure, simpler: Likely | None) -> Iterator[tuple[Real, Real]]:
        """First parameters and the errors' sigma to begin with, the most promising first; costly ones come late."""
        more: list[tuple[Real, Real]] = []
        if simpler is not None:
            more = [(theta, self._sigma(simpler)) for theta in self.grown_from(simpler)]
        response = self.lines.response if simpler is None else self._response(simpler)
        for floor in FIRST_FLOORS:
            sigma = np.asarray(np.sqrt((np.abs(response) ** 2 + floor**2) * self.lines.excitation))
            for guess in guesses(self.omega, response, sigma, self.likely_delays, structure, GUESSES):
                yield guess, sigma
                if more:
                    yield more.pop(0)

    def grown_from(self, simpler: Likely) -> list[Real]:
        """First guesses with one more zero mode and pole mode, where most residual is."""
        return grown(simpler, self.omega, self._response(simpler), self._sigma(simpler), GROWN)

    def worst_run(self, likely: Likely) -> float:
        """The largest median of three neighbouring residuals over their sigma."""
        z = np.abs(self._residual(likely)) / self._sigma(likely)
        return float(np.max(np.median(np.lib.stride_tricks.sliding_window_view(z, min(3, z.size)), axis=1)))

    def pursue(self, structure: Structure, starts: Iterable[Real], known: Likely, to_beat: float) -> Likely:
        """The likeliest fit from the most promising of ``starts``, with the errors of a fit that is known already."""
        sigma = self._sigma(known)
        promising = self._ranked(structure, starts, self._response(known), sigma)[:PURSUED]
        fits = [self._maximise(structure, theta, sigma, to_beat=to_beat) for theta in promising]
        return min(fits, key=lambda likely: likely.deviance)

    def _ranked(self, structure: Structure, starts: Iterable[Real], response: Complex, sigma: Real) -> list[Real]:
        """``starts``, each with its best gain, by a cost that a few lines far off cannot decide."""

        def cost(theta: Real) -> float:
            shape = response_of(structure, theta, self.omega) / sigma
            gain = np.vdot(shape, response / sigma).real / np.vdot(shape, shape).real
            return float(np.sum(np.log1p(np.abs(gain * shape - response / sigma) ** 2)))

        return sorted(starts, key=cost)

    def follow(self, other: ScaledTest, theirs: Likely) -> Likely:
        """What the parameters that fit another test lead to."""
        theta = self.to_scaled(theirs.structure, other.to_physical(theirs.structure, theirs.theta))
        return self._maximise(theirs.structure, theta, self._sigma(theirs))

    def taken_over(self, other: ScaledTest, theirs: Likely) -> Likely:
        """A fit of the same test at fewer lines, in this one's units; its deviance is that of the fewer."""
        theta = self.to_scaled(theirs.structure, other.to_physical(theirs.structure, theirs.theta))
        return replace(theirs, theta=theta, floor=theirs.floor * other.level / self.level)

    def as_well(self, mine: Likely, other: ScaledTest, theirs: Likely) -> bool:
        """Whether this test is explained as well as another one."""
        return mine.deviance / self.omega.size < theirs.deviance / other.omega.size + ALIKE

    def other_turns(self, so_far: Likely) -> Likely:
        """The likeliest of ``so_far`` and of dead times some turns of equally spaced lines away, if these tell them."""
        best = so_far
        if so_far.structure.delayed and tells_turns(self.omega):
            for turns in range(-MORE_TURNS, MORE_TURNS + 1):
                theta = so_far.theta.copy()
                theta[-1] += turns * turn_of(self.omega)
                if turns and theta[-1] >= 0:
                    found = self._maximise(so_far.structure, theta, self._sigma(so_far), to_beat=best.deviance)
                    best = min(best, found, key=lambda likely: likely.deviance)
        return best

    def restart(self, so_far: Likely, rng: np.random.Generator) -> Likely:
        """The likeliest of ``so_far`` and of random modes within the band."""
        structure, sigma = so_far.structure, self._sigma(so_far)
        best = so_far
        frequency, (low, high) = structure.frequencies(), np.log(self.omega[[0, -1]])
        for _ in range(RESTARTS):
            theta = rng.uniform(np.log(0.003), np.log(0.7), structure.size)
            theta[frequency] = rng.uniform(low, high, int(frequency.sum()))
            theta[-1] = so_far.theta[-1] * rng.uniform(0.5, 1.5)
            best = min(best, self._maximise(structure, theta, sigma), key=lambda likely: likely.deviance)
        return best

    @property
    def chance(self) -> float:
        """Correlation of neighbouring residuals that noise alone hardly reaches."""
        return 3 / float(np.sqrt(self.omega.size))

    def correlation(self, likely: Likely) -> float:
        """Of neighbouring residuals, each over its standard deviation; real part."""
        r = self._residual(likely) / self._sigma(likely)
        power = float(np.sum(np.abs(r) ** 2))
        return float(np.vdot(r[1:], r[:-1]).real / power) if power > 0 else 0.0

    def distance(self, likely: Likely) -> float:
        """The median of |test - plant|/|test| over the lines; those of no response are left out."""
        size = np.abs(self._response(likely))
        return float(np.median(np.abs(self._residual(likely))[size > 0] / size[size > 0]))

    def exact(self, likely: Likely) -> bool:
        """Whether nothing but rounding is left."""
        return max(likely.floor, likely.relative) < ROUNDING

    def finish(self, likely: Likely) -> OneFit:
        """Polish the fit and give its parameters and their covariance in physical units.

        Raises
        ------
        Misfit
            The model is nowhere near the data.
        Undetermined
            The data leave a parameter undetermined.

        Notes
        -----
        With rows r of the residuals' derivatives over sigma, psi the loss's derivative and errors alike at all lines
        the covariance is E|psi|^2/E(psi')^2 (sum r r')^-1 (Huber, "Robust Statistics", section 7.6).
        """
        likely = self._maximise(likely.structure, likely.theta, self._sigma(likely), FINE)
        structure = likely.structure
        turn = same_turn(self.omega)
        if turn is not None and likely.theta[-1] >= turn:  # of dead times that look alike, the shortest
            start = np.append(likely.theta[:-1], likely.theta[-1] % turn)
            likely = self._maximise(structure, start, self._sigma(likely), FINE)
        likely = replace(likely, theta=likely.theta[structure.in_order(likely.theta)])
        distance = self.distance(likely)
        if distance > WORST:
            raise Misfit(
                f"{self.name}: no stable plant with {structure} fits (median distance "
                f"{100 * distance:.0f} % of the response); expected at most {100 * WORST:.0f} %"
            )
        correlation = self.correlation(likely)
        z = np.abs(self._residual(likely) / self._sigma(likely)) ** 2
        at = int(np.argmax(z))
        freedom = 1 - (structure.free + 1) / (2 * self.omega.size)  # the ratio of the noise's two levels counts too
        spread = float(np.mean(z)) / 2 / freedom
        if self.soft:
            spread = float(np.mean(z / (1 + z)) / 2 / np.mean((1 + z / 2) / (1 + z) ** 1.5) ** 2) / freedom
        return OneFit(
            name=self.name,
            structure=structure,
            theta=self.to_physical(structure, likely.theta),
            sign=likely.sign,
            covariance=self._covariance(likely, spread),
            deviance=likely.deviance,
            spread=spread,
            misfit=2 * correlation / (1 - correlation) if correlation > self.chance else 0.0,
            floor=likely.floor * self.level,
            relative=likely.relative,
            chi_square=float(np.mean(z)) / freedom,
            correlation=correlation,
            distance=distance,
            worst=float(np.sqrt(z[at])),
            worst_omega=float(self.omega[at] * self.centre),
            around=float(np.median(np.sqrt(z[max(0, at - 1) : at + 2]))),
            lines=self.omega.size,
        )

    def covariance_at(self, fit: OneFit, theta: Real) -> Real:
        """The covariance of this test's ``fit`` if ``theta`` (p,) in physical units were the truth."""
        scaled = self.to_scaled(fit.structure, theta)
        likely = Likely(fit.structure, scaled, fit.sign, fit.floor / self.level, fit.relative, np.nan)
        return self._covariance(likely, fit.spread)

    def _covariance(self, likely: Likely, spread: float) -> Real:
        """Covariance (p, p) of theta in physical units."""
        structure, sigma = likely.structure, self._sigma(likely)
        curvature = information(structure, likely.theta, self.omega, sigma)
        scale = 1 / np.sqrt(np.diag(curvature))
        correlations = curvature * scale[:, None] * scale
        if not (structure.delayed or np.linalg.eigvalsh(correlations)[0] > SINGULAR):
            # what looks like a dead time is not asked for; by itself it would be as sure as this
            correlations[-1, :-1] = correlations[:-1, -1] = 0.0
        values, vectors = np.linalg.eigh(correlations)
        if not values[0] > SINGULAR:
            raise Undetermined(
                f"{self.name}: the data do not determine {structure}; expected other numbers of modes and real roots, "
                "or lines near them"
            )
        units = np.append(np.ones(structure.size - 1), 1 / self.centre)
        weighted = vectors * (scale * units)[:, None]
        return np.asarray(spread * (weighted / values) @ weighted.T)

    def to_physical(self, structure: Structure, theta: Real) -> Real:
        """Parameters in physical units from scaled ones."""
        return _shift(structure, theta, np.log(self.centre), np.log(self.level), 1 / self.centre)

    def to_scaled(self, structure: Structure, theta: Real) -> Real:
        """Scaled parameters from those in physical units."""
        return _shift(structure, theta, -np.log(self.centre), -np.log(self.level), self.centre)

    def _maximise(
        self,
        structure: Structure,
        theta: Real,
        sigma: Real,
        tolerance: float = COARSE,
        to_beat: float = np.inf,
    ) -> Likely:
        return maximise(self.lines, structure, theta, sigma, soft=self.soft, tolerance=tolerance, to_beat=to_beat)

    def _response(self, likely: Likely) -> Complex:
        """What was measured, without the aliases of a fit."""
        return self.lines.response - self.lines.aliases(likely.structure, likely.theta, likely.sign)

    def _residual(self, likely: Likely) -> Complex:
        return self._response(likely) - likely.sign * response_of(likely.structure, likely.theta, self.omega)

    def _sigma(self, likely: Likely) -> Real:
        power = np.abs(response_of(likely.structure, likely.theta, self.omega)) ** 2
        return np.sqrt((likely.floor**2 + likely.relative**2 * power) * self.lines.excitation)


def _shift(structure: Structure, theta: Real, log_centre: float, log_level: float, delay_unit: float) -> Real:
    moved = theta.copy()
    moved[structure.frequencies()] += log_centre
    moved[0] += log_level + structure.integrators * log_centre
    moved[-1] *= delay_unit
    return moved
