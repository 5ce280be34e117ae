"""``simulate`` with other references, and ``sampled``: what they write, and what they refuse in one sentence."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from click.testing import CliRunner, Result

from data.thesis import model_named
from design.design_file import Design
from experiments.__main__ import main
from experiments.drive.sampled_loop import Drive, SampledRun, simulate_sampled
from experiments.engine.simulate import Run, simulate
from experiments.runs.design_loop import design_loop
from experiments.runs.disturbances import Disturbances, noise, steps
from experiments.runs.references import Reference

SIMULATE = ["--limit", "12", "--anti-windup", "corrected", "--until", "1", "--sample-time", "0.01"]
SAMPLED = ["--limit", "12", "--anti-windup", "corrected", "--until", "1", "--rate", "800", "--method", "tustin"]
COMMANDS = {"simulate": SIMULATE, "sampled": SAMPLED}


@pytest.fixture
def design_json(extended_design: Design, tmp_path: Path) -> Path:
    path = tmp_path / "extended.json"
    path.write_text(extended_design.to_json(), encoding="utf-8")
    return path


@pytest.fixture
def reference_csv(tmp_path: Path) -> Path:
    path = tmp_path / "reference.csv"
    path.write_text("time_s,reference\n0.1,0\n0.2,3\n0.7,-1\n", encoding="utf-8")
    return path


def invoke(command: str, design: Path, *arguments: str) -> Result:
    output = design.parent / "run.csv"
    if not {"--amplitude", "--reference"} & set(arguments):
        arguments = (*arguments, "--amplitude", "50")
    return CliRunner().invoke(main, [command, str(design), *COMMANDS[command], *arguments, "--output", str(output)])


def written(result: Result, design: Path) -> pd.DataFrame:
    assert result.exit_code == 0, result.output
    return pd.read_csv(design.parent / "run.csv")


def refused(result: Result, design: Path, *parts: str) -> None:
    assert result.exit_code == 2, result.output
    lines = [line for line in result.stderr.splitlines() if line.startswith("Error:")]
    assert len(lines) == 1
    for part in parts:
        assert part in lines[0]
    assert not (design.parent / "run.csv").exists()


@pytest.mark.parametrize("command", COMMANDS)
def test_a_reference_from_a_file(command: str, design_json: Path, reference_csv: Path) -> None:
    table = written(invoke(command, design_json, "--reference", str(reference_csv)), design_json)
    expected = np.interp(table["time_s"], [0.1, 0.2, 0.7], [0.0, 3.0, -1.0])
    np.testing.assert_allclose(table["reference"], expected, atol=1e-9)
    assert np.abs(table["output"]).max() > 0.5


@pytest.mark.parametrize("command", COMMANDS)
def test_no_guarantee_is_claimed_of_an_actuator_that_does_more_than_saturate(command: str, design_json: Path) -> None:
    """The control crosses the limits in far less than the 24 s that this actuator takes from one to the other."""
    said = invoke(command, design_json, "--rate-limit", "1").output
    assert "No guarantee: the rate limit acted, and the guarantee covers saturation limits alone" in said
    assert "within it" not in said
    assert "too slow" not in invoke(command, design_json).output
    if command == "sampled":
        said = invoke(command, design_json, "--quantum", "5").output
        assert "No guarantee: the actuator has levels, and the guarantee covers saturation limits alone" in said


@pytest.mark.parametrize("command", COMMANDS)
def test_a_constant_is_its_amplitude_and_never_0_by_its_phase(
    command: str, extended_design: Design, design_json: Path
) -> None:
    constant = replace(extended_design, reference_omegas=(0.0, 1.5))
    design_json.write_text(constant.to_json(), encoding="utf-8")
    asked = ["--amplitude", "3", "--amplitude", "0"]
    zero = invoke(command, design_json, *asked, "--phase", "0", "--phase", "0")
    refused(zero, design_json, "frequency 0 has the phase 0, which makes it 0 at all times", "expected pi/2")
    assert set(written(invoke(command, design_json, *asked), design_json)["reference"]) == {3.0}


@pytest.mark.parametrize("command", COMMANDS)
def test_a_ramp(command: str, design_json: Path) -> None:
    table = written(invoke(command, design_json, "--slope", "2", "--amplitude", "0", "--offset", "0.5"), design_json)
    np.testing.assert_allclose(table["reference"], 0.5 + 2 * table["time_s"], atol=1e-9)
    table = written(invoke(command, design_json, "--slope", "-2", "--amplitude", "50", "--phase", "1"), design_json)
    np.testing.assert_allclose(
        table["reference"], 50 * np.sin(1.5 * table["time_s"] + 1) - 2 * table["time_s"], atol=1e-9
    )


@pytest.mark.parametrize("command", COMMANDS)
@pytest.mark.parametrize("option", ["--amplitude", "--phase", "--offset", "--slope"])
def test_a_file_is_the_whole_reference(command: str, option: str, design_json: Path, reference_csv: Path) -> None:
    result = invoke(command, design_json, "--reference", str(reference_csv), option, "0")
    refused(result, design_json, f"{option} belongs to a reference of sinusoids; found --reference", "reference.csv")


@pytest.mark.parametrize("command", COMMANDS)
def test_files_that_are_no_reference_and_what_is_read_is_not_written(
    command: str, design_json: Path, reference_csv: Path
) -> None:
    refused(invoke(command, design_json, "--reference", "nowhere.csv"), design_json, "nowhere.csv: no such file")
    run = design_json.parent / "run.csv"
    reference_csv.rename(run)
    before = run.read_text(encoding="utf-8")
    result = invoke(command, design_json, "--reference", str(run))
    assert result.exit_code == 2
    assert "is an input too" in result.stderr
    assert run.read_text(encoding="utf-8") == before


def test_sampled_writes_the_run(extended_design: Design, design_json: Path) -> None:
    drive = ["--quantum", "0.01", "--rate-limit", "500", "--input-delay", "0.001", "--plant", "table", "--phase", "1"]
    result = invoke("sampled", design_json, *drive, "--amplitude", "30")
    table = written(result, design_json)
    assert list(table) == ["time_s", "reference", "output", "error", "control", "saturated_control"]
    run = simulate_sampled(
        extended_design,
        Reference((30.0,), (1.5,), (1.0,), 0.0),
        extended_design.compensator("corrected"),
        Drive(800.0, "tustin", (-12.0, 12.0), 0.01, 500.0, 0.001),
        1.0,
        model_named("table").plant,
    )
    assert len(table) == 801
    for name, values in vars(run).items():
        if values is None:
            continue
        np.testing.assert_allclose(table[name], values, rtol=1e-10, atol=1e-10, err_msg=name)
    beyond = np.flatnonzero(np.abs(run.control) > 12)
    assert f"801 rows -> {design_json.parent / 'run.csv'}; {len(beyond)} samples beyond the limits" in result.stdout
    assert f"the last at {run.time_s[beyond[-1]]:.6g} s" in result.stdout


def test_sampled_without_limits(design_json: Path) -> None:
    result = invoke("sampled", design_json, "--limit", "inf", "--anti-windup", "none")
    assert "; 0 samples beyond the limits\n" in result.stdout
    assert result.stdout.startswith("At 800 Hz with the method tustin the linear loop is stable, its steady error")
    table = written(result, design_json)
    np.testing.assert_array_equal(table["control"], table["saturated_control"])


@pytest.mark.parametrize(
    ("arguments", "part"),
    [
        (["--rate", "0"], "the rate is 0 Hz"),
        (["--rate", "nan"], "the rate is nan Hz"),
        (["--rate", "1e12"], "rows; expected at most"),
        (["--until", "nan"], "the run lasts nan s"),
        (["--until", "inf"], "rows; expected at most"),
        (["--until", "0.001"], "expected a finite time of one sample"),
        (["--limit", "-1"], "--limit is -1"),
        (["--quantum", "-1"], "the quantum is -1"),
        (["--rate-limit", "0"], "the rate limit is 0"),
        (["--input-delay", "-1"], "the input delay is -1 s"),
        (["--method", "euler"], "euler"),
        (["--amplitude", "nan"], "expected finite numbers"),
        (["--amplitude", "1", "--amplitude", "2"], "1 frequencies, 2 amplitudes"),
        (["--anti-windup", "his"], "no anti-windup 'his'"),
        (["--plant", "nowhere.json"], "nowhere.json"),
        (["--rate", "2", "--until", "90", "--limit", "inf", "--anti-windup", "none"], "the loop diverges"),
    ],
)
def test_sampled_refuses(arguments: list[str], part: str, design_json: Path) -> None:
    refused(invoke("sampled", design_json, *arguments), design_json, part)


def test_sampled_refuses_a_missing_design(tmp_path: Path) -> None:
    refused(invoke("sampled", tmp_path / "none.json"), tmp_path / "none.json", "none.json: no such file")


def test_sampled_rates_is_for_the_extended_design(delay_free_design: Design, tmp_path: Path) -> None:
    path = tmp_path / "delay_free.json"
    path.write_text(delay_free_design.to_json(), encoding="utf-8")
    result = CliRunner().invoke(main, ["thesis", "sampled-rates", str(path), "--output", str(tmp_path)])
    assert result.exit_code == 2
    assert "kind is 'delay-free'; expected 'extended'" in result.stderr
    assert [file.name for file in tmp_path.iterdir()] == ["delay_free.json"]


@pytest.mark.parametrize("command", COMMANDS)
@pytest.mark.parametrize(
    ("words", "limits"),
    [(["-3", "8"], (-3, 8)), (["-3,8"], (-3, 8)), (["-3 8"], (-3, 8)), (["1", "2.5"], (1, 2.5)), (["4"], (-4, 4))],
)
def test_two_limits_or_one(command: str, words: list[str], limits: tuple[float, float], design_json: Path) -> None:
    table = written(invoke(command, design_json, "--until", "3", "--limit", *words), design_json)
    np.testing.assert_allclose(table["saturated_control"], np.clip(table["control"], *limits), atol=1e-10)
    assert (table["saturated_control"].min(), table["saturated_control"].max()) == limits


def test_the_argument_after_one_limit_is_the_design(design_json: Path) -> None:
    output = str(design_json.parent / "run.csv")
    words = ["--limit", "-3", "8", str(design_json), *SIMULATE[2:], "--amplitude", "50", "--output", output]
    assert CliRunner().invoke(main, ["simulate", *words]).exit_code == 0
    assert CliRunner().invoke(main, ["simulate", "--limit", "8", *words[3:]]).exit_code == 0


DISTURBED = ["--input-disturbance", "2", "--input-disturbance", "-1", "0.5", "--output-disturbance", "3", "0.2"]


@pytest.mark.parametrize("command", COMMANDS)
def test_disturbances_and_noise(command: str, extended_design: Design, design_json: Path) -> None:
    disturbances = Disturbances(steps([(2.0, 0.0), (-1.0, 0.5)]), steps([(3.0, 0.2)]), noise(0.1, 100.0, 5, 1.0))
    result = invoke(command, design_json, *DISTURBED, "--noise", "0.1", "100", "--seed", "5", "--phase", "0.3")
    table = written(result, design_json)
    reference, time_s = Reference((50.0,), (1.5,), (0.3,), 0.0), table["time_s"].to_numpy()
    run: Run | SampledRun
    if command == "simulate":
        run = simulate(design_loop(extended_design, reference, "corrected", None, disturbances), (-12.0, 12.0), time_s)
        measured, output = run.outputs["measured"], run.outputs["output"]
    else:
        drive = Drive(800.0, "tustin", (-12.0, 12.0))
        run = simulate_sampled(extended_design, reference, "corrected", drive, 1.0, disturbances=disturbances)
        assert run.measured is not None
        measured, output = run.measured, run.output
    np.testing.assert_allclose(table["measured"], measured, rtol=1e-10, atol=1e-10)
    np.testing.assert_allclose(table["output"], output, rtol=1e-10, atol=1e-10)
    assert "is not judged under disturbances" in result.stdout


def test_a_rate_limit(design_json: Path) -> None:
    result = invoke("simulate", design_json, "--rate-limit", "40", "--phase", "1")
    table = written(result, design_json)
    assert np.abs(np.diff(table["saturated_control"])).max() == pytest.approx(0.4, rel=1e-9)
    assert "No guarantee: the rate limit acted" in result.stdout


@pytest.mark.parametrize("command", COMMANDS)
@pytest.mark.parametrize(
    ("arguments", "part"),
    [
        (["--limit", "3", "-3"], "--limit is 3 -3; expected the lower limit first"),
        (["--limit", "3,4,5"], "'3,4,5' is neither a number nor two"),
        (["--limit", "nan", "3"], "--limit is nan 3"),
        (["--noise", "1", "100"], "--noise is given without --seed"),
        (["--seed", "1"], "--seed is given without --noise"),
        (["--input-disturbance", "1", "-2"], "begins at -2 s"),
        (["--output-disturbance", "1", "--output-disturbance", "2"], "two levels of a disturbance begin at 0 s"),
    ],
)
def test_limits_and_disturbances_that_are_none(
    command: str, arguments: list[str], part: str, design_json: Path
) -> None:
    refused(invoke(command, design_json, *arguments), design_json, part)
