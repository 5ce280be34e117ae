"""Exported C: equal to the sampled loop to the last bit, a start without a bump, what is not finite, names."""

from __future__ import annotations

import ctypes
import dataclasses
import math
import shutil
import subprocess
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from compiled_controller import Compiled, compiler, self_test
from scipy.signal import cont2discrete, zpk2ss

from design.blocks.block import Block, plant_block
from design.chapters_3_4.design_extended import design_extended
from design.design_file import Design
from experiments.drive.sampled_loop import Drive, SampledRun, simulate_sampled
from experiments.export import c_code
from experiments.export.check_run import check_run, commands
from experiments.export.controller import SampledController, sampled_controller
from experiments.runs.references import SampledReference
from identification.base.errors import InputError
from identification.model.additive_bound import AdditiveBound
from identification.model.model_file import IdentifiedModel
from identification.model.modes import Mode
from identification.model.plant import PlantModel
from identification.model.signals import Signals

PLANTS = {
    "one integrator, a share of a sample": (PlantModel(3.0, (Mode(300.0, 0.05),), (Mode(450.0, 0.02),), 4.3e-3), 3.0),
    "none, no dead time, a zero to the right": (PlantModel(2.0, (), (), 0.0, 0, (-90.0,), (20.0, 60.0)), 0.0),
    "two integrators, whole samples": (PlantModel(200.0, (), (Mode(150.0, 0.02),), 12e-3, 2, (), (900.0,)), 2.0),
    "none, whole samples": (PlantModel(-2.0, (), (Mode(150.0, 0.1),), 10e-3, 0, (), (30.0,)), 0.0),
}
CASES = [
    ("one integrator, a share of a sample", 2000.0, "tustin", "corrected", (-3.0, 2.0)),
    ("one integrator, a share of a sample", 1700.0, "matched", "corrected", (-2.0, 2.0)),
    ("none, no dead time, a zero to the right", 1500.0, "tustin", "corrected", (-math.inf, 1.0)),
    ("none, no dead time, a zero to the right", 1500.0, "exact", "internal-model", (0.0, 1.0)),
    ("two integrators, whole samples", 1000.0, "tustin", "corrected", (-0.5, 0.7)),
    ("two integrators, whole samples", 1000.0, "matched", "corrected", (-0.5, 0.7)),
    ("none, whole samples", 300.0, "matched", "none", (-2.0, 1.5)),
    ("chapter 2", 2000.0, "tustin", "corrected", (-12.0, 9.0)),
]


@cache
def designed(name: str) -> Design:
    plant, omega = PLANTS[name]
    near = omega or 2.0
    size = 0.05 * float(np.abs(plant(1j * near * np.array([0.01, 1.0, 2.7]))).min())
    bound = AdditiveBound.printed_form(size, 3 * near, 10 * near, 0.3)
    return design_extended(IdentifiedModel(plant, bound), [omega])


@dataclass(frozen=True)
class Case:
    design: Design
    controller: SampledController
    compiled: Compiled


@pytest.fixture(scope="module", params=CASES, ids=lambda case: " ".join(map(str, case)))
def case(request: pytest.FixtureRequest, delay_free_design: Design, tmp_path_factory: pytest.TempPathFactory) -> Case:
    name, rate_hz, method, anti_windup, limits = request.param
    design = delay_free_design if name == "chapter 2" else designed(name)
    controller = sampled_controller(design, anti_windup, limits, rate_hz, method, "axis")
    files = c_code.files(controller, check_run(design, controller))
    return Case(design, controller, Compiled(files, "axis", tmp_path_factory.mktemp("axis")))


