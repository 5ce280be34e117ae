"""Every command answers bad input with one sentence and status 2, and writes nothing."""

from __future__ import annotations

import dataclasses
import json
import math
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from click.testing import CliRunner, Result

from data.thesis import model_named
from design.__main__ import main as design_main
from design.anti_windup.compensator import from_one_plus
from design.anti_windup.judge import Compensator, judge
from design.blocks.block import Block
from design.chapters_3_4.design_extended import design_extended
from design.design_file import Design, read_design
from experiments.__main__ import main as experiments_main
from experiments.thesis.commands import thesis
from identification.model.model_file import IdentifiedModel


@pytest.fixture
def runner() -> CliRunner:
    return CliRunner()


@pytest.fixture
def extended_json(extended_design: Design, tmp_path: Path) -> Path:
    path = tmp_path / "extended.json"
    path.write_text(extended_design.to_json(), encoding="utf-8")
    return path


def refused(result: Result, *parts: str) -> None:
    """One sentence on stderr that names what is wrong, status 2, no traceback."""
    assert result.exit_code == 2, result.output
    assert isinstance(result.exception, SystemExit)
    lines = [line for line in result.stderr.splitlines() if line.startswith("Error:")]
    assert len(lines) == 1
    assert "Traceback" not in result.output
    for part in parts:
        assert part in lines[0]


@pytest.mark.parametrize("name", sorted(set(thesis.commands) - set(experiments_main.commands)))
def test_a_command_of_the_print_is_named_where_it_is(runner: CliRunner, name: str) -> None:
    refused(
        runner.invoke(experiments_main, [name, "--output", "."]), f"No such command '{name}'; it is now: thesis {name}"
    )


def test_no_other_command_is(runner: CliRunner) -> None:
    refused(runner.invoke(experiments_main, ["limit"]), "No such command 'limit'")


EPSILON = ["--epsilon", "1e-4"]
DESIGN_COMMANDS = {
    "delay-free": ["--reference-hz", "0.25", *EPSILON],
    "extended": ["--reference-omega", "1.5", "--a", "4", "--e", "2", "--f", "1"],
}


@pytest.mark.parametrize("command", DESIGN_COMMANDS)
@pytest.mark.parametrize(
    ("content", "parts"),
    [
        (None, ["no such file"]),
        ("not json", ["line 1", "not JSON"]),
        ('{"schema": 7}', ["schema is 7", "expected 1"]),
        ('{"schema": 1, "plant": {"gain": NaN}}', ["NaN"]),
        ('{"schema": 1}', ["'plant'", "expected an object"]),
    ],
)
def test_design_refuses_bad_models(
    runner: CliRunner, tmp_path: Path, command: str, content: str | None, parts: list[str]
) -> None:
    model, output = tmp_path / "model.json", tmp_path / "design.json"
    if content is not None:
        model.write_text(content, encoding="utf-8")
    result = runner.invoke(design_main, [command, str(model), *DESIGN_COMMANDS[command], "--output", str(output)])
    refused(result, "model.json", *parts)
    assert not output.exists()


@pytest.mark.parametrize(
    ("member", "value", "part"),
    [("gain", "seven", "expected a number"), ("gain", 0, "gain is 0"), ("delay_s", -0.1, "delay_s is -0.1")],
)
def test_design_refuses_bad_plants(runner: CliRunner, tmp_path: Path, member: str, value: object, part: str) -> None:
    content = json.loads(model_named("implied").to_json())
    content["plant"][member] = value
    model = tmp_path / "model.json"
    model.write_text(json.dumps(content), encoding="utf-8")
    output = tmp_path / "design.json"
    result = runner.invoke(
        design_main, ["delay-free", str(model), "--reference-hz", "0.25", *EPSILON, "--output", str(output)]
    )
    refused(result, "model.json", part)
    assert not output.exists()


