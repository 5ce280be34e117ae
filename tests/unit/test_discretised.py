"""The plant with a held input: closed forms, an independent discretisation, sums of aliases, and exact simulation."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from held_plant import PLANTS, held_response
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.integrate import quad_vec
from scipy.signal import cont2discrete

from identification.base.errors import InputError
from identification.model.modes import Mode
from identification.model.plant import PlantModel
from identification.model.pulse_response import aliases, hold, pulse_response, pulse_zeros

Complex = NDArray[np.complex128]
T = 2e-3
OMEGA = np.concatenate([np.geomspace(0.1, 1500.0, 60), [np.pi / T]])
Z = np.exp(1j * OMEGA * T)


def test_hold_is_the_average_over_one_interval() -> None:
    average = quad_vec(lambda t: np.exp(-1j * OMEGA * t), 0, T)[0] / T
    np.testing.assert_allclose(hold(OMEGA, T), average, rtol=1e-12)
    assert hold(0.0, T) == 1


@pytest.mark.parametrize("delay_s", [0.0, 0.3 * T, T, 4.75 * T, 5 * T])
def test_closed_form_of_an_integrator(delay_s: float) -> None:
    """K T (e + 1/(z - 1)) z^-d with h = (d - e) T."""
    d = np.ceil(delay_s / T)
    exact = 3 * T * (d - delay_s / T + 1 / np.expm1(1j * OMEGA * T)) * Z**-d
    np.testing.assert_allclose(pulse_response(PlantModel(3.0, (), (), delay_s), T, OMEGA), exact, rtol=1e-13)


@pytest.mark.parametrize("delay_s", [0.0, 0.3 * T, T, 4.75 * T, 5 * T])
@pytest.mark.parametrize("rate", [1e-6, 0.2, 300.0, 1e5])
def test_closed_form_of_a_real_pole(delay_s: float, rate: float) -> None:
    d = np.ceil(delay_s / T)
    early = d * T - delay_s
    step = -np.expm1(-rate * T) / (np.expm1(1j * OMEGA * T) - np.expm1(-rate * T))
    exact = 3 * (np.exp(-rate * early) * step - np.expm1(-rate * early)) * Z**-d
    plant = PlantModel(3.0, (), (), delay_s, 0, (), (rate,))
    np.testing.assert_allclose(pulse_response(plant, T, OMEGA), exact, rtol=1e-12)


def test_closed_form_of_a_double_integrator() -> None:
    exact = 5 * T**2 / 2 * (Z + 1) / np.expm1(1j * OMEGA * T) ** 2
    np.testing.assert_allclose(pulse_response(PlantModel(5.0, (), (), 0.0, 2), T, OMEGA), exact, rtol=1e-9, atol=1e-18)


@pytest.mark.parametrize("name", PLANTS)
def test_against_scipy_without_delay(name: str) -> None:
    """cont2discrete exponentiates a companion matrix; its coefficients cost digits where omega is small."""
    plant = replace(PLANTS[name], delay_s=0.0)
    zeros = np.array([[1 / m.omega**2, 2 * m.zeta / m.omega, 1] for m in plant.zero_modes])
    poles = np.array([[1 / m.omega**2, 2 * m.zeta / m.omega, 1] for m in plant.pole_modes])
    numerator, denominator = np.array([plant.gain]), np.array([1.0] + [0.0] * plant.integrators)
    for factor in [*zeros, *([1 / a, 1] for a in plant.real_zeros)]:
        numerator = np.polymul(numerator, factor)
    for factor in [*poles, *([1 / a, 1] for a in plant.real_poles)]:
        denominator = np.polymul(denominator, factor)
    sampled, monic, _ = cont2discrete((numerator, denominator), T)
    omega = OMEGA[OMEGA > 20]
    z = np.exp(1j * omega * T)
    exact = np.polyval(np.ravel(sampled), z) / np.polyval(monic, z)
    np.testing.assert_allclose(pulse_response(plant, T, omega), exact, rtol=1e-6)


@pytest.mark.parametrize("name", [name for name, plant in PLANTS.items() if plant.relative_degree >= 2])
def test_against_the_sum_of_aliases(name: str) -> None:
    """Beyond its corners |P| falls as w^-r; the terms left out are below 2 sum |P(K ws)| (K/k)^r omega/(k ws)."""
    plant, terms, rate = PLANTS[name], 4000, 2 * np.pi / T
    omega = np.array([5.0, 60.0, 149.0, 150.5, 700.0, 1500.0])
    k = np.concatenate([-np.arange(1, terms)[::-1], np.arange(1, terms)])[:, None]
    total = np.sum(plant(1j * (omega + k * rate)) * hold(omega + k * rate, T) / hold(omega, T), axis=0)
    degree = plant.relative_degree
    bound = 2 * np.abs(plant(1j * (terms - 1) * rate)) * 1.1 * omega / rate / degree
    found = aliases(plant, T, omega)
    assert np.all(np.abs(found - total) < bound + 1e-13 * np.abs(plant(1j * omega)))
    assert np.all(bound < 1e-3 * np.abs(found))


@pytest.mark.parametrize("name", [name for name, plant in PLANTS.items() if plant.integrators == 0])
def test_against_the_simulated_impulse_response(name: str) -> None:
    impulse = np.zeros(20000)
    impulse[0] = 1.0
    response = held_response(PLANTS[name], T, impulse)
    omega = OMEGA[::4]
    simulated = np.exp(-1j * omega[:, None] * T * np.arange(impulse.size)) @ response
    np.testing.assert_allclose(pulse_response(PLANTS[name], T, omega), simulated, rtol=1e-10)


modes = st.builds(Mode, st.floats(1.0, 3e3), st.floats(1e-4, 3.0))
rates = st.floats(1.0, 5e3)


@st.composite
def plants(draw: st.DrawFn) -> PlantModel:
    poles, slow = draw(st.lists(modes, max_size=3)), draw(st.lists(rates, max_size=3))
    integrators = draw(st.integers(0, 2))
    order = 2 * len(poles) + len(slow) + integrators
    pairs = draw(st.lists(modes, max_size=order // 2))
    single = draw(st.lists(rates, max_size=order - 2 * len(pairs)))
    delay_s = draw(st.floats(0, 10 * T))
    return PlantModel(2.0, tuple(pairs), tuple(poles), delay_s, integrators, tuple(single), tuple(slow))


@given(plants())
@settings(max_examples=50, deadline=None, derandomize=True)
def test_an_interval_more_of_delay_is_a_sample(plant: PlantModel) -> None:
    later = pulse_response(replace(plant, delay_s=plant.delay_s + T), T, OMEGA)
    tolerance = 1e-6 * np.abs(later) + 1e-10 * np.max(np.abs(later))
    assert np.all(np.abs(later * Z - pulse_response(plant, T, OMEGA)) < tolerance)


@given(plants())
@settings(max_examples=50, deadline=None, derandomize=True)
def test_slow_sampling_of_a_slow_plant_is_the_plant(plant: PlantModel) -> None:
    """At omega T = 1e-4 a plant without zeros has no aliases to speak of."""
    interval = 1e-4 / 50.0
    omega = np.array([50.0])
    strictly = replace(plant, zero_modes=(), real_zeros=(), real_poles=(*plant.real_poles, 5.0, 7.0))
    exact = strictly(1j * omega)
    np.testing.assert_allclose(
        pulse_response(strictly, interval, omega), exact * hold(omega, interval), rtol=1e-4, atol=0
    )


@given(plants(), st.floats(0.1, 10.0))
@settings(max_examples=40, deadline=None, derandomize=True)
def test_the_unit_of_time_does_not_matter(plant: PlantModel, unit: float) -> None:
    other = PlantModel(
        plant.gain / unit**plant.integrators,
        tuple(Mode(m.omega / unit, m.zeta) for m in plant.zero_modes),
        tuple(Mode(m.omega / unit, m.zeta) for m in plant.pole_modes),
        plant.delay_s * unit,
        plant.integrators,
        tuple(a / unit for a in plant.real_zeros),
        tuple(a / unit for a in plant.real_poles),
    )
    first = pulse_response(plant, T, OMEGA[:-1])
    tolerance = 1e-6 * np.abs(first) + 1e-10 * np.max(np.abs(first))
    assert np.all(np.abs(pulse_response(other, T * unit, OMEGA[:-1] / unit) - first) < tolerance)


@pytest.mark.parametrize("name", PLANTS)
def test_zeros_and_poles_make_up_the_response(name: str) -> None:
    """H(z) z^d prod(z - exp(p T))/prod(z - z_i) is one constant."""
    plant = PLANTS[name]
    poles = [root for mode in plant.pole_modes for root in mode.roots] + [-rate for rate in plant.real_poles]
    poles += [0.0] * plant.integrators
    zeros = np.exp(pulse_zeros(plant, T) * T)
    omega = OMEGA[OMEGA > 1]
    z = np.exp(1j * omega * T)[:, None]
    product = np.prod(z - np.exp(np.array(poles) * T), axis=1) / np.prod(z - zeros, axis=1)
    constant = pulse_response(plant, T, omega) * z[:, 0] ** np.ceil(plant.delay_s / T) * product
    np.testing.assert_allclose(constant, np.full(omega.size, constant[-1]), rtol=1e-7)


def test_fast_sampling_leaves_a_zero_where_it_is() -> None:
    plant = PLANTS["integrator"]
    wanted = plant.zero_modes[0].roots[1]
    for interval, closest in ((1e-3, 1.0), (1e-4, 1e-1), (1e-5, 1e-2)):
        assert np.min(np.abs(pulse_zeros(plant, interval) - wanted)) < closest


def test_equal_and_widely_spread_poles() -> None:
    """Equal poles are the limit of close ones, and a pole beyond all sampling is not there."""
    equal = PlantModel(2.0, (), (Mode(150.0, 1.0),), 3.3e-3, 1, (), (150.0, 150.0))
    close = replace(equal, pole_modes=(Mode(150.0, 1 + 1e-13),), real_poles=(150 * (1 + 1e-9), 150 * (1 - 1e-9)))
    np.testing.assert_allclose(pulse_response(close, T, OMEGA), pulse_response(equal, T, OMEGA), rtol=1e-8)
    slow = PlantModel(2.0, (), (Mode(1e-3, 0.5),), 3.3e-3, 1)
    fast = replace(slow, pole_modes=(*slow.pole_modes, Mode(1e12, 0.7)))
    np.testing.assert_allclose(pulse_response(fast, T, OMEGA), pulse_response(slow, T, OMEGA), rtol=1e-8)


def test_a_jump_is_seen_at_its_instant() -> None:
    """With as many zeros as poles a delay of whole intervals, rounded or not, shows the new value."""
    plant = replace(PLANTS["as many zeros as poles"], delay_s=3 * T)
    rounded = replace(plant, delay_s=3 * T * (1 + 1e-12))
    later = replace(plant, delay_s=3 * T * (1 + 1e-6))
    np.testing.assert_allclose(pulse_response(rounded, T, OMEGA), pulse_response(plant, T, OMEGA), rtol=1e-9)
    jump = plant.gain * np.prod([(20.0 / 60.0), (150.0 / 200.0) ** 2])
    difference = pulse_response(plant, T, OMEGA) - pulse_response(later, T, OMEGA)
    np.testing.assert_allclose(difference, jump * (Z**-3 - Z**-4), atol=1e-4 * np.max(np.abs(difference)))


@pytest.mark.parametrize("omega", [0.0, -1.0, 1.001 * np.pi / T, np.nan])
def test_refusal_of_frequencies(omega: float) -> None:
    with pytest.raises(InputError, match=r"omega is .*; expected more than 0 and at most the Nyquist frequency, 1570"):
        aliases(PLANTS["integrator"], T, [1.0, omega])


@pytest.mark.parametrize("interval", [0.0, -1.0, np.inf, np.nan])
def test_refusal_of_intervals(interval: float) -> None:
    for refused in (lambda: hold([1.0], interval), lambda: pulse_response(PLANTS["integrator"], interval, [1.0])):
        with pytest.raises(InputError, match=r"sampling interval is .*; expected a positive number"):
            refused()
