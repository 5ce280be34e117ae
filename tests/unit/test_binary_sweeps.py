"""Reading sweeps from MATLAB files: written with known numbers, read back, damaged and refused."""

from __future__ import annotations

import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from scipy.io import savemat
from sweep_columns import COLUMNS as SHARED
from sweep_columns import FREQUENCY_HZ, RESPONSE, require_sentence_after_damage

from identification.base.errors import InputError
from identification.formats import mat_choice
from identification.formats.reading import Reading
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


def test_mat_of_version_4_with_labels_of_letters(tmp_path: Path) -> None:
    path = tmp_path / "sweep.mat"
    columns = np.outer(RESPONSE, [1, 2])
    savemat(path, {"omega": FREQUENCY_HZ, "response": columns, "test": np.array(["one", "II"])}, format="4")
    assert [test.name for test in read_sweeps(path)] == ["sweep.mat, test one", "sweep.mat, test II"]


def test_mat_with_a_label_for_each_row(tmp_path: Path) -> None:
    path = _mat(
        tmp_path,
        omega=np.tile(FREQUENCY_HZ, 2),
        response=np.append(RESPONSE, 2 * RESPONSE),
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


CELLS = np.array(["a"] * 10, dtype=object)


def _with(values: np.ndarray, row: int, value: complex) -> np.ndarray:
    values = values.copy()
    values[row] = value
    return values


EXPECTED = (
    "expected frequency_hz, magnitude_db, phase_deg or frequency_hz, real, imag or frequency_hz, response or "
    "time_s, input, output (or omega, magnitude, phase_rad, input_held in their place), or --columns NAME=OURS"
)


@pytest.mark.parametrize(
    ("variables", "sentence"),
    [
        ({"x": 1}, f": the variables are 'x'; {EXPECTED}"),
        ({"s": {"omega": 1, "x": 1}}, f": the variables are 's (struct)', 's.omega', 's.x'; {EXPECTED}"),
        ({"omega": "text", "response": RESPONSE}, f": the variables are 'omega (char)', 'response'; {EXPECTED}"),
        (
            {"Omega": 1, "response": 1j},
            ": 'Omega' does not name a quantity with a unit; expected --columns \"Omega=omega\"",
        ),
        (
            {"omega": 1, "response": 1j, "Test": 1},
            ": one of the variables is 'Test'; expected 'test' or another name",
        ),
        (
            {"f": 1, "mag": 1, "phase": 1},
            ": 'f', 'mag', 'phase' do not name a quantity with a unit; expected --columns "
            '"f=frequency_hz,mag=magnitude_db,phase=phase_deg", or omega, or magnitude, or phase_rad',
        ),
        (
            {"data": {"freq": 1, "frf": 1j}},
            ": 'data.freq', 'data.frf' do not name a quantity with a unit; expected --columns "
            '"data.freq=frequency_hz,data.frf=response", or omega',
        ),
        (
            {"t": 1, "u": 1, "y": 1},
            ": 't', 'u', 'y' do not name a quantity with a unit; expected --columns "
            '"t=time_s,u=input,y=output", or input_held',
        ),
        (
            {"one": {"omega": 1, "response": 1j}, "two": {"omega": 1, "response": 1j}},
            ": 2 structures hold tests, 'one', 'two'; expected one, as by --columns "
            '"one.omega=omega,one.response=response"',
        ),
        (
            {"omega": 1, "response": 1j, "real": 1, "imag": 1},
            ": the variables hold both 'real' and 'response'; expected one of them",
        ),
        (
            {"omega": FREQUENCY_HZ, "response": RESPONSE.real},
            ": response is real; expected complex numbers (or a magnitude with a phase, or real and imag)",
        ),
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
            ": time_s(10) is 0.069; expected about 0.0703125 (uniform sampling, within 5 % of an interval), "
            "or --resample",
        ),
        (
            {"time_s": TIME_S, "input": SWEEP, "output": 0 * NOISE},
            ": the output is 0 throughout; expected the response to a sweep",
        ),
    ],
)
def test_mat_refusal_in_one_sentence(tmp_path: Path, variables: dict[str, Any], sentence: str) -> None:
    assert _refusal(_mat(tmp_path, **variables)) == sentence


