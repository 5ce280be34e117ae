"""Reading sweeps from CSV files: what is accepted means what it says, and what is refused gets one clear sentence."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from sweep_columns import COLUMNS, FREQUENCY_HZ, RESPONSE

from data.thesis import THESIS
from identification.base.errors import InputError
from identification.sweeps.input_files import input_files
from identification.sweeps.kept_responses import write_responses
from identification.sweeps.read_sweeps import read_sweeps
from identification.sweeps.response import FrequencyResponse

FRF = ["frequency_hz,magnitude_db,phase_deg,coherence"] + [f"{f},{-f},{10 * f},0.9" for f in range(1, 11)]
RAW = ["time_s,input,output"] + [f"{0.01 * k:.4f},{np.sin(k * k / 500):.6f},{np.sin(k):.6f}" for k in range(200)]
TWO = ["test,frequency_hz,real,imag"] + [f"{t},{f},{r},{f}" for t, r in ((7, 7), ("b", 8)) for f in range(1, 9)]
UNITS = [
    *(
        [f, m, p]
        for f in ("frequency_hz", "omega")
        for m in ("magnitude_db", "magnitude")
        for p in ("phase_deg", "phase_rad")
    ),
    ["frequency_hz", "real", "imag"],
    ["imag", "omega", "real"],
]


def _write(tmp_path: Path, lines: list[str], name: str = "sweep.csv") -> Path:
    path = tmp_path / name
    path.parent.mkdir(exist_ok=True)
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def _only_test(path: Path) -> FrequencyResponse:
    (test,) = read_sweeps([path])
    return test


def _changed(lines: list[str], line: int, text: str | None) -> list[str]:
    """The lines with the one numbered ``line`` (from 1) replaced, or left out."""
    return lines[: line - 1] + ([] if text is None else [text]) + lines[line:]


@pytest.mark.parametrize("separator", [",", ";", "\t", " , "])
@pytest.mark.parametrize("names", UNITS, ids="-".join)
def test_every_unit_reads_back_to_the_same_response(tmp_path: Path, names: list[str], separator: str) -> None:
    rows = zip(*(COLUMNS[name] for name in names), strict=True)
    lines = [separator.join(names), *(separator.join(map(repr, map(float, row))) for row in rows)]
    test = _only_test(_write(tmp_path, lines))
    np.testing.assert_allclose(test.omega, 2 * np.pi * FREQUENCY_HZ, rtol=1e-14)
    np.testing.assert_allclose(test.response, RESPONSE, rtol=1e-12)
    assert test.coherence is None
    assert test.name == "sweep.csv"
    assert not test.synthetic
    assert test.record is None


def test_coherence_comments_blank_lines_quotes_and_further_columns(tmp_path: Path) -> None:
    rows = [f'{k}, {f}.5, {f}, {-f}, 0.{f % 10},"a, b"' for k, f in enumerate(range(1, 11))]
    head = ["\ufeff# SYNTHETIC", "", 'row, frequency_hz, "real", imag, coherence, note']
    test = _only_test(_write(tmp_path, [*head, *rows[:4], "# a remark", *rows[4:]]))
    np.testing.assert_array_equal(test.response, np.arange(1, 11) * (1 - 1j))
    assert test.coherence is not None
    np.testing.assert_array_equal(test.coherence[:3], [0.1, 0.2, 0.3])
    assert test.synthetic


def test_single_zeros_of_the_response_are_kept(tmp_path: Path) -> None:
    test = _only_test(_write(tmp_path, ["frequency_hz,real,imag", *(f"{f},{f % 3},0" for f in range(1, 11))]))
    np.testing.assert_array_equal(test.response, np.arange(1, 11) % 3)


def test_raw_record(tmp_path: Path) -> None:
    """Times with six digits after the point at 512 Hz are up to 0.03 % of an interval off."""
    u = np.random.default_rng(1).standard_normal(4096).round(5)
    rows = [f"{k / 512:.6f},{value},{2 * value}" for k, value in enumerate(u)]
    test = _only_test(_write(tmp_path, ["time_s,input,output", *rows]))
    np.testing.assert_allclose(test.response, 2, rtol=1e-5)
    assert test.omega[-1] < np.pi * 512
    assert test.excitation is not None
    assert test.excitation.shape == test.omega.shape
    assert test.record is not None
    assert test.record.sampling_s == pytest.approx(1 / 512, rel=1e-6)
    np.testing.assert_array_equal(test.record.input, u)
    np.testing.assert_array_equal(test.record.output, 2 * u)
    assert not test.record.held


@pytest.mark.parametrize("order", ["one after the other", "line by line"])
def test_several_tests_in_one_file(tmp_path: Path, order: str) -> None:
    rows = (
        TWO[1:]
        if order == "one after the other"
        else [row for pair in zip(TWO[1:9], TWO[9:], strict=True) for row in pair]
    )
    path = _write(tmp_path, [TWO[0], *rows])
    first, second = read_sweeps([path])
    assert [first.name, second.name] == ["sweep.csv, test 7", "sweep.csv, test b"]
    assert first.path == second.path == path
    np.testing.assert_array_equal(first.response, 7 + 1j * np.arange(1, 9))


def test_one_label_is_no_part_of_the_name(tmp_path: Path) -> None:
    assert _only_test(_write(tmp_path, TWO[:9])).name == "sweep.csv"


def test_files_and_folders_in_their_order(tmp_path: Path) -> None:
    for k, name in enumerate(("b.csv", "a.CSV", ".hidden.csv", "notes.txt", "c.tsv", "d.lvm", "../0.txt")):
        _write(tmp_path, [FRF[0], *(f"{f},{k},0,0.9" for f in range(1, 9))], f"folder/{name}")
    (tmp_path / "folder" / "c.csv").mkdir()
    names = ["a.CSV", "b.csv", "c.tsv", "d.lvm", "0.txt"]
    assert [path.name for path in input_files([tmp_path / "folder", tmp_path / "0.txt"])] == names
    assert [test.name for test in read_sweeps([str(tmp_path / "folder"), tmp_path / "0.txt"])] == names


def test_equal_base_names_are_told_apart(tmp_path: Path) -> None:
    names = ("monday/1.csv", "tuesday/1.csv", "tuesday/2.csv")
    paths = [_write(tmp_path, FRF[: 9 + k], name) for k, name in enumerate(names)]
    assert [test.name for test in read_sweeps(paths)] == ["monday/1.csv", "tuesday/1.csv", "2.csv"]


def test_what_files_are_refused(tmp_path: Path) -> None:
    empty = tmp_path / "empty"
    empty.mkdir()
    with pytest.raises(InputError, match=r"empty: holds no file that ends in .csv, .tsv, .lvm, .mat, .*; expected"):
        input_files([empty])
    path = _write(tmp_path, FRF)
    with pytest.raises(InputError, match=r"sweep.csv: is given twice; expected each file once$"):
        read_sweeps([path, tmp_path])
    for name in ("none.csv", "none.mat", "none.uff", "none"):
        with pytest.raises(InputError, match=f"{name}: no such file$"):
            read_sweeps([tmp_path / name])


KINDS = (
    "expected frequency_hz, magnitude_db, phase_deg or frequency_hz, real, imag or frequency_hz, response "
    "or time_s, input, output (or omega, magnitude, phase_rad, input_held in their place), or --columns NAME=OURS"
)

UNIFORM = "expected about 0.07 (uniform sampling, within 5 % of an interval), or --resample"


@pytest.mark.parametrize(
    ("lines", "sentence"),
    [
        ([], ": holds no header and no numbers; expected a CSV with a header line"),
        (["# only this"], ": holds no header and no numbers; expected a CSV with a header line"),
        (FRF[:1], ": holds a header and no numbers; expected a line for each point"),
        # names
        (["frequency_hz,magnitude_db"], f", line 1: the columns are 'frequency_hz', 'magnitude_db'; {KINDS}"),
        (["# x", "freq_hz,mag_db"], f", line 2: the columns are 'freq_hz', 'mag_db'; {KINDS}"),
        (["time_s,input"], f", line 1: the columns are 'time_s', 'input'; {KINDS}"),
        (
            [",".join("abcdefghijklmnop") + "q" * 50],
            ", line 1: the columns are 'a', 'b', 'c', 'd', 'e', 'f', 'g', 'h', 'i', 'j', 'k', 'l' and 4 more; " + KINDS,
        ),
        (["frequency_hz,real,imag,real"], ", line 1: the columns hold 'real' twice; expected it once"),
        (
            ["frequency_hz,omega,real,imag"],
            ", line 1: the columns hold both 'frequency_hz' and 'omega'; expected one of them",
        ),
        (
            ["omega,magnitude,magnitude_db,phase_deg"],
            ", line 1: the columns hold both 'magnitude_db' and 'magnitude'; expected one of them",
        ),
        (
            ["omega,magnitude,phase_rad,phase_deg"],
            ", line 1: the columns hold both 'phase_deg' and 'phase_rad'; expected one of them",
        ),
        (
            ["omega,magnitude,phase_rad,real,imag"],
            ", line 1: the columns hold both 'magnitude' and 'real'; expected one of them",
        ),
        (
            ["time_s,input,input_held,output"],
            ", line 1: the columns hold both 'input' and 'input_held'; expected one of them",
        ),
        (
            ["time_s,input,output,coherence"],
            ", line 1: the columns hold both 'coherence' and 'time_s'; expected one of them",
        ),
        # numbers
        (
            ["frequency_hz;real,imag"],
            ", line 1: the header holds commas and semicolons; expected one of them between the columns",
        ),
        (_changed(FRF, 4, "3,-3,x,0.9"), ", line 4: phase_deg is 'x'; expected a finite number"),
        (["# a", "", *_changed(FRF, 4, "3,-3,x,0.9")], ", line 6: phase_deg is 'x'; expected a finite number"),
        (_changed(FRF, 4, "3,-3,,0.9"), ", line 4: phase_deg is ''; expected a finite number"),
        (_changed(FRF, 4, "3,1_0,0,0.9"), ", line 4: magnitude_db is '1_0'; expected a finite number"),
        (_changed(FRF, 4, "3,nan,0,0.9"), ", line 4: magnitude_db is 'nan'; expected a finite number"),
        (_changed(FRF, 4, "3,-inf,0,0.9"), ", line 4: magnitude_db is '-inf'; expected a finite number"),
        (["omega;real;imag", "1;2,5;0.1"], ", line 2: real is '2,5'; expected a finite number with a decimal point"),
        (
            ["omega,real,imag", "1,2,5,0"],
            ", line 2: holds 4 fields; expected 3 as in the header, and decimals with a point",
        ),
        (
            ["omega,real,imag", f"1,{'9' * 200000},0"],
            ", line 2: cannot be read (field larger than field limit (131072)); expected fields of a CSV",
        ),
        (_changed(FRF, 4, "3,-3,0"), ", line 4: holds 3 fields; expected 4 as in the header"),
        (_changed(FRF, 4, "3,1e5,0,0.9"), ", line 4: magnitude_db is 100000; expected a number from -1000 to 1000"),
        (_changed(FRF, 4, "1e60,1,0,0.9"), ", line 4: frequency_hz is 1e+60; expected a number up to 1e+50 in size"),
        # frequencies, coherence, response
        (_changed(FRF, 2, "-1,-3,0,0.9"), ", line 2: frequency_hz is -1; expected a positive number"),
        (_changed(FRF, 4, "3,-3,0,1.5"), ", line 4: coherence is 1.5; expected a number from 0 to 1"),
        (_changed(FRF, 4, "3,-3,0,-1e-3"), ", line 4: coherence is -0.001; expected a number from 0 to 1"),
        (_changed(FRF, 4, "3,-3,0,1.000100001"), ", line 4: coherence is 1.000100001; expected a number from 0 to 1"),
        (FRF[:6], ": holds 5 frequencies; expected 8 or more"),
        (
            ["omega,magnitude,phase_rad", *(f"{f},{5 - f},0" for f in range(1, 11))],
            ", line 7: magnitude is -1; expected zero or more (a minus sign is half a turn of the phase)",
        ),
        (
            ["frequency_hz,real,imag", *(f"{f},0,0" for f in range(1, 11))],
            ": the response is 0 at every frequency; expected a plant that responds",
        ),
        # tests
        (_changed(TWO, 12, "b,3,1,x"), ", line 12, test b: imag is 'x'; expected a finite number"),
        (_changed(TWO, 12, "b,2,1,1"), ", test b: holds 7 frequencies; expected 8 or more"),
        (_changed(TWO, 12, ",3,1,1"), ", line 12: test is ''; expected a number or a name"),
        (TWO[:12], ", test b: holds 3 frequencies; expected 8 or more"),
        # raw records
        (_changed(RAW, 9, "0.07,inf,0"), ", line 9: input is 'inf'; expected a finite number"),
        (
            _changed(RAW, 9, "0.06,1,0"),
            ", line 9: time_s is 0.06; expected more than the 0.06 of line 8 (increasing, no duplicates)",
        ),
        (
            _changed(RAW, 9, None),
            f", line 9: time_s is 0.08; {UNIFORM}",
        ),
        (
            _changed(RAW, 9, "0.0712,1,0"),
            f", line 9: time_s is 0.0712; {UNIFORM}",
        ),
        (RAW[:100], ": holds 99 samples; expected 128 or more"),
        ([RAW[0], *(f"{k},2,{k % 7}" for k in range(200))], ": the input is 2 throughout; expected a sweep"),
        (
            ["time_s,input_held,output", *(f"{k},2,{k % 7}" for k in range(200))],
            ": the input_held is 2 throughout; expected a sweep",
        ),
        (
            [RAW[0], *(f"{k},{k % 7},3" for k in range(200))],
            ": the output is 3 throughout; expected the response to a sweep",
        ),
        (
            [RAW[0], *(f"{k},{k % 7},{3 + 1e-12 * k}" for k in range(200))],
            ": the output is 3 throughout; expected the response to a sweep",
        ),
    ],
)
def test_refusal_in_one_sentence(tmp_path: Path, lines: list[str], sentence: str) -> None:
    path = _write(tmp_path, lines)
    with pytest.raises(InputError) as refusal:
        _only_test(path)
    assert str(refusal.value) == f"{path}{sentence}"


def _elevation(tmp_path: Path, kind: str, header: str) -> Path:
    """The first synthetic test under another header."""
    lines = (THESIS.parent / "elevation" / f"synthetic_test_1_{kind}.csv").read_text(encoding="utf-8").splitlines()
    return _write(tmp_path, ["# another header", header, *lines[4:]])


def test_swapped_input_and_output(tmp_path: Path) -> None:
    path = _elevation(tmp_path, "raw", "time_s,output,input")
    with pytest.raises(InputError) as refusal:
        _only_test(path)
    assert re.fullmatch(
        f"{path}: the output leads the input by about 0.008[0-9]* s; "
        r"expected an output that follows \(are the two swapped\?\)",
        str(refusal.value),
    )
    honest = _only_test(THESIS.parent / "elevation" / "synthetic_test_1_frf.csv")
    rows = [f"{w},{r.real},{r.imag}" for w, r in zip(honest.omega, 1 / honest.response, strict=True)]
    path = _write(tmp_path, ["omega,real,imag", *rows])
    with pytest.raises(InputError) as refusal:
        _only_test(path)
    assert str(refusal.value) == (
        f"{path}: the output leads the input by about 0.00879 s; expected a plant's output, which does not "
        "(are input and output swapped, or is the phase's sign?)"
    )


def test_phase_wrapped_in_the_other_unit(tmp_path: Path) -> None:
    path = _elevation(tmp_path, "frf", "frequency_hz,magnitude_db,phase_rad,coherence")
    with pytest.raises(InputError) as refusal:
        _only_test(path)
    assert str(refusal.value) == (
        f"{path}, line 232: phase_rad is 174.965 after the -178.964 of line 231, as if wrapped in degrees; "
        "expected radians"
    )
    honest = _only_test(THESIS.parent / "elevation" / "synthetic_test_1_frf.csv")
    rows = zip(honest.omega, np.abs(honest.response), np.angle(honest.response), strict=True)
    path = _write(tmp_path, ["omega,magnitude,phase_deg", *(f"{w},{m},{p:.4f}" for w, m, p in rows)])
    with pytest.raises(InputError) as refusal:
        _only_test(path)
    assert str(refusal.value) == (
        f"{path}, line 231: phase_deg is 3.0537 after the -3.1235 of line 230, as if wrapped in radians; "
        "expected degrees"
    )


def test_the_synthetic_tests_are_read_as_a_folder(tmp_path: Path) -> None:
    for path in (THESIS.parent / "elevation").glob("*_frf.csv"):
        shutil.copy(path, tmp_path)
    tests = read_sweeps([tmp_path])
    assert [test.name for test in tests] == [f"synthetic_test_{k}_frf.csv" for k in range(1, 7)]
    assert all(test.synthetic for test in tests)


def _read_or_refused_in_one_line(path: Path) -> bool:
    try:
        read_sweeps([path])
    except InputError as refusal:
        return str(refusal).startswith(str(path)) and len(str(refusal).splitlines()) == 1
    return True


HEADERS = st.sampled_from(
    ["", FRF[0], RAW[0], TWO[0], "omega;magnitude;phase_rad", "# f/kHz, Re(H), Im(H)", "frequency_hz,x,response"]
)
CELL = st.one_of(st.floats().map(repr), st.integers().map(str), st.text(max_size=5), st.just(""))


@settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    header=HEADERS,
    rows=st.one_of(st.text(), st.lists(st.lists(CELL, min_size=3, max_size=4).map(",".join)).map("\n".join)),
)
def test_no_text_raises_anything_else(tmp_path: Path, header: str, rows: str) -> None:
    path = tmp_path / "sweep.csv"
    path.write_text(f"{header}\n{rows}", encoding="utf-8", errors="replace", newline="")
    assert _read_or_refused_in_one_line(path)


@settings(max_examples=200, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    lines=st.sampled_from([FRF, RAW, TWO]),
    changes=st.lists(st.tuples(st.integers(0, 199), st.integers(0, 3), CELL), min_size=1, max_size=3),
)
def test_no_changed_number_raises_anything_else(
    tmp_path: Path, lines: list[str], changes: list[tuple[int, int, str]]
) -> None:
    cells = [line.split(",") for line in lines]
    for line, field, text in changes:
        row = cells[line % len(cells)]
        row[field % len(row)] = text
    path = tmp_path / "sweep.csv"
    path.write_text("\n".join(map(",".join, cells)), encoding="utf-8", errors="replace", newline="")
    assert _read_or_refused_in_one_line(path)


def test_responses_that_were_kept_are_read_as_they_were(tmp_path: Path) -> None:
    raw = THESIS.parent / "elevation" / "synthetic_test_1_raw.csv"
    tests = [*read_sweeps([raw]), _only_test(_write(tmp_path, FRF))]
    write_responses(tmp_path / "kept.npz", tests)
    for test, same in zip(tests, read_sweeps([tmp_path / "kept.npz"]), strict=True):
        assert (same.name, same.synthetic, same.path, same.record) == (test.name, test.synthetic, test.path, None)
        for name in ("omega", "response", "coherence", "excitation"):
            np.testing.assert_array_equal(getattr(same, name), getattr(test, name))
    for content in (b"", b"PK", (tmp_path / "kept.npz").read_bytes()[:500]):
        (tmp_path / "bad.npz").write_bytes(content)
        with pytest.raises(InputError, match=r"bad\.npz: not the responses"):
            read_sweeps([tmp_path / "bad.npz"])
