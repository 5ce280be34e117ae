"""Swapped channels and phases in another unit are seen where they are beyond doubt, and never in a plant's response."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from data.thesis import THESIS
from identification.model.modes import Mode
from identification.model.plant import PlantModel
from identification.sweeps.read_sweeps import read_sweeps
from identification.sweeps.swapped_or_wrong_unit import bends, lead_time, wrap

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]


def _modes(rng: np.random.Generator, low: float, high: float, count: int) -> tuple[Mode, ...]:
    return tuple(
        Mode(float(np.exp(rng.uniform(np.log(low), np.log(high)))), 10 ** rng.uniform(-3.3, -0.1)) for _ in range(count)
    )


def _rates(rng: np.random.Generator, low: float, high: float, count: int) -> tuple[float, ...]:
    return tuple(float(np.exp(rng.uniform(np.log(low), np.log(high)))) for _ in range(count))


def _any_plant(rng: np.random.Generator, low: float, high: float) -> PlantModel:
    """Any order of zeros and poles, in the band and around it, biproper ones included."""
    around = low / 5, 5 * high
    zeros, real_zeros, integrators = rng.integers(0, 5), rng.integers(0, 3), int(rng.integers(0, 3))
    return PlantModel(
        gain=float(rng.choice([-1, 1]) * 10 ** rng.uniform(-3, 3)),
        zero_modes=_modes(rng, *around, zeros),
        pole_modes=_modes(rng, *around, zeros + rng.integers(0, 3)),
        delay_s=0.0,
        integrators=integrators,
        real_zeros=_rates(rng, *around, real_zeros),
        real_poles=_rates(rng, *around, real_zeros + rng.integers(0, 2)),
    )


def _leading_plant(rng: np.random.Generator, low: float, high: float) -> PlantModel:
    """Zeros in the band and just above it, poles mostly far above: the phase leads as far as a plant's can."""
    zeros = rng.integers(1, 5)
    poles = (high, 10 * high) if rng.random() < 0.7 else (low, high)
    return PlantModel(
        1.0,
        _modes(rng, low, 1.3 * high, zeros),
        _modes(rng, *poles, zeros),
        0.0,
        int(rng.integers(0, 2)),
    )


def _draw(rng: np.random.Generator) -> tuple[Real, Complex, float]:
    """Frequencies, a response with up to 10 % of noise, and by how many rad a dead time turns it over the band."""
    low = 10 ** rng.uniform(-1, 3)
    high = low * 10 ** rng.uniform(0.3, 2.7)
    count = int(10 ** rng.uniform(0.9, 3))
    omega = np.linspace(low, high, count) if rng.random() < 0.5 else np.geomspace(low, high, count)
    plant = (_any_plant if rng.random() < 0.5 else _leading_plant)(rng, low, high)
    most = np.pi / np.median(np.diff(omega))
    delay_s = rng.choice([0, most]) * 10 ** rng.uniform(-2, 0)
    response = plant(1j * omega) * np.exp(-1j * omega * delay_s)
    size = rng.choice([0, 0.01, 0.1]) * (np.abs(response) if rng.random() < 0.5 else np.median(np.abs(response)))
    noise = rng.standard_normal((2, count)).T @ [1, 1j] / np.sqrt(2)
    return omega, response + size * noise, delay_s * (high - low)


def test_no_plant_is_refused_and_most_swapped_ones_are() -> None:
    """Of 12000 plants drawn in this way none was refused, and 75 % of the swapped ones were caught."""
    rng = np.random.default_rng(1)
    swapped = caught = 0
    for _ in range(300):
        omega, response, turned = _draw(rng)
        assert lead_time(omega, response) == 0
        phase_rad = np.angle(response)
        for wrapped in (phase_rad, phase_rad % (2 * np.pi), np.unwrap(phase_rad)):
            assert wrap(wrapped, 360.0) is None
            assert wrap(np.degrees(wrapped), 2 * np.pi) is None or not bends(omega, np.abs(response))
        if turned > 8 and turned / omega.size < 0.4:
            swapped += 1
            caught += lead_time(omega, 1 / response) > 0
    assert swapped > 20
    assert caught > 0.6 * swapped


@pytest.mark.parametrize("factor", [1e-6, 1.0, 1e6])
def test_a_pure_lead_is_measured(factor: float) -> None:
    omega = np.linspace(10.0, 100.0, 300) * factor
    for lead_s in (0.15, 0.2, 0.4):
        response = np.exp(1j * omega * lead_s / factor)
        assert lead_time(omega, response) == pytest.approx(lead_s / factor, abs=0.02 / factor)
        assert lead_time(omega, response.conj()) == 0


def test_what_the_synthetic_tests_become_when_swapped() -> None:
    (test,) = read_sweeps([THESIS.parent / "elevation" / "synthetic_test_2_frf.csv"])
    assert lead_time(test.omega, test.response) == 0
    assert lead_time(test.omega, 1 / test.response) == pytest.approx(8.1e-3, rel=0.1)  # the dead time


def test_zeros_and_few_lines_are_no_lead() -> None:
    omega = np.linspace(1.0, 100.0, 200)
    response = np.exp(1j * omega)
    response[::3] = 0
    assert lead_time(omega, response) == pytest.approx(1.0, rel=0.05)
    assert lead_time(omega[:10], response[:10]) == 0
    assert lead_time(omega, 0 * response) == 0


def test_wrap_says_where() -> None:
    phase = np.array([-100.0, -170.0, 120.0, 60.0, 0.0, -80.0, -179.0, 179.0])
    assert wrap(phase, 360.0) == 2
    assert wrap(np.unwrap(phase, period=360.0), 360.0) is None
    assert wrap(phase, 2 * np.pi) is None
    assert wrap(np.radians(phase), 2 * np.pi) == 2
