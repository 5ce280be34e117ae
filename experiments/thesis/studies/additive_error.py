"""The additive error of every test under W_a (Fig. 2.9)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd

from identification.model.model_file import IdentifiedModel
from identification.sweeps.as_fitted import as_fitted
from identification.sweeps.response import FrequencyResponse


def additive_error_tables(model: IdentifiedModel, tests: Sequence[FrequencyResponse]) -> dict[str, pd.DataFrame]:
    """|P - P_test| and |W_a| at every line of every test, Thesis Eq. (2.21), without the aliases of a held input.

    Returns
    -------
    dict
        ``additive_error``: test (1, 2, ...), omega in rad/s, error, bound, plant (magnitudes in the plant's
        unit). ``additive_error_summary``: one row; tests, the synthetic among them, lines, the largest
        error/bound and where it is.
    """
    frames = []
    for number, test in enumerate(as_fitted(model, tests), start=1):
        s = 1j * test.omega
        nominal = model.plant(s)
        frames.append(
            pd.DataFrame(
                {
                    "test": number,
                    "omega": test.omega,
                    "error": np.abs(nominal - test.response),
                    "bound": np.abs(model.additive_bound(s)),
                    "plant": np.abs(nominal),
                }
            )
        )
    table = pd.concat(frames, ignore_index=True)
    worst = table.iloc[int((table["error"] / table["bound"]).to_numpy().argmax())]
    summary = {
        "tests": len(tests),
        "synthetic_tests": sum(test.synthetic for test in tests),
        "lines": len(table),
        "largest_ratio": worst["error"] / worst["bound"],
        "largest_ratio_omega": worst["omega"],
    }
    return {"additive_error": table, "additive_error_summary": pd.DataFrame([summary])}
