"""Frequency responses -> the model that model.json holds: plant, bound, and how they came about."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from operator import index

from identification.base.errors import InputError, shown
from identification.bound.bound_residuals import bound_residuals
from identification.fitting.fit_plant import FitResult, fit_plant
from identification.fitting.subspace_check import check_modes
from identification.model.model_file import IdentifiedModel
from identification.model.plant import PlantModel
from identification.model.reports import BoundReport, SubspaceCheck
from identification.model.structure import Wanted
from identification.output.fit_facts import fit_record, standard_errors
from identification.sweeps.response import FrequencyResponse, alias_free

MOST_MODES = 8

Tick = Callable[[], object]


@dataclass(frozen=True)
class ModelFit:
    """A fitted model and all that it came from.

    Parameters
    ----------
    model
        Plant, bound, standard errors and the record of the fit.
    plant_fit, bound_fit
        How plant and bound were found.
    checks
        By the name of each test with a raw record, the subspace check of its modes.
    tests
        The responses without the aliases of a held input.
    """

    model: IdentifiedModel
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

    Raises
    ------
    InputError
        As these two do.
    """
    result = fit_plant(tests, wanted, soft=soft, seed=seed, tick=tick)
    plants = [test.plant for test in result.tests]
    checks = _checks(tests, plants, tick)
    clean = tuple(alias_free(test, result.plant) for test in tests)
    report = bound_residuals(result.plant, clean, plants, bound_order, below=bound_below, above=bound_above)
    record = fit_record(tests, result, report, checks)
    model = IdentifiedModel(result.plant, report.bound, standard_errors(result), record)
    return ModelFit(model, result, report, checks, clean)


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
) -> IdentifiedModel:
    """Fit plant and bound to tests, with what is left open chosen by the Bayesian information criterion.

    Parameters
    ----------
    tests
        One or more responses of the same plant.
    modes, real
        Zero and pole modes (up to 8 each), real zeros and poles (up to 1 each): one number for both, or a pair.
    integrators
        Poles at s = 0, 0 to 2.
    soft, bound_order, bound_below, bound_above, seed
        As for :func:`fit_model`.

    Raises
    ------
    InputError
        A number is none of these, or see :func:`fit_model`.
    """
    if integrators is not None and integrators not in (0, 1, 2):
        raise InputError(f"integrators is {shown(integrators)}; expected 0, 1 or 2")
    wanted = Wanted(integrators, _pair("modes", modes, MOST_MODES), _pair("real", real, 1))
    given = [tests] if isinstance(tests, FrequencyResponse) else tests
    fitted = fit_model(
        given,
        wanted,
        soft=soft,
        bound_order=bound_order,
        bound_below=bound_below,
        bound_above=bound_above,
        seed=seed,
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
