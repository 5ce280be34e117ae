"""python -m identification: what it writes, and that bad input gets one sentence and nothing written."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner, Result

from identification.__main__ import main
from identification.model.model_file import read_model
from identification.model.modes import Mode
from identification.model.plant import PlantModel
from identification.model.plant_json import shaped
from paper_figures.__main__ import main as paper_figures_main

PLANT = PlantModel(-2.0, (Mode(50.0, 0.03),), (Mode(80.0, 0.02),), 5e-3)


def _fit(*arguments: object) -> Result:
    return CliRunner().invoke(main, ["fit", *map(str, arguments)])


def _sweep(path: Path, seed: int, lines: int = 200, header: str = "") -> Path:
    rng = np.random.default_rng(seed)
    frequency_hz = np.linspace(2.0, 40.0, lines)
    response = PLANT(2j * np.pi * frequency_hz) * (1 + 0.02 * rng.standard_normal((2, lines)).T @ [1, 1j])
    rows = [f"{f:.6f},{h.real:.9g},{h.imag:.9g}" for f, h in zip(frequency_hz, response, strict=True)]
    path.write_text(header + "frequency_hz,real,imag\n" + "\n".join(rows) + "\n", encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def sweeps(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    folder = tmp_path_factory.mktemp("sweeps")
    return [_sweep(folder / f"test_{i}.csv", i) for i in range(2)]


@pytest.fixture(scope="module")
def fitted(sweeps: list[Path]) -> tuple[Path, str]:
    """The model of both, and what was said of it."""
    output = sweeps[0].with_name("model.json")
    result = _fit(*sweeps, "--output", output)
    assert result.exit_code == 0, result.output
    return output, result.output


def test_writes_a_model_that_design_can_read(fitted: tuple[Path, str], sweeps: list[Path]) -> None:
    output = fitted[0]
    model = read_model(output)
    assert model.plant.gain == pytest.approx(-2.0, rel=0.02)
    assert model.plant.pole_modes[0].omega == pytest.approx(80.0, rel=0.01)
    assert model.standard_errors is not None
    errors = shaped(model.plant, model.standard_errors)
    assert errors["pole_modes"][0].keys() == {"omega", "zeta"}
    assert 0 < errors["delay_s"] < 1e-4
    assert model.fit is not None
    assert model.fit.structure == "1 integrator, 1 zero mode, 1 pole mode"
    lower, upper = (shaped(model.plant, end)["pole_modes"][0]["omega"] for end in (model.fit.lower, model.fit.upper))
    assert lower < model.plant.pole_modes[0].omega < upper
    assert model.fit.synthetic is False
    assert [test.name for test in model.fit.tests] == ["test_0.csv", "test_1.csv"]
    assert model.fit.tests[0].sha256 == hashlib.sha256(sweeps[0].read_bytes()).hexdigest()
    assert model.fit.bound.mean_excess >= 1
    assert str(output.parent) not in output.read_text(encoding="utf-8")


def test_prints_estimates_errors_and_scatter(tmp_path: Path, fitted: tuple[Path, str], sweeps: list[Path]) -> None:
    lines = fitted[1].splitlines()
    assert lines[0].split() == ["parameter", "estimate", "95", "%", "interval", "noise", "scatter"]
    assert lines[1].split()[0] == "gain"
    assert len(lines[1].split()) == 7
    assert any(line.startswith("1 integrator, 1 zero mode, 1 pole mode; 2 tests") for line in lines)
    assert any(line.startswith("W_a = ") for line in lines)
    single = _fit(sweeps[0], "--modes", 1, "--real", 0, "--output", tmp_path / "model.json").output.splitlines()
    assert "scatter" not in single[0]
    assert len(single[1].split()) == 6


def test_one_synthetic_file_makes_the_model_synthetic(tmp_path: Path, sweeps: list[Path]) -> None:
    marked = _sweep(tmp_path / "marked.csv", 3, header="# SYNTHETIC\n")
    output = tmp_path / "model.json"
    assert _fit(sweeps[0], marked, "--modes", 1, "--real", 0, "--output", output).exit_code == 0
    assert json.loads(output.read_text(encoding="utf-8"))["fit"]["synthetic"] is True


def test_raw_and_frequency_response_together(tmp_path: Path) -> None:
    data = Path(__file__).resolve().parents[2] / "data" / "elevation"
    output = tmp_path / "model.json"
    files = [data / "synthetic_test_1_raw.csv", data / "synthetic_test_1_frf.csv"]
    result = _fit(*files, "--modes", 2, "--real", 0, "--integrators", 1, "--output", output)
    assert result.exit_code == 0, result.output
    assert read_model(output).fit.synthetic is True


def test_the_same_bytes_twice_and_its_figure(tmp_path: Path, fitted: tuple[Path, str], sweeps: list[Path]) -> None:
    again = tmp_path / "model.json"
    result = _fit(*sweeps, "--output", again)
    assert result.exit_code == 0, result.output
    assert again.read_bytes() == fitted[0].read_bytes()
    bode = ["bode", str(again), *map(str, sweeps), "--output", str(tmp_path)]
    assert CliRunner().invoke(paper_figures_main, bode).exit_code == 0
    assert all((tmp_path / f"bode.{kind}").stat().st_size > 0 for kind in ("pdf", "svg", "png"))
    assert "W_a" in (tmp_path / "bode.txt").read_text(encoding="utf-8")


def _refused(result: Result, folder: Path, *words: str) -> None:
    """One sentence on stderr, status 2, no traceback, no file but the input."""
    assert result.exit_code == 2
    assert isinstance(result.exception, SystemExit)
    assert result.stdout == ""
    assert "Traceback" not in result.stderr
    assert len(result.stderr.strip().splitlines()) == 1
    for word in words:
        assert word in result.stderr
    assert sorted(path.name for path in folder.iterdir()) == ["bad.csv"]


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ("", ["bad.csv", "no header"]),
        ("time_s,output\n0,1\n", ["bad.csv, line 1", "time_s, input, output"]),
        ("frequency_hz,real,imag\n1,2,x\n", ["bad.csv, line 2", "imag is 'x'", "a finite number"]),
        ("frequency_hz,real,imag\n1,2,nan\n", ["bad.csv, line 2", "imag is 'nan'"]),
        ("frequency_hz,real,imag\n2,1,1\n-1,1,1\n", ["bad.csv, line 3", "frequency_hz is -1"]),
        ("frequency_hz,real,imag\n1,1,1\n", ["bad.csv", "holds 1 frequencies", "8 or more"]),
        ("time_s,input,output\n" + "".join(f"{k},1,{k % 5}\n" for k in range(300)), ["the input is 1 throughout"]),
    ],
)
def test_bad_files(tmp_path: Path, content: str, words: list[str]) -> None:
    bad = tmp_path / "bad.csv"
    bad.write_text(content, encoding="utf-8")
    _refused(_fit(bad, "--output", tmp_path / "model.json"), tmp_path, *words)


def test_missing_file_and_missing_folder(tmp_path: Path) -> None:
    bad = _sweep(tmp_path / "bad.csv", 0)
    _refused(_fit(tmp_path / "no.csv", "--output", tmp_path / "model.json"), tmp_path, "no.csv: no such file")
    _refused(_fit(bad, "--output", tmp_path / "none" / "model.json"), tmp_path, "cannot be written")


def test_data_that_cannot_carry_the_parameters(tmp_path: Path) -> None:
    bad = _sweep(tmp_path / "bad.csv", 0, lines=12)
    _refused(_fit(bad, "--modes", 3, "--output", tmp_path / "model.json"), tmp_path, "holds 12 lines", "16 or more")


def test_structure_loss_and_order_of_the_bound_as_asked(tmp_path: Path, sweeps: list[Path]) -> None:
    output = tmp_path / "model.json"
    asked = ["--modes", "1/2", "--real", "1/0", "--integrators", 1, "--loss", "soft-l1", "--bound-order", 3]
    result = _fit(*sweeps, *asked, "--bound-below", 50, "--bound-above", 0.25, "--output", output)
    assert result.exit_code == 0
    assert "covers the level of 50 given" in result.stdout
    model = read_model(output)
    assert model.fit.structure == "1 integrator, 1 zero mode, 2 pole modes, 1 real zero"
    assert model.fit.loss == "soft-L1"
    assert model.additive_bound.order == 3
    assert (model.fit.bound.outside.below, model.fit.bound.outside.above) == (50.0, 0.25)
    assert model.additive_bound.gain >= 50.0
    assert model.plant.integrators == 1
    assert len(model.plant.real_zeros) == 1


@pytest.mark.parametrize("option", ["--bound-below", "--bound-above"])
@pytest.mark.parametrize("level", ["0", "-1", "nan", "inf", "x"])
def test_a_level_that_is_none(tmp_path: Path, sweeps: list[Path], option: str, level: str) -> None:
    result = _fit(sweeps[0], "--modes", 1, "--real", 0, f"{option}={level}", "--output", tmp_path / "model.json")
    assert result.exit_code == 2
    assert "Traceback" not in result.stderr
    assert not (tmp_path / "model.json").exists()


@pytest.mark.parametrize("option", ["--modes", "--real"])
@pytest.mark.parametrize("counts", ["-1", "x", "2.5", "9", "", "1/", "1/1/1"])
def test_counts_are_a_usage_error(tmp_path: Path, option: str, counts: str) -> None:
    bad = _sweep(tmp_path / "bad.csv", 0)
    result = _fit(bad, "--output", tmp_path / "model.json", f"{option}={counts}")
    assert result.exit_code == 2
    assert "expected auto, N or ZEROS/POLES from 0 to" in result.stderr
    assert "Traceback" not in result.stderr
    assert sorted(path.name for path in tmp_path.iterdir()) == ["bad.csv"]
