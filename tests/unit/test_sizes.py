"""Sizes: many lines, lines read twice, large records and files that say they are small; memory and numbers hold."""

from __future__ import annotations

import struct
import tracemalloc
import warnings
import zlib
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from identification.__main__ import main
from identification.base.errors import InputError
from identification.fitting import grouped_lines
from identification.fitting.dead_time import group_delay
from identification.fitting.fit_plant import fit_plant
from identification.fitting.grouped_lines import grouped
from identification.fitting.least_squares import (
    BLOCK,
    information,
    log_jacobian,
    normal_equations,
    response_of,
)
from identification.fitting.likelihood import noise_levels
from identification.formats import mat_level_5, sizes
from identification.formats.csv_file import read_csv
from identification.formats.mat_file import read_mat
from identification.formats.reading import Reading
from identification.model.modes import Mode
from identification.model.plant import PlantModel
from identification.model.structure import Structure
from identification.sweeps import estimate_response as module
from identification.sweeps import from_table as reader
from identification.sweeps.read_sweeps import read_sweeps
from identification.sweeps.response import FrequencyResponse

PLANT = PlantModel(7.0, (Mode(174.0, 0.01),), (Mode(282.0, 0.02),), 8e-3)
FIVE_TO_200_HZ = 2 * np.pi * np.array([5.0, 200.0])


def sweep(omega: np.ndarray, noise: float = 0.02) -> FrequencyResponse:
    random = np.random.default_rng(1).normal(size=(2, omega.size))
    return FrequencyResponse(omega, PLANT(1j * omega) * (1 + noise * (random[0] + 1j * random[1])), None, "test")


@pytest.mark.parametrize("spaced", [np.linspace, np.geomspace])
@pytest.mark.parametrize("count", [8, 400, 8192])
def test_ordinary_tests_are_taken_line_by_line(spaced: Callable[..., np.ndarray], count: int) -> None:
    for low, high in (FIVE_TO_200_HZ, (1e-2, 1e3)):
        test = sweep(spaced(low, high, count))
        assert grouped(test) is test


