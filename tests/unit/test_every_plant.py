"""Extended designs of the whole class: what T is at the points, internal stability, the level, units, refusals."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from design.blocks.block import plant_block
from design.chapters_3_4.design_extended import design_extended
from design.chapters_3_4.tracking import outer_part, tracking_conditions
from design.design_file import Design, read_design
from design.stability.characteristic_roots import roots_right_of
from design.stability.margins import delay_loop
from experiments.drive.sampled_loop import Drive, simulate_sampled
from experiments.engine.pade import with_pade
from experiments.engine.simulate import simulate
from experiments.runs.design_loop import design_loop
from experiments.runs.references import sinusoid
from experiments.runs.region import require_within_region
from experiments.runs.simulate_design import simulate_design
from identification.base.errors import InputError
from identification.model.additive_bound import AdditiveBound
from identification.model.model_file import IdentifiedModel
from identification.model.modes import Mode
from identification.model.plant import PlantModel


def random_plant(random: np.random.Generator) -> PlantModel:
    """Any number of roots of every kind but in the right half plane, where there may be one zero."""
    scale = 10.0 ** random.uniform(-2, 3)
    integrators = int(random.integers(0, 3))
    modes = [
        Mode(scale * 10.0 ** random.uniform(0, 1.5), 10.0 ** random.uniform(-2, -0.5))
        for _ in range(random.integers(0, 5))
    ]
    poles = [scale * 10.0 ** random.uniform(-1, 1) for _ in range(random.integers(1, 4))]
    zeros = [scale * 10.0 ** random.uniform(0, 1) for _ in range(random.integers(0, 2))]
    if random.random() < 0.4:
        zeros.append(-scale * 10.0 ** random.uniform(0.5, 1.5))
    half = len(modes) // 2
    return PlantModel(
        10.0 ** random.uniform(-3, 3) * random.choice([-1, 1]),
        tuple(modes[:half]),
        tuple(modes[half:]),
        10.0 ** random.uniform(-2, -0.5) / scale,
        integrators,
        tuple(zeros[: integrators + len(poles) + 2 * (len(modes) - 2 * half) - 1]),
        tuple(poles),
    )


def bound_of(plant: PlantModel, omega: float, share: float = 0.05) -> AdditiveBound:
    """A W_a that is a share of the plant's size around a frequency, and has a resonance ten times above it."""
    size = share * float(np.abs(plant(1j * omega * np.array([0.01, 1.0, 2.7]))).min())
    return AdditiveBound.printed_form(size, 3 * omega, 10 * omega, 0.3)


@pytest.fixture(scope="module", params=range(16))
def design(request: pytest.FixtureRequest) -> Design:
    random = np.random.default_rng(request.param)
    plant = random_plant(random)
    slowest = min((abs(root) for root in plant_block(plant).poles if root), default=1 / plant.delay_s)
    omega = slowest * 10.0 ** random.uniform(-0.7, 0.3)
    omegas = [omega] if random.random() < 0.6 else [omega, 2.7 * omega]
    return design_extended(IdentifiedModel(plant, bound_of(plant, omega)), omegas)


def test_every_plant_has_a_stable_loop_that_tracks(design: Design) -> None:
    plant, wanted = design.plant, tracking_conditions(design.plant, design.reference_omegas)
    K, T_so, T_si = (design.blocks[name] for name in ("K", "T_so", "T_si"))
    assert T_so.is_stable
    assert K.is_stable
    assert K.relative_degree >= 0
    for omega in wanted.omegas:
        assert complex(T_so(1j * omega) * T_si(1j * omega)) == pytest.approx(1.0, abs=1e-9)
    # 1 - T vanishes at s = 0 once more than the plant has poles there, as a difference of orders of s
    small = 1e-3 * min(abs(pole) for pole in T_so.poles + plant_block(plant).poles if pole)
    left = np.abs(1 - T_so(np.array([small, small / 2])) * T_si(np.array([small, small / 2])))
    assert math.log2(left[0] / left[1]) == pytest.approx(plant.integrators + 1, abs=0.05)
    # the poles of the loop, by the argument principle
    assert roots_right_of(delay_loop(design, plant), 0.0) == 0
    # C S = K on the axis, from C
    omega = np.geomspace(1e-2, 1e3, 400) * wanted.omegas[0]
    s = 1j * omega
    C = K(s) / (1 - T_so(s) * T_si(s))
    C_S = C / (1 + plant(s) * C)
    assert np.abs(design.additive_bound(s) * C_S).max() <= design.free.roll_off.level * (1 + 1e-6)


def test_it_follows_in_time(design: Design) -> None:
    omega = design.reference_omegas[0]
    until = 25 / design.free.pace + 4 * math.pi / omega
    run = simulate_design(design, math.inf, sinusoid(1.0, omega), None, until_s=until)
    last = np.abs(run.outputs["error"][run.time_s > until - math.pi / omega])
    assert last.max() < 1e-4


