"""Reading sweeps: what is accepted means what it says, and what is refused gets one clear sentence."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from identification.files import InputError
from identification.frequency_response import read_sweep

FRF = ["frequency_hz,magnitude_db,phase_deg,coherence"] + [f"{f},{-f},{10 * f},0.9" for f in range(1, 11)]
RAW = ["time_s,input,output"] + [f"{0.01 * k:.4f},{np.sin(k * k / 500):.6f},{np.sin(k):.6f}" for k in range(200)]


def _write(tmp_path: Path, lines: list[str]) -> Path:
    path = tmp_path / "sweep.csv"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def _changed(lines: list[str], line: int, text: str | None) -> list[str]:
    """The lines with the one numbered ``line`` (from 1) replaced, or left out."""
    return lines[: line - 1] + ([] if text is None else [text]) + lines[line:]


def test_magnitude_and_phase(tmp_path: Path) -> None:
    test = read_sweep(_write(tmp_path, FRF))
    frequency_hz = np.arange(1, 11)
    np.testing.assert_allclose(test.omega, 2 * np.pi * frequency_hz)
    expected = 10 ** (-frequency_hz / 20) * np.exp(1j * np.radians(10 * frequency_hz))
    np.testing.assert_allclose(test.response, expected, rtol=1e-14)
    assert test.coherence is not None
    assert np.all(test.coherence == 0.9)
    assert test.name == "sweep.csv"
    assert not test.synthetic


def test_real_and_imaginary_part_comments_blank_lines_and_further_columns(tmp_path: Path) -> None:
    rows = [f"{k}, {f}.5, {f}, {-f}" for k, f in enumerate(range(1, 11))]
    lines = ["# SYNTHETIC", "", "row, frequency_hz, real, imag", *rows[:4], "# a remark", *rows[4:]]
    test = read_sweep(_write(tmp_path, lines))
    np.testing.assert_array_equal(test.response, np.arange(1, 11) * (1 - 1j))
    assert test.coherence is None
    assert test.synthetic


@pytest.mark.parametrize(
    ("lines", "place", "found", "expected"),
    [
        ([], ": ", "no header", "a CSV with a header line"),
        (["# only this"], ": ", "no header", "a CSV with a header line"),
        (FRF[:1], ": ", "no numbers", "a line for each point"),
        (_changed(FRF, 1, "frequency_hz,magnitude_db"), ", line 1", "'magnitude_db'", "phase_deg"),
        (_changed(FRF, 1, "frequency_hz,real,imag,real"), ", line 1", "'real' comes twice", "once"),
        (_changed(FRF, 4, "3,-3,x,0.9"), ", line 4", "phase_deg is 'x'", "a finite number"),
        (["# a", "", *_changed(FRF, 4, "3,-3,x,0.9")], ", line 6", "phase_deg is 'x'", "a finite number"),
        (_changed(FRF, 4, "3,-3,,0.9"), ", line 4", "phase_deg is ''", "a finite number"),
        (_changed(FRF, 4, "3,nan,0,0.9"), ", line 4", "magnitude_db is 'nan'", "a finite number"),
        (_changed(FRF, 4, "3,-inf,0,0.9"), ", line 4", "magnitude_db is '-inf'", "a finite number"),
        (_changed(FRF, 4, "3,1e5,0,0.9"), ", line 4", "magnitude_db is 100000", "from -1000 to 1000"),
        (_changed(FRF, 4, "3,-3,0"), ", line 4", "3 fields", "4 as in the header"),
        (_changed(FRF, 4, "2,-3,0,0.9"), ", line 4", "frequency_hz is 2", "more than the 2 of line 3"),
        (_changed(FRF, 4, "1.5,-3,0,0.9"), ", line 4", "frequency_hz is 1.5", "more than the 2 of line 3"),
        (_changed(FRF, 2, "0,-3,0,0.9"), ", line 2", "frequency_hz is 0", "a positive number"),
        (_changed(FRF, 2, "-1,-3,0,0.9"), ", line 2", "frequency_hz is -1", "a positive number"),
        (_changed(FRF, 4, "3,-3,0,1.5"), ", line 4", "coherence is 1.5", "from 0 to 1"),
        (FRF[:6], ": ", "5 frequencies", "8 or more"),
        (["frequency_hz,real,imag", *(f"{f},0,0" for f in range(1, 11))], ": ", "0 at every", "a plant that responds"),
        (_changed(RAW, 1, "time_s,input"), ", line 1", "'input'", "time_s, input, output"),
        (_changed(RAW, 9, "0.07,inf,0"), ", line 9", "input is 'inf'", "a finite number"),
        (_changed(RAW, 9, "0.06,1,0"), ", line 9", "time_s is 0.06", "more than the 0.06 of line 8"),
        (_changed(RAW, 9, None), ", line 9", "time_s is 0.08", "about 0.07 (uniform sampling, within 5 %"),
        (_changed(RAW, 9, "0.0712,1,0"), ", line 9", "time_s is 0.0712", "about 0.07"),
        (RAW[:100], ": ", "99 samples", "128 or more"),
        ([RAW[0], *(f"{k},2,{k % 7}" for k in range(200))], ": ", "the input is 2 throughout", "a sweep"),
        ([RAW[0], *(f"{k},{k % 7},3" for k in range(200))], ": ", "the output never changes", "the response to"),
    ],
)
def test_refusal_names_the_place_what_was_found_and_what_was_expected(
    tmp_path: Path, lines: list[str], place: str, found: str, expected: str
) -> None:
    path = _write(tmp_path, lines)
    with pytest.raises(InputError) as refusal:
        read_sweep(path)
    sentence = str(refusal.value)
    assert sentence.startswith(f"{path}{place}")
    assert found in sentence
    assert expected in sentence
    assert "expected" in sentence
    assert "\n" not in sentence


def test_missing_file(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no such file"):
        read_sweep(tmp_path / "none.csv")


def test_rounded_times_are_uniform(tmp_path: Path) -> None:
    """Times with six digits after the point at 512 Hz are up to 0.03 % of an interval off."""
    rng = np.random.default_rng(1)
    rows = [f"{k / 512:.6f},{u:.5f},{u:.5f}" for k, u in enumerate(rng.standard_normal(4096))]
    test = read_sweep(_write(tmp_path, ["time_s,input,output", *rows]))
    np.testing.assert_allclose(test.response, 1, atol=1e-9)
    assert test.omega[-1] < np.pi * 512
    assert test.variance is not None
