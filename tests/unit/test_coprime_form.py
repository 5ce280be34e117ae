"""The controller without hidden modes: it is C, its factors are stable, and rounding inside it does not stay."""

from __future__ import annotations

from functools import cache
from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import quad_vec
from scipy.linalg import expm

from design.blocks.block import Block
from design.blocks.state_space import realize
from design.chapters_3_4.design_extended import design_extended
from design.chapters_3_4.realisation import realised
from design.design_file import Design
from experiments.drive.difference_equations import METHODS, SampledBlock, sample_block, sample_memory
from experiments.drive.sampled_loop import FORMS, Drive, simulate_sampled
from experiments.runs.references import sinusoid
from identification.model.additive_bound import AdditiveBound
from identification.model.model_file import IdentifiedModel
from identification.model.modes import Mode
from identification.model.plant import PlantModel

BOUND = AdditiveBound.printed_form(1e-3, 20.0, 280.0, 0.1)
PLANTS = {
    "one integrator": PlantModel(3.0, (Mode(40.0, 0.05),), (Mode(60.0, 0.03),), 0.05),
    "two integrators": PlantModel(2.0, (), (), 0.04, 2),
    "two integrators and a zero": PlantModel(-2.0, (), (), 0.04, 2, real_zeros=(-70.0,)),
    "none": PlantModel(2.0, (), (), 0.05, 0, real_poles=(3.0,)),
    "an unstable pole": PlantModel(2.0, (), (), 0.05, 0, real_poles=(3.0, -1.0)),
    "an unstable pair": PlantModel(2.0, (), (Mode(3.0, -0.2),), 0.05, 1),
    "an integrator and an unstable pole": PlantModel(2.0, (), (), 0.05, 1, real_poles=(-0.5,)),
    "a zero at s = 0": PlantModel(2.0, (), (), 0.05, -1, real_poles=(3.0, 4.0)),
    "no dead time": PlantModel(3.0, (), (Mode(60.0, 0.03),), 0.0),
}


@cache
def design_of(plant: PlantModel) -> Design:
    return design_extended(IdentifiedModel(plant, BOUND), [1.5], sector=0.8)


@pytest.fixture(scope="module", params=PLANTS)
def design(request: pytest.FixtureRequest) -> Design:
    return design_of(PLANTS[request.param])


@pytest.fixture(scope="module", params=[name for name in PLANTS if name not in ("none", "a zero at s = 0")])
def anchored(request: pytest.FixtureRequest) -> Design:
    return design_of(PLANTS[request.param])


def test_it_is_the_controller_and_its_factors_are_stable(design: Design) -> None:
    form, (K, T) = realised(design), design.controller_parts()
    assert all(part.is_stable for part in (form.forward, form.rest, form.through))
    random = np.random.default_rng(3)
    s = random.uniform(0.5, 30.0, 40) * np.exp(1j * random.uniform(-2, 2, 40))
    expected = K(s) / (1 - T(s) * np.exp(-design.plant.delay_s * s))
    np.testing.assert_allclose(form(s), expected, rtol=1e-8)
    if form.anchors:  # the kernel ends with the dead time
        A, b, c = form.kernel()
        late = form.delay_s
        value = quad_vec(lambda tau: c @ expm(A * tau) @ b * np.exp(-s * tau), 0.0, late)[0]
        Phi = (np.exp(-late * s) - np.polyval(form.E, s)) / np.prod(s[:, None] - np.array(form.anchors), axis=1)
        np.testing.assert_allclose(value, Phi, rtol=1e-8, atol=1e-12 * np.abs(Phi).max())


def summed(block: SampledBlock, given: np.ndarray) -> np.ndarray:
    """The sum of a block's outputs as its class states them, step by step."""
    x, p, total = np.zeros(len(block.b)), np.zeros((len(given), len(block.d))), np.zeros(len(given))
    for k, i in enumerate(given):
        p[k] = block.C @ x + block.d * i
        x = block.A @ x + block.b * i
        for o, first in enumerate(block.first):
            total[k] += sum(block.taps[o, j] * p[k - first - j, o] for j in range(block.length[o]) if k >= first + j)
    return total


