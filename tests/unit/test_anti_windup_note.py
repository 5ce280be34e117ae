"""docs/explanation/anti_windup.md: each of its steps as a test."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from design.anti_windup.compensator import from_one_plus, second_order
from design.anti_windup.condition import Sector
from design.anti_windup.corrected_compensator import corrected
from design.anti_windup.judge import judge, lasting_offset
from design.anti_windup.popov import popov_sector
from design.blocks.block import Block, plant_block
from design.chapters_3_4.design_extended import design_extended
from design.design_file import Design
from experiments.engine.simulate import simulate
from experiments.runs.design_loop import design_loop
from experiments.runs.references import sinusoid
from experiments.thesis.printed_choices import thesis_reference
from identification.model.model_file import IdentifiedModel
from identification.model.modes import Mode
from identification.model.plant import PlantModel

S = 1j * np.geomspace(1e-2, 1e3, 100) + 0.03
rates = st.floats(0.1, 50.0)


def test_fig_2_6_is_the_coprime_factor_scheme(extended_design: Design) -> None:
    """[theta1~; theta2] = [M - 1; N] with P = N/M, N and M stable and without a common zero on Re s >= 0."""
    kind, plant = extended_design.compensator("corrected"), extended_design.plant
    M, N = kind.one_plus, kind.theta2(plant)
    np.testing.assert_allclose(kind.theta1_tilde(S), M(S) - 1, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(N(S) / M(S), plant(S), rtol=1e-9)
    assert M.is_stable
    assert N.is_stable
    unstable = [zero for zero in M.zeros if zero.real >= 0]
    assert unstable
    assert all(abs(complex(N(zero))) > 1e-3 for zero in unstable)
    printed = extended_design.compensator("thesis")
    assert not printed.theta2(plant).is_stable


@pytest.mark.parametrize(
    ("plant", "limit"),
    [
        (PlantModel(7.105, (Mode(175.0, 0.008),), (Mode(282.0, 0.0195),), 8.1e-3), 12.0),
        (PlantModel(-2.0, (), (), 0.05), 45.0),
    ],
    ids=["one mode", "none, negative gain"],
)
@pytest.mark.parametrize("gamma", [5.0, 97.0])
def test_the_output_keeps_what_the_final_value_says(
    implied: IdentifiedModel, plant: PlantModel, limit: float, gamma: float
) -> None:
    design = design_extended(dataclasses.replace(implied, plant=plant), [1.5], 4.0, [(2.0, 1.0)])
    kind = second_order(0.05, 0.025, gamma)
    time_s = np.linspace(0.0, 40.0, 400001)
    run = simulate(design_loop(design, sinusoid(50.0, 1.5, 0.5, 0.0), kind), (-limit, limit), time_s)
    windup = np.trapezoid(run.control - run.saturated_control, time_s)
    assert abs(windup) > 1e-3
    error = run.outputs["error"][time_s > 40.0 - 2 * np.pi / 1.5]
    # y = y_lin - y_d and y_lin -> r
    offset = lasting_offset(plant, kind)
    assert offset is not None
    assert (error.max() + error.min()) / 2 == pytest.approx(offset * windup, rel=1e-3, abs=1e-3)
    assert offset == pytest.approx(plant.gain * (1 + gamma), rel=1e-9)


@settings(max_examples=40, deadline=None)
@given(
    integrators=st.integers(0, 2),
    zeros_at_origin=st.integers(0, 3),
    poles=st.lists(rates, min_size=4, max_size=4),
    zeros=st.lists(rates, min_size=4, max_size=4),
)
def test_theta2_is_stable_if_and_only_if_M_takes_the_unstable_poles(
    integrators: int, zeros_at_origin: int, poles: list[float], zeros: list[float]
) -> None:
    plant = PlantModel(3.0, (), (), 0.1, integrators=integrators)
    M = Block(
        1.0,
        (0j,) * zeros_at_origin + tuple(complex(-z) for z in zeros[zeros_at_origin:]),
        tuple(-p + 0j for p in poles),
    )
    kind = from_one_plus(M)
    assert kind.theta2(plant).is_stable == (zeros_at_origin >= integrators)
    offset = lasting_offset(plant, kind)
    missing = integrators - zeros_at_origin
    assert (offset == 0.0) == (missing <= 0)
    assert (offset is None) == (missing >= 2)


def test_popov_does_not_see_the_offset(implied: IdentifiedModel) -> None:
    judged = judge(implied.plant, implied.additive_bound, second_order(0.05, 0.025, 97.0))
    assert judged.popov_sector is None  # every sector
    assert not judged.theta2_stable
    assert judged.lasting_offset == pytest.approx(98 * implied.plant.gain, rel=1e-9)


@settings(max_examples=40, deadline=None)
@given(poles=st.lists(rates, min_size=1, max_size=4), zeros=st.lists(rates, min_size=3, max_size=3))
def test_no_sector_above_one_with_an_integrator(poles: list[float], zeros: list[float]) -> None:
    M = Block(1.0, (0j, *(complex(-z) for z in zeros[: len(poles) - 1])), tuple(complex(-p) for p in poles))
    assert popov_sector(from_one_plus(M).theta1_tilde)[0] <= 1 + 1e-9


def test_the_uncertainty_enters_through_the_loop(extended_design: Design) -> None:
    """The equations of Fig. 2.6 solved at each frequency, against the formula."""
    forward, feedback = extended_design.controller_parts()
    plant, kind = extended_design.plant, extended_design.compensator("corrected")
    rng = np.random.default_rng(4)
    for s in 1j * np.geomspace(0.1, 500, 30):
        P = complex(plant_block(plant)(s))
        C = complex(forward(s) / (1 - feedback(s) * np.exp(-plant.delay_s * s)))
        M, theta = complex(kind.one_plus(s)), complex(kind.theta1_tilde(s))
        Delta = 0.3 * abs(P) * np.exp(2j * np.pi * rng.uniform())
        # unknowns v, u, y, y_d for r = 0 and u_tilde = 1
        equations = np.array([[1, 0, C, C], [-1, 1, 0, 0], [0, -(P + Delta), 1, 0], [0, 0, 0, 1]])
        v, u, y, y_d = np.linalg.solve(equations, [0, -theta, -(P + Delta), P * M])
        S = 1 / (1 + P * C)
        S_Delta = S / (1 + C * S * Delta)
        assert S_Delta == pytest.approx(1 / (1 + (P + Delta) * C), rel=1e-9)
        assert u == pytest.approx(-(theta - C * S_Delta * Delta * M), rel=1e-8)
        assert v == pytest.approx(C * S_Delta * Delta * M, rel=1e-8, abs=1e-12)
        assert y + y_d == pytest.approx((P + Delta) * v - Delta * M, rel=1e-7, abs=1e-9)


def test_a_slow_recovery_centres_the_error_where_the_limits_are_too_small(delay_free_design: Design) -> None:
    """Chapter 2 under +-10, where 11.05 is needed and no control stays below a peak of 1.393."""
    reference = thesis_reference("delay-free", delay_free_design.reference_omegas)
    time_s = np.linspace(0.0, 48.0, 9601)
    peaks = []
    for recovery_s in (0.3, 3.0, 30.0):
        kind = corrected((0j,), delay_free_design.additive_bound, recovery_s, Sector(0.95), 960.0).anti_windup
        error = simulate(design_loop(delay_free_design, reference, kind), (-10.0, 10.0), time_s).outputs["error"]
        peaks.append(np.abs(error[time_s > 44]).max())
    assert peaks[0] > peaks[1] > peaks[2] > 1.3938
    assert peaks[2] < 1.15 * 1.394
    assert peaks[0] == pytest.approx(2 * 1.394, rel=0.01)
