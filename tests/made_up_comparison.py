"""Tables for Fig. A.8 with numbers that nobody computed, for its own test and for the snapshot of what it draws."""

from __future__ import annotations

import numpy as np
import pandas as pd

GUARANTEES = {"none": "none", "thesis": "none", "corrected": "global", "conditioning": "sector 0.875"}


def made_up_comparison() -> dict[str, pd.DataFrame]:
    """Four runs and one that is refused; the thesis's never recovers."""
    rows = []
    for upset, scale in (("start", 1.0), ("pulse", 0.5)):
        for k, (run, guarantee) in enumerate(GUARANTEES.items(), 1):
            row = {
                "run": run,
                "upset": upset,
                "lower_limit": -12.5,
                "limit": 12.5,
                "amplitude": 40.0,
                "refused": np.nan,
                "guarantee": guarantee,
            }
            row |= {"recovery_s": np.nan if run == "thesis" else scale * 5.25 / k, "largest_control": scale * 3.0 * k}
            row |= {"f": np.nan if run == "none" else 0.125 * k, "from_s": 1.375}
            rows.append(row | {"least_peak_error": 2.625 if upset == "start" else np.nan})
        rows.append({"run": "internal-model", "upset": upset, "refused": "the plant integrates"})
    time_s = np.linspace(0.0, 32.0, 321)
    runs = {"time_s": time_s, "reference": 40 * np.sin(1.5 * time_s), "output_unsaturated": 40 * np.sin(1.5 * time_s)}
    for k, run in enumerate(GUARANTEES, 1):
        since = time_s % 16
        runs[f"output_{run}"] = runs["output_unsaturated"] + (9.0 if run == "thesis" else 30 * np.exp(-k * since / 2))
    return {"compare": pd.DataFrame(rows), "compare_runs": pd.DataFrame(runs)}
