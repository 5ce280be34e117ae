"""The controller that is made again for the held plant: no error at the samples at any rate, whatever saturates."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.signal import cont2discrete, dlsim, lfilter, zpk2ss
from test_coprime_form import PLANTS, design_of

from design.anti_windup.other_anti_windups import OTHERS
from design.blocks.block import plant_block
from design.chapters_3_4.design_extended import design_extended
from design.design_file import Design
from experiments.drive.held_plant import held_plant
from experiments.drive.sampled_loop import FORMS, Drive, simulate_sampled
from experiments.engine.simulate import simulate
from experiments.runs.design_loop import design_loop
from experiments.runs.references import Reference, sinusoid
from identification.base.errors import InputError
from identification.model.additive_bound import AdditiveBound
from identification.model.model_file import IdentifiedModel
from identification.model.modes import Mode
from identification.model.plant import PlantModel

FREE = (-math.inf, math.inf)
RIGHT = PlantModel(2.0, (Mode(30.0, -0.4),), (Mode(50.0, 0.02),), 0.013, 1, real_poles=(9.0, 14.0))


@pytest.fixture(scope="module", params=[*PLANTS, "zeros in the right half plane"])
def design(request: pytest.FixtureRequest) -> Design:
    return design_of(PLANTS.get(request.param, RIGHT))


@pytest.mark.parametrize("rate", [1.0, 5.3, 61.3, 400.0])
def test_no_error_stays_at_the_samples(design: Design, rate: float) -> None:
    """Also where two samples make a period, and a plant with integrators follows a constant that was not asked for."""
    constant = 0.7 if design.plant.integrators > 0 else 0.0
    run = simulate_sampled(design, sinusoid(1.0, 1.5, 0.4, constant), None, Drive(rate, "matched", FREE), 60.0)
    assert np.abs(run.error[run.time_s > 50]).max() < 1e-9 * np.abs(run.output).max()


def test_several_frequencies_are_met_at_once() -> None:
    omegas = (0.6, 1.5, 4.0)
    design = design_extended(
        IdentifiedModel(PLANTS["one integrator"], AdditiveBound.printed_form(1e-3, 20.0, 280.0, 0.1)), omegas
    )
    reference = Reference((1.0, -0.3, 0.2), omegas, (0.1, 0.2, 0.3), 0.5)
    run = simulate_sampled(design, reference, None, Drive(11.0, "matched", FREE), 100.0)
    assert np.abs(run.error[run.time_s > 80]).max() < 1e-9


def test_it_tends_to_the_continuous_controller(design: Design) -> None:
    """Its run tends to that of Tustin's rule, which is tested against the continuous one, as 1/rate at least."""
    apart = []
    for rate in (500.0, 2000.0):
        runs = [
            simulate_sampled(design, sinusoid(1.0, 1.5), None, Drive(rate, method, FREE), 3.0).output
            for method in ("matched", "tustin")
        ]
        apart.append(np.abs(runs[0] - runs[1]).max() / np.abs(runs[1]).max())
    assert apart[1] < max(apart[0] / 3, 1e-9) < 0.05


@pytest.mark.parametrize(("plant", "name"), [("one integrator", "thesis"), *(("none", name) for name in OTHERS)])
def test_the_saturated_loop_tends_to_the_continuous_one(plant: str, name: str) -> None:
    """With every anti-windup; the difference is of the order of the rate at which the limits are left."""
    design, reference = design_of(PLANTS[plant]), sinusoid(1.0, 1.5, 1.2)
    kind, limits, apart = design.chosen(name), 1.1 * reference.required(design.plant).value * np.array([-1.0, 1.0]), []
    for rate in (100.0, 800.0):
        run = simulate_sampled(design, reference, kind, Drive(rate, "matched", (limits[0], limits[1])), 30.0)
        exact = simulate(design_loop(design, reference, kind), (limits[0], limits[1]), run.time_s[1:])
        apart.append(np.abs(run.output[1:] - exact.outputs["output"]).max() / np.abs(run.output).max())
    assert apart[1] < max(apart[0] / 3, 1e-9) < 0.1


