"""Reading sweeps from universal files: written by pyuff or by hand with known numbers, read back, damaged, refused."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import pyuff
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from sweep_columns import FREQUENCY_HZ, RESPONSE, require_sentence_after_damage

from identification.base.errors import InputError
from identification.formats.reading import Reading
from identification.formats.uff_file import read_uff
from identification.sweeps.read_sweeps import read_sweeps
from identification.sweeps.response import FrequencyResponse

COHERENCE = 1 - FREQUENCY_HZ / 100
TIME_S = np.arange(200) / 128
SWEEP = np.sin(np.arange(200.0) ** 2 / 500)
NOISE = np.random.default_rng(0).standard_normal(200)


def _only_test(path: Path, **reading: Any) -> FrequencyResponse:
    (test,) = read_sweeps([path], Reading(**reading))
    return test


def _refusal(path: Path, **reading: Any) -> str:
    with pytest.raises(InputError) as refusal:
        read_sweeps([path], Reading(**reading))
    assert str(refusal.value).startswith(str(path))
    return str(refusal.value).removeprefix(str(path))


def _function(kind: int, x: np.ndarray, data: np.ndarray, **fields: Any) -> dict[str, Any]:
    point = {"rsp_node": 1, "rsp_dir": 3, "ref_node": 2, "ref_dir": 3}
    return (
        {
            "type": 58,
            "func_type": kind,
            "x": x,
            "data": data,
            "abscissa_spacing": 1,
            "orddenom_spec_data_type": 0,
            "binary": 0,
        }
        | point
        | fields
    )


def _uff(tmp_path: Path, *functions: dict[str, Any], name: str = "beam.uff") -> Path:
    path = tmp_path / name
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ResourceWarning)  # pyuff leaves a file open when it writes binary data
        pyuff.UFF(str(path)).write_sets([dict(function) for function in functions], mode="add")
    return path


FRF = _function(4, FREQUENCY_HZ, RESPONSE, abscissa_axis_units_lab="Hz")
INPUT = _function(1, TIME_S, SWEEP, id1="input")
OUTPUT = _function(1, TIME_S, NOISE, id1="output")


@pytest.mark.parametrize("suffix", ["uff", "UNV", "58"])
@pytest.mark.parametrize("binary", [0, 1])
@pytest.mark.parametrize("spacing", [0, 1])
def test_uff_reads_back(tmp_path: Path, spacing: int, binary: int, suffix: str) -> None:
    written = FRF | {"abscissa_spacing": spacing, "binary": binary, "id2": "SYNTHETIC"}
    test = _only_test(_uff(tmp_path, written, name=f"beam.{suffix}"))
    np.testing.assert_allclose(test.omega, 2 * np.pi * FREQUENCY_HZ, rtol=1e-14)
    np.testing.assert_allclose(test.response, RESPONSE, rtol=1e-15 if binary else 1e-11)  # 12 digits in text
    assert test.coherence is None
    assert test.name == f"beam.{suffix}"
    assert test.synthetic


def test_uff_with_several_tests_their_coherences_and_other_functions(tmp_path: Path) -> None:
    x = FREQUENCY_HZ - 1
    path = _uff(
        tmp_path,
        _function(2, x, RESPONSE),
        _function(4, x, RESPONSE),
        _function(6, x, COHERENCE),
        {"type": 164, "units_code": 1, "length": 1, "force": 1, "temp": 1, "temp_offset": 0},
        _function(4, x, 2 * RESPONSE),
        _function(4, x, 3 * RESPONSE),
        _function(6, x, COHERENCE / 2),
        _function(6, x, COHERENCE / 3),
        _function(1, TIME_S, SWEEP, id1="tacho"),
    )
    tests = read_sweeps([path])
    assert [test.name for test in tests] == ["beam.uff, test 1", "beam.uff, test 2", "beam.uff, test 3"]
    for test, factor in zip(tests, (1, 2, 3), strict=True):
        np.testing.assert_allclose(test.omega, 2 * np.pi * x[1:])  # without the line at 0 Hz
        np.testing.assert_allclose(test.response, factor * RESPONSE[1:], rtol=1e-11)
        assert test.coherence is not None
        np.testing.assert_allclose(test.coherence, COHERENCE[1:] / factor)


def test_uff_raw_records(tmp_path: Path) -> None:
    u = np.random.default_rng(1).standard_normal(1024)
    time_s = np.arange(1024) / 128
    signals = [_function(1, time_s, k * u, id1=name) for k in (1, 2) for name in ("output", "input")]
    tests = read_sweeps([_uff(tmp_path, *signals, OUTPUT | {"id1": "tacho"})])
    assert [test.name for test in tests] == ["beam.uff, test 1", "beam.uff, test 2"]
    for test in tests:
        np.testing.assert_allclose(test.response, 1, rtol=1e-5)
        assert test.record is not None
        assert test.record.sampling_s == 1 / 128


EXPECTED_58 = (
    "expected data sets 58 of function type 4, or of type 1 with the first line input (or input_held) and output, "
    "or --columns NAME=OURS for that line"
)
OTHER_ABSCISSA = ", data set 2: the abscissa is another than that of data set 1; expected the same"


@pytest.mark.parametrize(
    ("functions", "sentence"),
    [
        (
            [_function(2, FREQUENCY_HZ, RESPONSE.real), _function(3, FREQUENCY_HZ, RESPONSE)],
            f": holds no frequency response but auto spectrum, cross spectrum; {EXPECTED_58}",
        ),
        (
            [INPUT | {"id1": "Input"}, OUTPUT | {"id1": "force"}],
            f": holds no frequency response but time responses 'Input', 'force'; {EXPECTED_58}",
        ),
        ([FRF, INPUT, OUTPUT], ": holds frequency responses and records of input and output; expected one of them"),
        ([INPUT, OUTPUT, OUTPUT], ": holds 1 inputs and 2 outputs; expected equal numbers"),
        ([FRF | {"data": RESPONSE.real}], ", data set 1: the values are real; expected complex ones"),
        ([INPUT | {"data": 1j * SWEEP}, OUTPUT], ", data set 1: the values are complex; expected real ones"),
        (
            [FRF | {"abscissa_axis_units_lab": "rpm"}],
            ", data set 1: the abscissa's unit is 'rpm'; expected Hz or rad/s",
        ),
        ([INPUT, OUTPUT | {"abscissa_axis_units_lab": "ms"}], ", data set 2: the abscissa's unit is 'ms'; expected s"),
        ([INPUT, _function(1, 2 * TIME_S, NOISE, id1="output")], OTHER_ABSCISSA),
        ([FRF, _function(6, FREQUENCY_HZ + 1, COHERENCE)], OTHER_ABSCISSA),
        (
            [FRF, FRF, _function(6, FREQUENCY_HZ, COHERENCE)],
            ", data set 1: 2 frequency responses and 1 coherences have its nodes and directions; "
            "expected one coherence for each",
        ),
        ([FRF, _function(6, FREQUENCY_HZ, COHERENCE + 1)], ": coherence(1) is 1.99; expected a number from 0 to 1"),
        ([INPUT | {"data": 0 * SWEEP}, OUTPUT], ": the input is 0 throughout; expected a sweep"),
    ],
)
def test_uff_refusal_in_one_sentence(tmp_path: Path, functions: list[dict[str, Any]], sentence: str) -> None:
    assert _refusal(_uff(tmp_path, *functions)) == sentence


def test_uff_that_is_cut_off_or_none(tmp_path: Path) -> None:
    path = _uff(tmp_path, FRF, FRF)
    lines = path.read_text(encoding="utf-8").splitlines(keepends=True)
    path.write_text("".join(lines[:14] + lines[15:]), encoding="utf-8")
    assert _refusal(path) == ", data set 1: cannot be read (8 of 10 values); expected a complete data set 58"
    path.write_text("".join(lines[:9] + lines[15:]), encoding="utf-8")
    assert _refusal(path).startswith(", data set 1: cannot be read (")
    assert _refusal(path).endswith("); expected a complete data set 58")
    path.write_text("frequency_hz,real,imag\n", encoding="utf-8")
    assert _refusal(path) == f": holds no frequency response; {EXPECTED_58}"


def _by_hand(ordinate: int, values: bytes, *, unit: str = "Hz", binary: str = "", kind: int = 4) -> bytes:
    """A data set 58 of nine values from 2 Hz on, laid out as its format says, whatever a library writes."""
    header = [
        f"    58{binary}",
        *["NONE"] * 5,
        f"{kind:5}{0:10}{1:5}{0:10} {'NONE':10}{1:10}{3:4} {'NONE':10}{2:10}{-3:4}",
        f"{ordinate:10}{9:10}{1:10}{2.0:13.5E}{0.5:13.5E}{0.0:13.5E}",
        f"{18:10}{0:5}{0:5}{0:5} {'Frequency':20} {unit:20}",
        f"{12:10}{0:5}{0:5}{0:5} {'Acceleration':20} {'m/s^2':20}",
        f"{13:10}{0:5}{0:5}{0:5} {'NONE':20} {'NONE':20}",
        f"{0:10}{0:5}{0:5}{0:5} {'NONE':20} {'NONE':20}",
    ]
    return b"    -1\n" + "".join(f"{line:80}\n" for line in header).encode() + values + b"    -1\n"


NINE = RESPONSE[:9]
PARTS = np.column_stack([NINE.real, NINE.imag]).ravel()
LINES = "".join(f"{number:20.12E}" for number in PARTS).encode() + b"\n"


@pytest.mark.parametrize(
    ("precision", "letter", "fill"),
    [("13.5", "E", "0"), ("20.12", "E", " "), ("20.12", "D", ""), ("20.12", "d", "0"), ("13.6", "E", "")],
)
def test_numbers_as_writers_write_them(tmp_path: Path, precision: str, letter: str, fill: str) -> None:
    """Exponents with a D, a last line that is filled up, numbers with no blank between; each in Windows' lines too."""
    width = int(float(precision))
    words = [f"{number:{precision}E}".replace("E", letter) for number in PARTS]
    per_line = 80 // width
    short = -len(words) % per_line
    words += {"0": [f"{0:{precision}E}"] * short, " ": [" " * width] * short, "": []}[fill]
    lines = ["".join(words[k : k + per_line]) for k in range(0, len(words), per_line)]
    content = _by_hand(5 if width == 13 else 6, "".join(f"{line}\n" for line in lines).encode())
    for end in (b"\n", b"\r\n", b"\r"):
        path = tmp_path / "beam.unv"
        path.write_bytes(content.replace(b"\n", end))
        test = _only_test(path)
        np.testing.assert_allclose(test.omega, 2 * np.pi * (2 + 0.5 * np.arange(9)))
        np.testing.assert_allclose(test.response, NINE, rtol=1e-5)


