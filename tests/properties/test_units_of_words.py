"""What captions and summaries say stays readable in any unit: no NaN, and no two numbers said alike that differ."""

from __future__ import annotations

import re
from importlib import import_module

import numpy as np
import pandas as pd
import pytest
from other_units import Units

from design.design_file import Design
from experiments.runs.guarantee import Guarantee
from experiments.runs.verdict import Verdict
from experiments.runs.words import sector_text
from experiments.thesis.studies import hidden_modes, interpolation
from experiments.thesis.studies.chapter_2 import delay_free_tables
from experiments.thesis.studies.chapter_4 import extended_tables
from experiments.thesis.studies.hidden_modes import hidden_modes_tables
from experiments.thesis.studies.interpolation import interpolation_tables
from experiments.thesis.studies.sampled_rates import sampled_rates_tables
from identification.base.digits import told_apart
from paper_figures.look.captions import apart, duration, number, sampling_rate
from paper_figures.thesis.report.of_designs import loop_table, sentences

RANGE = re.compile(r"(?:from|between) (\S+)(?: \w+)? (?:to|and) (\S+)")
FIGURES = ("2_12", "2_13", "2_14", "4_01", "4_02", "4_03", "4_04", "a_02", "a_05", "a_09")


@pytest.mark.parametrize("units", [Units(1e9, 1.0, 1e15), Units(1e-9, 1.0, -1e-15), Units(1e5)], ids=str)
def test_captions_and_summaries(
    small_designs: dict[str, Design], units: Units, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(interpolation, "FREQUENCIES", 12)
    monkeypatch.setattr(hidden_modes, "PERIODS", 20)
    own = {kind: units.design(design) for kind, design in small_designs.items()}
    limit = 40.0 * abs(units.input)
    tables = extended_tables(own["extended"]) | delay_free_tables(own["delay-free"], limit)
    tables |= interpolation_tables(own["extended"]) | sampled_rates_tables(own["extended"], limit)
    tables |= hidden_modes_tables(own["extended"], limit)
    said = [import_module(f"paper_figures.thesis.figures.fig_{name}").caption(tables) for name in FIGURES]
    summaries = {name: tables[f"{name}_summary"] for name in ("extended", "delay_free")}
    named = {name: own[name.replace("_", "-")] for name in summaries}
    table = loop_table(named, summaries)
    assert table is not None
    said += [" ".join(row) for row in table.rows]
    said.append(sentences(own["extended"], "extended", summaries))
    for text in said:
        assert not re.search(r"\bnan\b|\binf\b", text), text
        for low, high in RANGE.findall(text):
            assert low != high, text


def test_times_and_rates_have_the_unit_that_suits_them() -> None:
    times = {0.0: "0 s", 2e-10: "2e-10 s", 3e-8: "30 ns", 5e-4: "500 us", 8.1e-3: "8.1 ms", 100.0: "100 s"}
    assert {time_s: duration(time_s) for time_s in times} == times
    rates = {1e-3: "0.001 Hz", 45.0: "45 Hz", 320.0: "0.32 kHz", 5120.0: "5.12 kHz", 2e8: "0.2 GHz", 3e6: "3 MHz"}
    assert {rate: sampling_rate(rate) for rate in rates} == rates


def test_numbers_that_differ_are_told_apart() -> None:
    assert apart(99.9951, 100.02, " s") == "99.995 s to 100.02 s"
    assert apart(0.07, 20.35) == "0.07 to 20.4"
    assert apart(7.0, 7.0) == "7"
    assert told_apart(0.950134, 0.9501341, 3, sector_text) == ("0.950134", "0.9501341")
    assert told_apart(1 - 1e-9, 1 - 1.001e-9, 3, sector_text)[0] != sector_text(1 - 1.001e-9, 5)
    one, next_one = 1.0, float(np.nextafter(1.0, 2.0))
    assert len(set(told_apart(one, next_one, 3, number))) == 2


def test_a_verdict_tells_what_is_needed_from_what_is_guaranteed() -> None:
    """ "needs the sector 0.95, 0.95 is guaranteed" and "takes a control of 10, beyond the limit 10" are riddles."""
    given = Guarantee(0.9501)
    near = Verdict(given, 220.4, 1.0, (-5.0, 5.0), (-12.0, 12.0), 0.9502, 1.0, 1.0)
    assert "needs the sector 0.9502 at t = 1 s, 0.9501 is guaranteed" in str(near)
    beyond = Verdict(given, 220.4, 1.0, (-10.00001, 10.00001), (-10.0, 10.0), np.inf, 1.0, 1.0)
    assert "a control of 10.00001, beyond the limit 10;" in str(beyond)
    anything = Verdict(Guarantee(1.0), 220.4, 1.0, (-5.0, 5.0), (-12.0, 12.0), 0.9, 1.0, np.nan)
    assert "any size is covered" in str(anything)


def test_a_dead_time_in_the_summary(small_designs: dict[str, Design]) -> None:
    """It said "1e+05 ms to 1e+05 ms"."""
    robust = small_designs["extended"]
    rows = [{"run": f"design_{name}", "peak": 0.9, "delay_least_s": 99.9951} for name in ("extended", "robust")]
    for greatest, said in ((100.02, "from 99.995 s to 100.02 s"), (np.nan, "100 s or more")):
        table = pd.DataFrame(rows).assign(delay_greatest_s=greatest)
        assert f"True dead times {said}, all else" in sentences(robust, "robust", {"robustness": table})