def asked_run(case: Case, samples: int = 1500) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Reference, measurement and control of a run under random steps that saturate, with a rounding actuator."""
    controller, random = case.controller, np.random.default_rng(7)
    far = max(abs(limit) for limit in controller.limits if math.isfinite(limit))
    times = np.repeat(np.arange(0, samples, 40) / controller.rate_hz, 2)[1:-1]
    values = np.repeat(random.normal(size=len(times) // 2), 2)

    def run(size: float, limits: tuple[float, float], quantum: float) -> SampledRun:
        drive = Drive(controller.rate_hz, controller.method, limits, quantum)
        asked, until_s = SampledReference(times, size * values), samples / controller.rate_hz
        return simulate_sampled(case.design, asked, controller.anti_windup, drive, until_s)

    linear = np.abs(run(1.0, (-math.inf, math.inf), 0.0).control).max()
    found = run(4 * far / linear, controller.limits, far / 64)
    low, high = controller.limits
    assert np.any((found.control < low) | (found.control > high))
    return found.reference, found.output, found.control


def test_it_equals_the_sampled_loop_to_the_last_bit(case: Case) -> None:
    case.compiled.rest()
    reference, measurement, control = asked_run(case)
    for r, y, u in zip(reference, measurement, control, strict=True):
        command = case.compiled.step(r, y)
        assert command == min(max(u, case.controller.limits[0]), case.controller.limits[1])
        assert case.compiled.logged == (u, 0)


def test_it_does_so_where_states_decay_below_the_normal_numbers(case: Case) -> None:
    controller, random = case.controller, np.random.default_rng(3)
    assert controller.limits[0] <= 0 <= controller.limits[1]
    times = np.arange(0, 800, 40) / controller.rate_hz
    asked = SampledReference(np.repeat(times, 2)[1:-1], 1e-307 * np.repeat(random.normal(size=len(times) - 1), 2))
    drive = Drive(controller.rate_hz, controller.method, controller.limits)
    found = simulate_sampled(case.design, asked, controller.anti_windup, drive, 800 / controller.rate_hz)
    assert np.abs(found.control).max() > 0
    case.compiled.rest()
    for r, y, u in zip(found.reference, found.output, found.control, strict=True):
        case.compiled.step(r, y)
        assert case.compiled.logged == (u, 0)


def test_its_own_test_passes_under_sanitizers(extended_design: Design, tmp_path: Path) -> None:
    """And fails where the last bit of one number is another."""
    controller = sampled_controller(extended_design, "corrected", (-12.0, 10.0), 2000.0, "tustin", "axis")
    run = check_run(extended_design, controller)
    assert run.control.max() > 10
    assert run.control.min() < -12
    files = c_code.files(controller, run)
    said = self_test(files, "axis", tmp_path)
    assert said.startswith("axis: 1000 samples")
    right = repr(float(controller.forward.d[0]))
    assert right in files["axis.c"]
    wrong = files["axis.c"].replace(right, repr(float(np.nextafter(controller.forward.d[0], 1.0))))
    with pytest.raises(subprocess.CalledProcessError):
        self_test({**files, "axis.c": wrong}, "axis", tmp_path)


def test_a_float_takes_the_steps_that_its_difference_was_found_with(extended_design: Design, tmp_path: Path) -> None:
    controller = sampled_controller(extended_design, "corrected", (-12.0, 10.0), 2000.0, "exact", "axis")
    files = c_code.files(controller, check_run(extended_design, controller), "float")
    case = Case(extended_design, controller, Compiled(files, "axis", tmp_path, ctypes.c_float))
    reference, measurement, control = asked_run(case, 400)
    own, _ = commands(controller, reference, measurement, np.float32)
    for r, y, u in zip(reference, measurement, own, strict=True):
        case.compiled.step(r, y)
        assert case.compiled.logged == (u, 0)
    np.testing.assert_allclose(own, control, rtol=0, atol=1e-4 * np.abs(control).max())
    assert np.abs(own - control).max() > 0


def test_what_no_float_holds_and_what_no_int_counts_to_is_refused(extended_design: Design) -> None:
    controller = sampled_controller(extended_design, "corrected", (-1e39, 1e39), 2000.0, "tustin", "axis")
    with pytest.raises(InputError, match=r"number -1e\+39, which no float holds"):
        c_code.files(controller, check_run(extended_design, controller), "float")
    controller = dataclasses.replace(controller, limits=(-1e-50, 1.0))
    with pytest.raises(InputError, match="limit -1e-50, which no float holds"):
        c_code.files(controller, check_run(extended_design, controller), "float")
    vanishing = dataclasses.replace(
        controller, limits=(-1.0, 1.0), forward=controller.forward._replace(b=controller.forward.b * 1e-60)
    )
    vanishing = dataclasses.replace(vanishing, forward=vanishing.forward._replace(C=controller.forward.C * 1e60))
    with pytest.raises(InputError, match=r"which no float holds|in floats the controller is another"):
        c_code.files(vanishing, check_run(extended_design, vanishing), "float")
    slow = dataclasses.replace(extended_design, plant=dataclasses.replace(extended_design.plant, delay_s=0.4))
    with pytest.raises(InputError, match="the dead time is 40000 samples long; expected at most 32760"):
        sampled_controller(slow, "corrected", (-1.0, 1.0), 1e5, "tustin", "axis")


def test_limits_that_no_run_reaches_leave_a_test_within_them(extended_design: Design) -> None:
    """With one such limit the test goes beyond the other."""
    for limits, saturates in (((-1e300, 1e300), False), ((-math.inf, math.inf), False), ((-1e300, 2.0), True)):
        controller = sampled_controller(extended_design, "corrected", limits, 2000.0, "tustin", "axis")
        run = check_run(extended_design, controller)
        assert run.saturates == saturates
        assert run.saturates == (run.control.max() > limits[1])


# The start


def held_steps(plant: PlantModel, T: float, at_rest: float) -> tuple[np.ndarray, np.ndarray, np.ndarray, list[float]]:
    """The plant's difference equations by scipy, its state at rest under a command, and the commands on their way."""
    block = plant_block(plant).without_delay()
    A, B, C, _, _ = cont2discrete(zpk2ss(block.zeros, block.poles, block.gain), T)
    x = np.linalg.solve(np.eye(len(A)) - A, B[:, 0] * at_rest) if not plant.integrators else np.zeros(len(A))
    return A, B[:, 0], np.append(C[0], x), [at_rest] * round(plant.delay_s / T)


