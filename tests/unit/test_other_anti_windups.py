"""The anti-windups of others against their textbooks' loops, closed forms and brute force."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from scipy.integrate import solve_ivp
from scipy.linalg import expm

from design.anti_windup.circle_criterion import circle_sector
from design.anti_windup.compensator import AntiWindup
from design.anti_windup.least_gain import LeastGain, static, weston_postlethwaite
from design.anti_windup.linear_loop import LinearLoop
from design.anti_windup.other_anti_windups import OTHERS, back_calculation, observer
from design.blocks.block import Block
from design.blocks.state_space import realize
from design.chapters_3_4.design_extended import design_extended
from design.chapters_3_4.realisation import realised
from design.design_file import Design
from experiments.__main__ import main
from experiments.engine.simulate import simulate
from experiments.runs.design_loop import Controller, design_loop, plant_loop
from experiments.runs.references import sinusoid
from identification.base.errors import InputError
from identification.model.additive_bound import AdditiveBound
from identification.model.model_file import IdentifiedModel
from identification.model.modes import Mode
from identification.model.plant import PlantModel

BOUND = AdditiveBound.printed_form(gain=0.01, corner=100.0, omega=300.0, zeta=0.1)
DELAY_S = 0.05
FLEXIBLE = PlantModel(-3.0, (Mode(9.0, 0.05),), (Mode(14.0, 0.03),), 0.02)


@pytest.fixture(scope="module")
def late_integrator() -> Design:
    """K/s with a dead time."""
    return design_extended(IdentifiedModel(PlantModel(2.0, (), (), DELAY_S), BOUND), [1.5], 4.0, [(2.0, 1.0)])


def test_back_calculation_of_a_pi_controller_is_the_textbooks() -> None:
    """u = K_p e + x, x' = K_i e + (sat(u) - u)/T_t, integrated by scipy."""
    K, K_p, K_i, recovery_s, limit = 0.7, 3.0, 5.0, 1.4, 0.8
    plant, time_s = PlantModel(K, (), (), 0.0), np.linspace(0.0, 12.0, 400)
    C = Block(K_p, (complex(-K_i / K_p),), (0j,))
    kind = back_calculation(LinearLoop(plant, C, Block(0.0), None, (1.1,), recovery_s, 50.0))
    theta = realize(kind.theta1_tilde, kind.theta2(plant))
    reference = sinusoid(1.0, 1.1, 1.5)
    loop = plant_loop(Controller(realize(C), realize(Block(0.0)), theta, 0.0), plant, reference)
    found = simulate(loop, (-limit, limit), time_s)

    def textbook(t: float, state: np.ndarray) -> list[float]:
        y, x = state
        e = np.sin(1.1 * t + 1.5) - y
        u = K_p * e + x
        given = np.clip(u, -limit, limit)
        return [K * given, K_i * e + (given - u) * np.log(100) / recovery_s]

    expected = solve_ivp(textbook, (0.0, 12.0), [0.0, 0.0], t_eval=time_s, rtol=1e-9, atol=1e-11, max_step=0.01).y[0]
    assert len(found.events_s) >= 4
    np.testing.assert_allclose(found.outputs["output"], expected, atol=1e-6)


def test_back_calculation_finds_the_integrator_of_the_controller(late_integrator: Design) -> None:
    """T = 1 once more at s = 0 than the plant's integrator makes it is a pole of C there."""
    s = 1e-4
    C = realised(late_integrator)
    integrates = abs(complex(C(np.array(s / 10j))) / complex(C(np.array(s / 1j)))) > 5
    poles = late_integrator.chosen("back-calculation").theta1_tilde.poles  # type: ignore[union-attr]
    assert sorted(poles, key=lambda pole: pole.imag) == [-1.5j, *([0j] if integrates else []), 1.5j]


def test_conditioning_is_hanus_self_conditioned_controller(late_integrator: Design) -> None:
    """The states of K take e - u~/d, d = K(infinity), and those of T_so take sat(v): fixed steps with a buffer."""
    limit, step = 0.9, 1e-4
    K, T = (realize(block) for block in late_integrator.controller_parts())
    late, d = round(DELAY_S / step), K.d[0]
    reference = sinusoid(1.0, 1.5, 1.2)
    x_K, x_T, y = np.zeros(len(K.b)), np.zeros(len(T.b)), 0.0
    given, predicted = np.zeros(40_001 + late), np.zeros(40_001 + late)
    outputs = np.zeros(40_001)
    for k in range(40_001):
        outputs[k] = y
        e = float(reference(np.array(k * step))) - y
        v = float(K.C[0] @ x_K) + d * e + predicted[k]
        given[k + late] = sat = float(np.clip(v, -limit, limit))
        predicted[k + late] = float(T.C[0] @ x_T)
        x_K = x_K + step * (K.A @ x_K + K.b * (e - (v - sat) / d))
        x_T = x_T + step * (T.A @ x_T + T.b * sat)
        y += step * 2.0 * given[k]
    run = simulate(design_loop(late_integrator, reference, "conditioning"), (-limit, limit), step * np.arange(40_001))
    assert len(run.events_s) > 2
    np.testing.assert_allclose(run.outputs["output"], outputs, atol=2e-3)


def test_the_observer_drives_the_stable_factors_by_sat_u(late_integrator: Design) -> None:
    """M = S/(1 - G) with 1 - G = E/C of the realisation without hidden modes."""
    s = np.array([0.3 + 0.2j, 2j, 5.0 + 1j, 40j])
    form, (_, feedback) = realised(late_integrator), late_integrator.controller_parts()
    S = 1 - feedback(s) * np.exp(-DELAY_S * s)
    M = observer(late_integrator.linear_loop).one_plus
    np.testing.assert_allclose(M(s), S * form(s) / form.forward(s), rtol=1e-9)
    assert Block(1.0, (0j,), (-4.0 + 0j,)) == M


