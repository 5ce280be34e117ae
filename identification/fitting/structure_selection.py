"""Which structure the data ask for: of those tried from simple to rich and back that of least Bayesian criterion."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from identification.base.arrays import Real
from identification.base.errors import InputError
from identification.fitting.first_guess import BAND
from identification.fitting.likelihood import Likely
from identification.fitting.neighbouring_structures import (
    FLIPS,
    GROWTH,
    OUTSIDE,
    cancels_origin,
    has_needle,
    neighbours,
    reached_from,
    stepped,
    within_band,
)
from identification.fitting.single_test_fit import ScaledTest
from identification.model.structure import INTEGRATORS, Structure, Wanted

MOST_MODES = 8
BEHIND = 1.0  # deviance a line, behind the best number of integrators, at which another one is given up
WHITE = 0.1  # correlation of neighbouring residuals below which nothing is left to explain
FRUITLESS = 2  # rows of the path without a better structure after which it ends
LEVELLED = 0.2  # of the path's largest gain, below which gains are taken for those of superfluous pairs
SUPERFLUOUS = 8.0  # deviance that a mode pair too many takes off a test's white residuals; 4 to 10 seen
ALIKE = 6.0  # criteria closer than this are no strong evidence (Raftery, Sociol. Methodol. 25, 1995)
MATERIAL = 4.0  # times the median distance, that a root outside the band changes the response near its edge
LITTLE = 0.25  # deviance a line
AT_EDGE = 1.02  # times the end of the search
RUN = 3.5  # times the noise, that two of three neighbouring lines are missed by chance once in 1e9
HIDDEN = 30.0  # of the criterion: evidence for a pole or zero at s = 0 that roots below the band cancel
LAST_RESORT = 1e12  # above every criterion
HOPELESS = 20.0  # criterion lost on the first tests after which the others are not asked


class Selection:
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

    def search(self) -> Structure:
        """The admitted structure of least criterion that is found.

        Raises
        ------
        InputError
            No structure is admitted, or the tests have too few lines for any.

        Notes
        -----
        First as many zeros as poles, pair by pair, for each number of integrators that is not far behind the best;
        then single steps (:func:`identification.fitting.neighbouring_structures.neighbours`) as long as the criterion
        falls.

        On a real rig no model leaves white residuals: every further pair of modes takes a little more of a ripple that
        is no noise, without end. There the criterion is a quasi-likelihood's (Burnham and Anderson, "Model Selection
        and Multimodel Inference", 2nd ed., section 2.5): the deviance is divided by an overdispersion, which is
        what the small gains along the path are, in the median, over what superfluous pairs gain on white residuals.
        """
        path = self._path()
        best = min(self.fits, key=self.criterion)
        if self.wanted.modes is None and not self.white(best):
            self.overdispersion = self._overdispersion(path)
            best = min(self.fits, key=self.criterion)
        best = self._climb(best)
        if self.overdispersion > 1 and self.white(best):
            self.overdispersion = 1.0
            best = self._climb(best)
        self.fits[best] = [test.other_turns(fit) for test, fit in zip(self.tests, self.fits[best], strict=True)]
        return best

    def _overdispersion(self, path: list[Structure]) -> float:
        """Median of the path's small gains a test over that of a superfluous pair; 1 without several small gains.

        They are those after the last large one: before it the plant itself is not found yet.
        """
        gains = -np.diff([self._deviance(structure) for structure in path]) / len(self.tests)
        large = np.flatnonzero(gains >= LEVELLED * gains.max(initial=0.0))
        small = gains[large[-1] + 1 :] if large.size else gains[:0]
        return max(1.0, float(np.median(small)) / SUPERFLUOUS) if small.size > 1 else 1.0

    def _climb(self, best: Structure) -> Structure:
        """Single steps from ``best`` as long as the criterion falls.

        Where it hardly tells on which side of the axis zeros lie, they lie on the left.
        """
        tried = {best}
        while True:
            better, is_white = best, self.white(best)
            for step in [*neighbours(best), *stepped(best, [] if is_white else [GROWTH])]:
                if step in tried or not self._affordable(step) or not self.wanted.admits(step):
                    continue
                if is_white and step.right > best.right:
                    continue  # noise cannot ask for a zero in the right half plane
                tried.add(step)
                if self._step(best, step) and self._preference(step) < self._preference(better):
                    better = step
            if better == best:
                better = self._shed(best, tried)
            if better == best:
                return best
            best = better

    def criterion(self, structure: Structure) -> float:
        """Bayesian information criterion, summed over the tests; infinite for what is not admitted.

        It is at LAST_RESORT for what is taken only if there is nothing else.
        """
        if not self.wanted.admits(structure):
            return np.inf
        return sum(map(self._criterion_of, range(len(self.tests)), self.fits[structure]))

    def _preference(self, structure: Structure) -> float:
        return self.criterion(structure) + ALIKE * structure.right

    def white(self, structure: Structure) -> bool:
        """Whether a structure leaves nothing to explain in any test."""
        pairs = zip(self.tests, self.fits[structure], strict=True)
        return all(
            test.exact(fit) or (test.correlation(fit) < max(WHITE, test.chance) and test.worst_run(fit) < RUN)
            for test, fit in pairs
        )

    def _path(self) -> list[Structure]:
        """Structures that grow by one zero mode and one pole mode at a time; those admitted are never none."""
        zero_modes, pole_modes = self.wanted.modes or (MOST_MODES, MOST_MODES)
        real_zeros, real_poles = self.wanted.real or (0, 0)
        pairs = (real_zeros // 2, 0, real_poles // 2)
        integrators = [q for q in INTEGRATORS if self.wanted.integrators in (None, q)]
        right = 0
        path: list[Structure] = []
        fruitless, last = 0, None
        for n in range(max(zero_modes, pole_modes) + 1):
            zeros, poles = 2 * min(n, zero_modes) + real_zeros, 2 * min(n, pole_modes) + real_poles
            open_zeros = 0 if self.wanted.modes else 2  # a zero at s = 0 takes the place of another
            row = [
                Structure(q, zeros - right - min(max(-q, 0), open_zeros), poles, right, real_pairs=pairs)
                for q in integrators
            ]
            row = [structure for structure in row if structure.proper and self._affordable(structure)]
            if not row:
                continue
            leader: Structure | None = None
            for structure in row:
                self._fit(structure, leader)
                leader = min(leader or structure, structure, key=self._deviance)
            assert leader is not None
            path.append(leader)
            self._shed(leader, set())
            right = self._mirrored(leader).right
            if len(path) > 1:
                limit = self._deviance(leader) + BEHIND * sum(test.omega.size for test in self.tests)
                row = [structure for structure in row if self._deviance(structure) < limit]
            integrators = [structure.integrators for structure in sorted(row, key=self._deviance)]
            best = min(self.fits, key=self.criterion)
            if self.wanted.admits(best):
                fruitless = 0 if best != last else fruitless + 1
                if fruitless and (self.white(best) or fruitless == FRUITLESS):
                    break
            last = best
        if not any(self.wanted.admits(structure) for structure in path):
            self._refuse()
        return path

    def _fit(self, structure: Structure, rival: Structure | None) -> None:
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

    def _shed(self, here: Structure, tried: set[Structure]) -> Structure:
        """What is left of a structure without the roots that the first test puts far outside the band.

        That is fitted, and returned if the criterion does not speak strongly against it, or if those roots are where
        the search ends, change less than MATERIAL times what the model leaves at a line, and explain LITTLE. It counts
        as ``tried``.
        """
        for reach in (BAND / AT_EDGE, OUTSIDE):
            left = within_band(self.fits[here][0], self.tests[0].omega, reach)
            if left is not None and self.wanted.admits(left[0]) and self._does_without(here, *left, tried):
                return left[0]
        return here

    def _does_without(
        self, here: Structure, there: Structure, start: Real, change: float, tried: set[Structure]
    ) -> bool:
        """Whether a structure does without the roots that ``there`` leaves out, from ``start``, see :meth:`_shed`."""
        first = self.tests[0]
        tried.add(there)
        if there not in self.fits:
            fit = first.pursue(there, [start], self.fits[here][0], np.inf)
            self.fits[there] = [fit, *(test.follow(first, fit) for test in self.tests[1:])]
            self.tick()
        worse = self.criterion(there) - self.criterion(here)
        most = min(AT_EDGE / BAND, MATERIAL * first.distance(self.fits[here][0]))
        lines = sum(test.omega.size for test in self.tests)
        immaterial = change < most and self.overdispersion * worse < LITTLE * lines and not self.white(here)
        return worse < ALIKE or immaterial

    def _mirrored(self, here: Structure) -> Structure:
        """The likeliest of a structure and of those in which one of its zeros is mirrored on the imaginary axis."""
        if self.white(here):
            return here
        better = here
        for there in stepped(here, FLIPS):
            if there not in self.fits and self._affordable(there) and self._step(here, there):
                better = min(better, there, key=self._deviance)
        return better if self._deviance(better) < self._deviance(here) - ALIKE * len(self.tests) else here

    def _step(self, here: Structure, there: Structure) -> bool:
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

    def _deviance(self, structure: Structure) -> float:
        return sum(fit.deviance for fit in self.fits[structure])

    def _penalty(self, i: int, structure: Structure) -> float:
        """k log n, n numbers being two a line, for few lines more (McQuarrie, Stat. Probab. Lett. 44, 1999).

        The noise has two of the k parameters.
        """
        n, k = 2 * self.tests[i].omega.size, structure.free + 2
        return float(k * np.log(n) * n / (n - k - 2))

    def _affordable(self, structure: Structure) -> bool:
        """Whether every test has twice as many numbers as there are parameters."""
        return all(test.omega.size >= structure.free + 2 for test in self.tests)

    def _refuse(self) -> None:
        shortest = min(self.tests, key=lambda test: test.omega.size)
        modes, real = self.wanted.modes or (0, 0), self.wanted.real or (0, 0)
        least = Structure(self.wanted.integrators or 0, 2 * modes[0] + real[0], 2 * modes[1] + real[1])
        if self.wanted.modes is not None and least.size + 2 > shortest.omega.size:
            raise InputError(
                f"{shortest.name}: holds {shortest.omega.size} lines; expected {least.size + 2} or more for {least}"
            )
        raise InputError(f"{least} make an improper plant; expected no more zeros than poles and integrators")
