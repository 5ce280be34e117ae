"""The peak of the control that follows a reference in the steady state: closed forms, dense looks, units, phases."""

from __future__ import annotations

import math

import mpmath as mp
import numpy as np
import pytest

from design.chapters_3_4.design_extended import design_extended
from experiments.engine.simulate import simulate
from experiments.physical_limits.intervals import Interval
from experiments.physical_limits.least_peak_error import periodic_limit
from experiments.runs.design_loop import design_loop
from experiments.runs.references import Reference, sinusoid
from experiments.runs.sector_promise import steady_control
from experiments.runs.steady_control import Wave, peak
from identification.model.additive_bound import AdditiveBound
from identification.model.model_file import IdentifiedModel
from identification.model.modes import Mode
from identification.model.plant import PlantModel

PLANT = PlantModel(3.0, (Mode(30.0, 0.05),), (Mode(45.0, 0.02),), 0.03)


def steady(reference: Reference, plant: PlantModel, time_s: np.ndarray) -> np.ndarray:
    """The control itself, sinusoids only."""
    parts = zip(reference.amplitudes, reference.omegas, reference.phases_rad, strict=True)
    return np.sum([(a / plant(1j * w) * np.exp(1j * (w * time_s + p))).imag for a, w, p in parts], axis=0)


def test_one_frequency_takes_the_amplitude_over_the_size_of_the_plant() -> None:
    reference = sinusoid(-50.0, 1.5, 0.3, 7.0)
    found = reference.required(PLANT)
    assert found.value == pytest.approx(50.0 / abs(complex(PLANT(1.5j))), rel=1e-15)
    assert found.value < found.at_most < found.value * (1 + 1e-12)


@pytest.mark.parametrize("seed", range(12))
def test_common_period_by_a_dense_look(seed: int) -> None:
    """Any harmonics, phases and signs: never below what is seen, and above it by no more than the look misses."""
    rng = np.random.default_rng(seed)
    harmonics = rng.choice(np.arange(1, 40), rng.integers(2, 6), replace=False)
    slowest = 10.0 ** rng.uniform(-3, 3)
    reference = Reference(
        tuple(rng.normal(size=len(harmonics))),
        tuple(float(k * slowest) for k in harmonics),
        tuple(rng.uniform(-4, 4, len(harmonics))),
        float(rng.normal()),
    )
    plant = PlantModel(float(rng.normal()), (), (Mode(10 * slowest, 0.05),), float(rng.uniform(0, 9)))
    found = reference.required(plant)
    time_s = np.linspace(0, 2 * math.pi / slowest, 400_001)
    seen = np.abs(steady(reference, plant, time_s)).max()
    assert seen * (1 - 1e-9) <= found.value <= found.at_most
    assert found.at_most <= seen * (1 + 1e-6)
    assert found.at_most - found.value < 1e-10 * found.value


def test_two_harmonics_to_thirty_digits() -> None:
    """sin x + sin(2 x + 1): its greatest size at a root of its derivative."""
    with mp.workdps(30):
        roots = [mp.findroot(lambda x: mp.cos(x) + 2 * mp.cos(2 * x + 1), start) for start in np.arange(0, 6.3, 0.2)]
        known = max(abs(mp.sin(x) + mp.sin(2 * x + 1)) for x in roots)
        found = peak([Wave(1.0, 0.7, 0.0, 0.0), Wave(1.0, 1.4, 1.0, 0.0)], 0.0)
        assert found.value == pytest.approx(float(known), rel=1e-13)
        assert mp.mpf(found.at_most) >= known


def test_frequencies_without_a_common_period_come_to_their_sum() -> None:
    waves = [Wave(1.0, 1.0, 0.3, 0.0), Wave(2.0, math.sqrt(2), 1.0, 0.0)]
    assert peak(waves, 0.0).value == pytest.approx(3.0)
    time_s = np.linspace(0, 3e3, 3_000_001)
    assert np.abs(sum(w.amplitude * np.sin(w.omega * time_s + w.phase_rad) for w in waves)).max() > 2.999
    # sin x + cos 2x, x = t + 0.3, lies between -2, at x = -pi/2, and 9/8
    with_period = [*waves, Wave(1.0, 2.0, 0.6 + math.pi / 2, 0.0)]
    assert peak(with_period, 0.0).value == pytest.approx(4.0, rel=1e-12)
    assert peak(with_period, -0.5).value == pytest.approx(4.5, rel=1e-12)
    assert peak(with_period, 2.0).value == pytest.approx(2.0 + 9 / 8 + 2.0, rel=1e-12)


