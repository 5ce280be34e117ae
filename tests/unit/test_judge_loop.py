"""The judgement of a sampled loop without a run: its closed-loop poles and its steady error, by other means."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.signal import zpk2ss
from test_coprime_form import BOUND, PLANTS, design_of

from design.blocks.block import plant_block
from design.chapters_3_4.design_extended import design_extended
from design.design_file import Design
from experiments.drive.choose_method import choose_method, judge_methods, least_rate
from experiments.drive.difference_equations import SampledBlock
from experiments.drive.judge_loop import LoopJudgement, judge_loop
from experiments.drive.sampled_loop import METHODS, Drive, controller_blocks, simulate_sampled
from experiments.runs.references import sinusoid
from identification.base.errors import InputError
from identification.model.model_file import IdentifiedModel
from identification.model.modes import Mode
from identification.model.plant import PlantModel

FREE = (-math.inf, math.inf)


def steps_of(block: SampledBlock) -> tuple[int, object]:
    """How many numbers a block keeps from sample to sample, and what it makes of them and of its input."""
    n, m = len(block.b), len(block.d)
    length = int((block.first + block.length).max())

    def step(kept: np.ndarray, given: float | None) -> tuple[float, np.ndarray]:
        """The sum of the outputs without what comes of the input at once; and the numbers kept for the next sample."""
        x, past = kept[:n], kept[n:].reshape(m, length)
        p = block.C @ x + block.d * (given or 0.0)
        held = np.column_stack([p, past])
        out = sum(block.taps[o, j] * held[o, block.first[o] + j] for o in range(m) for j in range(block.length[o]))
        return float(out), np.append(block.A @ x + block.b * (given or 0.0), held[:, :length].ravel())

    return n + m * length, step


def spectral_radius(design: Design, drive: Drive, plant: PlantModel) -> float:
    """Of the matrix that carries all numbers of the loop from sample to sample, built by running it from each."""
    forward, feedback, _, around = controller_blocks(design, None, drive, "coprime")
    T, late = 1 / drive.rate_hz, (plant.delay_s + drive.input_delay_s) * drive.rate_hz
    P = plant_block(plant)
    A, b, c, d = zpk2ss(P.zeros, P.poles, P.gain)
    n, whole = len(A), math.floor(late + 1e-9)
    rest = max(late - whole, 0.0)
    full, part = (expm(np.block([[A, b], [np.zeros((1, n + 1))]]) * t) for t in (T, (1 - rest) * T))
    sizes = [steps_of(forward), steps_of(feedback)]
    N_K, N_F = sizes[0][0], sizes[1][0]
    total = N_K + N_F + n + whole + 1

    def advanced(state: np.ndarray) -> np.ndarray:
        kept_K, kept_F, x, commands = np.split(state, np.cumsum([N_K, N_F, n]))
        # the plant's state at the sample is that after the command issued whole + 1 samples ago stood for 1 - rest
        y = commands[-1] * float(d[0, 0]) + float((c @ (part[:n, :n] @ x + part[:n, n] * commands[-1]))[0])
        v = (sizes[0][1](kept_K, -y)[0] + sizes[1][1](kept_F, None)[0]) / (1 - around)
        _, new_K = sizes[0][1](kept_K, -y)
        _, new_F = sizes[1][1](kept_F, v)
        new_x = full[:n, :n] @ x + full[:n, n] * commands[-1]
        return np.concatenate([new_K, new_F, new_x, [v], commands[:-1]])

    return float(np.abs(np.linalg.eigvals(np.column_stack([advanced(row) for row in np.eye(total)]))).max())


@pytest.mark.parametrize("name", PLANTS)
def test_stable_is_what_the_closed_loop_poles_say(name: str) -> None:
    """At random rates, input delays and true plants, with all methods: the loops are often unstable."""
    random, design, seen = np.random.default_rng(len(name)), design_of(PLANTS[name]), []
    for _ in range(2):
        rate, delay = float(10 ** random.uniform(0.3, 1.3)), float(random.choice([0.0, 0.01]))
        off = design.plant.__class__(
            design.plant.gain * random.uniform(0.7, 1.6),
            design.plant.zero_modes,
            tuple(Mode(mode.omega * random.uniform(0.9, 1.1), mode.zeta) for mode in design.plant.pole_modes),
            design.plant.delay_s * random.uniform(0.5, 1.5),
            design.plant.integrators,
            design.plant.real_zeros,
            design.plant.real_poles,
        )
        for method in METHODS:
            for plant in (design.plant, off):
                drive = Drive(rate, method, FREE, input_delay_s=delay)
                found = judge_loop(design, drive, plant)
                if not found.refused:
                    radius = spectral_radius(design, drive, plant)
                    assert found.stable == (radius < 1), (method, rate, delay, radius)
                    seen.append(found.stable)
    assert True in seen


@pytest.mark.parametrize("method", METHODS)
def test_the_steady_error_is_that_of_a_long_run(method: str) -> None:
    design = design_of(PLANTS["two integrators"])
    drive = Drive(20.0, method, FREE)
    true = PlantModel(2.1, (), (), 0.05, 2)
    for omega in (1.5, 2.2):
        judged = judge_loop(design, drive, true, [omega])
        run = simulate_sampled(design, sinusoid(1.0, omega), None, drive, 120.0, true)
        t, late = run.time_s, run.time_s > 100
        waves = np.column_stack([np.sin(omega * t), np.cos(omega * t)])[late]
        left = np.hypot(*np.linalg.lstsq(waves, run.error[late], rcond=None)[0])
        assert judged.steady_errors[0] == pytest.approx(100 * left, rel=1e-5, abs=1e-9)


@pytest.mark.parametrize(("name", "rate", "omega"), [("two integrators", 5.0, 1.5), ("none", 1.7, 2.2)])
def test_the_error_between_the_samples_is_that_of_the_plant_under_the_held_control(
    name: str, rate: float, omega: float
) -> None:
    """The plant is carried by matrix exponentials in steps of 1/64 of a sample, its dead time behind it."""
    design, drive = design_of(PLANTS[name]), Drive(rate, "matched", FREE)
    judged = judge_loop(design, drive, omegas=[omega])
    u = simulate_sampled(design, sinusoid(1.0, omega), None, drive, 400 / rate).control
    P = plant_block(design.plant)
    A, b, c, _ = zpk2ss(P.zeros, P.poles, P.gain)
    n, x, errors, dt = len(A), np.zeros(len(A)), [], 1 / (64 * rate)
    step = expm(np.block([[A, b], [np.zeros((1, n + 1))]]) * dt)
    for k in range(399 * 64):
        errors.append(math.sin(omega * (k * dt + design.plant.delay_s)) - float((c @ x)[0]))
        x = step[:n, :n] @ x + step[:n, n] * u[k // 64]
    assert judged.between_errors[0] == pytest.approx(100 * np.abs(errors[200 * 64 :]).max(), rel=0.01)
    assert judged.steady_error == judged.between_errors[0] > 0.04


@pytest.mark.parametrize("rate", [20.0, 2e4])
def test_a_constant_leaves_no_error_at_any_rate(rate: float) -> None:
    """T(0) = 1, with or without an integrator in the plant, and every method keeps what a block makes of a constant."""
    slow = PlantModel(2.0, (), (), 1.0, 0, real_poles=(0.5,))
    for plant, omega in ((slow, 0.0), (PLANTS["one integrator"], 1.5)):
        design = design_extended(IdentifiedModel(plant, BOUND), [omega], sector=0.8)
        found = [judge_loop(design, Drive(rate, method, FREE), omegas=[0.0]) for method in METHODS]
        assert found[0].stable
        assert all(each.steady_error < 1e-6 for each in found if each.stable)


def test_what_looks_alike_is_in_the_order_of_the_methods(monkeypatch: pytest.MonkeyPatch) -> None:
    design, errors = design_of(PLANTS["none"]), {"matched": 3.04e-3, "tustin": 3.02e-3, "exact": 3e-3}
    for margins in ((0.951, 0.949, 0.95), (0.949, 0.952, 0.95)):
        of = dict(zip(METHODS, margins, strict=True))

        def judged(_: Design, drive: Drive, *__: object) -> LoopJudgement:
            error = (errors[drive.method],)
            return LoopJudgement(drive.method, 30.0, "", True, (0.0,), error, error, (0.0,), of[drive.method])  # noqa: B023

        monkeypatch.setattr("experiments.drive.choose_method.judge_loop", judged)
        assert [each.method for each in judge_methods(design, Drive(30.0, "exact", FREE))] == list(METHODS)


@pytest.mark.parametrize("method", METHODS[1:])
def test_chapter_2_whose_controller_has_poles_on_the_circle(delay_free_design: Design, method: str) -> None:
    """Its integrator is hidden, a pole at 1 that is not judged; the error at another frequency is that of a run."""
    plant = delay_free_design.loop_plant
    for rate in (40.0, 80.0, 90.0):
        drive = Drive(rate, method, FREE)
        radius = spectral_radius(delay_free_design, drive, plant)
        assert judge_loop(delay_free_design, drive).stable == (radius < 1 + 1e-6), (rate, radius)
    drive = Drive(500.0, method, FREE)
    run = simulate_sampled(delay_free_design, sinusoid(1.0, 1.4), None, drive, 8.0)
    judged = judge_loop(delay_free_design, drive, omegas=[1.4, *delay_free_design.reference_omegas])
    assert judged.steady_errors[0] == pytest.approx(100 * np.abs(run.error[run.time_s > 3]).max(), rel=1e-2)
    assert judged.steady_errors[0] == pytest.approx(judged.continuous_errors[0], rel=1e-2)
    assert judged.steady_errors[1] < (1e-6 if method == "exact" else 1e-3)


def test_the_margin_is_the_least_distance_from_minus_one() -> None:
    """Of T_d = 1 - S on a dense grid, S from the run's own impulse response."""
    design, drive = design_of(PLANTS["none"]), Drive(30.0, "matched", FREE)
    T, count = 1 / 30.0, 3000
    forward, feedback, _, _ = controller_blocks(design, None, drive, "coprime")
    (_, step_K), (_, step_F) = steps_of(forward), steps_of(feedback)
    kept_K, kept_F = np.zeros(steps_of(forward)[0]), np.zeros(steps_of(feedback)[0])
    P = plant_block(design.plant)
    A, b, c, _ = zpk2ss(P.zeros, P.poles, P.gain)
    n, late = len(A), design.plant.delay_s / T
    whole, rest = math.floor(late), late - math.floor(late)
    full, part = (expm(np.block([[A, b], [np.zeros((1, n + 1))]]) * t) for t in (T, (1 - rest) * T))
    x, commands, errors = np.zeros(n), [0.0] * (whole + 1), []
    for k in range(count):
        y = float((c @ (part[:n, :n] @ x + part[:n, n] * commands[-1]))[0])
        errors.append(float(k == 0) - y)
        v = step_K(kept_K, errors[-1])[0] + step_F(kept_F, None)[0]
        kept_K, kept_F = step_K(kept_K, errors[-1])[1], step_F(kept_F, v)[1]
        x, commands = full[:n, :n] @ x + full[:n, n] * commands[-1], [v, *commands[:-1]]
    S = np.abs(np.fft.rfft(errors, 2**16))
    assert judge_loop(design, drive).modulus_margin == pytest.approx(1 / S.max(), rel=2e-2)


