"""Residuals of all tests -> the additive bound W_a that covers them, Thesis Eq. (2.21) and (2.22)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from identification.base.arrays import Real, Whole
from identification.base.errors import InputError
from identification.bound.beyond import Beyond
from identification.bound.envelope import WIDTH, Envelope, envelope_of, largest_of
from identification.bound.orders import HIGHEST_ORDER
from identification.bound.tightest_bound import Points, resonances, shares, tightest, within
from identification.model.additive_bound import AdditiveBound
from identification.model.plant import PlantModel
from identification.model.reports import BoundReport, Excess, Touch
from identification.sweeps.response import FrequencyResponse, require_one_band

GRID = 1000  # frequencies, equal in logarithm, that are looked at besides the lines
ROUNDING = 1e-12  # of the plant: two models that differ by less do not differ
MARGIN = 1e-9  # relative, so that rounding cannot uncover the line where the bound touches
NEAR = 0.01  # share of a residual within which W_a touches it
ZOOMS = 3  # into what is between the grid's frequencies where W_a is within PEAK of a fit's distance
ZOOM = 33  # frequencies
PEAK = 1e-3


@dataclass(frozen=True)
class _Sample:
    """Residuals (M,) at frequencies (M,) in rad/s, and the number of the test that each belongs to."""

    omega: Real
    residual: Real
    test: Whole


def bound_residuals(
    plant: PlantModel,
    tests: Sequence[FrequencyResponse],
    models: Sequence[PlantModel] | None = None,
    order: int = 2,
    *,
    below: float | None = None,
    above: float | None = None,
) -> BoundReport:
    """W_a that covers |P - test| at every line, and on a grid between lines as far as the tests' fits say something.

    At the lines this is Thesis Eq. (2.21).

    Parameters
    ----------
    plant
        The nominal plant P.
    tests
        The tests to cover.
    models
        Each test's own fit, in the same order; None leaves what is between the lines open.
    order
        Number n of W_a's poles, 1 to HIGHEST_ORDER; there are n - 1 zeros. 2 is the form of (2.22).
    below, above
        Levels that W_a covers too, output unit per input unit: one from 0 to the lowest line, one from the highest to
        ten times it. None asks for nothing there.

    Raises
    ------
    InputError
        An order that is no such number or takes more lines than there are, a level that is not positive, a number of
        models that is not the tests', a residual that is not finite, a plant that meets every test exactly, or
        residuals too small for numbers that could cover them.

    Notes
    -----
    n - 1 zeros for n poles is what (2.22) has for n = 2: W_a falls off like 1/s as the residuals of strictly proper
    plants do, and an order contains the one below (a zero on a pole), so that more poles are never looser.

    Between the lines the data speak through each test's fit: two resonances that differ by less than the lines'
    distance part on a peak of |P - P_test| that no line sees. The grid there is made of equal angles on the circles
    of the modes of P and P_test, within the test's own band. What remains between a test and its own fit is not
    added between the lines: it counts in full at every line, where it was seen, and is the instrument's rather than
    the plant's as far as it changes from line to line.

    The excess counts over :func:`identification.bound.envelope.envelope_of`, since single residuals come near zero by
    chance; :func:`identification.bound.tightest_bound.fit_bound` says what is least. It sees one point a bin, and then,
    round by round, the worst points of the bound found, the peaks and notches of the bound itself among them.

    Between the lines W_a follows residuals no deeper than a straight line between neighbours, in logarithms: no notch
    slips between two lines. Outside the band nothing was measured. There W_a may exceed the envelope's continuation, in
    proportion to 1/omega below and to omega above, by no more than it exceeds the envelope; and none of its modes has a
    resonance or a notch of its own there (:class:`identification.bound.shape.Shape`).

    No stable W_a covers an error of an integrator's gain down to 0, where |P| is infinite: ``below`` says that there
    is none, or how far down it matters, since an error dK is |dK|/omega. Above, W_a keeps the form of (2.22) and falls
    like 1/s, which no constant level does: from ten times the highest line on ``above`` is left.
    """
    _refuse(tests, models, order)
    lines = _sample([(test.omega, np.abs(plant(1j * test.omega) - test.response)) for test in tests])
    if not lines.residual.any():
        raise InputError("the model meets every test exactly; expected residuals to bound")
    band = float(lines.omega.min()), float(lines.omega.max())
    beyond = Beyond(band, below, above)
    grid = band[0] * np.exp(np.linspace(0.0, np.log(band[1] / band[0]), GRID)[1:-1])
    pairs = () if models is None else tuple(zip(tests, models, strict=True))

    def around(test: FrequencyResponse, *models: PlantModel | AdditiveBound) -> Real:
        return np.concatenate([grid, test.omega[[0, -1]], resonances(plant, *models)])

    gaps = _sample([_apart(plant, *pair, around(*pair)) for pair in pairs])
    envelopes = [envelope_of(sample.omega, sample.residual) for sample in (lines, gaps) if sample.residual.any()]

    omega, largest, _ = largest_of(lines.omega, lines.residual)
    joined = Envelope(omega[largest > 0], largest[largest > 0])

    def points(*parts: tuple[Real, Real]) -> Points:
        """Residuals at single frequencies, with what is asked there besides and the envelope of everything."""
        omega, largest, _ = largest_of(*(np.concatenate(each) for each in zip(*parts, strict=True)))
        level = np.max([envelope(np.clip(omega, *band)) for envelope in envelopes], axis=0) * beyond.continued(omega)
        residual = np.maximum(largest, beyond.asked(omega))
        least = np.maximum(residual, np.minimum(joined(omega), level))
        return Points(omega, residual, least, np.maximum(level, residual))

    def probe(bound: AdditiveBound) -> Points:
        omega = resonances(bound)
        found = _sample([_apart(plant, *pair, omega) for pair in pairs])
        return points((omega, np.zeros(omega.size)), (found.omega, found.residual))

    unseen = np.concatenate([grid, beyond.fitted()])
    apart = gaps.residual > 0
    between = gaps.omega[apart], gaps.residual[apart]
    seen = points((lines.omega, lines.residual), between, (unseen, np.zeros(unseen.size)))
    bound, least_excess = tightest(seen, probe, band, order)
    gaps = _sample([_apart(plant, *pair, _peaks(bound, plant, *pair, around(*pair, bound))) for pair in pairs])
    omega = beyond.around(bound)
    bound, touches = _touching(bound, lines, gaps, (omega, beyond.asked(omega)), [test.name for test in tests])
    every = seen.joined(probe(bound)).joined(points((omega[omega > 0], np.zeros(np.count_nonzero(omega)))))
    inside = every.of(within(every.omega, band))
    largest_excess = _excess(bound, every.omega, every.envelope).largest
    each = [_excess(bound, envelope.omega, envelope.level) for envelope in envelopes]
    return BoundReport(
        bound=bound,
        largest_excess=largest_excess,
        mean_excess=_excess(bound, inside.omega, inside.envelope).mean,
        least_excess=min(least_excess, largest_excess),
        at_lines=each[0],
        between_lines=each[1] if len(each) > 1 else None,
        touches=touches,
        outside=beyond.report(bound),
    )


def _refuse(tests: Sequence[FrequencyResponse], models: Sequence[PlantModel] | None, order: int) -> None:
    if order not in range(1, HIGHEST_ORDER + 1):
        raise InputError(f"the order of the bound is {order}; expected an integer from 1 to {HIGHEST_ORDER}")
    require_one_band(tests)
    lines = np.unique(np.concatenate([test.omega for test in tests])).size
    if lines < 4 * order:
        raise InputError(f"the tests have {lines} lines; expected {4 * order} or more for a bound of order {order}")
    if models is not None and len(models) != len(tests):
        raise InputError(f"there are {len(models)} fits; expected one for each of the {len(tests)} tests")


def _apart(plant: PlantModel, test: FrequencyResponse, model: PlantModel, omega: Real) -> tuple[Real, Real]:
    """The frequencies within the test's band, and |P - P_test| there."""
    omega = omega[(omega >= test.omega[0]) & (omega <= test.omega[-1])]
    nominal = plant(1j * omega)
    distance = np.abs(nominal - model(1j * omega))
    return omega, np.where(distance > ROUNDING * np.abs(nominal), distance, 0.0)