@pytest.mark.parametrize(
    ("arguments", "part"),
    [
        (["delay-free", "implied", "--reference-hz", "-0.25", *EPSILON], "expected one or more positive numbers"),
        (["delay-free", "implied", "--reference-hz", "nan", *EPSILON], "expected one or more positive numbers"),
        (["delay-free", "implied", "--reference-hz", "0.25", "--epsilon", "99"], "epsilon"),
        (["delay-free", "implied", "--reference-hz", "0.25"], "neither --epsilon nor --integral-action is given"),
        (
            ["delay-free", "implied", "--reference-hz", "0.25", *EPSILON, "--integral-action"],
            "both --epsilon and --integral-action are given; expected one",
        ),
        (
            ["delay-free", "implied", "--reference-hz", "0.25", "--reference-hz", "0.25", *EPSILON],
            "expected each frequency once",
        ),
        (["extended", "implied", "--reference-omega", "0", "--a", "4", "--e", "2", "--f", "1"], "0 frequencies above"),
        (["extended", "implied", "--reference-omega", "-1", "--a", "4", "--e", "2", "--f", "1"], "omega >= 0"),
        (["extended", "implied", "--reference-omega", "1.5", "--a", "4", "--e", "2"], "--f 0 times"),
        (["delay-free", "implied", "--reference-hz", "0.25", *EPSILON, "--sector", "1"], "0 < sector < 1"),
        (
            ["delay-free", "implied", "--reference-hz", "0.25", *EPSILON, "--bandwidth", "0.1"],
            "bandwidth of the anti-windup",
        ),
        (["extended", "implied", "--reference-omega", "1.5", "--a", "4", "--e", "-2", "--f", "1"], "unstable"),
        (
            [
                "extended",
                "implied",
                "--reference-omega",
                "1.5",
                "--a",
                "4",
                "--e",
                "2",
                "--f",
                "1",
                "--interpolation",
                "poles",
            ],
            "unstable poles",
        ),
    ],
)
def test_design_refuses_bad_numbers(runner: CliRunner, tmp_path: Path, arguments: list[str], part: str) -> None:
    output = tmp_path / "design.json"
    refused(runner.invoke(design_main, [*arguments, "--output", str(output)]), part)
    assert not output.exists()


def test_integral_action_hides_no_integrator(runner: CliRunner, tmp_path: Path) -> None:
    written = {}
    for option in (EPSILON, ["--integral-action"]):
        output = tmp_path / "design.json"
        arguments = [
            "delay-free",
            "implied",
            "--reference-hz",
            "0.25",
            "--reference-hz",
            "0.7",
            *option,
            "--output",
            str(output),
        ]
        result = runner.invoke(design_main, arguments)
        assert result.exit_code == 0
        assert ("C hides the integrator of the plant" in result.output) == (option is EPSILON)
        written[option[0]] = read_design(output)
    for name, design in written.items():
        assert design.reference_omegas == (math.tau * 0.25, math.tau * 0.7)
        C = design.controller_parts()[0]
        assert (0 in C.zeros, 0 in C.poles) == ((True, False) if name == "--epsilon" else (False, True))


def test_design_refuses_a_missing_folder(runner: CliRunner, tmp_path: Path) -> None:
    output = tmp_path / "nowhere" / "design.json"
    result = runner.invoke(
        design_main, ["delay-free", "implied", "--reference-hz", "0.25", *EPSILON, "--output", str(output)]
    )
    refused(result, "cannot be written")


SINUSOID = ["--amplitude", "50", "--phase", "1"]
APPENDIX = ["trade-off", "interpolation", "robustness", "limits", "sampled-rates", "hidden-modes"]
SIMULATE = ["--limit", "12", "--anti-windup", "thesis", "--until", "1", "--sample-time", "0.01", *SINUSOID]


def test_simulate_writes_what_it_promises(runner: CliRunner, tmp_path: Path, extended_json: Path) -> None:
    output = tmp_path / "run.csv"
    result = runner.invoke(experiments_main, ["simulate", str(extended_json), *SIMULATE, "--output", str(output)])
    assert result.exit_code == 0, result.output
    table = pd.read_csv(output)
    assert list(table) == ["time_s", "reference", "output", "error", "control", "saturated_control"]
    assert len(table) == 101
    np.testing.assert_allclose(table["error"], table["reference"] - table["output"], atol=1e-9)
    np.testing.assert_allclose(table["saturated_control"], table["control"].clip(-12, 12), atol=1e-9)
    np.testing.assert_allclose(table["reference"], 50 * np.sin(1.5 * table["time_s"] + 1), atol=1e-9)