def test_groups_are_weighted_means_with_the_errors_of_means(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(grouped_lines, "MOST_LINES", 100)
    test = sweep(np.linspace(*FIVE_TO_200_HZ, 20000))
    few = grouped(test)
    assert 90 < few.omega.size <= 101
    assert few.excitation is not None
    count = np.rint(1 / few.excitation)
    assert count.sum() == 20000
    assert np.sum(count * few.response) == pytest.approx(np.sum(test.response))
    error = np.abs(few.response / PLANT(1j * few.omega) - 1) * np.sqrt(count)
    away = np.abs(np.log(few.omega / np.array([[174.0], [282.0]]))).min(axis=0) > 0.2
    assert np.sqrt(np.mean(error[away] ** 2)) == pytest.approx(0.02 * np.sqrt(2), rel=0.3)


def test_the_plant_of_very_many_lines_is_that_of_every_line(monkeypatch: pytest.MonkeyPatch) -> None:
    """However few groups chose the structure: no number of the fit comes from them."""
    test = sweep(np.linspace(*FIVE_TO_200_HZ, 1200))
    expected = fit_plant([test])
    monkeypatch.setattr(grouped_lines, "MOST_LINES", 400)
    found = fit_plant([test])
    assert found.structure == expected.structure
    apart = np.abs(found.nominal.theta - expected.nominal.theta)
    assert np.all(apart < 0.05 * expected.nominal.noise)
    np.testing.assert_allclose(found.nominal.noise, expected.nominal.noise, rtol=1e-4)
    assert found.tests[0].lines == 1200
    assert found.tests[0].chi_square == pytest.approx(expected.tests[0].chi_square, rel=1e-6)


def test_blocks_of_lines_are_added() -> None:
    structure, omega = Structure(1, 2, 2), np.linspace(0.1, 3.0, 2 * BLOCK + 7)
    theta = np.array([0.1, 0.2, -3.0, 0.5, -3.0, 0.01])
    value, sigma = response_of(structure, theta, omega), 1 + omega
    response = value * (1 + 0.1 * np.sin(omega))
    rows = value[:, None] * log_jacobian(structure, theta, omega) / sigma[:, None]
    residual = (value - response) / sigma
    cost, slope, curvature = normal_equations(structure, theta, omega, response, sigma, soft=False)
    assert cost == pytest.approx(np.sum(np.abs(residual) ** 2))
    np.testing.assert_allclose(slope, (rows.conj().T @ residual).real, rtol=1e-9, atol=1e-9 * cost)
    for found in (curvature, information(structure, theta, omega, sigma)):
        np.testing.assert_allclose(found, (rows.conj().T @ rows).real, rtol=1e-9, atol=1e-9 * cost)


@pytest.mark.parametrize("soft", [False, True])
def test_the_noise_of_many_lines_is_searched_in_parts(soft: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    random = np.random.default_rng(2)
    power, excitation = random.uniform(0.1, 10, 500), random.uniform(0.5, 2, 500)
    error = (0.01 + 0.02 * power) * random.exponential(size=500)
    expected = noise_levels(error, power, excitation, soft)
    monkeypatch.setattr("identification.fitting.likelihood.HELD", 1)
    assert noise_levels(error, power, excitation, soft) == expected


@pytest.mark.parametrize("gap", [1e-4, 1e-9])
def test_lines_that_are_read_twice_are_one(gap: float) -> None:
    once = np.linspace(*FIVE_TO_200_HZ, 60)
    omega = np.sort(np.concatenate([once, once + gap]))
    assert grouped(sweep(omega)).omega.size == 60
    found = fit_plant([sweep(omega)])
    assert str(found.structure) == "1 integrator, 1 zero mode, 1 pole mode"
    truth = np.log([7.0, 174.0, 0.01, 282.0, 0.02])
    assert np.all(np.abs(found.nominal.theta[:-1] - truth) < 4 * found.nominal.noise[:-1])


@pytest.mark.parametrize("seed", range(6))
def test_lines_however_unevenly_apart_take_little_memory(seed: int) -> None:
    """Steps over nine decades; the dead times to look at are as many as the largest is times the least."""
    random = np.random.default_rng(seed)
    omega = 60.0 + np.cumsum(10 ** random.uniform(-8, 1, 40))
    tracemalloc.start()
    group_delay(omega, PLANT(1j * omega))
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 50e6


def test_a_csv_takes_little_more_memory_than_its_text(tmp_path: Path) -> None:
    test = sweep(np.linspace(*FIVE_TO_200_HZ, 20000))
    table = np.column_stack([test.omega, test.response.real, test.response.imag])
    np.savetxt(tmp_path / "many.csv", table, fmt="%.12g", delimiter=",", header="omega,real,imag", comments="")
    tracemalloc.start()
    (found,) = read_csv(tmp_path / "many.csv", Reading())
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 6 * (tmp_path / "many.csv").stat().st_size
    np.testing.assert_allclose(found.columns["imag"], test.response.imag, rtol=1e-10)


def test_windows_of_a_large_record_are_fitted_in_pieces(monkeypatch: pytest.MonkeyPatch) -> None:
    time_s = np.arange(2**12) * 1e-3
    u = np.sin(2 * np.pi * (5 * time_s + 24 * time_s**2))
    y = np.convolve(u, np.exp(-20 * time_s) * 0.02)[: u.size]
    expected = module.estimate_response(1e-3, u, y)
    monkeypatch.setattr(module, "HELD", 100)
    found = module.estimate_response(1e-3, u, y)
    np.testing.assert_allclose(found.omega, expected.omega, rtol=1e-12)
    np.testing.assert_allclose(found.response, expected.response, rtol=1e-6)


def test_more_points_than_a_fit_can_hold_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "many.csv").write_text("omega,real,imag\n" + "".join(f"{k},1,0\n" for k in range(1, 30)), "utf-8")
    monkeypatch.setattr(reader, "MOST_POINTS", 20)
    with pytest.raises(InputError, match=r"many\.csv: holds 29 points; expected at most 20"):
        read_sweeps(tmp_path / "many.csv")
    monkeypatch.setattr(sizes, "MOST_BYTES", 100)
    for name in ("many.csv", "many.uff", "many.mat"):
        (tmp_path / name).write_bytes((tmp_path / "many.csv").read_bytes())
        with pytest.raises(InputError, match=r": holds .* GB; expected at most 1e-07 GB"):
            read_sweeps(tmp_path / name)


ZEROS = 10**7  # bytes, which the files below hold in some 10 kB


def element(kind: int, content: bytes, zeros: int = 0) -> bytes:
    return struct.pack("<II", kind, len(content) + zeros) + content + bytes(zeros)


def array(kind: int, shape: tuple[int, ...], name: bytes, rest: bytes) -> bytes:
    """The content of a MAT array of a class."""
    head = element(6, struct.pack("<II", kind, 0)) + element(5, struct.pack(f"<{len(shape)}i", *shape))
    return head + element(1, name) + bytes(-len(name) % 8) + rest


def packed(content: bytes) -> bytes:
    return element(15, zlib.compress(element(14, content), 9))


NUMBERS = element(9, struct.pack("<19d", *range(1, 20)))
HUGE = array(6, (ZEROS // 8, 1), b"", element(9, b"", ZEROS))
BOMBS = {
    r"frequency_hz is 1250000 x 1, 0\.01 GB; expected": array(
        6, (ZEROS // 8, 1), b"frequency_hz", element(9, b"", ZEROS)
    ),
    r"real is 1073741824 x 4, 34\.4 GB; expected": array(6, (2**30, 4), b"real", NUMBERS),
    r"test is 1073741824 x 1, 8\.59 GB; expected": array(1, (2**30, 1), b"test", b""),
    "real is damaged; expected a whole double array": array(6, (19, 1), b"real", element(9, b"", ZEROS)),
    "test is damaged; expected a whole cell array": array(1, (1, 1), b"test", element(14, HUGE)),
    "test is damaged; expected a whole cell": array(
        1, (1, 1), b"test", element(14, array(1, (1, 1), b"", element(14, HUGE)))
    ),
}


@pytest.mark.parametrize("sentence", BOMBS)
def test_a_mat_file_is_asked_its_sizes_first(sentence: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for changed in (sizes, mat_level_5):
        monkeypatch.setattr(changed, "MOST_BYTES", 2 * 10**6)
    monkeypatch.setattr(mat_level_5, "MOST_CELLS", 10**6)
    header = b"MATLAB 5.0 MAT-file".ljust(124) + struct.pack("<H", 0x100) + b"IM"
    names = [name for name in (b"frequency_hz", b"real", b"imag") if name not in BOMBS[sentence][:80]]
    whole = [packed(array(6, (19, 1), name, NUMBERS)) for name in names]
    path = tmp_path / "bomb.mat"
    path.write_bytes(b"".join([header, *whole, packed(BOMBS[sentence])]))
    with pytest.raises(InputError, match=sentence):
        read_mat(path, Reading())


def test_a_structure_is_unpacked_where_it_is_needed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(mat_level_5, "MOST_BYTES", ZEROS // 2)
    header = b"MATLAB 5.0 MAT-file".ljust(124) + struct.pack("<H", 0x100) + b"IM"
    members = element(5, struct.pack("<i", 8)) + element(1, b"a".ljust(8, b"\0")) + element(14, HUGE)
    mine = packed(array(2, (1, 1), b"mine", members))
    whole = [packed(array(6, (19, 1), name, NUMBERS)) for name in (b"frequency_hz", b"real", b"imag")]
    (tmp_path / "mine.mat").write_bytes(b"".join([header, *whole, mine]))
    (table,) = read_mat(tmp_path / "mine.mat", Reading())
    np.testing.assert_array_equal(table.columns["real"], np.arange(1.0, 20.0))
    (tmp_path / "mine.mat").write_bytes(b"".join([header, *whole[:2], mine]))
    with pytest.raises(InputError, match=r"mine\.mat: mine is damaged; expected a whole structure"):
        read_mat(tmp_path / "mine.mat", Reading())


EXTREMES = (5e-324, 1e-320, 2.3e-308, 1e-160, 1e-60, 1e-49, 1e49, 1e50, 1e160, 1e300, 1.7e308)


@pytest.mark.parametrize("seed", range(6))
def test_extreme_numbers_end_in_a_sentence_or_a_fit(seed: int, tmp_path: Path) -> None:
    """In one place or a whole column, of a response or a record; beside another band. Warnings count as errors."""
    random = np.random.default_rng(seed)
    frequency_hz, time_s = np.linspace(5, 80, 24), np.arange(512) * 1e-3
    test = sweep(2 * np.pi * frequency_hz, 0.01)
    u = np.sin(2 * np.pi * (5 * time_s + 120 * time_s**2))
    kinds = (
        {"frequency_hz": frequency_hz, "real": test.response.real, "imag": test.response.imag},
        {"omega": test.omega, "magnitude": np.abs(test.response), "phase_rad": np.angle(test.response)},
        {"time_s": time_s, "input": u, "output": np.convolve(u, np.exp(-20 * time_s) * 0.02)[: u.size]},
    )
    columns = {name: values.copy() for name, values in kinds[seed % 3].items()}
    name, value = random.choice(list(columns)), random.choice(EXTREMES)
    with np.errstate(all="ignore"):
        if random.integers(2):
            columns[name] *= value
        else:
            columns[name][random.integers(columns[name].size)] = value * random.choice([-1, 1])
    path, other = tmp_path / "extreme.csv", tmp_path / "other.csv"
    for file, content in ((path, columns), (other, kinds[0])):
        rows = "\n".join(",".join(f"{number:.12g}" for number in row) for row in zip(*content.values(), strict=True))
        file.write_text(f"{','.join(content)}\n{rows}\n", encoding="utf-8")
    files = [str(path)] if random.integers(2) else [str(path), str(other)]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        result = CliRunner().invoke(main, ["fit", *files, "--output", str(tmp_path / "model.json")])
    assert result.exit_code in (0, 2), result.exception
    assert (tmp_path / "model.json").exists() == (result.exit_code == 0)
    if result.exit_code:
        assert len(result.stderr.splitlines()) == 1
        assert result.stderr.startswith("Error: ")


def test_tests_of_bands_far_apart_are_refused() -> None:
    tests = [sweep(np.linspace(*FIVE_TO_200_HZ, 60)), sweep(np.linspace(6e41, 5e42, 60))]
    with pytest.raises(InputError, match=r"lie from 31\.4159 to 5e\+42 rad/s; expected a band whose ends are no more"):
        fit_plant(tests)
