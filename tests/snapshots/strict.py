"""The one strict snapshot fixture."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from pytest_regressions.num_regression import NumericRegressionFixture

RTOL = 1e-7

Strict = Callable[[str, Mapping[str, np.ndarray]], None]


def check_strictly(
    columns: Mapping[str, np.ndarray], stored: Path, compare: Callable[[dict[str, np.ndarray], float], None]
) -> None:
    """What pytest-regressions leaves out: equal columns, equal lengths, finite reals, a tolerance on each column.

    ``num_regression`` passes when a column is dropped, when NaN meets NaN, and when 1e-9 becomes 3e-9. Here the
    columns must be the same in the same order, every value a finite real, and the tolerance is RTOL of the value
    or of the column's largest magnitude, whichever is larger; nothing is absolute.
    """
    for name, values in columns.items():
        assert values.dtype.kind in "fi", f"{name}: {values.dtype} is not real"
        assert values.ndim == 1, f"{name}: has {values.ndim} dimensions"
        assert np.all(np.isfinite(values)), f"{name}: holds a value that is not finite"
    if stored.exists():
        expected = pd.read_csv(stored, index_col=0)
        assert list(expected) == list(columns), f"columns changed from {list(expected)} to {list(columns)}"
        for name, values in columns.items():
            want = expected[name].to_numpy(dtype=float)
            assert np.all(np.isfinite(want)), f"{name}: the snapshot holds a value that is not finite"
            assert len(want) == len(values), f"{name}: {len(values)} rows, the snapshot has {len(want)}"
            worst = np.abs(values - want).max()
            assert worst <= RTOL * np.abs(want).max(), f"{name}: differs by {worst:g}"
    compare({name: np.asarray(values, dtype=float) for name, values in columns.items()}, RTOL)


@pytest.fixture
def strict_snapshot(num_regression: NumericRegressionFixture, request: pytest.FixtureRequest) -> Strict:
    """Compare named columns of equal length with the stored snapshot of this name."""

    def check(name: str, columns: Mapping[str, np.ndarray]) -> None:
        stored = request.path.with_suffix("") / f"{name}.csv"
        if request.config.getoption("force_regen"):
            stored.unlink(missing_ok=True)

        def compare(data: dict[str, np.ndarray], rtol: float) -> None:
            tolerances = {key: {"rtol": 0.0, "atol": rtol * float(np.abs(v).max())} for key, v in data.items()}
            num_regression.check(data, basename=name, tolerances=tolerances)

        check_strictly(columns, stored, compare)

    return check