def _peaks(bound: AdditiveBound, plant: PlantModel, test: FrequencyResponse, model: PlantModel, omega: Real) -> Real:
    """``omega`` and what is between where |P - P_test|/|W_a| is largest there: the peaks that ``omega`` shows."""
    zoomed = np.unique(omega)
    for _ in range(ZOOMS):
        zoomed, distance = _apart(plant, test, model, zoomed)
        ratio = distance / np.abs(bound(1j * zoomed))
        inner = ratio[1:-1]
        top = (inner >= ratio[:-2]) & (inner >= ratio[2:]) & (inner > (1 - PEAK) * ratio.max())
        finer = np.linspace(zoomed[:-2][top], zoomed[2:][top], ZOOM)
        zoomed = np.unique(np.append(finer, zoomed[np.argmax(ratio)]))
    return np.append(omega, zoomed)


def _sample(residuals: Sequence[tuple[Real, Real]]) -> _Sample:
    """Put together frequencies and residuals of the tests."""
    omega = np.concatenate([np.empty(0), *(pair[0] for pair in residuals)])
    residual = np.concatenate([np.empty(0), *(pair[1] for pair in residuals)])
    if not np.all(np.isfinite(residual)):
        raise InputError(
            f"a test's distance from the model is not finite at {omega[~np.isfinite(residual)][0]:.6g} rad/s"
        )
    return _Sample(omega, residual, np.repeat(np.arange(len(residuals)), [pair[0].size for pair in residuals]))


def _touching(
    bound: AdditiveBound, lines: _Sample, gaps: _Sample, levels: tuple[Real, Real], names: Sequence[str]
) -> tuple[AdditiveBound, tuple[Touch, ...]]:
    """The bound with the least gain that covers, levels given at frequencies too, and which residuals it touches."""
    omega = np.concatenate([lines.omega, gaps.omega])
    residual = np.concatenate([lines.residual, gaps.residual])
    test = np.concatenate([lines.test, gaps.test])
    short = max(float(np.max(size / np.abs(bound(1j * at)))) for at, size in ((omega, residual), levels))
    bound = replace(bound, gain=bound.gain * short * (1 + MARGIN))
    ratio, some = np.full(omega.size, np.inf), residual > 0
    ratio[some] = np.abs(bound(1j * omega[some])) / residual[some]
    if not np.all(ratio >= 1):
        raise InputError(
            f"W_a misses a residual by rounding errors (the largest is {residual.max():.3g}); expected other units"
        )
    touches: list[Touch] = []
    for i in np.argsort(ratio, kind="stable")[: np.count_nonzero(ratio <= 1 + NEAR)]:
        if all(abs(np.log(omega[i] / touch.omega)) > WIDTH for touch in touches):
            touches.append(Touch(float(omega[i]), names[test[i]], bool(i >= lines.omega.size), float(ratio[i])))
    return bound, tuple(touches)


def _excess(bound: AdditiveBound, omega: Real, level: Real) -> Excess:
    ratio = np.abs(bound(1j * omega)) / level
    at = int(np.argmax(ratio))
    mean = np.exp(shares(np.log(omega)) @ np.log(ratio))
    return Excess(float(ratio[at]), float(omega[at]), float(mean))
