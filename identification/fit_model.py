"""Frequency responses -> the model that model.json holds: plant, bound, and how they came about."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from operator import index

import numpy as np

from identification.base.errors import InputError, shown
from identification.bound.bound_residuals import bound_residuals
from identification.fitting.fit_plant import FitResult, fit_plant
from identification.fitting.other_classes import refuse_unstable, reversed_fit, robust_fit
from identification.fitting.single_test_fit import Misfit, Undetermined
from identification.fitting.subspace_check import check_modes
from identification.model.fit_record import FitRecord
from identification.model.model_file import IdentifiedModel
from identification.model.plant import INTEGRATORS, PlantModel
from identification.model.reports import BoundReport, SubspaceCheck
from identification.model.signals import UNNAMED, Signals
from identification.model.structure import MOST_REAL, Wanted
from identification.output.cautions import POOR
from identification.output.fit_facts import fit_record, standard_errors
from identification.sweeps.joined_bands import joined_bands
from identification.sweeps.noise_lines import within, without_noise
from identification.sweeps.response import FrequencyResponse, alias_free, conjugated

MOST_MODES = 8
BY_CHANCE = 4.5  # times the noise: no line of some thousand is missed by more by chance

Tick = Callable[[], object]


@dataclass(frozen=True)
class ModelFit:
    """A fitted model and all that it came from.

    Parameters
    ----------
    model
        Plant, bound, standard errors and the record of the fit.
    record
        How the model came about, its ``fit``.
    plant_fit, bound_fit
        How plant and bound were found.
    checks
        By the name of each test with a raw record, the subspace check of its modes.
    tests
        The responses without the aliases of a held input.
    """

    model: IdentifiedModel
    record: FitRecord
    plant_fit: FitResult
    bound_fit: BoundReport
    checks: Mapping[str, SubspaceCheck]
    tests: tuple[FrequencyResponse, ...]


def fit_model(
    tests: Sequence[FrequencyResponse],
    wanted: Wanted | None = None,
    *,
    soft: bool = False,
    bound_order: int = 2,
    bound_below: float | None = None,
    bound_above: float | None = None,
    seed: int = 0,
    band: tuple[float, float] | None = None,
    signals: Signals = UNNAMED,
    tick: Tick = lambda: None,
) -> ModelFit:
    """Fit the plant of Thesis Eq. (2.20) and the bound of (2.21) to tests.

    Parameters
    ----------
    tests, wanted, soft, seed, tick
        As for :func:`identification.fitting.fit_plant.fit_plant`.
    bound_order, bound_below, bound_above
        Number of poles of W_a, and levels that it covers beyond the lines, see
        :func:`identification.bound.bound_residuals.bound_residuals`.
    band
        Lowest and highest frequency in Hz that is used of each test; None leaves out what is noise at both ends, see
        :func:`identification.sweeps.noise_lines.without_noise`.
    signals
        Names and units of the plant's input and output.

    Raises
    ------
    InputError
        As these two do; no line lies in the band; or the plant is unstable.

    Notes
    -----
    Tests of different bands are fitted as one, see :func:`identification.sweeps.joined_bands.joined_bands`.
    Where single lines spoil the fit by least squares, soft-L1 errors are taken; ``record.loss`` and a caution say so.
    Where the conjugate of all responses fits far better than they do, their phase has the other sign, as that of
    analysers that count a lag as positive, and the conjugate is fitted; ``record.conjugated`` says so.
    """
    within_band = without_noise(tests) if band is None else [within(test, *band) for test in tests]
    chosen = joined_bands(within_band)
    used, result, reversed_from = _fit_either_sign(chosen, wanted or Wanted(), soft=soft, seed=seed, tick=tick)
    plants = [test.plant for test in result.tests]
    checks = _checks(used, plants, tick)
    clean = tuple(alias_free(test, result.plant) for test in used)
    report = bound_residuals(result.plant, clean, plants, bound_order, below=bound_below, above=bound_above)
    record = fit_record(used, result, report, checks, reversed_from)
    model = IdentifiedModel(result.plant, report.bound, standard_errors(result), record, signals)
    return ModelFit(model, record, result, report, checks, clean)


def _fit_either_sign(
    tests: Sequence[FrequencyResponse],
    wanted: Wanted,
    *,
    soft: bool,
    seed: int,
    tick: Tick,
    known: FitResult | None = None,
) -> tuple[Sequence[FrequencyResponse], FitResult, float | None]:
    """The tests as they were fitted, the fit, and, if their phase is reversed, the misfit before; None if it is not.

    ``known`` is the fit of the tests as they are, if it was made already.
    """
    result, refusal, distance, stands_out = None, None, np.inf, True
    try:
        result = known or fit_plant(tests, wanted, soft=soft, seed=seed, tick=tick)
        distance = max(test.distance for test in result.tests)
        stands_out = any(test.worst > BY_CHANCE for test in result.tests)
        if distance < POOR and not stands_out and not any(test.misfit for test in result.tests):
            return tests, result, None
    except (Misfit, Undetermined) as error:
        refusal = error
    is_suspect, is_one = not soft and (stands_out or distance > POOR), len(tests) == 1
    if is_suspect and (found := robust_fit(tests[0], wanted, distance, seed=seed)):
        known = found if is_one else None
        used, robust, before = _fit_either_sign(tests, wanted, soft=True, seed=seed, tick=tick, known=known)
        if before is None:
            return used, robust, None
        # the sign was what least squares missed: with the other one they are tried again
        return used, _fit_either_sign(used, wanted, soft=False, seed=seed, tick=tick)[1], before
    deviance = np.inf if result is None else result.tests[0].deviance
    if found := reversed_fit(tests, wanted, distance, deviance, soft=soft, seed=seed):
        turned = [conjugated(test) for test in tests]
        return turned, found if is_one else fit_plant(turned, wanted, soft=soft, seed=seed, tick=tick), distance
    refuse_unstable(tests[0], None if result is None else result.structure, distance)
    if refusal is not None:
        raise refusal
    assert result is not None
    return tests, result, None


def fit(
    tests: FrequencyResponse | Sequence[FrequencyResponse],
    *,
    modes: int | Sequence[int] | None = None,
    real: int | Sequence[int] | None = None,
    integrators: int | None = None,
    soft: bool = False,
    bound_order: int = 2,
    bound_below: float | None = None,
    bound_above: float | None = None,
    seed: int = 0,
    band: tuple[float, float] | None = None,
    signals: Signals = UNNAMED,
) -> IdentifiedModel:
    """Fit plant and bound to tests, with what is left open chosen by the Bayesian information criterion.

    Parameters
    ----------
    tests
        One or more responses of the same plant.
    modes, real
        Zero and pole modes (up to 8 each), real zeros and poles (up to 3 each): one number for both, or a pair.
    integrators
        Poles at s = 0, up to 2; a negative number, down to -2, counts zeros there.
    soft, bound_order, bound_below, bound_above, seed, band, signals
        As for :func:`fit_model`.

    Raises
    ------
    InputError
        A number is none of these, or see :func:`fit_model`.
    """
    if integrators is not None and integrators not in INTEGRATORS:
        raise InputError(f"integrators is {shown(integrators)}; expected an integer from -2 to 2")
    wanted = Wanted(integrators, _pair("modes", modes, MOST_MODES), _pair("real", real, MOST_REAL))
    given = [tests] if isinstance(tests, FrequencyResponse) else tests
    fitted = fit_model(
        given,
        wanted,
        soft=soft,
        bound_order=bound_order,
        bound_below=bound_below,
        bound_above=bound_above,
        seed=seed,
        band=band,
        signals=signals,
    )
    return fitted.model


def _pair(name: str, count: int | Sequence[int] | None, most: int) -> tuple[int, int] | None:
    """Numbers of zeros and of poles: of one number twice that; raises InputError when it is none from 0 to ``most``."""
    if count is None:
        return None
    try:
        zeros, poles = count if isinstance(count, Sequence) and not isinstance(count, str) else (count, count)
        pair = index(zeros), index(poles)
    except (TypeError, ValueError):
        pair = -1, -1
    if not all(0 <= each <= most for each in pair):
        raise InputError(f"{name} is {shown(count)}; expected a number from 0 to {most}, or a pair of zeros and poles")
    return pair


def _checks(tests: Sequence[FrequencyResponse], plants: Sequence[PlantModel], tick: Tick) -> dict[str, SubspaceCheck]:
    """By its name, the subspace check of each test that was read from a raw record against its own fit."""
    checks = {}
    for test, plant in zip(tests, plants, strict=True):
        if test.record is not None:
            checks[test.name] = check_modes(plant, test.record, (float(test.omega[0]), float(test.omega[-1])))
            tick()
    return checks