@pytest.mark.parametrize("fill", [b"", b"\n", b"\r\n", b" " * 16 + b"\n"])
@pytest.mark.parametrize(("order", "letter"), [(1, "<"), (2, ">")])
@pytest.mark.parametrize(("ordinate", "size"), [(5, "f4"), (6, "f8")])
def test_binary_numbers_as_writers_write_them(
    tmp_path: Path, ordinate: int, size: str, order: int, letter: str, fill: bytes
) -> None:
    """In both byte orders and precisions, one of which is what ends a data set of text; a count of bytes that lies."""
    numbers = PARTS.astype(letter + size)
    numbers[2:4] = np.frombuffer(b"\n    -1\n        ", letter + size)[:2]  # looks like an end
    binary = f"b{order:6}{2:6}{11:12}{7:12}{0:6}{0:6}{0:12}{0:12}"
    path = tmp_path / "beam.ufb"
    path.write_bytes(2 * _by_hand(ordinate, numbers.tobytes() + fill, binary=binary))
    tests = read_uff(path, Reading())
    assert len(tests) == 2
    for test in tests:
        np.testing.assert_array_equal(
            test.columns["response"], numbers[::2].astype(float) + 1j * numbers[1::2].astype(float)
        )


@pytest.mark.parametrize("unit", ["Hz", "[Hz]", "HERTZ", "(hz)", "NONE", "", "rad/s", "[Rad/S]"])
def test_units_of_the_abscissa(tmp_path: Path, unit: str) -> None:
    path = tmp_path / "beam.unv"
    path.write_bytes(_by_hand(6, LINES, unit=unit))
    factor = 1 if "ad/" in unit else 2 * np.pi
    test = _only_test(path)
    np.testing.assert_allclose(test.omega, factor * (2 + 0.5 * np.arange(9)))
    assert test.remarks == ("the response is acceleration in 'm/s^2' over force",)


