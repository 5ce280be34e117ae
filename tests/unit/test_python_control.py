"""Plants, bounds, blocks, responses and runs as python-control's objects, and back."""

from __future__ import annotations

from dataclasses import replace

import control
import numpy as np
import pytest

from design.blocks.block import Block
from design.design_file import Design
from experiments.engine.simulate import simulate
from experiments.runs.design_loop import design_loop
from experiments.runs.references import sinusoid
from identification.base.errors import InputError
from identification.model.additive_bound import AdditiveBound
from identification.model.modes import Mode
from identification.model.plant import PlantModel
from identification.sweeps.response import FrequencyResponse

PLANT = PlantModel(-3.0, (Mode(20.0, 0.1),), (Mode(30.0, 0.02), Mode(50.0, 1.5)), 0.02, 2, (7.0,), (40.0, 90.0))
BOUND = AdditiveBound(0.3, (Mode(9.0, 0.4),), (Mode(12.0, 0.1),), (2.0,), (5.0,))
OMEGA = np.geomspace(0.1, 1e3, 40)


def test_a_plant_goes_there_and_back() -> None:
    system = PLANT.to_control()
    assert "without its dead time" in system.name
    np.testing.assert_allclose(system(1j * OMEGA), PLANT.without_delay()(1j * OMEGA), rtol=1e-9)
    back = PlantModel.from_control(system, PLANT.delay_s)
    assert (back.integrators, len(back.zero_modes), len(back.pole_modes)) == (2, 1, 1)  # zeta = 1.5 are real poles
    np.testing.assert_allclose(back(1j * OMEGA), PLANT(1j * OMEGA), rtol=1e-9)
    assert replace(PLANT, delay_s=0.0).to_control().name == "P"


def test_the_dead_time_by_pade_on_request() -> None:
    slow = OMEGA[1 / PLANT.delay_s > OMEGA]
    np.testing.assert_allclose(PLANT.to_control(pade_order=5)(1j * slow), PLANT(1j * slow), rtol=1e-9)
    with pytest.raises(InputError, match="the order of the Pade approximation is -1"):
        PLANT.to_control(pade_order=-1)


def test_a_bound_and_a_block_go_there_and_back() -> None:
    back = AdditiveBound.from_control(BOUND.to_control())
    np.testing.assert_allclose(back(1j * OMEGA), BOUND(1j * OMEGA), rtol=1e-9)
    block = Block(2.0, (1 + 2j, 1 - 2j), (-3.0, 4.0), 0.5)
    np.testing.assert_allclose(Block.from_control(block.to_control(), 0.5)(1j * OMEGA), block(1j * OMEGA), rtol=1e-9)


@pytest.mark.parametrize("seed", range(20))
def test_state_spaces_in_any_coordinates_keep_their_integrator(seed: int) -> None:
    """1/s + 1/(s + 1) + 1/(s + 3): rounding moves the pole at 0, which is said and not taken for another plant."""
    A, b, c = np.diag([0.0, -1.0, -3.0]), np.ones((3, 1)), np.ones((1, 3))
    T = np.random.default_rng(seed).standard_normal((3, 3))
    system = control.ss(np.linalg.solve(T, A @ T), np.linalg.solve(T, b), c @ T, 0.0)
    expected = control.ss(A, b, c, 0.0)(1j * OMEGA)
    found = PlantModel.from_control(system, integrators=1)
    assert (found.integrators, len(found.real_zeros) + 2 * len(found.zero_modes)) == (1, 2)
    np.testing.assert_allclose(found(1j * OMEGA), expected, rtol=1e-6)
    try:
        said = str(PlantModel.from_control(system).integrators)
    except InputError as error:
        said = str(error)
    assert said == "1" or said.endswith("which says how many are at s = 0")


def test_a_pole_in_the_right_half_plane_comes_along() -> None:
    system = control.tf([2.0], [1.0, 1.0, -6.0])  # 2/((s + 3) (s - 2))
    found = PlantModel.from_control(system)
    assert sorted(found.real_poles) == pytest.approx([-2.0, 3.0])
    np.testing.assert_allclose(found(1j * OMEGA), system(1j * OMEGA), rtol=1e-12)


@pytest.mark.parametrize(
    ("system", "part"),
    [
        (control.tf([1.0], [1.0, 0.0, 4.0]), "zeta is"),
        (control.tf([1.0], [1.0, 0.5], 0.1), "of discrete time, dt = 0.1"),
        (control.ss([[-1.0]], [[1.0, 1.0]], [[1.0]], [[0.0, 0.0]]), "2 inputs and 1 outputs"),
        (control.tf([0.0], [1.0, 1.0]), "is 0 or not finite"),
        ("P", "the system is a str; expected a transfer function"),
    ],
)
def test_what_is_no_plant_is_refused(system: object, part: str) -> None:
    with pytest.raises(InputError, match=part):
        PlantModel.from_control(system)


def test_a_response_goes_there_and_back() -> None:
    test = FrequencyResponse(OMEGA, PLANT(1j * OMEGA), None, "mine")
    data = test.to_control()
    np.testing.assert_array_equal(data(1j * OMEGA[3]), test.response[3])
    back = FrequencyResponse.from_control(data)
    np.testing.assert_array_equal(back.response, test.response)
    assert back.name == "mine"
    assert replace(test, name="sweep.csv").to_control().name == "sweep_csv"
    for omega, response, said in (
        (OMEGA[::-1], test.response, "increasing"),
        (OMEGA, test.response[:3], "shapes"),
        (OMEGA, np.nan * test.response, "not finite"),
        ([], [], "equal lengths of at least 1"),
    ):
        with pytest.raises(InputError, match=said):
            FrequencyResponse(omega, response, None, "mine")


def test_a_run_is_a_time_response(extended_design: Design) -> None:
    loop = design_loop(extended_design, sinusoid(50.0, 1.5, 1.0, 0.0), extended_design.compensator("corrected"))
    run = simulate(loop, (-12.0, 12.0), np.linspace(0.0, 1.0, 101))
    response = run.to_control()
    np.testing.assert_array_equal(response.outputs[response.output_labels.index("output")], run.outputs["output"])
    np.testing.assert_array_equal(response.inputs[0], run.saturated_control)
    np.testing.assert_array_equal(response.time, run.time_s)


def test_zeros_at_the_origin_come_back_from_a_state_space() -> None:
    """Rounding moves a double zero off s = 0; it is said, and the number of zeros can be given."""
    plant = PlantModel(1e-3, (), (Mode(200.0, 0.03),), 0.0, -2)
    system = control.ss(plant.to_control())
    back = PlantModel.from_control(system, integrators=-2)
    assert back.integrators == -2
    s = 1j * np.geomspace(1.0, 1e3, 20)
    np.testing.assert_allclose(back(s), plant(s), rtol=1e-6)
