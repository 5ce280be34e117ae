"""The strict fixture catches what pytest-regressions lets through."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from strict import RTOL, check_strictly

GOOD = {"x": np.linspace(1e-9, 2e-9, 5), "y": np.array([1.0, 2.0, 3.0, 4.0, 5.0])}


@pytest.fixture
def stored(tmp_path: Path) -> Path:
    import pandas as pd

    path = tmp_path / "stored.csv"
    pd.DataFrame(GOOD).to_csv(path, float_format="%.17g")
    return path


def check(columns: dict[str, np.ndarray], stored: Path) -> None:
    check_strictly(columns, stored, lambda _columns, _rtol: None)


def test_the_same_passes(stored: Path) -> None:
    check(GOOD, stored)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda c: {"x": c["x"]}, "columns changed"),
        (lambda c: c | {"z": c["x"]}, "columns changed"),
        (lambda c: {"y": c["y"], "x": c["x"]}, "columns changed"),
        (lambda c: c | {"x": 3 * c["x"]}, "differs"),  # far below num_regression's absolute tolerance
        (lambda c: c | {"y": c["y"] * (1 + 1e-6)}, "differs"),
        (lambda c: c | {"y": np.append(c["y"], 6.0)}, "rows"),
        (lambda c: c | {"y": np.array([1.0, 2.0, np.nan, 4.0, 5.0])}, "not finite"),
        (lambda c: c | {"y": c["y"] * np.inf}, "not finite"),
        (lambda c: c | {"y": c["y"] + 0j}, "not real"),
    ],
)
def test_every_change_is_caught(change, message: str, stored: Path) -> None:  # type: ignore[no-untyped-def]
    with pytest.raises(AssertionError, match=message):
        check(change(dict(GOOD)), stored)


def test_rounding_passes(stored: Path) -> None:
    check(GOOD | {"y": GOOD["y"] * (1 + RTOL / 10)}, stored)


def test_a_nan_in_the_snapshot_does_not_match_anything(stored: Path) -> None:
    stored.write_text(stored.read_text(encoding="utf-8").replace("3", "nan", 1), encoding="utf-8")
    with pytest.raises(AssertionError):
        check(GOOD, stored)
