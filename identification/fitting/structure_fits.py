"""Fits of several tests by several structures, and how well each structure does."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from identification.fitting.likelihood import Likely
from identification.fitting.neighbouring_structures import cancels_origin, has_needle, reached_from
from identification.fitting.single_test_fit import ScaledTest
from identification.model.structure import Structure, Wanted

WHITE = 0.1  # correlation of neighbouring residuals below which nothing is left to explain
ALIKE = 6.0  # criteria closer than this are no strong evidence (Raftery, Sociol. Methodol. 25, 1995)
RUN = 3.5  # times the noise, that two of three neighbouring lines are missed by chance once in 1e9
HIDDEN = 30.0  # of the criterion: evidence for a pole or zero at s = 0 that roots below the band cancel
LAST_RESORT = 1e12  # above every criterion
HOPELESS = 20.0  # criterion lost on the first tests after which the others are not asked


class StructureFits:
    """Fits of several tests by several structures.

    Parameters
    ----------
    tests
        Each is fitted on its own.
    wanted
        What the user admits.
    tick
        Called after each fit of a test.

    Attributes
    ----------
    fits
        For each structure fitted, one fit a test.
    overdispersion
        By what the deviance is divided in the criterion: 1 for errors that are noise.
    """

    def __init__(self, tests: list[ScaledTest], wanted: Wanted, tick: Callable[[], object]) -> None:
        self.tests = tests
        self.wanted = wanted
        self.tick = tick
        self.fits: dict[Structure, list[Likely]] = {}
        self.overdispersion = 1.0

    def criterion(self, structure: Structure) -> float:
        """Bayesian information criterion, summed over the tests; infinite for what is not admitted.

        It is at LAST_RESORT for what is taken only if there is nothing else.
        """
        if not self.wanted.admits(structure):
            return np.inf
        return sum(map(self._criterion_of, range(len(self.tests)), self.fits[structure]))

    def preference(self, structure: Structure) -> float:
        """The criterion, and ALIKE for each zero in the right half plane: it has to be asked for."""
        return self.criterion(structure) + ALIKE * structure.right

    def white(self, structure: Structure) -> bool:
        """Whether a structure leaves nothing to explain in any test."""
        pairs = zip(self.tests, self.fits[structure], strict=True)
        return all(
            test.exact(fit) or (test.correlation(fit) < max(WHITE, test.chance) and test.worst_run(fit) < RUN)
            for test, fit in pairs
        )

    def fit(self, structure: Structure, rival: Structure | None) -> None:
        """Each test on its own; one that another test's parameters explain as well needs no guesses of its own.

        The search for guesses ends early where they stay far behind a rival structure.
        """
        below = self.fits.get(replace(structure, zeros=structure.zeros - 2, poles=structure.poles - 2))
        to_beat = [fit.deviance for fit in self.fits[rival]] if rival else [np.inf] * len(self.tests)
        fits: list[Likely] = []
        for i, test in enumerate(self.tests):
            leader = min(range(i), key=lambda k: fits[k].deviance / self.tests[k].omega.size, default=None)
            fit = test.follow(self.tests[leader], fits[leader]) if leader is not None else None
            if fit is None or leader is None or not test.as_well(fit, self.tests[leader], fits[leader]):
                own = test.fit(structure, below[i] if below else None, to_beat[i])
                fit = own if fit is None or own.deviance < fit.deviance else fit
            fits.append(fit)
            self.tick()
        leader = min(range(len(fits)), key=lambda k: fits[k].deviance / self.tests[k].omega.size)
        for i, test in enumerate(self.tests):
            if not test.as_well(fits[i], self.tests[leader], fits[leader]):
                fits[i] = min(fits[i], test.follow(self.tests[leader], fits[leader]), key=lambda fit: fit.deviance)
        self.fits[structure] = fits

    def step(self, here: Structure, there: Structure) -> bool:
        """Fit a neighbour from the parameters of ``here``; False when the first tests say that it is worse."""
        fits: list[Likely] = []
        lost = 0.0
        for i, (test, known) in enumerate(zip(self.tests, self.fits[here], strict=True)):
            penalty = self._penalty(i, there) - self._penalty(i, here)
            to_beat = known.deviance - self.overdispersion * (penalty - HOPELESS)
            grows = there.poles > here.poles + 1
            starts = test.grown_from(known) if grows else reached_from(known, there, test.omega)
            if not starts:
                return False
            found = test.pursue(there, starts, known, to_beat)
            fits.append(found)
            lost += self._criterion_of(i, found) - self._criterion_of(i, known)
            self.tick()
            if lost > HOPELESS:
                return False
        self.fits[there] = fits
        return True

    def _criterion_of(self, i: int, fit: Likely) -> float:
        """The criterion of one test: HIDDEN more where no line shows what is at s = 0; LAST_RESORT of needles."""
        omega = self.tests[i].omega
        hidden = HIDDEN * (self.wanted.integrators is None and cancels_origin(fit, omega))
        needle = LAST_RESORT * has_needle(fit, omega)
        return fit.deviance / self.overdispersion + self._penalty(i, fit.structure) + hidden + needle

    def deviance(self, structure: Structure) -> float:
        """-2 log likelihood, summed over the tests."""
        return sum(fit.deviance for fit in self.fits[structure])

    def _penalty(self, i: int, structure: Structure) -> float:
        """k log n, n numbers being two a line, for few lines more (McQuarrie, Stat. Probab. Lett. 44, 1999).

        The noise has two of the k parameters.
        """
        n, k = 2 * self.tests[i].omega.size, structure.free + 2
        return float(k * np.log(n) * n / (n - k - 2))

    def affordable(self, structure: Structure) -> bool:
        """Whether every test has twice as many numbers as there are parameters."""
        return all(test.omega.size >= structure.free + 2 for test in self.tests)