@pytest.mark.parametrize("time", [1e-3, 1e4])
def test_another_unit_of_time_is_the_same_design(time: float) -> None:
    random = np.random.default_rng(5)
    plant = random_plant(random)
    bound = bound_of(plant, 1.0)
    other = PlantModel(
        plant.gain / time**plant.integrators,
        tuple(Mode(mode.omega / time, mode.zeta) for mode in plant.zero_modes),
        tuple(Mode(mode.omega / time, mode.zeta) for mode in plant.pole_modes),
        plant.delay_s * time,
        plant.integrators,
        tuple(rate / time for rate in plant.real_zeros),
        tuple(rate / time for rate in plant.real_poles),
    )
    slower = AdditiveBound.printed_form(bound.gain, bound.corner / time, 10.0 / time, 0.3)
    own, theirs = (
        design_extended(IdentifiedModel(*each), [omega]).free
        for each, omega in (((plant, bound), 1.0), ((other, slower), 1.0 / time))
    )
    assert theirs.a * time == pytest.approx(own.a, rel=1e-9)
    assert theirs.roll_off.order == own.roll_off.order
    assert theirs.roll_off.rate * time == pytest.approx(own.roll_off.rate, rel=2e-3)


def test_an_unstable_pole_is_held() -> None:
    """T = 1 at the pole, and the loop has no root in the right half plane."""
    plant = PlantModel(2.0, (), (), 0.05, 0, real_poles=(3.0, -1.0))
    design = design_extended(IdentifiedModel(plant, bound_of(plant, 2.0, 0.005)), [0.5])
    assert complex(design.blocks["T_so"](1.0) * design.blocks["T_si"](1.0)) == pytest.approx(1.0, rel=1e-12)
    assert roots_right_of(delay_loop(design, plant), 0.0) == 0
    run = simulate_design(design, math.inf, sinusoid(1.0, 0.5), None, until_s=14 / design.free.pace)
    assert np.abs(run.outputs["error"][-100:]).max() < 1e-3


def test_a_reference_beyond_the_region_of_an_unstable_plant_is_refused() -> None:
    plant = PlantModel(2.0, (), (), 0.05, 0, real_poles=(3.0, -1.0))
    design = design_extended(IdentifiedModel(plant, bound_of(plant, 2.0, 0.005)), [0.5])
    needed = 1 / abs(complex(plant.without_delay()(0.5j)))
    border = needed / abs(0.5j - 1)  # z' = z + u
    with pytest.raises(InputError, match=r"a pole at 1\+0j rad/s in the right half plane, .* 1.25 times the largest"):
        simulate_design(design, 0.8 * border, sinusoid(1.0, 0.5), until_s=8.0)
    require_within_region(plant, sinusoid(1.0, 0.5), (-1.01 * border, 1.01 * border))
    require_within_region(plant, sinusoid(0.0, 0.5, offset=10.0), (-1.0, 5.1))  # u = 5, whatever the other limit
    with pytest.raises(InputError, match=r"times the largest that the limits -1 to 4.9"):
        require_within_region(plant, sinusoid(0.0, 0.5, offset=10.0), (-1.0, 4.9))
    with pytest.raises(InputError, match=r"the run lasts 26 s; expected at most 25 s"):
        simulate_design(design, 3 * needed, sinusoid(1.0, 0.5), until_s=26.0)
    assert simulate_design(design, 3 * needed, sinusoid(1.0, 0.5), until_s=8.0).time_s[-1] == 8.0


def test_without_integral_action_where_the_model_is_not_known_at_rest() -> None:
    """|W_a/P| is above the level at s = 0 alone: the sinusoid is followed, and the design says what it does without."""
    plant = PlantModel(1.0, (), (Mode(30.0, 0.05),), 0.01, 0)
    bound = AdditiveBound(0.8, (), (), (500.0,), (1.0, 2000.0))
    design = design_extended(IdentifiedModel(plant, bound), [3.0])
    assert any("no integral action" in reason for reason in design.free.reasons)
    assert complex(design.blocks["T_so"](3j) * design.blocks["T_si"](3j)) == pytest.approx(1.0, rel=1e-9)
    with pytest.raises(
        InputError, match=r"\|W_a/P\| = 0.8 at 0 rad/s.*a level above that, or a tighter W_a, .*another frequency"
    ):
        design_extended(IdentifiedModel(plant, bound), [0.0, 3.0])


