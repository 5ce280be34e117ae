"""The strict fixture catches what pytest-regressions lets through, and files of snapshots cannot go wrong unseen."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from strict import FLOOR, LONG, RTOL, Stored, Strict, flagged, pack, read_snapshot, table_of

GOOD = {
    "x": np.linspace(1e-9, 2e-9, 5),
    "y": np.array([1.0, 2.0, 3.0, 4.0, 5.0]),
    "count": np.arange(5),
    "run": np.array(["none", "none", "thesis", "thesis", "corrected"]),
}


@pytest.fixture
def original_datadir(tmp_path: Path) -> Path:
    """A folder of its own in place of this module's: nothing is written into the tree."""
    return tmp_path / "stored"


@pytest.fixture
def stored(original_datadir: Path, strict_snapshot: Strict) -> Path:
    """The folder of a snapshot of GOOD; the first run fails and writes."""
    with pytest.raises(pytest.fail.Exception, match="not found"):
        strict_snapshot("good", GOOD)
    assert {path.name for path in original_datadir.iterdir()} == {"good.csv", "good.npz"}
    return original_datadir


def test_the_same_passes(stored: Path, strict_snapshot: Strict) -> None:
    strict_snapshot("good", GOOD)


def test_the_tolerances_are_what_the_readme_says() -> None:
    assert (RTOL, FLOOR) == (1e-8, 1e-12)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda c: {key: c[key] for key in ("x", "count", "run")}, "columns changed"),
        (lambda c: c | {"z": c["x"]}, "columns changed"),
        (lambda c: {key: c[key] for key in ("y", "x", "count", "run")}, "columns changed"),
        (lambda c: c | {"x": 3 * c["x"]}, "differs"),  # far below num_regression's absolute tolerance
        (lambda c: c | {"y": c["y"] * (1 + 1e-6)}, "differs"),
        (lambda c: c | {"y": c["y"] * (1 + 2 * RTOL)}, "differs"),
        (lambda c: c | {"y": c["y"] + np.array([1e-6, 0, 0, 0, 0])}, "differs, first in row 0"),
        (lambda c: c | {"y": np.append(c["y"], 6.0)}, "rows"),
        (lambda c: c | {"y": np.array([1.0, 2.0, np.nan, 4.0, 5.0])}, "not finite"),
        (lambda c: c | {"y": c["y"] * np.inf}, "not finite"),
        (lambda c: c | {"y": c["y"] + 0j}, "neither real"),
        (lambda c: c | {"y": c["y"].astype(object)}, "neither real"),
        (lambda c: c | {"y": c["y"][:, None]}, "dimensions"),
        (lambda c: c | {"y": c["y"].astype(int)}, "kind"),
        (lambda c: c | {"count": c["count"].astype(float)}, "kind"),
        (lambda c: c | {"run": c["run"][::-1]}, "differs"),
        (lambda c: c | {"run": np.array(["none", "none", "thesis", "thesis", "mended"])}, "differs"),
        (lambda c: {name: values[:0] for name, values in c.items()}, "no rows"),
        (lambda _: {}, "no columns"),
    ],
)
def test_every_change_is_caught(change, message: str, stored: Path, strict_snapshot: Strict) -> None:  # type: ignore[no-untyped-def]
    before = {path.name: path.read_bytes() for path in stored.iterdir()}
    with pytest.raises(AssertionError, match=message):
        strict_snapshot("good", change(dict(GOOD)))
    assert {path.name: path.read_bytes() for path in stored.iterdir()} == before


def test_rounding_passes(stored: Path, strict_snapshot: Strict) -> None:
    strict_snapshot("good", GOOD | {"y": GOOD["y"] * (1 + RTOL / 10)})
    strict_snapshot("good", GOOD | {"y": GOOD["y"] + FLOOR, "x": GOOD["x"] / 3 * 3})


def test_a_negative_zero_is_a_zero() -> None:
    Stored({"x": np.array([0.0, 1.0])}).check({"x": np.array([-0.0, 1.0])})


def test_a_nan_in_the_readable_file_does_not_match_anything(stored: Path, strict_snapshot: Strict) -> None:
    path = stored / "good.csv"
    path.write_text(path.read_text(encoding="utf-8").replace(",3,", ",nan,", 1), encoding="utf-8")
    with pytest.raises(AssertionError, match="the snapshot holds a value that is not finite"):
        strict_snapshot("good", GOOD)


def test_a_nan_in_the_packed_file_does_not_match_anything(stored: Path, strict_snapshot: Strict) -> None:
    pack(GOOD | {"y": np.array([1.0, 2.0, np.nan, 4.0, 5.0])}, stored / "good.npz")
    with pytest.raises(AssertionError, match="the snapshot holds a value that is not finite"):
        strict_snapshot("good", GOOD)


@pytest.mark.parametrize("suffix", [".csv", ".npz"])
def test_a_missing_file_fails(suffix: str, stored: Path, strict_snapshot: Strict) -> None:
    (stored / f"good{suffix}").unlink()
    with pytest.raises(pytest.fail.Exception, match="not found"):
        strict_snapshot("good", GOOD)


def test_long_columns_come_back_from_their_file(tmp_path: Path) -> None:
    """Rounded to an eighth of the FLOOR, whatever their shape."""
    random = np.random.default_rng(1)
    count = 10 * LONG
    columns = {
        "smooth": 1e5 * np.sin(np.linspace(0, 20, count)),
        "rough": random.standard_normal(count) * 10.0 ** random.uniform(-12, 0, count),
        "extremes": np.where(random.random(count) < 0.5, -1e-300, 1e-300),
        "zero": np.zeros(count),
        "count": random.integers(-9, 9, count),
    }
    pack(columns, tmp_path / "file.npz")
    found = read_snapshot(tmp_path / "file.npz")
    assert list(found) == list(columns)
    for name, want in columns.items():
        assert found[name].dtype == want.dtype
        assert np.abs(found[name] - want).max() <= FLOOR / 7.9 * np.abs(want).max()


def test_empty_cells_come_back_from_their_flags() -> None:
    cells = {"x": np.array([1.0, np.nan, 0.0]), "run": np.array(["a", np.nan, "c"], dtype=object), "n": np.arange(3)}
    columns = {key: column for name, values in cells.items() for key, column in flagged(name, values).items()}
    assert list(columns) == ["x.is_empty", "x", "run.is_empty", "run", "n"]
    table = table_of(columns)
    assert list(table) == ["x", "run", "n"]
    assert table["x"].isna().tolist() == table["run"].isna().tolist() == [False, True, False]
    assert table["run"].tolist()[::2] == ["a", "c"]