def test_simulate_takes_a_theta1_of_the_design_and_several_amplitudes(
    runner: CliRunner, tmp_path: Path, implied: IdentifiedModel
) -> None:
    design = design_extended(implied, [1.5, 3.0], 4.0, [(2.0, 1.0), (2.0, 4.0)])
    kind = from_one_plus(Block(1.0, (0j,), (-25.0 + 0j,)))
    mine = dataclasses.replace(
        design, added={"mine": Compensator(kind, judge(implied.plant, implied.additive_bound, kind))}
    )
    path, output = tmp_path / "mine.json", tmp_path / "run.csv"
    path.write_text(mine.to_json(), encoding="utf-8")
    arguments = ["simulate", str(path), *SIMULATE, "--anti-windup", "mine", "--output", str(output)]
    arguments += ["--amplitude", "5", "--phase", "0"]
    result = runner.invoke(experiments_main, arguments)
    assert result.exit_code == 0, result.output
    table = pd.read_csv(output)
    t = table["time_s"]
    np.testing.assert_allclose(table["reference"], 50 * np.sin(1.5 * t + 1) + 5 * np.sin(3 * t), atol=1e-9)
    output.unlink()
    refused(
        runner.invoke(experiments_main, [*arguments, "--amplitude", "1"]), "2 frequencies, 3 amplitudes and 2 phases"
    )
    refused(runner.invoke(experiments_main, [*arguments, "--anti-windup", "his"]), "no anti-windup 'his'", "mine")
    silent = ["simulate", str(path), *SIMULATE[: -len(SINUSOID)], "--output", str(output)]
    refused(runner.invoke(experiments_main, silent), "no --amplitude is given", "1.5, 3 rad/s")
    assert not output.exists()


def test_simulate_takes_another_true_plant(runner: CliRunner, tmp_path: Path, extended_json: Path) -> None:
    outputs = []
    for name, plant in (("model", []), ("same", ["--plant", "implied"]), ("other", ["--plant", "table"])):
        output = tmp_path / f"{name}.csv"
        arguments = ["simulate", str(extended_json), *SIMULATE, *plant, "--output", str(output)]
        result = runner.invoke(experiments_main, arguments)
        assert result.exit_code == 0, result.output
        outputs.append(pd.read_csv(output)["output"].to_numpy())
    np.testing.assert_array_equal(outputs[0], outputs[1])
    assert np.abs(outputs[2] - outputs[0]).max() > 1e-3
    arguments = [
        "simulate",
        str(extended_json),
        *SIMULATE,
        "--plant",
        "nowhere.json",
        "--output",
        str(tmp_path / "x.csv"),
    ]
    refused(runner.invoke(experiments_main, arguments), "nowhere.json", "no such file")


def test_simulate_stops_at_until(runner: CliRunner, tmp_path: Path, extended_json: Path) -> None:
    output = tmp_path / "run.csv"
    arguments = ["--limit", "12", "--anti-windup", "none", "--until", "1", "--sample-time", "0.6", *SINUSOID]
    assert (
        runner.invoke(experiments_main, ["simulate", str(extended_json), *arguments, "--output", str(output)]).exit_code
        == 0
    )
    assert list(pd.read_csv(output)["time_s"]) == [0.0, 0.6]


@pytest.mark.parametrize(
    ("changes", "part"),
    [
        ({"--limit": "-1"}, "--limit is -1"),
        ({"--limit": "nan"}, "--limit is nan"),
        ({"--until": "0"}, "--until is 0"),
        ({"--sample-time": "2"}, "sample time <= until"),
        ({"--until": "inf"}, "until < inf"),
        ({"--gamma": "5", "--anti-windup": "corrected"}, "--gamma belongs to --anti-windup thesis"),
        ({"--alpha": "-1"}, "expected alpha > 0"),
        ({"--amplitude": "nan"}, "expected finite numbers"),
    ],
)
def test_simulate_refuses_bad_numbers(
    runner: CliRunner, tmp_path: Path, extended_json: Path, changes: dict[str, str], part: str
) -> None:
    options = dict(zip(SIMULATE[::2], SIMULATE[1::2], strict=True)) | changes
    flat = [word for pair in options.items() for word in pair]
    output = tmp_path / "run.csv"
    refused(runner.invoke(experiments_main, ["simulate", str(extended_json), *flat, "--output", str(output)]), part)
    assert not output.exists()


@pytest.mark.parametrize("command", ["simulate", "f-gamma", "chapter-2", "chapter-4", *APPENDIX])
def test_experiments_refuse_a_missing_design(runner: CliRunner, tmp_path: Path, command: str) -> None:
    options = (
        [*SIMULATE, "--output", str(tmp_path / "run.csv")] if command == "simulate" else ["--output", str(tmp_path)]
    )
    group = [] if command == "simulate" else ["thesis"]
    result = runner.invoke(experiments_main, [*group, command, str(tmp_path / "none.json"), *options])
    refused(result, "none.json", "no such file")
    assert not list(tmp_path.iterdir())