@pytest.mark.parametrize("samples", [0.4, 4.3])
def test_a_held_input_meets_the_exact_memory(anchored: Design, samples: float) -> None:
    """R v = v - (1/g) v + (T_so/g) v late: each of the three is rational, and unstable where the anchors are."""
    form = realised(anchored)
    T, v = (form.delay_s or 0.05) / samples, np.random.default_rng(1).normal(size=30)
    g = Block(1.0, form.anchors, (complex(-anchored.free.a),) * len(form.anchors))
    unheld = (
        form.through * g.inverse() * Block(1.0, (), (complex(-anchored.free.a),) * len(form.anchors)),
        form.delay_s,
    )
    now, late = (
        summed(sample_block(realize(each), [delay_s], T, "exact"), v) for each, delay_s in ((g.inverse(), 0.0), unheld)
    )
    found = summed(sample_memory(form, T, "exact"), v)
    np.testing.assert_allclose(found, v - now + late, rtol=0, atol=1e-8 * (np.abs(now).max() + np.abs(late).max()))


@pytest.mark.parametrize("samples", [0.4, 4.3])
def test_straight_lines_meet_the_memory_of_tustins_rule(anchored: Design, samples: float) -> None:
    form = realised(anchored)
    T, v = (form.delay_s or 0.05) / samples, np.random.default_rng(2).normal(size=12)
    A, b, c = form.kernel()
    rest, z = (summed(sample_block(realize(each), [0.0], T, "tustin"), v) for each in (form.rest, form.through))
    times = T * np.arange(-2, len(v))
    lines = np.concatenate([[0.0, 0.0], z])
    lines[:2] = 0.0

    def remembered(t: float) -> float:
        points = sorted({0.0, form.delay_s, *(t - times[(times < t) & (times > t - form.delay_s)])})
        pieces = [
            quad_vec(lambda tau: c @ expm(A * tau) @ b * np.interp(t - tau, times, lines), low, high)[0]
            for low, high in pairwise(points)
        ]
        return float(sum(pieces))

    expected = rest + [remembered(k * T) for k in range(len(v))]
    found = summed(sample_memory(form, T, "tustin"), v)
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-9 * np.abs(found).max())


@pytest.mark.parametrize("method", METHODS)
def test_both_forms_are_one_loop_where_nothing_is_rounded(method: str) -> None:
    """They tend to the same run as the rate grows: the difference falls with it."""
    design, apart = design_of(PLANTS["one integrator"]), []
    for rate in (1000.0, 4000.0):
        runs = [
            simulate_sampled(design, sinusoid(1.0, 1.5), "corrected", Drive(rate, method, (-3.0, 3.0)), 4.0, form=form)
            for form in FORMS
        ]
        apart.append(np.abs(runs[0].output - runs[1].output).max())
    assert apart[1] < max(apart[0] / 3, 1e-12) < 1e-2


@pytest.mark.parametrize(("name", "power"), [("one integrator", 1), ("two integrators", 2)])
def test_what_a_computer_rounds_stays_in_the_thesis_form_alone(name: str, power: int) -> None:
    """v is cut down by half a step on average: n = -resolution/2, and y = P n grows as its integral, y = P g n not."""
    design, resolution, rate = design_of(PLANTS[name]), 1e-3, 400.0
    ends, grown = (10.0, 20.0), {}
    for form in FORMS:
        drive = Drive(rate, "tustin", (-100.0, 100.0), resolution=resolution)
        run = simulate_sampled(design, sinusoid(1.0, 1.5), None, drive, 20.0, form=form)
        plain = simulate_sampled(
            design, sinusoid(1.0, 1.5), None, Drive(rate, "tustin", (-100.0, 100.0)), 20.0, form=form
        )
        drift = run.output - plain.output
        grown[form] = [float(np.abs(drift[(run.time_s > end - 4) & (run.time_s <= end)]).mean()) for end in ends]
    gain = abs(design.plant.gain)
    expected = gain * resolution / 2 * (20.0 - 2.0) ** power / power
    assert grown["thesis"][1] == pytest.approx(expected, rel=0.2)
    assert grown["thesis"][1] > 1.7**power * grown["thesis"][0]
    assert grown["coprime"][1] < 0.1 * grown["thesis"][1]
    assert grown["coprime"][1] < 1.5 * grown["coprime"][0]
