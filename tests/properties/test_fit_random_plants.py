"""Random plants in random bands with random noise: the fit finds them from no starting point."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from identification.fitting.fit_plant import fit_plant
from identification.model.modes import Mode
from identification.model.plant import PlantModel
from identification.model.structure import Structure
from identification.sweeps.response import FrequencyResponse

BANDS_HZ = ((0.1, 5.0), (10.0, 200.0), (100.0, 5000.0))


def _plant(rng: np.random.Generator, omega: np.ndarray, pairs: int) -> PlantModel:
    """Modes within the band, each half a third of it from its neighbours; gain of either sign over six decades."""
    places = np.exp(np.linspace(np.log(omega[0]), np.log(omega[-1]), 2 * pairs + 2)[1:-1])
    places = rng.permutation(places * np.exp(rng.uniform(-0.1, 0.1, 2 * pairs)))
    modes = [Mode(float(place), float(np.exp(rng.uniform(np.log(0.01), np.log(0.2))))) for place in places]
    gain = float(rng.choice([-1, 1]) * 10 ** rng.uniform(-3, 3))
    delay_s = float(rng.choice([0.0, rng.uniform(0, 20e-3)]))
    return PlantModel(gain, tuple(modes[:pairs]), tuple(modes[pairs:]), delay_s)


# every band with every order, every spacing with either
CASES = [
    (band_hz, pairs, (np.linspace, np.geomspace)[(k + pairs) % 2])
    for k, band_hz in enumerate(BANDS_HZ)
    for pairs in range(4)
]


@pytest.mark.parametrize(("band_hz", "pairs", "spacing"), CASES)
def test_random_plant(band_hz: tuple[float, float], pairs: int, spacing: Callable[..., np.ndarray]) -> None:
    """The response of the fit is the plant's within what the noise allows.

    With p parameters on M lines the squared distance to the plant, over the noise's variance and summed over the
    lines, has mean p/2 and is below 2 p + 10 with a probability of 0.9999 or more.
    """
    rng = np.random.default_rng([pairs, int(band_hz[1]), spacing is np.linspace])
    omega = 2 * np.pi * spacing(*band_hz, 200)
    plant = _plant(rng, omega, pairs)
    exact = plant(1j * omega)
    sigma = np.hypot(rng.uniform(0.01, 0.1) * np.abs(exact), 0.01 * np.median(np.abs(exact)))
    error = sigma * (rng.standard_normal((2, omega.size)).T @ [1, 1j]) / np.sqrt(2)
    result = fit_plant([FrequencyResponse(omega, exact + error, None, "random")])
    assert replace(result.structure, delayed=True) == Structure(1, 2 * pairs, 2 * pairs)  # a short one may not show
    distance = np.sum(np.abs((result.plant(1j * omega) - exact) / sigma) ** 2)
    assert distance < 2 * (4 * pairs + 2) + 10