def test_experiments_refuse_the_other_kind(runner: CliRunner, tmp_path: Path, extended_json: Path) -> None:
    result = runner.invoke(experiments_main, ["thesis", "chapter-2", str(extended_json), "--output", str(tmp_path)])
    refused(result, "kind is 'extended'", "expected 'delay-free'")


def test_experiments_refuse_a_missing_block(runner: CliRunner, tmp_path: Path, extended_json: Path) -> None:
    content = json.loads(extended_json.read_text(encoding="utf-8"))
    del content["blocks"]["T_so"]
    extended_json.write_text(json.dumps(content), encoding="utf-8")
    result = runner.invoke(experiments_main, ["thesis", "chapter-4", str(extended_json), "--output", str(tmp_path)])
    refused(result, "extended.json", "'T_so' is missing")


@pytest.mark.parametrize(
    ("text", "parts"),
    [
        ("frequency_hz,magnitude_db\n1,2\n", ["phase_deg"]),
        ("frequency_hz,magnitude_db,phase_deg\n1,2,3\n2,x,3\n", ["line 3", "'x'"]),
        ("frequency_hz,magnitude_db,phase_deg\n2,2,3\n-1,2,3\n", ["line 3"]),
        ("", []),
        ('frequency_hz,magnitude_db,phase_deg\n"1,2,3\n', ["line 2"]),
    ],
)
def test_additive_error_refuses_bad_sweeps(runner: CliRunner, tmp_path: Path, text: str, parts: list[str]) -> None:
    sweep, output = tmp_path / "sweep.csv", tmp_path / "tables"
    sweep.write_text(text, encoding="utf-8")
    output.mkdir()
    refused(
        runner.invoke(experiments_main, ["thesis", "additive-error", "implied", str(sweep), "--output", str(output)]),
        "sweep.csv",
        *parts,
    )
    assert not list(output.iterdir())


def test_no_command_writes_over_its_input(runner: CliRunner, tmp_path: Path, extended_json: Path) -> None:
    before = extended_json.read_text(encoding="utf-8")
    result = runner.invoke(
        experiments_main, ["simulate", str(extended_json), *SIMULATE, "--output", str(extended_json)]
    )
    refused(result, "is an input too")
    assert extended_json.read_text(encoding="utf-8") == before


def test_outputs_are_files_and_links_are_followed(runner: CliRunner, tmp_path: Path, extended_json: Path) -> None:
    target, link = tmp_path / "real.csv", tmp_path / "link.csv"
    target.write_text("old", encoding="utf-8")
    link.symlink_to(target)
    arguments = ["simulate", str(extended_json), *SIMULATE, "--output"]
    assert runner.invoke(experiments_main, [*arguments, str(link)]).exit_code == 0
    assert link.is_symlink()
    assert target.read_text(encoding="utf-8").startswith("time_s")
    assert runner.invoke(experiments_main, [*arguments, str(tmp_path)]).exit_code == 2
    assert not list(tmp_path.glob(".partial-*"))


@pytest.mark.parametrize(
    ("arguments", "part"),
    [
        (["delay-free", "implied", "--reference-hz", "1e300", *EPSILON], ""),
        (["extended", "implied", "--reference-omega", "1.5", "--a", "1e300", "--e", "2", "--f", "1"], ""),
    ],
)
def test_extreme_numbers_get_a_sentence(runner: CliRunner, tmp_path: Path, arguments: list[str], part: str) -> None:
    output = tmp_path / "design.json"
    refused(runner.invoke(design_main, [*arguments, "--output", str(output)]), part)
    assert not output.exists()


def test_a_run_of_too_many_steps_or_rows_is_refused(runner: CliRunner, tmp_path: Path, extended_json: Path) -> None:
    arguments = [
        "simulate",
        str(extended_json),
        "--limit",
        "12",
        "--anti-windup",
        "none",
        *SINUSOID,
        "--output",
        str(tmp_path / "r"),
    ]
    refused(runner.invoke(experiments_main, [*arguments, "--until", "1", "--sample-time", "1e-12"]), "rows")
    refused(runner.invoke(experiments_main, [*arguments, "--until", "1e7", "--sample-time", "1e6"]), "steps")


def test_additive_error_refuses_a_missing_sweep(runner: CliRunner, tmp_path: Path) -> None:
    arguments = ["thesis", "additive-error", "implied", str(tmp_path / "none.csv"), "--output", str(tmp_path)]
    refused(runner.invoke(experiments_main, arguments), "none.csv")
    assert not list(tmp_path.iterdir())
