"""Time stamps that were rounded are even; uneven ones are refused, or brought to an even grid on request."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from identification.base.errors import InputError
from identification.formats.columns import Table
from identification.sweeps.even_grid import on_even_grid

Real = NDArray[np.float64]
N = 2000
RNG = np.random.default_rng(3)


def _table(time_s: Real, **signals: Real) -> Table:
    signals = signals or {"input": np.sin(time_s), "output": np.cos(time_s)}
    return Table(Path("a.csv"), {"time_s": time_s, **signals}, np.arange(2, time_s.size + 2), in_lines=True)


@pytest.mark.parametrize("start", [0.0, -7.5, 1.7e9], ids=["zero", "negative", "epoch"])
@pytest.mark.parametrize("rate", [360.0, 990.0, 1024.0, 2400.0])
def test_stamps_of_three_decimals_are_even(rate: float, start: float) -> None:
    """Also where the interval is less than the last digit, so that stamps repeat; none of it moves the rate."""
    stamps = np.round(start + np.arange(N) / rate, 3)
    table, sampling_s = on_even_grid(_table(stamps), resample=False)
    assert sampling_s == pytest.approx(1 / rate, rel=1e-5)
    assert table.remarks == (f"the time stamps are rounded to 0.001 s; all fit {1 / sampling_s:.7g} samples a second",)


def test_single_precision_is_even() -> None:
    stamps = (1000 + np.arange(N) / 3600).astype(np.float32).astype(float)
    _, sampling_s = on_even_grid(_table(stamps), resample=False)
    assert sampling_s == pytest.approx(1 / 3600, rel=1e-6)


def test_stamps_that_are_even_are_taken_as_they_are() -> None:
    stamps = 0.3 + np.arange(N) * 0.01
    table, sampling_s = on_even_grid(_table(stamps), resample=False)
    assert (sampling_s, table.remarks) == ((stamps[-1] - stamps[0]) / (N - 1), ())


UNEVEN = {
    "a row is missing": np.delete(np.arange(N + 1) / 100, 700),
    "rows are missing": np.delete(np.arange(N + 4) / 100, [300, 700, 1100, 1500]),
    "a row is missing, rounded": np.delete(np.round(np.arange(N + 1) / 360, 3), 700),
    "jitter": np.arange(N) / 100 + 2e-3 * RNG.uniform(-1, 1, N),
    "jitter, rounded": np.round(np.arange(N) / 100 + 2e-3 * RNG.uniform(-1, 1, N), 3),
    "another rate from half on": np.append(np.arange(N // 2) / 100, N / 200 + np.arange(N // 2) / 80),
}


@pytest.mark.parametrize("kind", UNEVEN)
def test_others_are_refused_with_what_to_type(kind: str) -> None:
    with pytest.raises(InputError, match=r"^a\.csv, line \d+: time_s is \S+; expected about \S+ .*or --resample$"):
        on_even_grid(_table(UNEVEN[kind]), resample=False)


def test_a_refusal_shows_the_digits_that_differ() -> None:
    stamps = 1.7e9 + UNEVEN["a row is missing, rounded"]
    with pytest.raises(InputError) as refusal:
        on_even_grid(_table(stamps), resample=False)
    found, expected = re.findall(r"1700000001\.\d+", str(refusal.value))
    assert float(found) - float(expected) == pytest.approx(0.003, abs=1.1e-3)


@pytest.mark.parametrize("resample", [False, True])
def test_times_that_fall_or_repeat_are_refused(resample: bool) -> None:
    for change in (0.0, -0.5):
        stamps = np.arange(N) / 100.0
        stamps[5] = stamps[4] + change / 100
        with pytest.raises(InputError, match=r"line 7: time_s is \S+; expected more than the 0\.04 of line 6"):
            on_even_grid(_table(stamps), resample=resample)


@pytest.mark.parametrize("kind", UNEVEN)
def test_a_resampled_record_is_off_by_no_more_than_is_said(kind: str) -> None:
    """A sine at the frequency that the remark gives, and a held input that keeps its last value."""
    time_s = UNEVEN[kind]
    first, _ = on_even_grid(_table(time_s), resample=True)
    (remark,) = first.remarks
    highest = float(re.search(r"a sine is followed to 1 % up to (\S+) Hz$", remark)[1])  # type: ignore[index]
    sine = np.sin(2 * np.pi * highest * time_s)
    table, sampling_s = on_even_grid(_table(time_s, input_held=time_s.copy(), output=sine), resample=True)
    grid = table.columns["time_s"]
    np.testing.assert_allclose(np.diff(grid), sampling_s, rtol=1e-6)
    inside = slice(5, -5)  # the spline has no slopes at its ends
    assert np.max(np.abs(table.columns["output"] - np.sin(2 * np.pi * highest * grid))[inside]) <= 0.011
    held = table.columns["input_held"]
    assert np.all((held <= grid + 1e-12) & np.isin(held, time_s))
    assert 0.03 / sampling_s > highest / 4 if "missing" in kind else highest > 0.1 / sampling_s


def test_long_gaps_are_refused() -> None:
    stamps = np.append(np.arange(N) / 100, 1e6)
    with pytest.raises(InputError, match=r"has 2000 intervals, an even grid of 0\.01 s has 100000000;"):
        on_even_grid(_table(stamps), resample=True)
