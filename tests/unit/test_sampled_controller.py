"""Difference equations against closed forms, scipy, and an independent discretisation of held inputs."""

from __future__ import annotations

import numpy as np
import pytest
from sampled_response import response
from scipy.signal import bilinear_zpk, cont2discrete, freqz_zpk

from design.blocks.block import Block, plant_block
from design.blocks.state_space import realize
from design.design_file import Design
from experiments.drive.difference_equations import SampledBlock, sample_block, split
from identification.base.errors import InputError
from identification.model.modes import Mode
from identification.model.plant import PlantModel
from identification.model.pulse_response import pulse_response

T = 2e-3
OMEGA = np.geomspace(0.5, 0.98 * np.pi / T, 80)
Z = np.exp(1j * OMEGA * T)
DELAYS = [0.0, 0.3 * T, T, 4.75 * T, 5 * T]


def run(block: SampledBlock, given: np.ndarray) -> np.ndarray:
    """The difference equations as the class states them, step by step."""
    x, p = np.zeros(len(block.b)), np.zeros((len(given), len(block.d)))
    w = np.zeros_like(p)
    for k, i in enumerate(given):
        p[k] = block.C @ x + block.d * i
        x = block.A @ x + block.b * i
        for m, first in enumerate(block.first):
            w[k, m] = sum(block.taps[m, j] * p[k - first - j, m] for j in range(block.length[m]) if k >= first + j)
    return w


def blocks(design: Design) -> dict[str, Block]:
    forward, feedback = design.controller_parts()
    kind = design.compensator("corrected")
    theta2 = kind.theta2(design.loop_plant)
    return {"forward": forward, "T_so": feedback, "theta1~": kind.theta1_tilde, "theta2": theta2.without_delay()}


@pytest.mark.parametrize("delay_s", DELAYS)
def test_tustin_is_the_block_at_another_frequency(
    extended_design: Design, delay_free_design: Design, delay_s: float
) -> None:
    whole, rest = split(delay_s, T)
    lag = (1 - rest + rest / Z) * Z**-whole
    s = 2 / T * (Z - 1) / (Z + 1)
    for design in (extended_design, delay_free_design):
        for name, block in blocks(design).items():
            found = response(sample_block(realize(block), [delay_s], T, "tustin"), Z)[:, 0]
            np.testing.assert_allclose(found, block(s) * lag, rtol=1e-8, err_msg=name)


def test_tustin_against_scipy(extended_design: Design) -> None:
    for name, block in blocks(extended_design).items():
        zeros, poles, gain = bilinear_zpk(np.array(block.zeros), np.array(block.poles), block.gain, 1 / T)
        _, expected = freqz_zpk(zeros, poles, gain, OMEGA * T)
        found = response(sample_block(realize(block), [0.0], T, "tustin"), Z)[:, 0]
        np.testing.assert_allclose(found, expected, rtol=1e-8, err_msg=name)


def test_a_share_of_a_sample_by_a_straight_line_is_of_second_order() -> None:
    block = sample_block(realize(Block(1.0)), [0.3 * T], T, "tustin")
    exact = np.exp(-0.3j * OMEGA * T)
    error = np.abs(response(block, Z)[:, 0] - exact)
    assert np.all(error <= 0.3 * 0.7 / 2 * (OMEGA * T) ** 2 * (1 + 1e-9))


@pytest.mark.parametrize("delay_s", DELAYS)
def test_held_closed_form_of_an_integrator(delay_s: float) -> None:
    """K T (e + 1/(z - 1)) z^-d with h = (d - e) T."""
    d = np.ceil(delay_s / T)
    exact = 3 * T * (d - delay_s / T + 1 / (Z - 1)) * Z**-d
    found = response(sample_block(realize(Block(3.0, (), (0j,))), [delay_s], T, "exact"), Z)[:, 0]
    np.testing.assert_allclose(found, exact, rtol=1e-12)


@pytest.mark.parametrize("delay_s", DELAYS)
def test_held_against_the_discretisation_of_the_fit(delay_s: float) -> None:
    plant = PlantModel(3.0, (Mode(300.0, 0.05),), (Mode(450.0, 0.01),), delay_s, 1, (), (60.0,))
    found = response(sample_block(realize(plant_block(plant)), [delay_s], T, "exact"), Z)[:, 0]
    np.testing.assert_allclose(found, pulse_response(plant, T, OMEGA), rtol=1e-9)


def test_held_step_response_is_the_continuous_one_at_the_samples() -> None:
    """1 - exp(-a t) of a/(s + a), from the dead time on; and a direct part answers at once."""
    a, t = 170.0, T * np.arange(30)
    for delay_s in DELAYS:
        found = run(sample_block(realize(Block(a, (), (-a,))), [delay_s], T, "exact"), np.ones(30))[:, 0]
        exact = np.where(t >= delay_s - 1e-12, -np.expm1(-a * (t - delay_s)), 0.0)
        np.testing.assert_allclose(found, exact, rtol=0, atol=1e-13)
    found = run(sample_block(realize(Block(2.0, (-a / 3,), (-a,))), [0.3 * T], T, "exact"), np.ones(30))[:, 0]
    late = t - 0.3 * T
    exact = np.where(late > 0, 2 / 3 + 4 / 3 * np.exp(-a * late), 0.0)
    np.testing.assert_allclose(found, exact, rtol=0, atol=1e-13)


@pytest.mark.parametrize(("method", "name"), [("tustin", "bilinear"), ("exact", "zoh")])
def test_two_outputs_against_scipy(method: str, name: str) -> None:
    parts = Block(40.0, (), (-30.0 + 80j, -30.0 - 80j)), Block(2.0, (-9.0,), (-30.0 + 80j, -30.0 - 80j, -5.0))
    system = realize(*parts)
    A, B, C, D, _ = cont2discrete((system.A, system.b[:, None], system.C, system.d[:, None]), T, method=name)
    expected = np.array([(C @ np.linalg.solve(z * np.eye(len(A)) - A, B) + D)[:, 0] for z in Z])
    expected *= np.column_stack([np.ones_like(Z), Z**-3])
    block = sample_block(system, [0.0, 3 * T], T, method)
    np.testing.assert_allclose(response(block, Z), expected, rtol=1e-10)
    given = np.random.default_rng(1).normal(size=40)
    found, line = run(block, given), np.zeros((40, 2))
    x = np.zeros((len(A), 1))
    for k in range(40):
        line[k] = (C @ x + D * given[k])[:, 0]
        x = A @ x + B * given[k]
    np.testing.assert_allclose(found[:, 0], line[:, 0], atol=1e-12)
    np.testing.assert_allclose(found[3:, 1], line[:-3, 1], atol=1e-12)


def test_a_delay_a_rounding_off_a_whole_number_is_whole() -> None:
    assert split(0.3, 0.1) == (3, 0.0)
    assert split(0.7, 0.1) == (7, 0.0)
    assert split(0.0, 0.1) == (0, 0.0)
    whole, rest = split(0.25, 0.1)
    assert (whole, round(rest, 12)) == (2, 0.5)


def test_what_cannot_be_discretised_is_refused() -> None:
    with pytest.raises(InputError, match="the method is 'euler'; expected tustin or exact"):
        sample_block(realize(Block(1.0)), [0.0], T, "euler")
    with pytest.raises(InputError, match=r"a pole at 1000 rad/s, twice the rate"):
        sample_block(realize(Block(1.0, (), (1000.0,))), [0.0], T, "tustin")
    assert np.isfinite(sample_block(realize(Block(1.0, (), (1000.0,))), [0.0], T, "exact").A).all()
