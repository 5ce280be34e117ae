"""Tables for Fig. A.7 with numbers that nobody computed, for its own test and for the snapshot of what it draws."""

from __future__ import annotations

import numpy as np
import pandas as pd

RECOVERIES = ("recovery_saturation_s", "recovery_1_s", "recovery_to_offset_s")
PRINTED = {"error": (8.6, 0.05), "desaturation": (4.0, 0.5), "recovery": (4.46, 0.005)}


def row(search: str, outcome: str, reading: str, **more: object) -> dict[str, object]:
    value, half_unit = PRINTED.get(outcome, (0.098, 0.0005))
    head = {
        "search": search,
        "outcome": outcome,
        "reading": reading,
        "printed": value,
        "tolerance": half_unit,
        "met": 0,
    }
    return head | {"limit": 12.0, "computed": value + 1.0} | more


def made_up_conditions() -> dict[str, pd.DataFrame]:
    """``conditions`` and ``conditions_summary`` with numbers that nobody computed."""
    limits = np.linspace(6.0, 30.0, 25)
    rows, alone = [], []
    for k, name in enumerate(("implied", "table")):
        for delay in ("exact", "pade"):
            for output in (0.0, 50.0):
                under = {"set": name, "delay": delay, "initial_output": output}
                for limit in limits[:: 3 if delay == "pade" else 1]:
                    values = {"error_after_1s": 200 / limit + k, "desaturation_s": 50 / limit + k}
                    values |= {"recovery_saturation_s": 30 / limit, "recovery_to_offset_s": 90 / limit}
                    rows.append({"case": "extended", "required": 10.5, "limit": limit} | under | values)
                span = {"met": 1, "limit_low": 19.25, "limit_high": 19.375, "limit": 19.3125 + (delay == "pade") / 64}
                alone.append(row("alone", "error", "error_after_1s", **(under | span)))
                span = {"met": 1, "limit_low": 12.5, "limit_high": 13.5, "limit": 13.0}
                alone.append(row("alone", "desaturation", "desaturation_s", **(under | span)))
                alone += [row("alone", "recovery", reading, **under) for reading in RECOVERIES]
                if output == 0.0:
                    alone[-1] |= {"limit": np.nan, "computed": np.nan}
        under = {"set": name, "delay": "none", "initial_output": 0.0}
        for limit in (9.0, 11.0, 10.0):
            values = {"limit": limit, "weights": "usual", "peak_percent": 10.0 ** (10 - limit)}
            rows.append({"case": "delay_free", "required": 11.0} | under | values)
        alone.append(
            row("alone", "delay_free_error", "peak_percent", **under, met=1, limit_low=10.75, limit_high=10.76)
            | {"limit": 10.755}
        )
        alone.append(row("weights", "delay_free_error", "peak_percent", **under, computed=2.875) | {"limit": 10.0})
        alone.append(
            row("any controller", "delay_free_error", "peak_percent", **under, computed=2.625) | {"limit": 10.0}
        )
        for search, miss in (("together", 0.1875), ("together, converging", 0.75)):
            joint = {"set": name, "delay": "exact", "initial_output": 61.5, "limit": 10.625, "worst_miss": miss + k / 8}
            for outcome, reading, ratio in (
                ("error", "error_overall", 1.125),
                ("desaturation", "desaturation_s", 0.5),
                ("recovery", "recovery_1_s", 0.75),
            ):
                computed = PRINTED[outcome][0] * ratio
                alone.append(row(search, outcome, reading, **joint, computed=computed, final_error_percent=37.0))
    return {"conditions": pd.DataFrame(rows), "conditions_summary": pd.DataFrame(alone)}
