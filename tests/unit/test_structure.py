"""Structures, their neighbours, and the way back and forth between parameters and plants."""

from __future__ import annotations

import numpy as np
import pytest

from identification.fitting.least_squares import response_of
from identification.fitting.likelihood import Likely
from identification.fitting.neighbouring_structures import neighbours, reached_from, within_band
from identification.fitting.single_test_fit import ScaledTest
from identification.fitting.structure_fits import StructureFits
from identification.model.plant_json import shaped
from identification.model.structure import Structure, Wanted
from identification.sweeps.response import FrequencyResponse

OMEGA = np.geomspace(0.3, 3.0, 40)


@pytest.mark.parametrize(
    ("structure", "words"),
    [
        (Structure(0, 0, 0), "a gain"),
        (Structure(1, 4, 4), "1 integrator, 2 zero modes, 2 pole modes"),
        (Structure(2, 1, 3), "2 integrators, 1 pole mode, 1 real zero, 1 real pole"),
    ],
)
def test_words(structure: Structure, words: str) -> None:
    assert str(structure) == words


def test_parameters_and_plant_are_the_same() -> None:
    structure = Structure(2, 3, 5)
    theta = np.random.default_rng(0).uniform(-0.7, 0.7, structure.size)
    theta[-1] = 0.2
    plant = structure.plant(theta, -1.0)
    np.testing.assert_allclose(plant(1j * OMEGA), -response_of(structure, theta, OMEGA), rtol=1e-13)
    values = np.array([parameter.value for parameter in plant.parameters])
    np.testing.assert_allclose(values, np.append(np.exp(theta[:-1]), 0.2) * np.where(np.arange(10) == 0, -1, 1))
    found = shaped(plant, np.arange(10.0))
    assert found["zero_modes"] == [{"omega": 1.0, "zeta": 2.0}]
    assert found["pole_modes"] == [{"omega": 3.0, "zeta": 4.0}, {"omega": 5.0, "zeta": 6.0}]
    assert (found["real_zeros"], found["real_poles"], found["delay_s"]) == ([7.0], [8.0], 9.0)


def test_order_sorts_the_modes_and_nothing_else() -> None:
    structure = Structure(1, 4, 3)
    theta = np.array([0.1, 2.0, -1.0, 1.0, -2.0, 0.5, -3.0, 0.7, 0.3])
    np.testing.assert_array_equal(theta[structure.in_order(theta)], [0.1, 1.0, -2.0, 2.0, -1.0, 0.5, -3.0, 0.7, 0.3])


def test_neighbours_are_proper_and_near() -> None:
    for structure in (Structure(0, 0, 0), Structure(1, 2, 2), Structure(2, 3, 1)):
        for other in neighbours(structure):
            assert other.proper
            assert -2 <= other.integrators <= 2
            assert other != structure


@pytest.mark.parametrize("structure", [Structure(1, 4, 4), Structure(1, 3, 4), Structure(0, 2, 5), Structure(2, 1, 0)])
def test_guesses_for_neighbours_have_their_parameters(structure: Structure) -> None:
    theta = np.random.default_rng(1).uniform(-0.9, 0.9, structure.size)
    fit = Likely(structure, theta, 1.0, 0.1, 0.1, 0.0)
    for other in neighbours(structure):
        starts = reached_from(fit, other, OMEGA)
        assert starts
        for start in starts:
            assert start.shape == (other.size,)
            assert np.all(np.isfinite(start))


def test_a_real_root_more_and_then_less_is_the_plant_again() -> None:
    """Two real roots are a mode of zeta >= 1; without one of its roots it is the other."""
    structure = Structure(1, 2, 3)
    theta = np.array([0.0, 0.2, -2.0, -0.3, -1.0, 0.4, 0.1])
    fit = Likely(structure, theta, 1.0, 0.1, 0.1, 0.0)
    exact = response_of(structure, theta, OMEGA)
    distances = []
    for more in reached_from(fit, Structure(1, 2, 4), OMEGA):
        richer = Likely(Structure(1, 2, 4), more, 1.0, 0.1, 0.1, 0.0)
        for less in reached_from(richer, structure, OMEGA):
            distances.append(np.max(np.abs(response_of(structure, less, OMEGA) / exact - 1)))
    assert min(distances) < 1e-12


def test_roots_far_outside_the_band_are_left_out() -> None:
    """A pole at a hundredth of the band is an integrator, one at a hundred times the band is nothing."""
    structure = Structure(1, 0, 4)
    slow_and_fast = [np.log(np.sqrt(0.003 * 300)), np.log((0.003 + 300) / (2 * np.sqrt(0.003 * 300)))]
    theta = np.array([0.0, *slow_and_fast, 0.2, -2.0, 0.1])
    left = within_band(Likely(structure, theta, 1.0, 0.1, 0.1, 0.0), OMEGA, 2.5)
    assert left is not None
    assert left[0] == Structure(2, 0, 2)
    np.testing.assert_allclose(left[1], [0.0, 0.2, -2.0, 0.1])
    inside = np.array([0.0, 0.2, -2.0, 0.1])
    assert within_band(Likely(Structure(2, 0, 2), inside, 1.0, 0.1, 0.1, 0.0), OMEGA, 2.5) is None


def test_a_dead_time_is_given_up_for_a_zero_on_the_right() -> None:
    """SYNTHETIC: two real poles and a dead time miss the plant; the step to a zero at 40 rad/s leaves noise."""
    omega = np.geomspace(0.6, 600.0, 60)
    exact = 2 * (1 - 1j * omega / 40) / ((1 + 1j * omega / 5) * (1 + 1j * omega / 100)) * np.exp(-0.002j * omega)
    noise = np.random.default_rng(3).standard_normal((60, 2)) @ [1, 1j] / np.sqrt(2)
    test = ScaledTest(FrequencyResponse(omega, exact * (1 + 0.02 * noise), None, "one"), soft=False)
    fits = StructureFits([test], Wanted(), lambda: None)
    without, with_zero = Structure(0, 0, 2), Structure(0, 0, 2, right=1)
    fits.fit(without, None)
    assert test.distance(fits.fits[without][0]) > 0.1
    assert with_zero in neighbours(without)
    assert fits.step(without, with_zero)
    found = fits.fits[with_zero][0]
    assert test.distance(found) < 0.02
    plant = with_zero.plant(test.to_physical(with_zero, found.theta), found.sign)
    assert plant.real_zeros[0] == pytest.approx(-40, rel=0.02)
    assert plant.delay_s == pytest.approx(0.002, rel=0.05)


def test_what_is_wanted() -> None:
    assert Wanted().admits(Structure(0, 3, 4))
    assert not Wanted().admits(Structure(0, 2, 1))
    assert Wanted(1, (1, 2), (1, 0)).admits(Structure(1, 3, 4))
    assert not Wanted(1, (1, 2), (1, 0)).admits(Structure(1, 2, 4))
    assert not Wanted(integrators=0).admits(Structure(1, 2, 2))
