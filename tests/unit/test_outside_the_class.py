"""docs/explanation/outside_the_class.md: each of its statements as a test."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from design.auditing.audit_design import audit, covered_delay
from design.blocks.block import Block, plant_block
from design.chapters_3_4.design_extended import design_extended
from design.design_file import Design
from design.stability.characteristic_roots import roots_right_of
from design.stability.delay_loop import DelayLoop
from experiments.engine.saturated_loop import SaturatedLoop
from experiments.engine.simulate import simulate
from identification.model.additive_bound import AdditiveBound
from identification.model.model_file import IdentifiedModel
from identification.model.plant import PlantModel


def loop_with_delay(design: Design, delay_s: float) -> DelayLoop:
    P = plant_block(design.plant)
    return DelayLoop(Block(P.gain, P.zeros, P.poles, delay_s), *design.controller_parts(), design.plant.delay_s)


@pytest.mark.parametrize("delay_s", [0.0081, 0.05])
def test_the_range_of_true_dead_times(implied: IdentifiedModel, delay_s: float) -> None:
    model = dataclasses.replace(implied, plant=dataclasses.replace(implied.plant, delay_s=delay_s))
    design = design_extended(model, [1.5], 4.0, [(2.0, 1.0)])
    margins = audit(design).margins
    assert not isinstance(margins, str)
    least, greatest = margins.delay_least_s.value, margins.delay_greatest_s.value
    assert least <= delay_s < greatest
    for inside in np.linspace(least + 1e-6, greatest - 1e-6, 7):
        assert roots_right_of(loop_with_delay(design, float(inside)), 0.0) == 0
    assert roots_right_of(loop_with_delay(design, greatest * 1.001), 0.0) == 2
    if least > 0:
        assert roots_right_of(loop_with_delay(design, least * 0.999), 0.0) == 2


def test_dead_times_within_the_bound(implied: IdentifiedModel) -> None:
    plant, bound = implied.plant, implied.additive_bound
    covered = covered_delay(plant, bound)
    s = 1j * np.geomspace(1e-3, 1e4, 20000)
    s = np.union1d(s.imag, np.linspace(100.0, 400.0, 300_001)) * 1j  # W_a is nearest to twice |P| between the modes
    for factor, inside in ((1.0, True), (1 + 1e-5, False)):
        moved = dataclasses.replace(plant, delay_s=plant.delay_s + factor * covered)
        assert bool(np.all(np.abs(moved(s) - plant(s)) <= np.abs(bound(s)))) == inside
    # two integrators move P by more than any finite W_a at low frequency
    assert covered_delay(dataclasses.replace(plant, integrators=2), bound) == 0.0
    # 2 |P| above |W_a| at high frequency leaves nothing
    assert covered_delay(plant, AdditiveBound.printed_form(0.005, 20.0, 280.0, 0.01)) == 0.0
    # every phase is covered where W_a exceeds 2 |P|
    assert covered_delay(PlantModel(1e-6, (), (), 0.1), AdditiveBound(1.0, (), (), (1.0,), (2.0,))) > 1e5


@pytest.mark.parametrize("integrators", [-2, -1, 0])
def test_dead_times_within_the_bound_of_other_plants(integrators: int) -> None:
    """Nearly the same at all frequencies beyond the poles, with zeros at s = 0 too: the least on a fine grid."""
    omega = np.geomspace(1e-4, 1e6, 400_001)
    rng = np.random.default_rng(integrators + 2)
    for _ in range(4):
        poles = (1.0, 3.0, *10 ** rng.uniform(-1, 2, -integrators))
        plant = PlantModel(1.0, (), (), 0.01, integrators, (), poles)
        bound = AdditiveBound(10 ** rng.uniform(-3, -1), (), (), (), (10 ** rng.uniform(-1, 2),))
        ratio = np.abs(bound(1j * omega) / plant(1j * omega))
        least = np.min(np.where(ratio < 2, 2 / omega * np.arcsin(np.minimum(ratio / 2, 1.0)), np.inf))
        assert covered_delay(plant, bound) == pytest.approx(least, rel=1e-6)


def test_no_bound_covers_the_integrators_gain(implied: IdentifiedModel) -> None:
    plant, bound = implied.plant, implied.additive_bound
    for change in (1e-2, 1e-6):
        moved = dataclasses.replace(plant, gain=plant.gain * (1 + change))
        s = 1j * change * plant.gain / abs(complex(bound(0j))) * 0.5
        assert abs(complex(moved(s) - plant(s))) > abs(complex(bound(s)))


def test_an_unstable_pole_would_stay_as_a_hidden_mode() -> None:
    """P = 1/(s - p) under C = (T/P)/(1 - T exp(-h s)): T exp(-h s) = 1 at p, and p is cancelled all the same."""
    p, h, a = 0.5, 0.2, 3.0
    # T(s) = (c s + d)/(s + a)^2 with T(0) = 1 and T(p) = exp(h p)
    d = a**2
    c = (np.exp(h * p) * (p + a) ** 2 - d) / p
    T = Block(c, (complex(-d / c),), (complex(-a),) * 2)
    P = Block(1.0, (), (complex(p),), h)
    K = T * Block(1.0, (complex(p),))
    assert abs(1 - complex(T(p)) * np.exp(-h * p)) < 1e-12
    loop = DelayLoop(P, K, T, h)
    assert complex(p) in loop.hidden
    # what r and y see is stable: the characteristic equation without the hidden roots has no such root
    assert roots_right_of(loop, 0.0) == 0


def test_a_limited_input_holds_an_unstable_plant_near_zero_only() -> None:
    """y' = p y + K sat(u), u = -50 y: from |y| > K L/p it escapes, from below it returns."""
    p, K, L = 0.7, 2.0, 3.0
    for factor in (1.01, 0.99):
        start = factor * K * L / p
        loop = SaturatedLoop(
            A=np.array([[p]]),
            B=np.array([K]),
            C=np.array([-50.0]),
            D=np.zeros((1, 0)),
            E=np.zeros(0),
            Z=np.zeros((0, 1)),
            delays=np.zeros(0),
            x0=np.array([start]),
            outputs={"y": (np.ones(1), np.zeros(0))},
        )
        y = simulate(loop, (-L, L), np.linspace(0.0, 12.0, 121)).outputs["y"]
        assert abs(y[-1]) > 2 * start if factor > 1 else abs(y[-1]) < 1e-6


def test_the_approximate_inverse_is_stable_for_small_epsilon_only(implied: IdentifiedModel) -> None:
    """(3.2) with R_eps: the characteristic equation is no longer (3.5), and the audit counts its roots."""
    stable = design_extended(implied, [1.5], 4.0, [(2.0, 1.0)], inverse_epsilon=1e-3)
    assert not isinstance(audit(stable).margins, str)
    unstable = design_extended(implied, [1.5], 4.0, [(2.0, 1.0)], inverse_epsilon=1.0)
    assert "right half plane" in str(audit(unstable).margins)