def test_no_mat_at_all(tmp_path: Path) -> None:
    path = tmp_path / "sweep.mat"
    path.write_bytes(b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM" + bytes(400))
    assert _refusal(path).endswith("(file signature not found)); expected a whole MAT file")
    path.write_bytes(b"frequency_hz,real,imag\n" * 20)
    assert _refusal(path).startswith(": cannot be read (Unknown mat file type")
    assert _refusal(path).endswith("); expected a whole MAT file")


STRUCTURES: list[tuple[dict[str, Any], dict[str, str]]] = [
    ({"s": {"omega": FREQUENCY_HZ, "response": RESPONSE}}, {}),
    ({"top": {"s": {"omega": FREQUENCY_HZ, "response": RESPONSE}, "note": "further"}}, {}),
    ({"omega": FREQUENCY_HZ, "response": RESPONSE, "s": {"omega": -FREQUENCY_HZ, "response": RESPONSE}}, {}),
    ({"d": {"f": FREQUENCY_HZ, "frf": RESPONSE}}, {"d.f": "omega", "d.frf": "response", "Other (Hz)": "frequency_hz"}),
    ({"d": {"f": FREQUENCY_HZ, "response": RESPONSE}, "e": {"response": 1j}}, {"d.f": "omega"}),
    ({"f": FREQUENCY_HZ, "omega": 1, "d": {"frf": RESPONSE, "omega": 2}}, {"f": "omega", "d.frf": "response"}),
    (
        {"d": {"w_krad": 1, "f_kHz": FREQUENCY_HZ / (2e3 * np.pi), "frf": RESPONSE}},
        {"d.f_kHz": "frequency_hz", "d.frf": "response"},
    ),
    ({"w_rad_s": FREQUENCY_HZ, "FRF": RESPONSE}, {}),
    ({"f_Hz": FREQUENCY_HZ / (2 * np.pi), "H": RESPONSE}, {}),
    ({"freq_kHz": FREQUENCY_HZ / (2e3 * np.pi), "real": RESPONSE.real, "imag": RESPONSE.imag, "H": [1j, 2]}, {}),
]


@pytest.mark.parametrize("version", ["7", "7.3"])
@pytest.mark.parametrize(("variables", "columns"), STRUCTURES)
def test_mat_names_and_fields(tmp_path: Path, variables: dict[str, Any], columns: dict[str, str], version: str) -> None:
    if version == "7":
        path = tmp_path / "sweep.mat"
        savemat(path, variables, do_compression=True)
    else:
        path = _hdf5(tmp_path, **variables)
    (test,) = read_sweeps(path, Reading(columns))
    np.testing.assert_allclose(test.omega, FREQUENCY_HZ, rtol=1e-14)
    np.testing.assert_allclose(test.response, RESPONSE, rtol=1e-14)


def test_mat_vectors_along_any_axis(tmp_path: Path) -> None:
    path = _mat(tmp_path, omega=FREQUENCY_HZ[:, None], response=RESPONSE[None, None, :], coherence=COHERENCE[None, :])
    np.testing.assert_array_equal(_only_test(path).response, RESPONSE)
    path = _mat(tmp_path, omega=FREQUENCY_HZ, response=np.ones((2, 1, 10)) * RESPONSE)
    assert _refusal(path) == ": response is 2 x 1 x 10; expected a vector or a matrix"


@pytest.mark.parametrize("byte_order", ["<", ">"])
def test_mat_in_both_byte_orders(tmp_path: Path, byte_order: str) -> None:
    """The classes of numbers as they are stored: each in the smallest type that holds them."""
    path = tmp_path / "sweep.mat"
    numbers = {"frequency_hz": (9, "f4", 7), "real": (6, "i2", 3), "imag": (6, "u1", 2), "coherence": (9, "u1", 2)}
    elements = []
    for name, (kind, stored, tag) in numbers.items():
        content = np.arange(1, 11, dtype=byte_order + stored) if name != "coherence" else np.ones(10, "u1")
        flags = kind if name != "coherence" else 9 | 0x200
        parts = [
            (6, struct.pack(f"{byte_order}II", flags, 0)),
            (5, struct.pack(f"{byte_order}ii", 10, 1)),
            (1, name.encode()),
            (tag, content.tobytes()),
        ]
        body = b"".join(
            struct.pack(f"{byte_order}II", each, len(part)) + part + bytes(-len(part) % 8) for each, part in parts
        )
        elements.append(struct.pack(f"{byte_order}II", 14, len(body)) + body)
    mark = b"\x00\x01IM" if byte_order == "<" else b"\x01\x00MI"
    path.write_bytes(b"MATLAB 5.0 MAT-file".ljust(124) + mark + b"".join(elements))
    test = _only_test(path)
    np.testing.assert_array_equal(test.response, np.arange(1, 11) * (1 + 1j))
    assert test.coherence is not None
    assert np.all(test.coherence == 1)


def test_mat_objects_are_named_with_what_to_type(tmp_path: Path) -> None:
    """As MATLAB writes them: a variable without size, and what belongs to them in one without a name."""
    path = _mat(tmp_path, note=1)
    content = path.read_bytes()
    for kind, way in (("frd", "frequency_hz = G.Frequency; response = squeeze"), ("iddata", "input = G.InputData")):
        parts = [(6, struct.pack("<II", 17, 0)), (1, b"G"), (1, b"MCOS"), (1, kind.encode())]
        body = b"".join(struct.pack("<II", each, len(part)) + part + bytes(-len(part) % 8) for each, part in parts)
        path.write_bytes(content + struct.pack("<II", 14, len(body)) + body)
        assert f": G is an object of class {kind}, which only MATLAB reads; expected its numbers in" in _refusal(path)
        assert way in _refusal(path)
    plain = _mat(tmp_path, omega=FREQUENCY_HZ, response=RESPONSE)
    plain.write_bytes(plain.read_bytes() + struct.pack("<II", 14, len(body)) + body)
    np.testing.assert_array_equal(_only_test(plain).response, RESPONSE)


def _hdf5(tmp_path: Path, **variables: Any) -> Path:
    """A file of version 7.3 as MATLAB writes it: axes in the other order, structures as groups, cells as references."""
    path = tmp_path / "sweep.mat"
    with h5py.File(path, "w", userblock_size=512) as file:
        for name, value in variables.items():
            _put(file, name, value)
    with path.open("r+b") as raw:
        raw.write(b"MATLAB 7.0 MAT-file".ljust(124) + b"\x00\x02IM")
    return path


def _put(group: h5py.Group, name: str, value: Any) -> None:
    if isinstance(value, dict):
        item = group.create_group(name)
        kind = "struct"
        for field, each in value.items():
            _put(item, field, each)
    elif isinstance(value, str):
        item, kind = group.create_dataset(name, data=np.array([[ord(letter)] for letter in value], "u2")), "char"
    elif isinstance(value, list) and isinstance(value[0], str):
        for k, each in enumerate(value):
            _put(group.require_group("#refs#"), f"{name}{k}", each)
        cells = [group["#refs#"][f"{name}{k}"].ref for k in range(len(value))]
        item, kind = group.create_dataset(name, data=np.array([cells], h5py.ref_dtype)), "cell"
    else:
        value = np.atleast_2d(value).T
        kind = {"f8": "double", "c16": "double", "f4": "single", "i2": "int16", "b1": "logical"}.get(
            value.dtype.str[1:], "double"
        )
        if np.iscomplexobj(value):
            value = np.ascontiguousarray(value, complex).view([("real", "f8"), ("imag", "f8")])
        item = group.create_dataset(name, data=value.astype("u1") if kind == "logical" else value)
    item.attrs["MATLAB_class"] = np.bytes_(kind)


def test_mat_of_version_7_3(tmp_path: Path) -> None:
    """Of MATLAB, whatever the file is called, and of another program."""
    path = _hdf5(
        tmp_path,
        frequency_hz=FREQUENCY_HZ.astype("f4"),
        real=np.outer([1, 2], np.arange(1, 11, dtype="i2")).T,
        imag=np.outer([1, 2], np.ones(10)).T,
        test=["one", "II"],
        SYNTHETIC=True,
    )
    one, two = read_sweeps(path)
    assert (one.name, two.name) == ("sweep.mat, test one", "sweep.mat, test II")
    assert one.synthetic
    np.testing.assert_array_equal(two.response, 2 * np.arange(1, 11) + 2j)
    with h5py.File(path.rename(tmp_path / "sweep.data"), "w") as file:
        file.update({"frequency_hz": FREQUENCY_HZ, "response": RESPONSE})
    np.testing.assert_array_equal(_only_test(tmp_path / "sweep.data").response, RESPONSE)


def test_mat_of_version_7_3_with_a_structure_in_itself(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(mat_choice, "MOST_STRUCTURES", 50)
    path = _hdf5(tmp_path, s={"omega": FREQUENCY_HZ})
    with h5py.File(path, "r+") as file:
        file["s"].update({str(k): file["s"] for k in range(10)})
    assert _refusal(path).startswith(": the variables are 's (struct)', 's.0 (struct)', 's.1 (struct)'")


def test_mat_of_version_7_3_with_an_object(tmp_path: Path) -> None:
    path = _hdf5(tmp_path, G=np.arange(6))
    with h5py.File(path, "r+") as file:
        file["G"].attrs.update({"MATLAB_class": np.bytes_("idfrd"), "MATLAB_object_decode": 3})
    assert ": G is an object of class idfrd, which only MATLAB reads" in _refusal(path)


def test_mat_of_version_7_3_is_asked_its_sizes_and_places_first(tmp_path: Path) -> None:
    """Numbers that are none but would fill the memory; such as lie in other files."""
    path = _hdf5(tmp_path, omega=FREQUENCY_HZ)
    with h5py.File(path, "r+") as file:
        file.create_dataset("response", (10**9, 10), "c16", chunks=(1000, 10), compression="gzip")
    assert _refusal(path) == ": response is 10 x 1000000000, 80 GB; expected at most 1 GB"
    with h5py.File(path, "r+") as file:
        del file["response"]
        file.create_dataset("response", (10,), "c16", maxshape=(None,), chunks=(10**8,), compression="gzip")
    assert _refusal(path) == ": response is damaged; expected a whole double array"
    for link in (h5py.ExternalLink("other.mat", "response"), h5py.SoftLink("/omega")):
        with h5py.File(path, "r+") as file:
            del file["response"]
            file["response"] = link
        assert _refusal(path).startswith(": the variables are 'omega'; expected")
    with h5py.File(path, "r+") as file:
        del file["response"]
        file.create_dataset("response", (10,), "c16", external=[(str(path), 0, 160)])
    assert _refusal(path) == ": response is damaged; expected a whole double array"


WHOLE = {
    "of level 5": lambda folder: _mat(folder, omega=FREQUENCY_HZ, response=RESPONSE, test=CELLS),
    "of structures": lambda folder: _mat(folder, s={"t": {"omega": FREQUENCY_HZ, "response": RESPONSE}, "u": "a"}),
    "of version 7.3": lambda folder: _hdf5(folder, s={"omega": FREQUENCY_HZ, "response": RESPONSE}, test=["a"] * 10),
}


@pytest.mark.parametrize("make", WHOLE.values(), ids=WHOLE)
@settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_no_damage_raises_anything_else(tmp_path: Path, make: Callable[[Path], Path], data: st.DataObject) -> None:
    path = tmp_path / "sweep.mat"
    require_sentence_after_damage(path if path.exists() else make(tmp_path), data)
