"""Tables of numbers are written as pandas writes them, to the byte."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from experiments.tables import csv_writer

RANDOM = np.random.default_rng(1)
NUMBERS = RANDOM.normal(size=(9000, 5)) * 10.0 ** RANDOM.integers(-320, 308, size=(9000, 5))
NUMBERS[RANDOM.random(NUMBERS.shape) < 0.1] = np.nan
NUMBERS[0] = [np.inf, -np.inf, -0.0, 5e-324, 1e17]


@pytest.mark.parametrize("rows", [0, 1, 9000])
def test_numbers_are_written_as_pandas_writes_them(rows: int, tmp_path: Path) -> None:
    table = pd.DataFrame(NUMBERS[:rows], columns=["time_s", "b,c", 'd"', "é", "nan"])
    csv_writer(table)(tmp_path / "ours.csv")
    table.to_csv(tmp_path / "theirs.csv", index=False, float_format="%.12g", lineterminator="\n")
    assert (tmp_path / "ours.csv").read_bytes() == (tmp_path / "theirs.csv").read_bytes()
