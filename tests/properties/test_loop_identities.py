"""Identities of Fig. 2.6 that hold whatever saturates, simulated without using them."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st

from design.anti_windup.compensator import AntiWindup, second_order
from design.auditing.audit_design import audit
from design.chapters_3_4.design_extended import design_extended
from design.design_file import Design
from experiments.engine.pade import with_pade
from experiments.engine.simulate import simulate
from experiments.runs.design_loop import design_loop
from experiments.runs.metrics import last_saturation
from experiments.runs.references import Reference, sinusoid
from experiments.thesis.printed_choices import thesis_reference
from identification.base.errors import InputError
from identification.model.model_file import IdentifiedModel
from identification.model.plant import PlantModel

LIMITS = st.floats(8.0, 40.0)
FREE = (-np.inf, np.inf)
quick = settings(max_examples=8, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])


def compensator(design: Design, kind: str, gamma: float) -> AntiWindup:
    return second_order(0.05, 0.025, gamma) if kind == "thesis" else design.compensator("corrected")


@pytest.mark.parametrize("kind", ["thesis", "corrected"])
@pytest.mark.parametrize("which", ["extended_design", "delay_free_design"])
@quick
@given(limit=LIMITS, gamma=st.floats(-0.9, 150.0), omega=st.floats(0.3, 6.0), offset=st.floats(-60.0, 60.0))
def test_y_plus_y_d_is_the_linear_response(
    request: pytest.FixtureRequest, which: str, kind: str, limit: float, gamma: float, omega: float, offset: float
) -> None:
    """Lemma 2: y_lin = G_A u_lin, saturation or not; and v is the control of the linear loop."""
    design = request.getfixturevalue(which)
    loop = design_loop(design, sinusoid(50.0, omega, 0.4, offset), compensator(design, kind, gamma))
    t = np.linspace(0, 3, 301)
    saturated, linear = simulate(loop, (-limit, limit), t), simulate(loop, FREE, t)
    assume(len(saturated.events_s) > 0)
    scale = np.abs(linear.outputs["output"]).max()
    np.testing.assert_allclose(saturated.outputs["y_lin"], linear.outputs["output"], rtol=0, atol=1e-8 * scale)
    control = np.abs(linear.control).max()
    np.testing.assert_allclose(saturated.outputs["v"], linear.control, rtol=0, atol=1e-8 * control)


@quick
@given(limit=LIMITS)
def test_without_saturation_every_anti_windup_is_the_same(extended_design: Design, limit: float) -> None:
    reference = sinusoid(0.02 * limit, 1.5, 0.0, 0.0)
    t = np.linspace(0, 2, 101)
    runs = [
        simulate(design_loop(extended_design, reference, kind), (-limit, limit), t)
        for kind in (None, extended_design.compensator("thesis"), extended_design.compensator("corrected"))
    ]
    for run in runs:
        assert len(run.events_s) == 0
        np.testing.assert_allclose(run.outputs["output"], runs[0].outputs["output"], rtol=0, atol=1e-11 * limit)


def test_loop_is_homogeneous(extended_design: Design) -> None:
    # reference and limits times c: every signal times c
    t = np.linspace(0, 3, 301)
    small, large = (
        simulate(
            design_loop(extended_design, sinusoid(c * 50.0, 1.5, 1.2, 0.0), extended_design.compensator("thesis")),
            (-c * 12.0, c * 12.0),
            t,
        )
        for c in (1.0, 1000.0)
    )
    np.testing.assert_allclose(large.outputs["output"], 1000 * small.outputs["output"], rtol=0, atol=1e-6)
    np.testing.assert_allclose(large.events_s, small.events_s, rtol=0, atol=1e-9)


def test_offset_is_the_integral_of_what_the_actuator_left_out(extended_design: Design) -> None:
    """y - r -> -K (1 + gamma) * integral of u_tilde: the thesis's lasting offset; none with theta1~(0) = -1."""
    reference = thesis_reference("extended", [1.5])
    t = np.linspace(0, 25, 250_001)
    kind = extended_design.compensator("thesis")
    run = simulate(design_loop(extended_design, reference, kind), (-12.0, 12.0), t)
    excess = np.trapezoid(run.control - run.saturated_control, t)
    gain = extended_design.plant.gain * float(kind.one_plus(0j).real)
    error = run.outputs["error"][-1]
    assert abs(error) > 10
    assert error == pytest.approx(gain * excess, rel=1e-3)  # trapezoids of a kinked signal
    corrected = design_loop(extended_design, reference, extended_design.compensator("corrected"))
    assert abs(simulate(corrected, (-12.0, 12.0), np.array([0.0, 25.0])).outputs["error"][-1]) < 1e-6


def test_last_saturation_without_anti_windup(extended_design: Design) -> None:
    """8.03 s, 3.80 s and 1.84 s under limits of 12, 13 and 15, known from an independent program."""
    loop = design_loop(extended_design, thesis_reference("extended", [1.5]), None)
    times = [last_saturation(simulate(loop, (-limit, limit), np.array([0.0, 20.0]))) for limit in (12.0, 13.0, 15.0)]
    np.testing.assert_allclose(times, [8.03, 3.80, 1.84], atol=0.005)