@pytest.mark.parametrize(
    ("plant", "omegas", "sentence"),
    [
        (PlantModel(1.0, (), (Mode(9.0, 0.1),), 0.01, -1), [0.0], r"zero\(s\) at s = 0, .* no bounded control holds"),
        (PlantModel(1.0, (), (), 0.01), [], "none rad/s; expected one or more"),
        (PlantModel(1.0, (), (), 0.01), [2.0, 2.0], "expected each once"),
        (PlantModel(1.0, (), (), 0.01), [-2.0], "none negative"),
    ],
)
def test_what_no_controller_follows_is_refused(plant: PlantModel, omegas: list[float], sentence: str) -> None:
    with pytest.raises(InputError, match=sentence):
        design_extended(IdentifiedModel(plant, bound_of(plant, 2.0, 0.01)), omegas)


def test_far_apart_frequencies_lose_nothing() -> None:
    """Interpolation over six decades: a Vandermonde matrix in doubles would lose all its digits."""
    wanted = tracking_conditions(PlantModel(1.0, (), (), 1e-3, 2, real_zeros=(-3e3,)), (1e-2, 1.0, 1e2, 1e4))
    T_so = outer_part(wanted, (complex(-20.0),) * wanted.count + (complex(-500.0),) * 2)
    for omega in wanted.omegas:
        assert complex(T_so(1j * omega) * wanted.T_si(1j * omega)) == pytest.approx(1.0, abs=1e-7)


def test_reasons_and_inner_factor_survive_the_file(design: Design, tmp_path) -> None:  # type: ignore[no-untyped-def]
    path = tmp_path / "design.json"
    path.write_text(design.to_json())
    again = read_design(path)
    assert again.free.reasons == design.free.reasons != ()
    assert again.controller_parts() == design.controller_parts()
    changed = dataclasses.replace(again, plant=dataclasses.replace(again.plant, gain=again.plant.gain * 2))
    assert changed.controller_parts()[1] == design.controller_parts()[1]


@pytest.mark.parametrize("delay_s", [0.02, 0.0])
@pytest.mark.parametrize("kind", ["none", "corrected"])
def test_a_plant_that_jumps_with_its_input_runs_like_its_sampled_loop(delay_s: float, kind: str) -> None:
    """With as many zeros as poles y and y_d have a direct part; the computer shares no code with the engine."""
    plant = PlantModel(5.0, (), (), delay_s, 0, (40.0,), (3.0,))
    design = design_extended(IdentifiedModel(plant, bound_of(plant, 2.0)), [2.0])
    reference = sinusoid(1.0, 2.0)
    limit = 0.8 * reference.required(plant).value
    run = simulate_design(design, limit, reference, kind, until_s=5.0, samples=1001)
    assert len(run.events_s) > 4
    apart = []
    for rate in (800.0, 3200.0):
        drive = Drive(rate, "tustin", (-limit, limit))
        sampled = simulate_sampled(design, reference, kind, drive, 5.0)
        apart.append(np.abs(sampled.output[:: round(rate / 200)] - run.outputs["output"]).max())
    assert apart[1] < apart[0] / 3 < 0.01


def test_pades_approximation_of_a_plant_that_jumps_with_its_input_tends_to_its_dead_time() -> None:
    plant = PlantModel(5.0, (), (), 0.02, 0, (40.0,), (3.0,))
    design = design_extended(IdentifiedModel(plant, bound_of(plant, 2.0)), [2.0])
    reference = sinusoid(1.0, 2.0)
    loop, limit = design_loop(design, reference, "corrected"), 0.9 * reference.required(plant).value
    time_s = np.linspace(0.0, 6.0, 601)
    exact = simulate(loop, (-limit, limit), time_s).outputs["output"]
    apart = [
        np.abs(simulate(with_pade(loop, order), (-limit, limit), time_s).outputs["output"] - exact).max()
        for order in (1, 3, 6)
    ]
    assert apart[0] > 2 * apart[1] > 2.5 * apart[2]
    assert apart[2] < 1e-3


@pytest.mark.parametrize("seed", [1002, 1149])
def test_where_the_fine_grid_shows_more_than_the_coarse_one_the_design_says_so(seed: int) -> None:
    random = np.random.default_rng(seed)
    plant = random_plant(random)
    slowest = min(abs(root) for root in plant_block(plant).poles if root)
    omega = slowest * 10.0 ** random.uniform(-0.7, 0.3)
    omegas = [omega] if random.random() < 0.6 else [omega, 2.7 * omega]
    omegas = [0.0, *omegas] if random.random() < 0.15 else omegas
    bound = bound_of(plant, omega, 10.0 ** random.uniform(-3, -0.8))
    design = design_extended(IdentifiedModel(plant, bound), omegas)
    said = next(reason for reason in design.free.reasons if "was tried keeps it smaller" in reason)
    T_so, T_si = design.blocks["T_so"], design.blocks["T_si"]
    s = 1j * omega * np.geomspace(1e-2, 1e3, 200_001)
    assert np.abs(1 - T_so(s) * T_si(s)).max() == pytest.approx(float(said.split()[2]), rel=0.01)