@pytest.mark.parametrize(
    ("method", "rate_hz", "applied", "precision"),
    [("tustin", 1000.0, 0.7, "double"), ("exact", 5000.0, -1.1, "double"), ("tustin", 2000.0, 1.2, "float")],
)
def test_a_start_without_a_bump_then_the_loop_follows(
    method: str, rate_hz: float, applied: float, precision: str, tmp_path: Path
) -> None:
    """From a hand's constant command, the plant at rest under it, to a reference elsewhere."""
    design = designed("none, whole samples")
    controller = sampled_controller(design, "corrected", (-2.0, 1.5), rate_hz, method, "axis")
    number, share = (ctypes.c_double, 1e-12) if precision == "double" else (ctypes.c_float, 1e-5)
    compiled = Compiled(c_code.files(controller, check_run(design, controller), precision), "axis", tmp_path, number)
    A, b, rest, late = held_steps(design.plant, 1 / rate_hz, applied)
    c, x = rest[: len(b)], rest[len(b) :]
    reference = 0.9
    assert compiled.start(reference, float(c @ x), applied) == 1
    sent, seen = [applied], []
    for _ in range(round(6 * rate_hz)):
        seen.append(float(c @ x))
        sent.append(compiled.step(reference, seen[-1]))
        late.append(sent[-1])
        x = A @ x + b * late.pop(0)
    assert sent[1] == pytest.approx(applied, rel=share)
    way = abs(sent[-1] - applied)
    assert np.abs(np.diff(sent)).max() < 0.02 * way
    np.testing.assert_allclose(seen[-10:], reference, rtol=max(share, 1e-6))
    assert sent[-1] == pytest.approx(reference / design.plant.gain, rel=max(share, 1e-6))