def test_pade_converges_to_the_exact_dead_time(extended_design: Design) -> None:
    """Section 4.2: "larger n gives more accurate equivalent of the dead-time"."""
    loop = design_loop(extended_design, thesis_reference("extended", [1.5]), None)
    t = np.linspace(0, 3, 301)
    exact = simulate(loop, (-15.0, 15.0), t).outputs["output"]
    approximate = [simulate(with_pade(loop, order), (-15.0, 15.0), t).outputs["output"] for order in (1, 2, 3)]
    errors = [np.abs(output - exact).max() for output in approximate]
    assert errors[0] > errors[1] > errors[2]


def test_chapter_two_without_anti_windup_does_not_follow(delay_free_design: Design) -> None:
    """Fig. 2.14; and the corrected compensator keeps the error within what the limit allows."""
    reference = thesis_reference("delay-free", delay_free_design.reference_omegas)
    t = np.linspace(0, 24, 2401)
    without = simulate(design_loop(delay_free_design, reference, None), (-10.0, 10.0), t).outputs["error"]
    kind = delay_free_design.compensator("corrected")
    corrected = simulate(design_loop(delay_free_design, reference, kind), (-10.0, 10.0), t).outputs["error"]
    assert np.abs(without[t > 20]).max() > 50
    assert np.abs(corrected[t > 20]).max() < 5


def test_chapter_two_hides_the_plants_integrator(delay_free_design: Design) -> None:
    """C = K A/Lambda has a zero where the plant has its pole: P S keeps the pole at 0, as Lemma 1 (A stable) warns."""

    C = delay_free_design.controller_parts()[0]
    assert 0j in C.zeros
    P = delay_free_design.plant.without_delay()
    s = np.array([1e-6, 1e-7])
    P_S = P(s) / (1 + P(s) * C(s))
    assert abs(P_S[1] / P_S[0]) == pytest.approx(10.0, rel=1e-3)


@pytest.mark.parametrize("omegas", [[0.0], [0.8, 2.5], [0.0, 1.5]])
@pytest.mark.parametrize("level", [None, 0.9])
def test_every_frequency_of_the_reference_is_followed(
    implied: IdentifiedModel, omegas: list[float], level: float | None
) -> None:
    """One interpolation condition each: from rest and with saturation on the way the error dies out."""
    pairs = [(2.0, 1.0)] * sum(omega > 0 for omega in omegas)
    design = design_extended(implied, omegas, 4.0, pairs, robust_level=level)
    n = len(omegas)
    reference = Reference((20.0,) * n, tuple(omegas), (1.0,) * n, 0.0)
    loop = design_loop(design, reference, design.compensator("corrected"))
    run = simulate(loop, (-15.0, 15.0), np.linspace(0, 40, 4001))
    assert len(run.events_s) > 0
    error = run.outputs["error"]
    assert np.abs(error[run.time_s > 35]).max() < 1e-6
    assert abs(error[0]) > 10


def test_another_true_plant_is_another_loop(extended_design: Design) -> None:
    """The audit's range of true dead times, seen in time: just inside the error dies out, just outside it grows."""
    margins = audit(extended_design).margins
    assert not isinstance(margins, str)
    errors = []
    for delay_s in (0.9 * margins.delay_greatest_s.value, 1.1 * margins.delay_greatest_s.value):
        plant = dataclasses.replace(extended_design.plant, delay_s=delay_s)
        loop = design_loop(extended_design, thesis_reference("extended", [1.5]), None, plant)
        error = np.abs(simulate(loop, (-np.inf, np.inf), np.linspace(0, 16, 1601)).outputs["error"])
        errors.append(error[-160:].max() / error[800:960].max())
    assert errors[0] < 0.9
    assert errors[1] > 1.1


@pytest.mark.parametrize("change", [{"gain": 9.0}, {"gain": 5.0}, {"delay_s": 0.02}, {"delay_s": 0.0}])
def test_a_mismatch_that_leaves_the_loop_stable_leaves_no_error(
    extended_design: Design, change: dict[str, float]
) -> None:
    """The internal model stays in the controller: the sinusoid is followed although the plant is another."""
    plant = dataclasses.replace(extended_design.plant, **change)
    kind = extended_design.compensator("corrected")
    loop = design_loop(extended_design, thesis_reference("extended", [1.5]), kind, plant)
    error = np.abs(simulate(loop, (-25.0, 25.0), np.linspace(0, 40, 4001)).outputs["error"])
    assert error[3500:].max() < 1e-6 * error.max()


def test_the_model_as_the_true_plant_changes_nothing(extended_design: Design, delay_free_design: Design) -> None:
    t = np.linspace(0, 3, 301)
    for design in (extended_design, delay_free_design):
        reference = thesis_reference(design.kind, design.reference_omegas)
        loops = [
            design_loop(design, reference, design.compensator("thesis"), plant) for plant in (None, design.loop_plant)
        ]
        runs = [simulate(loop, (-9.0, 9.0), t).outputs["output"] for loop in loops]
        np.testing.assert_array_equal(*runs)


def test_a_true_plant_that_jumps_is_refused(extended_design: Design) -> None:
    plant = PlantModel(1.0, (), (), 0.0, integrators=0)
    with pytest.raises(InputError, match="as many zeros as poles"):
        design_loop(extended_design, thesis_reference("extended", [1.5]), None, plant)
