"""What Fig. 2.10 and 2.11 share: the curves f(gamma), one a beta, and where each is least."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pandas as pd

from paper_figures.look.captions import only


def curves(tables: Mapping[str, pd.DataFrame]) -> list[tuple[float, pd.DataFrame]]:
    """Return each beta with its rows in the order of gamma, the chosen beta first and the others ascending."""
    table, chosen = tables["f_gamma"], only(tables["f_gamma_summary"], "beta")
    betas = sorted(table["beta"].unique())
    nearest = min(betas, key=lambda beta: abs(beta - chosen))
    betas.sort(key=lambda beta: (beta != nearest, beta))
    return [(beta, table[table["beta"] == beta].sort_values("gamma", ignore_index=True)) for beta in betas]


def lowest(curve: pd.DataFrame) -> tuple[float, float]:
    """Return gamma and f where f is least."""
    row = curve.iloc[int(curve["f"].to_numpy().argmin())]
    return float(row["gamma"]), float(row["f"])


def at_zero(curve: pd.DataFrame) -> float:
    """Return f(0) = ||W_a||_inf, which is the same for each beta."""
    return float(np.interp(0.0, curve["gamma"], curve["f"]))
