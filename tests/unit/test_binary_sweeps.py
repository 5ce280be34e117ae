"""Reading sweeps from MATLAB files: written with known numbers, read back, damaged and refused."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from scipy.io import savemat
from sweep_columns import COLUMNS as SHARED
from sweep_columns import FREQUENCY_HZ, RESPONSE, require_sentence_after_damage

from identification.base.errors import InputError
from identification.sweeps.read_sweeps import read_sweeps
from identification.sweeps.response import FrequencyResponse

COHERENCE = 1 - FREQUENCY_HZ / 100
TIME_S = np.arange(200) / 128
SWEEP = np.sin(np.arange(200.0) ** 2 / 500)
NOISE = np.random.default_rng(0).standard_normal(200)

COLUMNS = SHARED | {"response": RESPONSE, "coherence": COHERENCE}


def _only_test(path: Path) -> FrequencyResponse:
    (test,) = read_sweeps([path])
    return test


def _refusal(path: Path) -> str:
    with pytest.raises(InputError) as refusal:
        read_sweeps([path])
    assert str(refusal.value).startswith(str(path))
    return str(refusal.value).removeprefix(str(path))


def _mat(tmp_path: Path, **variables: Any) -> Path:
    path = tmp_path / "sweep.mat"
    savemat(path, variables)
    return path


@pytest.mark.parametrize("orientation", ["row", "column"])
@pytest.mark.parametrize("version", ["4", "5"])
@pytest.mark.parametrize(
    "names",
    [
        ["frequency_hz", "magnitude_db", "phase_deg"],
        ["omega", "magnitude", "phase_rad"],
        ["omega", "real", "imag"],
        ["frequency_hz", "response", "coherence"],
    ],
    ids="-".join,
)
def test_mat_reads_back(tmp_path: Path, names: list[str], version: str, orientation: str) -> None:
    path = tmp_path / "sweep.mat"
    variables = {name: COLUMNS[name] for name in names} | {"note": "further"}
    savemat(path, variables, format=version, oned_as=orientation)
    test = _only_test(path)
    np.testing.assert_allclose(test.omega, 2 * np.pi * FREQUENCY_HZ, rtol=1e-14)
    np.testing.assert_allclose(test.response, RESPONSE, rtol=1e-12)
    assert (test.coherence is not None) == ("coherence" in names)
    assert not test.synthetic


@pytest.mark.parametrize(
    ("labels", "names"),
    [
        (None, ["1", "2", "3"]),
        (np.array([4.0, 2.5, 1]), ["4", "2.5", "1"]),
        (np.array(["one", "2", "III"], dtype=object), ["one", "2", "III"]),
        (np.array(["one", "two", "III"]), ["one", "two", "III"]),
    ],
    ids=["none", "numbers", "cell", "char"],
)
def test_mat_with_a_column_for_each_test(tmp_path: Path, labels: Any, names: list[str]) -> None:
    variables = {} if labels is None else {"test": labels}
    path = _mat(tmp_path, omega=FREQUENCY_HZ, response=np.outer(RESPONSE, [1, 2, 3]), SYNTHETIC=True, **variables)
    tests = read_sweeps([path])
    assert [test.name for test in tests] == [f"sweep.mat, test {name}" for name in names]
    assert all(test.synthetic for test in tests)
    np.testing.assert_array_equal(tests[2].response, 3 * RESPONSE)


def test_mat_with_a_label_for_each_row(tmp_path: Path) -> None:
    path = _mat(
        tmp_path,
        omega=np.tile(FREQUENCY_HZ, 2),
        response=np.tile(RESPONSE, 2),
        test=np.repeat([1, 2], FREQUENCY_HZ.size),
    )
    assert [test.name for test in read_sweeps([path])] == ["sweep.mat, test 1", "sweep.mat, test 2"]


def test_mat_raw_record_of_integers(tmp_path: Path) -> None:
    u = np.random.default_rng(1).integers(-1000, 1000, 2048).astype(np.int16)
    test = _only_test(_mat(tmp_path, time_s=np.arange(2048) / 8, input=u, output=2 * u))
    np.testing.assert_allclose(test.response, 2, rtol=1e-5)
    assert test.record is not None
    assert test.record.sampling_s == 1 / 8
    np.testing.assert_array_equal(test.record.input, u)


def _with(values: np.ndarray, row: int, value: complex) -> np.ndarray:
    values = values.copy()
    values[row] = value
    return values


EXPECTED = (
    "expected frequency_hz, magnitude_db, phase_deg or frequency_hz, real, imag or frequency_hz, response or "
    "time_s, input, output (or omega, magnitude, phase_rad, input_held in their place)"
)


@pytest.mark.parametrize(
    ("variables", "sentence"),
    [
        ({"x": 1}, f": the variables are 'x'; {EXPECTED}"),
        ({"s": {"omega": 1, "response": 1j}}, f": the variables are 's (struct)'; {EXPECTED}"),
        ({"omega": "text", "response": RESPONSE}, f": the variables are 'omega (char)', 'response'; {EXPECTED}"),
        ({"Omega": 1, "response": 1j}, ": one of the variables is 'Omega'; expected 'omega' or another name"),
        (
            {"omega": 1, "response": 1j, "real": 1, "imag": 1},
            ": the variables hold both 'real' and 'response'; expected one of them",
        ),
        ({"omega": FREQUENCY_HZ, "response": RESPONSE.real}, ": response is real; expected complex numbers"),
        (
            {"omega": FREQUENCY_HZ, "magnitude": RESPONSE, "phase_deg": RESPONSE.real},
            ": magnitude is complex; expected real numbers",
        ),
        ({"omega": np.ones((2, 3)), "response": RESPONSE}, ": omega is 2 x 3; expected a vector"),
        ({"omega": np.ones((2, 3, 4)), "response": RESPONSE}, ": omega is 2 x 3 x 4; expected a vector or a matrix"),
        (
            {"omega": FREQUENCY_HZ, "response": RESPONSE[1:]},
            ": response is 9 x 1, omega holds 10 numbers; expected vectors of 10, "
            "or 10 rows and a column for each test, in all of response",
        ),
        (
            {"omega": FREQUENCY_HZ, "real": np.ones((10, 3)), "imag": np.ones(10)},
            ": imag is 10 x 1, omega holds 10 numbers; expected vectors of 10, or 10 rows and a column for each test, "
            "in all of real, imag",
        ),
        (
            {"omega": FREQUENCY_HZ, "response": RESPONSE, "test": [1, 2]},
            ": test holds 2 labels; expected 10",
        ),
        (
            {"omega": FREQUENCY_HZ, "response": np.outer(RESPONSE, [1, 2]), "test": [1, 1]},
            ": test holds 1, 1; expected one for each column of response, all different",
        ),
        (
            {
                "omega": FREQUENCY_HZ,
                "response": np.outer(RESPONSE, [1, 2]),
                "test": np.array([[1, 2], "b"], dtype=object),
            },
            ": test(1) is '[[1 2]]'; expected a number or a name",
        ),
        (
            {"omega": _with(FREQUENCY_HZ, 2, np.nan), "response": RESPONSE},
            ": omega(3) is nan; expected a finite number",
        ),
        (
            {"omega": _with(FREQUENCY_HZ, 2, 1.5), "response": RESPONSE},
            ": omega(3) is 1.5; expected more than the 2 of omega(2) (increasing, no duplicates)",
        ),
        (
            {"omega": FREQUENCY_HZ, "response": np.stack([RESPONSE, _with(RESPONSE, 4, np.inf)], axis=1)},
            ", test 2: response(5) is inf+0j; expected a finite number",
        ),
        (
            {"omega": FREQUENCY_HZ, "response": RESPONSE, "coherence": 2 * COHERENCE},
            ": coherence(1) is 1.98; expected a number from 0 to 1",
        ),
        ({"omega": FREQUENCY_HZ[:0], "response": RESPONSE[:0]}, ": omega is 0 x 0; expected a vector"),
        (
            {"time_s": _with(TIME_S, 9, 0.069), "input": SWEEP, "output": NOISE},
            ": time_s(10) is 0.069; expected about 0.0703125 (uniform sampling, within 5 % of an interval)",
        ),
        (
            {"time_s": TIME_S, "input": SWEEP, "output": 0 * NOISE},
            ": the output is 0 throughout; expected the response to a sweep",
        ),
    ],
)
def test_mat_refusal_in_one_sentence(tmp_path: Path, variables: dict[str, Any], sentence: str) -> None:
    assert _refusal(_mat(tmp_path, **variables)) == sentence


def test_mat_of_version_7_3_and_no_mat_at_all(tmp_path: Path) -> None:
    path = tmp_path / "sweep.mat"
    path.write_bytes(b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM" + bytes(400))
    assert _refusal(path) == ": is a MAT file of version 7.3; expected version 7 or older (in MATLAB, save with -v7)"
    path.write_bytes(b"frequency_hz,real,imag\n" * 20)
    assert _refusal(path).startswith(": cannot be read (Unknown mat file type")
    assert _refusal(path).endswith("); expected a MAT file of version 4 to 7")


@settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_no_damage_raises_anything_else(tmp_path: Path, data: st.DataObject) -> None:
    path = tmp_path / "whole.mat"
    if not path.exists():
        savemat(path, {"omega": FREQUENCY_HZ, "response": RESPONSE, "test": np.array(["a"] * 10, dtype=object)})
    require_sentence_after_damage(path, data)