def test_the_first_command_is_what_was_applied(case: Case) -> None:
    """Within the limits, from any state; the next ones change little while nothing else does."""
    (low, high), compiled = case.controller.limits, case.compiled
    random = np.random.default_rng(3)
    for _ in range(10):
        for _ in range(30):
            compiled.step(*random.normal(size=2))
        r, y = random.normal(size=2)
        applied = random.uniform(max(low, -1.0), min(high, 1.0))
        assert compiled.start(r, y, applied) == 1
        first, *others = (compiled.step(r, y) for _ in range(5))
        assert first == pytest.approx(applied, rel=1e-9, abs=1e-9)
        assert np.abs(np.array(others) - applied).max() < 0.2 * (abs(applied) + abs(r - y))
    beyond = high + 1 if math.isfinite(high) else low - 1
    compiled.start(0.0, 0.0, beyond)
    assert compiled.step(0.0, 0.0) == pytest.approx(min(max(beyond, low), high), rel=1e-9)


def test_a_controller_without_memory_of_its_error_says_that_it_cannot(extended_design: Design, tmp_path: Path) -> None:
    plant = PlantModel(1.0, (), (), 0.0, 0, (), (5.0,))
    blocks = {**extended_design.blocks, "K": Block(2.0), "T_so": Block(0.0)}
    design = dataclasses.replace(extended_design, plant=plant, blocks=blocks)
    controller = sampled_controller(design, "none", (-5.0, 5.0), 100.0, "exact", "gain")
    files = c_code.files(controller, check_run(design, controller))
    assert "no memory of its error" in files["gain.h"]
    compiled = Compiled(files, "gain", tmp_path)
    assert compiled.start(1.0, 0.0, -1.0) == 1
    assert compiled.step(1.0, 0.0) == 2.0


# What is not finite


def test_what_is_not_finite_leaves_the_state_and_holds_the_command(case: Case) -> None:
    compiled = case.compiled
    compiled.rest()
    reference, measurement, control = asked_run(case, 200)
    last = compiled.step(reference[0], measurement[0])
    for k in range(1, 200):
        if k % 7 == 0:
            bad = (math.nan, math.inf, -math.inf)[k % 3]
            assert compiled.step(bad, measurement[k]) == last
            assert compiled.step(reference[k], bad) == last
            assert compiled.logged[1] == 2
            assert compiled.start(0.0, bad, 0.0) == compiled.start(bad, 0.0, 0.0) == compiled.start(0.0, 0.0, bad) == 0
        last = compiled.step(reference[k], measurement[k])
        assert compiled.logged == (control[k], 0)


# Names, and what the code asks for


def test_names_are_identifiers_and_comments_end_where_they_should(extended_design: Design, tmp_path: Path) -> None:
    signals = Signals("2. Ström*/", "µA /* ??/", "位置", "°")
    controller = sampled_controller(extended_design, "corrected", (-12.0, 10.0), 2000.0, "tustin", "axis")
    controller = dataclasses.replace(controller, signals=signals)
    files = c_code.files(controller, check_run(extended_design, controller))
    Compiled(files, "axis", tmp_path)
    assert "command_2_Strom;" in files["axis.h"]
    assert "double reference_output, double measured_output" in files["axis.h"]
    assert "[°]" in files["axis.h"]


def test_the_code_calls_nothing(extended_design: Design, tmp_path: Path) -> None:
    if shutil.which("nm") is None:
        pytest.skip("no nm")
    controller = sampled_controller(extended_design, "corrected", (-12.0, 10.0), 2000.0, "tustin", "axis")
    for name, text in c_code.files(controller, check_run(extended_design, controller)).items():
        (tmp_path / name).write_text(text)
    subprocess.run([compiler(), "-std=c99", "-O1", "-c", "axis.c"], cwd=tmp_path, check=True)
    found = subprocess.run(["nm", "-u", "axis.o"], cwd=tmp_path, check=True, capture_output=True, text=True).stdout
    assert not found.strip()
    assert "#include <" not in (tmp_path / "axis.c").read_text() + (tmp_path / "axis.h").read_text()