def test_the_default_is_stable_where_a_method_is() -> None:
    design = design_of(PLANTS["one integrator"])
    for rate in (5.0, 61.3):
        first, *others = judge_methods(design, Drive(rate, "exact", FREE))
        assert (first.method, first.stable) == ("matched", True)
        assert max(first.steady_errors) < 1e-6
        assert all(each.steady_error >= 0.99 * first.steady_error for each in others)
    drive, said = choose_method(design, Drive(61.3, "matched", FREE))
    assert drive.method == "matched"
    assert said.startswith("At 61.3 Hz with the method matched, which is chosen, the linear loop is stable, its steady")
    drive, said = choose_method(design, Drive(61.3, "matched", FREE), "exact")
    assert drive.method == "exact"
    assert "the method exact the linear loop is UNSTABLE; matched: stable" in said


def test_the_least_rate_parts_stable_from_unstable() -> None:
    design = design_of(PLANTS["none"])
    found = least_rate(design, Drive(1.0, "exact", FREE))
    radii = [
        spectral_radius(design, Drive(rate, "exact", FREE), design.plant)
        for rate in (found.unstable_hz, found.stable_hz)
    ]
    assert radii[0] >= 1 > radii[1]
    assert found.stable_hz < 1.002 * found.unstable_hz


def test_where_none_was_unstable_the_end_of_the_search_is_no_limit() -> None:
    found = least_rate(design_of(PLANTS["two integrators"]), Drive(1.0, "matched", FREE))
    assert found.unstable_hz == 0
    assert str(found).startswith(f"matched: all from {found.searched_hz[0]:.4g} to ")