def test_a_record_with_an_uneven_abscissa_and_a_name_of_its_own(tmp_path: Path) -> None:
    u = np.random.default_rng(1).standard_normal(1024)
    time_s = np.arange(1024) / 128
    signals = [_function(1, time_s, u, id1=name, abscissa_spacing=0, binary=1) for name in ("Force", "output")]
    test = _only_test(_uff(tmp_path, *signals), columns={"Force": "input"})
    np.testing.assert_allclose(test.response, 1, rtol=1e-5)


def test_functions_of_several_plants_are_told_apart(tmp_path: Path) -> None:
    """By the response's node and direction; by the reference's where a hammer moves."""
    ends = [(1, 3), (2, 3), (2, -1)]
    responses = [
        _function(4, FREQUENCY_HZ, (k + 1) * RESPONSE, rsp_node=node, rsp_dir=direction)
        for k, (node, direction) in enumerate([*ends, ends[0]])
    ]
    path = _uff(tmp_path, *responses)
    assert _refusal(path) == (
        ": holds functions of 3 plants, from the reference at node 2, direction 3 to the response at node 1, "
        "direction 3 (2 functions); from the reference at node 2, direction 3 to the response at node 2, direction -1 "
        "(1 function); from the reference at node 2, direction 3 to the response at node 2, direction 3 (1 function); "
        "expected those of one (choose its response, as in --node 1 --direction 3)"
    )
    assert "holds functions of 2 plants" in _refusal(path, node=2)
    assert ": holds no function whose response has node 7; expected one of these: from the" in _refusal(path, node=7)
    tests = read_sweeps(path, Reading(node=1))
    assert [test.name for test in tests] == ["beam.uff, test 1", "beam.uff, test 2"]
    np.testing.assert_allclose(tests[1].response, 4 * RESPONSE, rtol=1e-11)
    np.testing.assert_allclose(_only_test(path, node=2, direction=-1).response, 3 * RESPONSE, rtol=1e-11)

    moved = [_function(4, FREQUENCY_HZ, k * RESPONSE, ref_node=k) for k in (1, 2, 3)]
    path = _uff(tmp_path, *moved, name="hammer.uff")
    assert "choose its reference, as in --node 1 --direction 3)" in _refusal(path)
    np.testing.assert_allclose(_only_test(path, node=3).response, 3 * RESPONSE, rtol=1e-11)

    path = _uff(tmp_path, *responses, *moved, name="matrix.uff")
    assert "expected functions of one reference (keep those of each" in _refusal(path, node=1)


def test_records_of_several_plants_are_told_apart(tmp_path: Path) -> None:
    outputs = [OUTPUT | {"rsp_node": node} for node in (1, 2)]
    path = _uff(tmp_path, INPUT, outputs[0], INPUT, outputs[1])
    assert "holds functions of 2 plants" in _refusal(path)


def test_a_transmissibility_in_a_universal_file_of_any_name(tmp_path: Path) -> None:
    (tmp_path / "beam.txt").write_bytes(_by_hand(6, LINES, kind=5))
    np.testing.assert_allclose(_only_test(tmp_path / "beam.txt").response, NINE, rtol=1e-11)


@settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_no_damage_raises_anything_else(tmp_path: Path, data: st.DataObject) -> None:
    path = tmp_path / "whole.uff"
    if not path.exists():
        _uff(tmp_path, FRF | {"binary": 1}, _function(6, FREQUENCY_HZ, COHERENCE), name=path.name)
    require_sentence_after_damage(path, data)
