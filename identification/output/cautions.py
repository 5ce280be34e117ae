"""What a user of a fitted plant must know: misfit, edges of the search, what the data leave open."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from identification.base.arrays import Real
from identification.base.digits import percent
from identification.fitting.dead_time import same_turn, turns_sign
from identification.fitting.first_guess import BAND, LEAST_ZETA, most_zeta
from identification.fitting.fit_plant import FitResult
from identification.fitting.neighbouring_structures import OUTSIDE
from identification.fitting.structure_fits import ALIKE, RUN
from identification.model.parameter import Parameter
from identification.model.plant import PlantModel
from identification.model.structure import MOST_REAL, Structure
from identification.sweeps.response import FrequencyResponse

MISSED = 0.6  # correlation of neighbouring residuals that a ripple hardly reaches
POOR = 0.15  # median distance of a test from its own fit
WORSE = 3.0  # times the distance of a test from its own fit
AT_EDGE = 0.02  # of the search, a logarithm
OUTLIER = 12.0  # times the noise, that a line is missed
OPEN, UNKNOWN = 10.0, 1e6  # ratio of the ends of an interval


def cautions(result: FitResult, tests: Sequence[FrequencyResponse], reversed_from: float | None = None) -> list[str]:
    """Sentences on what a fit to ``tests`` leaves open, the gravest first.

    ``reversed_from`` is as for :func:`identification.output.fit_facts.fit_record`.
    """
    edges = _edges(result.plant, np.concatenate([test.omega for test in tests]))
    return [
        *_reversed(result, tests, reversed_from),
        *_outliers(result),
        *_misfit(result),
        *_open(result, edges),
        *_dead_time(result, tests),
        *_alike(result),
    ]


def _reversed(result: FitResult, tests: Sequence[FrequencyResponse], reversed_from: float | None) -> Iterator[str]:
    if any(test.conjugated for test in tests):
        own = max(test.distance for test in result.tests)
        before = "as it is does not fit"
        if reversed_from is not None and np.isfinite(reversed_from):
            before = f"as it is at {percent(reversed_from)} %"
        yield (
            f"the sign of the phase is reversed: the conjugate fits at {percent(own)} %, the response {before}; if a "
            "lag is negative in your files, the plant is unstable and this fit is wrong"
        )


def _outliers(result: FitResult) -> Iterator[str]:
    """Lines that the plant misses by far more than its neighbours."""
    for fit in result.tests:
        where = f"{fit.name}: the plant misses the line at {fit.worst_omega / (2 * np.pi):.4g} Hz"
        if fit.worst > OUTLIER and fit.around < OUTLIER / 3:
            mended = "the loss is soft-L1 for it" if result.soft else "--loss soft-l1 reduces its weight"
            yield f"{where} by {fit.worst:.2g} times the noise but not its neighbours: an outlier; {mended}"
        elif fit.around > RUN:
            yield f"{where} and its neighbours by {fit.around:.2g} times the noise: the structure is too simple there"


def _misfit(result: FitResult) -> Iterator[str]:
    own, nominal = max(test.distance for test in result.tests), max(result.distances)
    if own > POOR and max(test.relative for test in result.tests) > POOR:
        yield f"noise does not explain a median distance of {percent(own)} %: the plant may be of another class"
    correlation = max(test.correlation for test in result.tests)
    if result.nominal.misfit.any() and correlation > MISSED:
        yield f"the search may have missed a root: {_one_zero_more(result.structure)}"
    if nominal > POOR and nominal > WORSE * own:
        yield (
            f"the tests differ much: the plant misses one by {percent(nominal)} %, a test's own fit misses it by at "
            f"most {percent(own)} %; the tests may be of different plants"
        )


def _one_zero_more(structure: Structure) -> str:
    """The options that ask for one real zero more, and for one pole more if that would be improper."""
    (zero_modes, pole_modes), (zeros, poles) = structure.modes, structure.real
    poles += not replace(structure, zeros=structure.zeros + 1).proper
    if max(zeros + 1, poles) > MOST_REAL:
        return f"try other --modes than {zero_modes}/{pole_modes}"
    return f"try --modes {zero_modes}/{pole_modes} --real {zeros + 1}/{poles}"


def _edges(plant: PlantModel, omega: Real) -> dict[str, str]:
    """By a parameter's name, a sentence about each that is where the search ends or far from the lines."""
    low, high = float(omega.min()), float(omega.max())
    said, seen = {}, False
    for parameter in plant.parameters:
        size = abs(parameter.value)
        if parameter.quantity == "omega":
            seen = low <= size <= high
        if parameter.quantity == "zeta":
            if size < LEAST_ZETA * (1 + AT_EDGE) and seen:
                said[parameter.name] = (
                    f"{_name(parameter)} is {size:.3g}, the lower end of the search: the resonance is narrower than "
                    "the spacing of the lines, or undamped"
                )
            elif size > most_zeta(omega) * (1 - AT_EDGE):
                said[parameter.name] = f"{_name(parameter)} is {size:.3g}, the upper end of the search"
        elif parameter.kind not in ("gain", "delay_s") and not low / OUTSIDE < size < high * OUTSIDE:
            side, end, ideal = ("below", low / BAND, "one at s = 0") if size < low else ("above", high * BAND, "none")
            where = ", the end of the search" if abs(np.log(size / end)) < AT_EDGE else ""
            which = "lowest" if side == "below" else "highest"
            said[parameter.name] = (
                f"{_name(parameter)} is {parameter.value:.4g} rad/s{where}, {side} all lines ({low:.4g} to {high:.4g} "
                f"rad/s): only its small effect at the {which} of them distinguishes it from {ideal}"
            )
    return said


