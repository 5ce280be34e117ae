"""The audit: what it computes, what it prints, and a theta1~ of the user's own."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner
from scipy import signal

from design.__main__ import main
from design.auditing.as_text import audit_text
from design.auditing.audit_design import audit
from design.chapter_2.design_delay_free import design_delay_free
from design.chapters_3_4.design_extended import design_extended
from design.design_file import Design, read_design
from design.hinf.mixed_sensitivity import Synthesis
from identification.model.additive_bound import AdditiveBound
from identification.model.model_file import IdentifiedModel
from identification.model.modes import Mode
from identification.model.plant import PlantModel


@pytest.fixture
def path(extended_design: Design, tmp_path: Path) -> Path:
    path = tmp_path / "chapter3.json"
    path.write_text(extended_design.to_json(), encoding="utf-8")
    return path


def run(*arguments: str) -> str:
    result = CliRunner().invoke(main, list(arguments))
    assert result.exit_code == 0, result.output
    return result.output


def test_the_thesis_design(extended_design: Design) -> None:
    found = audit(extended_design)
    margins = found.margins
    assert not isinstance(margins, str)
    assert margins.W_a_C_S.value == pytest.approx(8.84, abs=5e-3)
    assert margins.W_a_C_S.omega == pytest.approx(175, abs=0.1)
    assert not margins.is_guaranteed
    assert found.same_controller is not None
    assert found.same_controller < 1e-7  # C_aw = C_s
    assert found.robust_sector == {"thesis": 0.0, "corrected": 0.0}
    assert found.anti_windup["thesis"].lasting_offset == pytest.approx(696.15, abs=0.01)
    assert found.anti_windup["corrected"].lasting_offset == 0.0
    own = found.anti_windup["corrected"]
    assert found.output_recovery_s == {"thesis": np.inf, "corrected": pytest.approx(own.recovery_s, rel=1e-12)}
    assert found.least_f[3] == pytest.approx(1.36804, abs=1e-5)
    visible = found.roots.roots[~found.roots.hidden]
    np.testing.assert_allclose(visible[:2], [-1, -1], rtol=1e-6)
    assert found.with_delay is None
    assert found.infimum is None


def test_the_redesign_is_guaranteed(implied: IdentifiedModel) -> None:
    found = audit(design_extended(implied, [1.5], 4.0, [(2.0, 1.0)], robust_level=0.9))
    assert not isinstance(found.margins, str)
    assert found.margins.is_guaranteed
    assert 0 < found.robust_sector["corrected"] < 0.95
    assert found.tracking_floor == pytest.approx(0.002329, rel=1e-3)


def test_a_guarantee_is_judged_again(extended_design: Design, implied: IdentifiedModel) -> None:
    """A file says what it likes: robust of a theta1~ for the model alone, by the condition at 10^5 frequencies."""

    def claimed(design: Design) -> Design:
        own = dataclasses.replace(design.corrected, guarantee="robust", guarantee_said="proved")
        return dataclasses.replace(design, corrected=own)

    omega = np.geomspace(1e-3, 1e5, 100001)
    for asked, expected in (("robust", True), ("global", False)):
        design = design_extended(implied, [1.5], 4.0, [(2.0, 1.0)], robust_level=0.4, guarantee=asked)
        forward, bound = design.controller_parts()[0], design.additive_bound
        M = design.corrected.kind.one_plus(1j * omega)
        x = np.abs(forward(1j * omega) * bound(1j * omega))  # C S of a predictor with its own model
        assert np.all(M.real > np.abs(M) * x / (1 - x)) == expected
        said = audit(claimed(design)).guarantee
        assert said.startswith("for every plant within W_a") == said.endswith("proved in exact arithmetic") == expected
        assert ("does not hold" in said) != expected
    assert "NOT met, |W_a C S| reaches 8.84" in audit(claimed(extended_design)).guarantee


def test_chapter_two_with_and_without_its_dead_time(delay_free_design: Design) -> None:
    found = audit(delay_free_design)
    assert not isinstance(found.margins, str)
    assert not isinstance(found.with_delay, str)
    assert found.with_delay is not None
    assert found.with_delay.modulus.value < found.margins.modulus.value
    assert found.infimum is not None
    assert delay_free_design.hinf is not None
    assert found.infimum.lower < found.infimum.upper < 1.01 * found.infimum.lower
    assert found.infimum.upper < delay_free_design.hinf.gamma


def test_what_the_stabiliser_reaches_is_not_taken_from_the_file(delay_free_design: Design) -> None:
    hinf, K = delay_free_design.hinf, delay_free_design.blocks["K"]
    assert hinf is not None
    claimed = dataclasses.replace(hinf, gamma=1e-9, gamma_line_lower=1.0)
    found = audit(dataclasses.replace(delay_free_design, hinf=claimed))
    assert isinstance(found.stabiliser, Synthesis)
    for name in ("gamma_lower", "gamma", "gamma_line_lower", "gamma_line", "decay_rate", "reason", "line_reason"):
        assert getattr(found.stabiliser, name) == getattr(hinf, name)
    slower = audit(dataclasses.replace(delay_free_design, blocks={**delay_free_design.blocks, "K": K.scaled(0.01)}))
    assert isinstance(slower.stabiliser, str)
    assert "K gives a closed-loop pole with Re s = " in slower.stabiliser


def test_a_dead_time_that_the_design_ignored_may_be_fatal(implied: IdentifiedModel) -> None:
    plant = dataclasses.replace(implied.plant, delay_s=0.2)
    found = audit(design_delay_free(dataclasses.replace(implied, plant=plant), [1.5], 1e-4))
    assert isinstance(found.with_delay, str)
    assert "roots in the right half plane" in found.with_delay


@pytest.mark.parametrize(
    ("plant", "omegas"),
    [
        (PlantModel(20.0, (), (), 0.02), [3.0]),
        (PlantModel(-3.0, (Mode(50, 0.05),), (Mode(80, 0.03),), 0.004), [0.0]),
        (PlantModel(0.7, (Mode(50, 0.05), Mode(150, 0.05)), (Mode(80, 0.03), Mode(190, 0.05)), 0.0), [0.5, 2.0]),
    ],
    ids=["no modes", "constant", "no delay, two frequencies"],
)
def test_other_plants(implied: IdentifiedModel, plant: PlantModel, omegas: list[float]) -> None:
    bound = AdditiveBound.printed_form(0.0015 * abs(plant.gain), 20.0, 60.0, 0.05)
    found = audit(
        design_extended(IdentifiedModel(plant, bound), omegas, 4.0, [(2.0, 1.0)] * sum(omega > 0 for omega in omegas))
    )
    assert not isinstance(found.margins, str)
    assert found.same_controller is not None
    assert found.same_controller < 1e-6
    assert found.anti_windup["corrected"].lasting_offset == 0.0


def test_what_is_printed(path: Path) -> None:
    said = run("audit", str(path), "--windup", "2")
    for part in (
        "C_aw = C_s",
        "8.84 (at 175 rad/s): NO guarantee",
        "0 to 129.4 ms",
        "NOT stable",
        "1392",  # K (1 + gamma) times 2
        "f = 1.368",
    ):
        assert part in said
    assert "nan" not in said


def test_what_is_printed_of_chapter_two(delay_free_design: Design, tmp_path: Path) -> None:
    path = tmp_path / "chapter2.json"
    path.write_text(delay_free_design.to_json(), encoding="utf-8")
    said = run("audit", str(path))
    for part in (
        "on the plant with its dead time of 8.1 ms",
        "infimum of (2.8)",
        "no stable T meets the 14 interpolation conditions",
        "cancelled",
    ):
        assert part in said


def test_what_is_left_of_y_d_decays_with_the_plant_too(implied: IdentifiedModel) -> None:
    """The slow pole of P is one of theta2 = P M: its step falls like exp(-t/10) though theta1~ has forgotten."""
    plant = PlantModel(1.0, (), (), 0.1, integrators=0, real_poles=(0.1,))
    bound = AdditiveBound.printed_form(0.002, 20.0, 60.0, 0.05)
    design = design_extended(dataclasses.replace(implied, plant=plant, additive_bound=bound), [0.3], 4.0, [(2.0, 1.0)])
    found = audit(design)
    fast, slow = found.anti_windup["corrected"].recovery_s, found.output_recovery_s["corrected"]
    theta2 = design.compensator("corrected").theta2(plant)
    response = signal.ZerosPolesGain(theta2.zeros, theta2.poles, theta2.gain)
    time_s = np.array([slow, 2 * slow])
    left = np.abs(signal.impulse(response, T=np.append(0.0, time_s))[1][1:])
    assert left[1] / left[0] == pytest.approx(0.01, rel=1e-6)
    assert fast < slow / 10
    assert f"{fast:.4g}" in (text := audit_text(design, found, 1.0))
    assert f"  {slow:.4g}" in text


def test_a_theta1_of_ones_own(path: Path, tmp_path: Path) -> None:
    output = tmp_path / "mine.json"
    run(
        *("anti-windup", str(path), "--name", "mine", "--numerator=-25", "--denominator", "1, 25"),
        *("--output", str(output)),
    )
    kind = read_design(output).compensator("mine")
    assert kind.one_plus.zeros == (0j,)
    assert kind.one_plus.poles == (-25 + 0j,)
    assert "mine" in run("audit", str(output))


@pytest.mark.parametrize(
    ("options", "part"),
    [
        (["--name", "thesis", "--numerator", "1", "--denominator", "1 2"], "not none, thesis or corrected"),
        (["--name", "x", "--numerator", "1 two", "--denominator", "1 2"], "--numerator is '1 two'"),
        (["--name", "x", "--numerator", "1", "--denominator", ""], "--denominator is ''"),
        (["--name", "x", "--numerator", "1 0", "--denominator", "1 2"], "strictly proper and stable"),
        (["--name", "x", "--numerator", "1", "--denominator", "1 -2"], "strictly proper and stable"),
    ],
)
def test_a_bad_theta1_is_refused(path: Path, tmp_path: Path, options: list[str], part: str) -> None:
    output = tmp_path / "mine.json"
    result = CliRunner().invoke(main, ["anti-windup", str(path), *options, "--output", str(output)])
    assert result.exit_code == 2
    assert part in result.output
    assert not output.exists()


def test_a_design_of_an_earlier_version_is_refused(path: Path) -> None:
    path.write_text(path.read_text(encoding="utf-8").replace('"schema": 3', '"schema": 1'), encoding="utf-8")
    result = CliRunner().invoke(main, ["audit", str(path)])
    assert result.exit_code == 2
    assert "schema is 1; expected 3" in result.output


def test_the_robust_sector_sees_a_narrow_resonance_of_the_bound(implied: IdentifiedModel) -> None:
    """|W_a C S| passes 1 on a peak a thousandth as wide as its frequency: no sector is left."""
    zeta, plant = 1e-3, PlantModel(7.0, (), (), 0.01)
    for size, robust in ((0.8, False), (0.4, True)):
        bound = AdditiveBound(2.4 * zeta * size, (), (Mode(33.3, zeta), Mode(300.0, 0.5)), (200.0,), ())
        found = audit(design_extended(IdentifiedModel(plant, bound), [1.5], 4.0, [(2.0, 1.0)]))
        assert not isinstance(found.margins, str)
        assert found.margins.is_guaranteed == robust
        assert all((sector > 0) == robust for sector in found.robust_sector.values())
        if robust:
            assert found.robust_sector["thesis"] < 0.8


def test_an_unstable_loop_has_no_robust_sector(implied: IdentifiedModel) -> None:
    found = audit(design_extended(implied, [1.5], 4.0, [(2.0, 1.0)], inverse_epsilon=10.0))
    assert isinstance(found.margins, str)
    assert set(found.robust_sector.values()) == {0.0}


@pytest.mark.parametrize("scale", [1e-3, 1e3])
def test_slow_and_fast_plants(implied: IdentifiedModel, scale: float) -> None:
    plant = PlantModel(7.0 * scale, (Mode(175 * scale, 0.01),), (Mode(282 * scale, 0.02),), 0.008 / scale)
    bound = AdditiveBound.printed_form(0.002, 20.0 * scale, 280.0 * scale, 0.02)
    design = design_extended(
        IdentifiedModel(plant, bound), [1.5 * scale, 10 * scale], 4.0 * scale, [(3 * scale, 2.25 * scale**2)] * 2
    )
    found = audit(design)
    assert not isinstance(found.margins, str)
    assert not isinstance(found.roots, str)
    assert found.same_controller is not None
    assert found.same_controller < 1e-6


@pytest.mark.parametrize(
    ("change", "part"),
    [
        (lambda content: content["blocks"].pop("T_so"), "'T_so' is missing"),
        (lambda content: content["blocks"]["T_so"].update(zeros={}), "expected a list of pairs of numbers"),
        (lambda content: content["plant"].update(gain=14.0), "do not belong to the plant"),
        (lambda content: content["plant"].update(integrators=2), "so the controller is improper"),
        (lambda content: content["anti_windup"]["corrected"].update(bandwidth=-5.0), "not a positive number"),
        (lambda content: content["anti_windup"]["corrected"].update(bandwidth="x"), "expected a number"),
        (lambda content: content.update(hinf={"gamma": 1.0}), "gamma_lower"),
        (lambda content: content["anti_windup"]["thesis"]["one_plus"].update(gain=2.0), "is not 1 + theta1_tilde"),
        (lambda content: content["anti_windup"]["thesis"].pop("f"), "'f' is None; expected a number"),
        (lambda content: content["anti_windup"]["thesis"].update(theta2_stable=1), "expected true or false"),
        (lambda content: content["anti_windup"].pop("corrected"), "there is no anti-windup 'corrected'"),
        (lambda content: content["parameters"].update(pairs=[[1.0]]), "expected a list of pairs of numbers"),
        (lambda content: content["parameters"].update(method=3), "expected a text"),
        (lambda content: content.update(reference_omegas=[-1.0]), "no negative number"),
        (lambda content: content.update(reference_omegas=1.5), "expected a list"),
    ],
)
def test_an_edited_design_is_refused(path: Path, change: Callable[[dict[str, Any]], object], part: str) -> None:
    content = json.loads(path.read_text(encoding="utf-8"))
    change(content)
    path.write_text(json.dumps(content), encoding="utf-8")
    result = CliRunner().invoke(main, ["audit", str(path)])
    assert result.exit_code == 2, result.output
    assert part in result.output
    assert "Traceback" not in result.output


def test_a_delay_free_design_without_its_norms_is_refused(delay_free_design: Design, tmp_path: Path) -> None:
    for name in ("gamma", "decay_rate", "gamma_line"):
        content = json.loads(delay_free_design.to_json())
        content["hinf"].pop(name)
        path = tmp_path / "chapter2.json"
        path.write_text(json.dumps(content), encoding="utf-8")
        result = CliRunner().invoke(main, ["audit", str(path)])
        assert result.exit_code == 2
        assert name in result.output
