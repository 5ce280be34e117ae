"""What the report says of the thesis's designs and of its loops."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
from made_up_fit import design_of

from design.parameters import RollOff
from paper_figures.thesis.report.of_designs import loop_table, sentences


def outcomes() -> dict[str, pd.DataFrame]:
    rows = [
        {
            **{
                "run": run,
                "limit": 6.5,
                "required": 7.25,
                "last_saturation_s": last,
                "peak_error_after_1s": 4.5,
            },
            "relative_error_percent": error,
            **{"guaranteed_sector": sector, "needed_sector": np.inf, "largest_control": 123.5},
            **{"covered_control": 17.25, "covered": 0},
        }
        for run, last, error, sector in (
            ("none", np.nan, np.nan, np.nan),
            ("thesis", np.nan, 62.5, 0.0),
            ("corrected", 3.125, 0.75, 0.875),
        )
    ]
    return {
        **dict.fromkeys(("delay_free", "extended"), pd.DataFrame(rows)),
        "f_gamma": pd.DataFrame([{"f_best": 0.03125}]),
    }


def test_what_a_design_gives() -> None:
    found = sentences(design_of("delay-free"), "delay_free", outcomes())
    for part in (
        "With the corrected anti-windup the run is NOT covered by its guarantee, since the reference takes more",
        "= 0.375, no stabilising controller below 0.3125. K itself is UNSTABLE",
        "gamma = 48.5 by (2.23); corrected, guarantee sector 0.75, recovery in 1.75 s",
        "exceeds the limits of +-6.5",
    ):
        assert part in found, part
    found = sentences(design_of("extended"), "extended", outcomes())
    for part in ("poles of T_so -1+2j, -1-2j, -4", "The least f of (2.23) found over beta is 0.0312"):
        assert part in found, part


def test_a_row_for_each_loop() -> None:
    designs = {"delay_free": design_of("delay-free"), "extended": design_of("extended")}
    table = loop_table(designs, outcomes())
    assert table is not None
    rows = [" ".join(row) for row in table.rows]
    assert rows[0].split() == ["Chapter", "2,", "no", "anti-windup", "diverges"]
    assert "thesis's anti-windup 0.0625 any NOT stable none to the end 4.5 62.5 %" in rows[1]
    assert "1 stable LEFT 3.12 s 4.5 0.75 %" in rows[5]
    assert loop_table(designs, {}) is None


def test_the_robust_redesign_in_words() -> None:
    plain = design_of("extended")
    design = replace(plain, parameters=replace(plain.free, roll_off=RollOff(0.9, 2, 45.5)))
    table = pd.DataFrame(
        {
            "run": ["design_extended", "design_robust"],
            "peak": [7.25, 0.875],
            "delay_least_s": [0.0, 0.0015],
            "delay_greatest_s": [0.155, 0.144],
        }
    )
    said = sentences(design, "robust", {"robustness": table})
    for part in ("2 more poles of T_so at 45.5 rad/s", "= 0.875, where that design has 7.25", "1.5 ms to 144 ms"):
        assert part in said
    assert sentences(design, "robust", {}).endswith("45.5 rad/s.")
    as_it_is = replace(plain, parameters=replace(plain.free, roll_off=RollOff(0.9, 0, 45.5)))
    assert sentences(as_it_is, "robust", {}) == "As the design of chapters 3, 4."