@pytest.mark.parametrize("bandwidth", [3.0, 700.0])
def test_the_least_gain_of_an_integrator_is_the_closed_form(bandwidth: float) -> None:
    """With M = s/(s + b) and u~ = k u, y_d = K k/(s + b (1 - k)) v: no smaller gain with b <= bandwidth."""
    K, found = -2.5, weston_postlethwaite(PlantModel(-2.5, (), (), 0.3), bandwidth)
    k = found.sector
    assert found.gain == pytest.approx(abs(K) * k / (bandwidth * (1 - k)), rel=0.01)
    assert found.kind.one_plus.poles[0].real == pytest.approx(-bandwidth, rel=0.01)
    assert circle_sector(found.kind.theta1_tilde) == 1.0


def test_no_gain_below_the_peak_of_a_stable_plant() -> None:
    """With u~ = u, u = v/M: y_d = P v whatever M, so that ||P|| is least, and the internal model has it."""
    plant = PlantModel(4.0, (), (Mode(7.0, 0.1),), 0.1, integrators=0)
    peak = 4.0 / (2 * 0.1 * np.sqrt(1 - 0.01))
    assert weston_postlethwaite(plant, 50.0).gain == pytest.approx(peak, rel=0.01)


@pytest.mark.parametrize(("integrators", "rates"), [(0, (2.0,)), (1, ()), (2, ()), (0, ())])
def test_the_gain_holds_whatever_the_nonlinearity_within_the_sector(integrators: int, rates: tuple[float, ...]) -> None:
    """u~ = kappa(t) u with kappa anywhere in [0, k], v random: piecewise exact by the matrix exponential."""
    plant = replace(FLEXIBLE, integrators=integrators, real_poles=rates)
    g = Block(1.0, (0j,) * integrators, (-3.0 + 0j,) * integrators)
    rng = np.random.default_rng(4)
    for found in (weston_postlethwaite(plant, 40.0), static(plant, g, [-5.0, -2.0 + 1j, -2.0 - 1j])):
        assert found.kind.theta2(plant).is_stable
        assert circle_sector(found.kind.theta1_tilde) >= found.sector * (1 - 1e-4)
        ratios = [_largest_ratio(found, plant, rng) for _ in range(5)]
        assert max(ratios) <= found.gain * 1.001
        assert max(ratios) > 0.1 * found.gain


def _largest_ratio(found: LeastGain, plant: PlantModel, rng: np.random.Generator) -> float:
    """||y_d||/||v|| of piecewise constant v and kappa, both norms by sums over a fine grid."""
    system, step = realize(found.kind.theta1_tilde, found.kind.theta2(plant)), 2e-3
    x, energies = np.zeros(len(system.b)), np.zeros(2)
    slow = rng.random() < 0.7
    for _ in range(60):
        kappa = found.sector * (1.0 if rng.random() < 0.8 else rng.random())
        v = 1.0 if slow else rng.normal()
        # u = v - c x, u~ = kappa u
        A = system.A - kappa * np.outer(system.b, system.C[0])
        moved = expm(step * np.block([[A, kappa * v * system.b[:, None]], [np.zeros((1, len(x) + 1))]]))
        for _ in range(int(rng.integers(20, 300))):
            before = x
            x = moved[:-1, :-1] @ x + moved[:-1, -1]
            middle = (before + x) / 2
            y_d = system.C[1] @ middle + system.d[1] * kappa * (v - system.C[0] @ middle)
            energies += step * np.array([y_d**2, v**2])
    return float(np.sqrt(energies[0] / energies[1]))


def test_what_cannot_be_is_refused_in_a_sentence(late_integrator: Design, delay_free_design: Design) -> None:
    with pytest.raises(
        InputError, match="the plant has a pole at 0 rad/s; expected a stable plant for the internal model"
    ):
        late_integrator.chosen("internal-model")
    for name in ("observer", "static"):
        with pytest.raises(InputError, match="extended"):
            delay_free_design.chosen(name)
    rolled_off = design_extended(IdentifiedModel(FLEXIBLE, BOUND), [1.5])
    with pytest.raises(InputError, match="more poles than zeros"):
        rolled_off.chosen("conditioning")
    with pytest.raises(InputError, match="no pole on the imaginary axis"):
        back_calculation(replace(late_integrator.linear_loop, forward=Block(1.0), pole=None))


@pytest.mark.parametrize("name", [*OTHERS])
def test_every_name_is_taken_by_simulate(late_integrator: Design, tmp_path: Path, name: str) -> None:
    """It is made for the run, and stands in no design.json; what it refuses leaves nothing behind."""
    path, output = tmp_path / "design.json", tmp_path / "run.csv"
    path.write_text(late_integrator.to_json(), encoding="utf-8")
    assert name not in path.read_text(encoding="utf-8")
    words = f"simulate {path} --amplitude 1 --limit 2 --anti-windup {name} --until 0.1 --sample-time 0.1".split()
    result = CliRunner().invoke(main, [*words, "--output", str(output)])
    assert (result.exit_code == 0) == output.exists() == (name != "internal-model")


def test_a_design_without_dead_time_has_its_own_conditioning(delay_free_design: Design) -> None:
    """M = C S/C(infinity), S of the loop without dead time."""
    s = np.array([0.4 + 1j, 30j, 200.0 + 100j])
    C, plant = delay_free_design.controller_parts()[0], delay_free_design.loop_plant
    kind = delay_free_design.chosen("conditioning")
    assert isinstance(kind, AntiWindup)
    np.testing.assert_allclose(kind.one_plus(s), C(s) / (1 + C(s) * plant(s)) / C.gain, rtol=1e-6)
