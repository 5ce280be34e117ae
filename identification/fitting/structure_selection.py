"""Which structure the data ask for: of those tried from simple to rich and back that of least Bayesian criterion."""

from __future__ import annotations

import numpy as np

from identification.base.arrays import Real
from identification.base.errors import InputError
from identification.fitting.first_guess import BAND
from identification.fitting.neighbouring_structures import (
    FLIPS,
    GROWTH,
    OUTSIDE,
    neighbours,
    stepped,
    within_band,
)
from identification.fitting.structure_fits import ALIKE, StructureFits
from identification.model.plant import INTEGRATORS
from identification.model.structure import Structure

MOST_MODES = 8
BEHIND = 1.0  # deviance a line, behind the best number of integrators, at which another one is given up
FRUITLESS = 2  # rows of the path without a better structure after which it ends
LEVELLED = 0.2  # of the path's largest gain, below which gains are taken for those of superfluous pairs
SUPERFLUOUS = 8.0  # deviance that a mode pair too many takes off a test's white residuals; 4 to 10 seen
MATERIAL = 4.0  # times the median distance, that a root outside the band changes the response near its edge
LITTLE = 0.25  # deviance a line
AT_EDGE = 1.02  # times the end of the search


class Selection(StructureFits):
    """The search for the structure that the data ask for; see :class:`StructureFits` for what it holds."""

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
        best = self._with_most_integrators(best)
        self.fits[best] = [test.other_turns(fit) for test, fit in zip(self.tests, self.fits[best], strict=True)]
        return best

    def _with_most_integrators(self, best: Structure) -> Structure:
        """Of structures no richer that the criterion hardly tells apart, that with the most poles at s = 0."""
        near = [other for other in self.fits if self.criterion(other) < self.criterion(best) + ALIKE]
        no_richer = [other for other in near if other.free <= best.free and other.right <= best.right]
        most = max((other.integrators for other in no_richer), default=0)
        if most <= max(best.integrators, 0):
            return best
        return min((other for other in no_richer if other.integrators == most), key=self.criterion)

    def _overdispersion(self, path: list[Structure]) -> float:
        """Median of the path's small gains a test over that of a superfluous pair; 1 without several small gains.

        They are those after the last large one: before it the plant itself is not found yet.
        """
        gains = -np.diff([self.deviance(structure) for structure in path]) / len(self.tests)
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
                if step in tried or not self.affordable(step) or not self.wanted.admits(step):
                    continue
                if is_white and step.right > best.right:
                    continue  # noise cannot ask for a zero in the right half plane
                tried.add(step)
                if self.step(best, step) and self.preference(step) < self.preference(better):
                    better = step
            if better == best:
                better = self._shed(best, tried)
            if better == best:
                return best
            best = better

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
            row = [structure for structure in row if structure.proper and self.affordable(structure)]
            if not row:
                continue
            leader: Structure | None = None
            for structure in row:
                self.fit(structure, leader)
                leader = min(leader or structure, structure, key=self.deviance)
            assert leader is not None
            path.append(leader)
            self._shed(leader, set())
            right = self._mirrored(leader).right
            if len(path) > 1:
                limit = self.deviance(leader) + BEHIND * sum(test.omega.size for test in self.tests)
                row = [structure for structure in row if self.deviance(structure) < limit]
            integrators = [structure.integrators for structure in sorted(row, key=self.deviance)]
            best = min(self.fits, key=self.criterion)
            if self.wanted.admits(best):
                fruitless = 0 if best != last else fruitless + 1
                if fruitless and (self.white(best) or fruitless == FRUITLESS):
                    break
            last = best
        if not any(self.wanted.admits(structure) for structure in path):
            self._refuse()
        return path

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
            if there not in self.fits and self.affordable(there) and self.step(here, there):
                better = min(better, there, key=self.deviance)
        return better if self.deviance(better) < self.deviance(here) - ALIKE * len(self.tests) else here

    def _refuse(self) -> None:
        shortest = min(self.tests, key=lambda test: test.omega.size)
        modes, real = self.wanted.modes or (0, 0), self.wanted.real or (0, 0)
        least = Structure(self.wanted.integrators or 0, 2 * modes[0] + real[0], 2 * modes[1] + real[1])
        if self.wanted.modes is not None and least.size + 2 > shortest.omega.size:
            raise InputError(
                f"{shortest.name}: holds {shortest.omega.size} lines; expected {least.size + 2} or more for {least}"
            )
        raise InputError(f"{least} make an improper plant; expected no more zeros than poles and integrators")