def test_a_delay_of_too_many_samples_is_refused_at_once() -> None:
    design = design_of(PLANTS["none"])
    for drive in (Drive(500.0, "tustin", FREE, input_delay_s=1e5), Drive(1e9, "tustin", FREE)):
        with pytest.raises(InputError, match=r"samples at .*expected at most 100000 samples$"):
            choose_method(design, drive)
    with pytest.raises(InputError, match="expected at most 100000 samples"):
        choose_method(design, Drive(500.0, "tustin", FREE), plant=replace(design.plant, delay_s=1e5))


@pytest.mark.parametrize("rate", [1e-300, 1e-100, 1e200])
def test_a_rate_far_from_the_loop_is_refused_in_words(rate: float) -> None:
    for method in (None, *METHODS):
        with pytest.raises(InputError, match=r"the loop.s fastest root|more than twice that"):
            choose_method(design_of(PLANTS["no dead time"]), Drive(rate, "exact", FREE), method)


def test_chapter_2_has_no_matched_method(delay_free_design: Design) -> None:
    drive, said = choose_method(delay_free_design, Drive(4000.0, "matched", FREE))
    assert drive.method in ("tustin", "exact")
    assert "stable" in said
    assert "matched" not in said
    with pytest.raises(InputError, match="the method is 'matched', for"):
        choose_method(delay_free_design, Drive(4000.0, "tustin", FREE), "matched")