@pytest.mark.parametrize("name", ["one integrator", "none", "no dead time"])
def test_what_saturates_is_not_seen_by_the_linear_loop(name: str) -> None:
    """y + P_d (1 + theta1~) u_tilde is the linear response at every sample; P_d and theta1~ by scipy."""
    design, rate, until = design_of(PLANTS[name]), 20.0, 30.0  # whole samples of dead time
    kind, reference = design.compensator("corrected"), sinusoid(1.0, 1.5, 1.2)
    limit = 1.1 * reference.required(design.plant).value
    runs = [
        simulate_sampled(design, reference, anti_windup, Drive(rate, "matched", limits), until)
        for anti_windup, limits in ((kind, (-limit, limit)), (None, FREE))
    ]
    left_out = runs[0].control - np.clip(runs[0].control, -limit, limit)
    assert np.abs(left_out).max() > limit / 2
    P = plant_block(design.plant)
    states = zpk2ss(P.zeros, P.poles, P.gain)
    late = np.append(np.zeros(round(design.plant.delay_s * rate)), left_out)[: len(left_out)]
    one_plus = cont2discrete(zpk2ss(kind.one_plus.zeros, kind.one_plus.poles, 1.0), 1 / rate, "bilinear")
    y_d = dlsim((*cont2discrete(states, 1 / rate, "zoh")[:4], 1 / rate), dlsim((*one_plus[:4], 1 / rate), late)[1])[1]
    linear = np.abs(runs[1].output).max()
    np.testing.assert_allclose(
        runs[0].output + y_d[:, 0], runs[1].output, rtol=0, atol=1e-8 * (linear + np.abs(y_d).max())
    )


def test_both_forms_are_one_loop(design: Design) -> None:
    if design.plant.unstable_poles:
        return  # as drawn, an unstable mode is hidden, and rounding grows in it
    drive = Drive(30.0, "matched", (-3.0, 3.0))
    runs = [simulate_sampled(design, sinusoid(1.0, 1.5), "corrected", drive, 6.0, form=form).output for form in FORMS]
    np.testing.assert_allclose(runs[0], runs[1], rtol=0, atol=1e-8 * (1 + np.abs(runs[0]).max()))


@pytest.mark.parametrize("delay", [0.0, 0.3, 1.0, 2.75])
def test_the_held_plant_is_its_pulse_response(delay: float) -> None:
    T = 0.04
    plant = PlantModel(2.0, (Mode(20.0, -0.1),), (Mode(31.0, 0.05),), 0.5 * delay * T, 2, real_poles=(6.0,))
    P_d, samples = held_plant(plant, T, 0.5 * delay * T)
    z_zeros, z_poles = (1 + T * np.array(roots) for roots in (P_d.zeros, P_d.poles))
    found = lfilter(P_d.gain * np.real(np.poly(z_zeros)), np.real(np.poly(z_poles)), np.eye(1, 30)[0])
    found = np.append(np.zeros(samples), found)[:30]
    P = plant_block(plant)
    A, b, c, _ = zpk2ss(P.zeros, P.poles, P.gain)
    n = len(A)
    whole = np.block([[A, b], [np.zeros((1, n + 1))]])

    def step(t: float) -> float:
        return float((c @ expm(whole * t)[:n, n:])[0, 0]) if t > 0 else 0.0

    expected = [step((k - delay) * T) - step((k - 1 - delay) * T) for k in range(30)]
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-9 * np.abs(expected).max())


def test_what_it_is_not_for_is_refused(delay_free_design: Design, extended_design: Design) -> None:
    with pytest.raises(InputError, match="method is 'matched', for an extended design"):
        simulate_sampled(delay_free_design, sinusoid(1.0, 1.5), None, Drive(100.0, "matched", FREE), 1.0)
    with pytest.raises(
        InputError, match=r"rate is 0.4 Hz and the reference has 0.238732415 Hz; expected more than twice"
    ):
        simulate_sampled(extended_design, sinusoid(1.0, 1.5), None, Drive(0.4, "matched", FREE), 10.0)
