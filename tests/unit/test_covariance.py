"""What the parameters' covariance says of a response: against refits of noisy data, and derivatives by differences."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import t as student

from identification.base.errors import InputError
from identification.fit_model import fit
from identification.fitting.fit_plant import fit_plant
from identification.model.covariance import Covariance, log_derivatives
from identification.model.fit_record import FitRecord
from identification.model.modes import Mode
from identification.model.plant import PlantModel
from identification.model.structure import Wanted
from identification.sweeps.response import FrequencyResponse

PLANT = PlantModel(-3.0, (Mode(20.0, -0.1),), (Mode(30.0, 0.05), Mode(9.0, 0.4)), 0.02, 1, (-15.0, 70.0), (5.0,))
RESONANT = PlantModel(2.0, (), (Mode(25.0, 0.04),), 0.0, 0)
OMEGA = np.linspace(2.0, 80.0, 60)


def moved(plant: PlantModel, k: int, step: float) -> PlantModel:
    """The plant with its k-th parameter times exp(step), or the dead time plus the step."""
    values = [each.value * (np.exp(step) if i == k else 1.0) for i, each in enumerate(plant.parameters)]
    gain, *middle, delay_s = values
    if k == len(values) - 1:
        delay_s = plant.delay_s + step
    zeros, poles = len(plant.zero_modes), len(plant.pole_modes)
    modes = [Mode(omega, zeta) for omega, zeta in zip(middle[0 : 2 * (zeros + poles) : 2], middle[1::2], strict=False)]
    rates = middle[2 * (zeros + poles) :]
    return PlantModel(
        gain,
        tuple(modes[:zeros]),
        tuple(modes[zeros : zeros + poles]),
        delay_s,
        plant.integrators,
        tuple(rates[: len(plant.real_zeros)]),
        tuple(rates[len(plant.real_zeros) :]),
    )


def test_derivatives_are_those_of_the_response() -> None:
    derivatives = log_derivatives(PLANT, OMEGA)
    assert derivatives.shape == (OMEGA.size, len(PLANT.parameters))
    for k in range(len(PLANT.parameters)):
        ends = [moved(PLANT, k, step)(1j * OMEGA) for step in (1e-5, -1e-5)]
        np.testing.assert_allclose(derivatives[:, k], np.log(ends[0] / ends[1]) / 2e-5, rtol=1e-6, atol=1e-8)


def test_the_band_is_as_wide_as_refits_scatter() -> None:
    """Independent errors of the parameters would make it twice as wide on the flanks of the resonance."""
    rng, fits = np.random.default_rng(7), []
    for _ in range(20):
        noise = 0.02 * (rng.normal(size=OMEGA.size) + 1j * rng.normal(size=OMEGA.size))
        test = FrequencyResponse(OMEGA, RESONANT(1j * OMEGA) * (1 + noise), None, "a")
        fits.append(fit_plant([test], Wanted(0, (0, 1), (0, 0))))
    at = np.array([3.0, 15.0, 23.0, 25.0, 27.0, 60.0])
    seen = np.log(np.array([found.plant(1j * at) for found in fits]))
    covariance = fits[0].nominal.covariance
    widths = covariance.of_response(fits[0].plant, at)
    quantile = student.ppf(0.975, covariance.freedom)
    np.testing.assert_allclose(widths[0] / quantile, seen.real.std(axis=0), rtol=0.5)
    inside = np.abs(seen.real - np.log(np.abs(RESONANT(1j * at)))) < widths[0]
    assert 0.85 < inside.mean() < 1.0


def test_it_is_kept_with_the_standard_errors_on_its_diagonal() -> None:
    rng = np.random.default_rng(3)
    tests = [
        FrequencyResponse(OMEGA, gain * RESONANT(1j * OMEGA) * np.exp(0.01 * rng.normal(size=OMEGA.size)), None, name)
        for gain, name in ((1.0, "a"), (1.1, "b"), (1.2, "c"))
    ]
    model = fit(tests, modes=(0, 1), real=0, integrators=0)
    record = model.fit
    assert record is not None
    covariance = record.covariance
    assert covariance is not None
    assert covariance.scatter is not None
    units = np.array([each.value for each in model.plant.parameters[:-1]] + [1.0])
    for matrix, errors in ((covariance.noise, record.noise), (covariance.scatter, record.scatter)):
        assert errors is not None
        np.testing.assert_allclose(np.sqrt(np.diag(matrix)) * units, errors, rtol=1e-9)
    content = json.loads(model.to_json())["fit"]
    assert FitRecord.from_dict(content, model.plant, model.additive_bound).covariance == covariance
    older = {key: value for key, value in content.items() if key != "covariance"}
    assert FitRecord.from_dict(older, model.plant, model.additive_bound) == replace(record, covariance=None)


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ({"noise": [[1.0, 0.0]]}, "'noise' is not a matrix; expected 2 rows of 2 numbers"),
        ({"misfit": [[1.0, "x"], [0.0, 1.0]]}, "expected a number"),
        ({"freedom": 0}, "'freedom' is 0 and 'count' 2; expected at least 1"),
        ({"count": 1}, "expected at least 1 and 2"),
    ],
)
def test_what_is_no_covariance_is_refused(wrong: dict[str, object], said: str) -> None:
    unit = ((1.0, 0.0), (0.0, 1.0))
    content = {key: list(map(list, unit)) for key in ("noise", "misfit", "scatter")} | {"freedom": 5, "count": 2}
    assert Covariance.from_dict(content, 2) == Covariance(unit, unit, unit, 5, 2)
    with pytest.raises(InputError, match=said):
        Covariance.from_dict(content | wrong, 2)


def test_tests_that_differ_widen_by_students_distribution_of_so_few() -> None:
    row = [[1.0, 2.0]]
    small, wide = ((1e-4, 0.0), (0.0, 1e-4)), ((0.04, 0.01), (0.01, 0.09))
    found = Covariance(small, ((0.0, 0.0), (0.0, 0.0)), wide, 100, 3).half_widths(row)
    assert found == pytest.approx(student.ppf(0.975, 2) * np.sqrt(0.04 + 4 * 0.01 + 4 * 0.09))
