"""The one strict snapshot fixture: every number of every column, finite, real and within a stated tolerance."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from pytest_regressions.ndarrays_regression import NDArraysRegressionFixture
from pytest_regressions.num_regression import NumericRegressionFixture

RTOL = 1e-8
"""Of the number itself. Fits change by 2e-10 of it at most from one kernel to another."""

FLOOR = 1e-12
"""Of the column's largest magnitude, for small differences of large numbers.

They need 6e-14 beside RTOL. With five kernels of BLAS, one or two threads, NumPy without its vector instructions, libm
without FMA, compiled code for a generic processor, and all at once, no number of any table moves by more than a tenth
of its tolerance. Numbers below 1e-6 of their column's largest may therefore change by 1e-6 of themselves.
"""

FLOORS = {
    # The tail of a Riccati equation's digits: 9e-9 of each number from one BLAS kernel to another.
    "design_delay_free.*": 1e-7,
    # The part between +-10 of a control that diverges to 6e5: 8e-10, as exact as that scale permits.
    "delay_free.saturated_none": 1e-7,
    # What is left of an error of 36 after its offset: 1e-3 at most, and 1e-9 of that from kernel to kernel.
    "extended_summary.ripple": 1e-7,
    # What half a million samples leave of the difference of two runs of 50: 4e-12, another way of carrying the plant.
    "hidden_modes.drift_coprime": 1e-7,
}
"""Columns that the computation itself knows less well, ``snapshot.column`` or ``snapshot.*``, each with its reason."""

MOST_ROWS = 120
"""A readable file keeps about this many rows of a long table, evenly spaced."""

LONG = 600
"""A column of more numbers than this is packed, and thinned in the readable file."""

Columns = Mapping[str, np.ndarray]
Strict = Callable[..., None]


def floor_of(want: np.ndarray, snapshot: str, column: str) -> float:
    """The tolerance that all numbers of a stored column have in common."""
    floor = FLOORS.get(f"{snapshot}.{column}", FLOORS.get(f"{snapshot}.*", FLOOR))
    return floor * float(np.abs(want).max())


def is_kept(values: np.ndarray, want: np.ndarray, tolerated: np.ndarray | None) -> np.ndarray:
    """For each value whether it counts as the stored one; integers and names have no tolerance, NaN never counts."""
    if tolerated is None:
        return np.asarray(values == want)
    return np.asarray(np.abs(values - want) <= tolerated)


class Stored:
    """A snapshot's columns, and what each of their numbers tolerates.

    Parameters
    ----------
    columns
        Its columns.
    name
        Of the snapshot, for :data:`FLOORS`.
    """

    def __init__(self, columns: Columns, name: str = "") -> None:
        self.columns, self.name = dict(columns), name
        for column, want in self.columns.items():
            _require_finite(column, want, "the snapshot")
        real = {column: want for column, want in self.columns.items() if want.dtype.kind == "f"}
        self.floors = {column: floor_of(want, name, column) for column, want in real.items()}
        self.tolerances = {column: RTOL * np.abs(want) + self.floors[column] for column, want in real.items()}

    def check(self, columns: Columns) -> None:
        """What pytest-regressions leaves out: equal columns, in order, of equal kind and length; finite reals.

        ``num_regression`` passes when a column is dropped, when NaN meets NaN, when 1.0 becomes 1, and with its own
        tolerances when 1e-9 becomes 3e-9. Here each number is held by RTOL of itself and a FLOOR of the largest of
        its column; nothing is absolute, and integers and names are exact.
        """
        assert columns, "there are no columns"
        others = {name: values for name, values in columns.items() if values is not self.columns.get(name)}
        for name, values in others.items():
            _require_real(name, values, "the data")
        assert list(self.columns) == list(columns), f"columns changed from {list(self.columns)} to {list(columns)}"
        for name, values in others.items():
            want = self.columns[name]
            assert len(want) == len(values), f"{name}: {len(values)} rows, the snapshot has {len(want)}"
            assert want.dtype.kind == values.dtype.kind, f"{name}: kind {values.dtype}, the snapshot's is {want.dtype}"
            kept = is_kept(values, want, self.tolerances.get(name))
            if not kept.all():
                _require_finite(name, values, "the data")
                row = int(np.argmin(kept))
                raise AssertionError(f"{name}: differs, first in row {row}: {values[row]!r} instead of {want[row]!r}")


def _require_real(name: str, values: np.ndarray, where: str) -> None:
    assert values.dtype.kind in "fiU", f"{name}: {values.dtype} is neither real nor a name"
    assert values.ndim == 1, f"{name}: has {values.ndim} dimensions"
    assert len(values), f"{name}: {where} has no rows"


def _require_finite(name: str, values: np.ndarray, where: str) -> None:
    _require_real(name, values, where)
    if values.dtype.kind == "f":
        assert np.all(np.isfinite(values)), f"{name}: {where} holds a value that is not finite"


def flagged(name: str, values: Any) -> dict[str, np.ndarray]:
    """A column as the fixture takes it: empty and infinite cells become zeros, or the name "-", with a flag beside."""
    values = np.ma.filled(values, np.nan) if isinstance(values, np.ma.MaskedArray) else np.asarray(values)
    if values.dtype.kind in "OT":
        empty = np.asarray(pd.isna(values))
        names = np.where(empty, "-", values).astype(str)
        return {f"{name}.is_empty": empty.astype(int), name: names} if empty.any() else {name: names}
    if values.dtype.kind == "b":
        return {name: values.astype(int)}
    if values.dtype.kind == "f" and np.isinf(values).any():
        infinite = np.isinf(values)
        signs = np.where(infinite, np.sign(values), 0.0).astype(int)
        return {f"{name}.is_infinite": signs} | flagged(name, np.where(infinite, 0.0, values))
    if values.dtype.kind != "f" or not np.isnan(values).any():
        return {name: values}
    return {f"{name}.is_empty": np.isnan(values).astype(int), name: np.nan_to_num(values, nan=0.0)}


def table_of(columns: Columns) -> pd.DataFrame:
    """The table whose columns these are, its empty cells empty again and its infinite ones infinite."""
    kept = {}
    for name, values in columns.items():
        if name.endswith((".is_empty", ".is_infinite")):
            continue
        column, signs, empty = pd.Series(values), columns.get(f"{name}.is_infinite"), columns.get(f"{name}.is_empty")
        if signs is not None:
            column = column.mask(signs != 0, np.copysign(np.inf, signs))
        kept[name] = column if empty is None else column.mask(empty == 1)
    return pd.DataFrame(kept)


def readable(columns: Columns) -> dict[str, np.ndarray]:
    """The rows of the readable file; integers are written as floats, which a CSV file does not tell apart."""
    rows = max((len(values) for values in columns.values()), default=0)
    step = rows // MOST_ROWS if rows > LONG else 1
    return {
        name: values[::step].astype(float) if values.dtype.kind == "i" else values[::step]
        for name, values in columns.items()
    }


def read_snapshot(path: Path) -> dict[str, np.ndarray]:
    """The columns of a stored file, ``.csv`` or ``.npz``."""
    if path.suffix == ".npz":
        return unpacked(path)
    table = pd.read_csv(path, index_col=0)
    kinds = {name: float if table[name].dtype.kind in "fi" else str for name in table}
    return {str(name): table[name].to_numpy(dtype=kind) for name, kind in kinds.items()}


def pack(columns: Columns, path: Path) -> None:
    """Write columns; long ones in whole steps of a quarter of the FLOOR, as differences, a byte of each in turn.

    Of order 0 to 6, whichever are smallest: smooth signals leave few bytes. Every row of every table and every point of
    every line take 2.5 MB instead of 11; sums over blocks of rows would be smaller, but could not say which number
    changed, nor could the figures be drawn from them.
    """
    arrays: dict[str, np.ndarray] = {}
    for name, values in columns.items():
        if values.dtype.kind != "f" or len(values) <= LONG:
            arrays[name] = values
            continue
        step = FLOOR / 4 * float(np.abs(values).max()) or 1.0
        steps = np.rint(values / step).astype(np.int64)
        differences = [np.diff(steps, n=order, prepend=np.zeros(order, np.int64)) for order in range(7)]
        order = int(np.argmin([np.log2(1.0 + np.abs(found)).sum() for found in differences]))
        folded = ((differences[order] << 1) ^ (differences[order] >> 63)).astype("<u8")
        arrays[f"{name}|step, order"] = np.array([step, order])
        arrays[name] = folded.view(np.uint8).reshape(-1, 8).T
    np.savez_compressed(path, **arrays)  # type: ignore[arg-type]


def unpacked(path: Path) -> dict[str, np.ndarray]:
    """The columns that :func:`pack` wrote."""
    with np.load(path) as file:
        arrays = dict(file)
    columns: dict[str, np.ndarray] = {}
    for name, values in arrays.items():
        if f"{name}|step, order" in arrays:
            step, order = arrays[f"{name}|step, order"]
            folded = np.ascontiguousarray(values.T).view("<u8").ravel()
            steps = (folded >> np.uint64(1)).astype(np.int64) ^ -(folded & np.uint64(1)).astype(np.int64)
            for _ in range(int(order)):
                steps = np.cumsum(steps)
            columns[name] = steps * step
        elif not name.endswith("|step, order"):
            columns[name] = values
    return columns


class PackedRegression(NDArraysRegressionFixture):
    """``ndarrays_regression`` with packed files."""

    def _dump_fn(self, data_dict: dict[str, Any], filename: Path) -> None:
        pack(data_dict, filename)

    def _load_fn(self, filename: Path) -> dict[str, Any]:
        return unpacked(filename)


@pytest.fixture
def strict_snapshot(
    num_regression: NumericRegressionFixture,
    datadir: Any,
    original_datadir: Path,
    request: pytest.FixtureRequest,
) -> Strict:
    """Compare named columns with the stored snapshot of this name.

    ``name.npz`` holds every number. Unless ``rows=False``, for columns that are no table, ``name.csv`` beside it is
    for reading: the same rows, or evenly thinned ones of a long table. ``--force-regen`` writes what has changed.
    """
    packed = PackedRegression(datadir, original_datadir, request)

    def check(name: str, columns: Columns, *, rows: bool = True) -> None:
        failures: list[BaseException] = []
        for suffix, data in ((".npz", dict(columns)), (".csv", readable(columns))):
            if suffix == ".csv" and not rows:
                continue
            with collected(failures):
                tolerances = _precheck(original_datadir / f"{name}{suffix}", name, data, request.config)
                regression = packed if suffix == ".npz" else num_regression
                regression.check(data, basename=name, tolerances=tolerances)
        if failures:
            raise failures[0]

    return check


def _precheck(path: Path, name: str, data: Columns, config: pytest.Config) -> dict[str, dict[str, float]]:
    """Check against the stored file, if there is one, and return the same tolerances for pytest-regressions."""
    assert data, "there are no columns"
    for column, values in data.items():
        _require_finite(column, values, "the data")
    wanted = dict(data)
    if path.exists() and not config.getoption("regen_all"):
        try:
            stored = Stored(read_snapshot(path), name)
            stored.check(data)
        except AssertionError:
            if not config.getoption("force_regen"):
                raise
            path.unlink()
        else:
            wanted = stored.columns
    return {
        column: {"rtol": RTOL, "atol": floor_of(want, name, column)}
        for column, want in wanted.items()
        if want.dtype.kind == "f"
    }


@contextmanager
def collected(failures: list[BaseException]) -> Iterator[None]:
    """Keep a failure for later, so that one run looks at, or writes, all files of a snapshot."""
    try:
        yield
    except (AssertionError, pytest.fail.Exception) as failure:
        failures.append(failure)