def test_constants_and_slopes() -> None:
    stable, double = PlantModel(-2.0, (), (), 0.0, 0, (), (5.0,)), PlantModel(2.0, (), (), 0.0, 2)
    two = Reference((3.0, 4.0), (1.0, 0.0), (0.4, math.pi / 6), -9.0, 0.0)
    wave = 3.0 / abs(complex(stable(1j)))
    assert two.required(stable).value == pytest.approx(wave + 7.0 / 2.0)
    assert two.required(PLANT).value == pytest.approx(3.0 / abs(complex(PLANT(1j))))
    ramp = Reference((3.0,), (1.0,), (0.4,), -9.0, -0.5)
    assert ramp.required(PLANT).value == pytest.approx(3.0 / abs(complex(PLANT(1j))) + 0.5 / 3.0)
    assert ramp.required(double).value == pytest.approx(1.5)
    assert ramp.required(stable).value == math.inf
    assert Reference((0.0,), (0.0,), (0.0,), 4.0).required(PLANT).value == 0.0


def test_zeros_at_zero_and_in_the_right_half_plane() -> None:
    """A constant takes an integral of it, a sinusoid its amplitude over |P|, on whichever side the zeros lie."""
    velocity = PlantModel(2.0, (), (Mode(5.0, 0.2),), 0.4, -1)
    for level, slope in ((1e-9, 0.0), (0.0, 1e-9)):
        assert Reference((3.0,), (1.0,), (0.4,), level, slope).required(velocity) == (math.inf, math.inf)
    assert sinusoid(3.0, 1.0, 0.4, 0.0).required(velocity).value == pytest.approx(3.0 / abs(complex(velocity(1j))))
    one, other = (
        PlantModel(2.0, (Mode(3.0, zeta),), (), 0.1, 2, (rate,), (8.0,)) for zeta, rate in ((2.0, 4.0), (-2.0, -4.0))
    )
    reference = Reference((3.0, 1.0), (1.0, 3.0), (0.4, 0.0), 5.0, 7.0)  # a double integrator keeps its speed
    time_s = np.linspace(0, 2 * math.pi, 100_001)
    for plant in (one, other):
        seen = np.abs(steady(reference, plant, time_s)).max()
        found = reference.required(plant)
        assert seen * (1 - 1e-9) <= found.value <= found.at_most <= seen * (1 + 1e-6)


def test_distance_from_a_middle_and_constants_that_cancel() -> None:
    """From the middle of unequal limits; of constants that cancel the bound keeps what their rounding may be."""
    plant = PlantModel(2.0, (), (), 0.0, 0, (), (5.0,))
    wave = 3.0 / abs(complex(plant(1j)))
    assert sinusoid(3.0, 1.0, 0.0, 4.0).required(plant, 1.5).value == pytest.approx(wave + 0.5)
    assert sinusoid(3.0, 1.0, 0.0, 4.0).required(plant, 3.0).value == pytest.approx(wave + 1.0)
    found = Reference((1e12, 1.0), (0.0, 1.0), (math.pi / 6, 0.0), -5e11).required(plant)
    assert found.at_most - found.value > 1e-5


def test_no_error_is_forced_from_the_true_peak_on() -> None:
    """The peak is 7 % and more below the sum of the amplitudes; what a linear program would leave open there is 0."""
    reference = Reference((50.0, 20.0), (1.5, 4.5), (math.pi / 2, math.pi / 2), 0.0)
    found = reference.required(PLANT)
    each = sum(a / abs(complex(PLANT(1j * w))) for a, w in zip(reference.amplitudes, reference.omegas, strict=True))
    assert found.at_most < 0.93 * each
    assert periodic_limit(PLANT, reference, found.at_most) == Interval(0.0, 0.0)
    below = periodic_limit(PLANT, reference, 0.93 * found.value)
    assert 0 < below.lower < below.upper


@pytest.mark.parametrize(
    ("plant", "level"),
    [
        (PlantModel(5.0, (), (), 0.02, 0, (), (3.0,)), 1.5),
        (PlantModel(5.0, (), (), 0.02, 1, (-20.0,), (10.0, 30.0)), 1.5),
        (PlantModel(5.0, (), (Mode(60.0, 0.05),), 0.02, 2), 1.5),
        (PlantModel(50.0, (), (Mode(10.0, 0.3),), 0.01, -1), 0.0),
    ],
)
def test_the_control_of_a_loop_settles_at_it(plant: PlantModel, level: float) -> None:
    """Around plants with 0, 1 and 2 integrators, a zero at s = 0 and one in the right half plane."""
    bound = AdditiveBound(0.1 * abs(complex(plant(20j))), (), (), (), (100.0,))
    omegas = (0.0, 4.0) if level else (4.0,)
    design = design_extended(IdentifiedModel(plant, bound), omegas)
    amplitudes, phases = ((0.5, 2.0), (math.pi / 2, 0.3)) if level else ((2.0,), (0.3,))
    reference = Reference(amplitudes, omegas, phases, 2 * level / 3)
    time_s = np.linspace(0.0, 30.0, 1501)
    run = simulate(design_loop(design, reference, None), (-np.inf, np.inf), time_s)
    late = time_s > 25
    settled = steady_control(reference, plant, time_s)[late]
    np.testing.assert_allclose(run.control[late], settled, atol=1e-8 * np.abs(settled).max())
    assert np.abs(settled).max() == pytest.approx(reference.required(plant).value, rel=1e-3)