def _open(result: FitResult, edges: dict[str, str]) -> Iterator[str]:
    """What is at an edge, and what else has an interval that says nothing."""
    yield from edges.values()
    lower, upper = result.nominal.intervals
    for parameter, low, high in zip(result.plant.parameters, lower, upper, strict=True):
        ends = sorted((abs(low), abs(high)))
        if parameter.kind != "delay_s" and parameter.name not in edges and ends[1] > OPEN * ends[0]:
            known = ends[1] < UNKNOWN * ends[0]
            how = f"allow every value from {low:.3g} to {high:.3g}" if known else "do not determine it"
            yield f"{_name(parameter)}: the data {how}"


def _dead_time(result: FitResult, tests: Sequence[FrequencyResponse]) -> Iterator[str]:
    delay_s = result.plant.delay_s
    if not result.structure.delayed:
        right = any(mode.zeta < 0 for mode in result.plant.zero_modes) or any(a < 0 for a in result.plant.real_zeros)
        stands_in = ", and a zero in the right half plane can replace one" if right else ""
        most = f"{result.nominal.intervals[1][-1]:.3g} s"
        yield f"the data show no dead time; in this structure it is at most {most}{stands_in}"
    turns = [same_turn(test.omega) for test in tests if test.record is None]
    if len(turns) == len(tests) and all(turns):
        turn = max(turn or 0.0 for turn in turns)
        sign = (
            " (an odd multiple reverses the sign of the gain)" if any(turns_sign(test.omega) for test in tests) else ""
        )
        yield (
            f"the lines are equally spaced, so that any multiple of {turn:.4g} s can be added to the dead time of "
            f"{delay_s:.4g} s{sign}"
        )


def _alike(result: FitResult) -> Iterator[str]:
    near = [f"{structure} ({more:+.1f})" for structure, more in result.alike.items() if more > -ALIKE]
    better = [f"{structure} ({more:+.1f})" for structure, more in result.alike.items() if more <= -ALIKE]
    if better:
        yield (
            f"the BIC alone would choose {better[0]}, with roots far outside the band or roots that the data do not "
            "determine"
        )
    if near:
        yield f"structures within {ALIKE:g} of its BIC: {'; '.join(near)}"


def _name(parameter: Parameter) -> str:
    return parameter.label.split(" [")[0]
