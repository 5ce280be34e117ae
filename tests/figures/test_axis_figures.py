"""The figures of a refit: they draw their tables, every axis has its unit, and nothing of somebody else's plant."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from made_up_fit import SIMPLE, model_of, plant_of, sweeps_of
from matplotlib.figure import Figure
from matplotlib.text import Text

from design.chapters_3_4.design_extended import design_extended
from design.design_file import Design
from experiments import rates
from experiments.comparison import comparison_tables
from experiments.rates import lowest_rate, rates_tables
from experiments.runs.references import sinusoid
from experiments.tracking import tracking_tables
from identification.model.additive_bound import AdditiveBound
from identification.model.model_file import IdentifiedModel
from identification.model.plant import PlantModel
from identification.model.signals import Signals
from paper_figures.axis_figures.registry import NAMES, axis_figure
from paper_figures.look.bode import plot_bode
from paper_figures.look.captions import hertz
from paper_figures.summary import page
from paper_figures.summary.build_folder import Found
from paper_figures.summary.words import summarise

SIGNALS = Signals("valve current", "mA", "level", "cm")
LIMITS = (-5.0, 9.0)
REFERENCE = sinusoid(7.0, 1.5, 1.2)
FOREIGN = re.compile(r"thesis|as the text|chapter|amplitude 50|12\.96|Popov", re.IGNORECASE)
UNITS = re.compile(r"\[(s|Hz|rad/s|cm|mA|deg|dB re cm/mA|-)\]$")
WITHOUT = re.compile(r"|Real part|Imaginary part|Magnitude|Relative distance \[dB\]")
Tables = dict[str, pd.DataFrame]


@pytest.fixture(scope="module")
def design() -> Design:
    bound = AdditiveBound.printed_form(gain=0.01, corner=100.0, omega=300.0, zeta=0.1)
    made = design_extended(IdentifiedModel(PlantModel(2.0, (), (), 0.05), bound), [1.5], 4.0, [(2.0, 1.0)])
    return replace(made, signals=SIGNALS)


@pytest.fixture(scope="module")
def tables(design: Design) -> Tables:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(rates, "SAMPLES", (2, 16))
        found = rates_tables(design, REFERENCE, LIMITS, rate=30.0)
    found |= tracking_tables(design, REFERENCE, LIMITS) | comparison_tables(design, REFERENCE, LIMITS)
    return found | made_up()


def made_up() -> Tables:
    """The physical limits and a campaign, with numbers that nobody computed."""
    start = np.arange(0.0, 12.0, 0.5)
    rest = {"start_s": start, "rest_lower": 4 / (1 + start) ** 3, "rest_upper": 4.1 / (1 + start) ** 3}
    rest |= {f"tail_{run}": k / (1 + start) ** 2 for run, k in (("none", 9.0), ("corrected", 6.0))}
    facts = {"lower_limit": LIMITS[0], "limit": LIMITS[1], "rate_limit": 40.0}
    settling = {"settling_upper_s": [2.5], "settling_none_s": [np.nan], "settling_corrected_s": [7.5]}
    share = np.linspace(0.1, 1.0, 10)
    runs = ("none", "thesis", "corrected")
    measured = {"peak_error": share, "steady_error": 0.1 * share, "recovery_s": 5 * share}
    peaks = {"least_peak_error": 0.25, "greatest_peak_error": 0.75}
    outcomes = {"plants": 40, "linear_stable": 1.0, "diverged": 0.0, "recovered": 0.9, "covered": 0.5}
    numbers = {"steady_error_50": 0.05, "recovery_50_s": 2.5, "seed": 3, "horizon_s": 21.0}
    return {
        "limits_extended": pd.DataFrame(settling).assign(**facts),
        "limits_extended_summary": pd.DataFrame(rest).assign(**facts),
        "campaign": pd.concat([pd.DataFrame({"run": run, "share": share} | measured) for run in runs]),
        "campaign_distance": pd.DataFrame(
            [{"run": run, "from": k / 4, "to": (k + 1) / 4} | outcomes | peaks for run in runs for k in range(4)]
        ),
        "campaign_summary": pd.DataFrame([{"run": run} | facts | outcomes | numbers for run in runs]),
    }


def drawn(name: str, design: Design, tables: Tables) -> tuple[Figure, str]:
    module = axis_figure(name)
    own = {table: tables[table] for table in module.TABLES}
    return module.draw(design, own), module.caption(design, own)


def labels(figure: Figure) -> list[str]:
    return [label for panel in figure.axes for label in (panel.get_xlabel(), panel.get_ylabel())]


@pytest.mark.parametrize("name", [*NAMES, "bode", "summary"])
def test_every_axis_has_its_unit_and_nothing_is_foreign(name: str, design: Design, tables: Tables) -> None:
    if name in NAMES:
        figure, caption = drawn(name, design, tables)
    else:
        tests = sweeps_of(plant_of(1), 2)
        model = model_of(plant_of(1), tests, SIMPLE, SIGNALS)
        kept = {"limits_extended": tables["limits_extended"].assign(periodic_lower=0.0)}
        kept |= {"tracking": tables["tracking_summary"], "compare": tables["compare"], "rates": tables["rates"]}
        said = summarise(model, tests, Found(None, {"design": design}, kept))
        figure = plot_bode(model, tests) if name == "bode" else page.draw(said, model, tests)
        caption = said.text()
    for label in labels(figure):
        assert UNITS.search(label) or WITHOUT.fullmatch(label), label
    assert any(UNITS.search(label) for label in labels(figure)) or name == "nyquist"
    printed = [text.get_text() for text in figure.findobj(Text)]
    for text in (caption, *printed):
        assert not FOREIGN.search(text), text


def test_the_run_is_that_of_the_table(design: Design, tables: Tables) -> None:
    figure, caption = drawn("run", design, tables)
    output, error, *controls = figure.axes
    assert [panel.get_ylabel() for panel in (output, error)] == ["level [cm]", "error [cm]"]
    table = tables["tracking"]
    for panel, signal in ((output, "output"), (error, "error")):
        line = panel.lines[-1]
        x, y = (np.asarray(values, dtype=float) for values in line.get_data())
        np.testing.assert_allclose(y, np.interp(x, table["time_s"], table[f"{signal}_corrected"]), atol=1e-9)
    assert len(controls) == 2
    assert {float(line.get_ydata()[0]) for line in controls[0].lines if line.get_linestyle() != "-"} >= {*LIMITS}
    last = tables["tracking_summary"].set_index("run")["last_saturation_s"]["corrected"]
    assert f"is last saturated at {last:.3g} s" in caption


def test_the_rates_are_those_of_the_table_and_the_caption_says_from_where_on(design: Design, tables: Tables) -> None:
    figure, caption = drawn("rates", design, tables)
    (panel,) = figure.axes
    table = tables["rates"]
    rows = table[(table["run"] == "corrected") & (table["method"] == "exact")]
    assert any(
        np.array_equal(line.get_xdata(), rows["rate_hz"])
        and np.allclose(line.get_ydata(), rows["steady_error"], equal_nan=True)
        for line in panel.lines
    )
    assert 30.0 in set(rows["rate_hz"])
    for method, words in (("tustin", "Tustin's rule"), ("exact", "held inputs")):
        rate = lowest_rate(table, "corrected", method)
        where = "at none of these rates" if np.isnan(rate) else f"from {rate:.3g} Hz on"
        assert f"{words} {where}" in caption


def test_the_lowest_rate_is_the_one_from_which_on_all_are_near() -> None:
    errors = {100.0: 0.5, 200.0: 0.05, 400.0: 0.5, 800.0: 0.05, 1600.0: 0.02}
    rows = [{"method": "continuous", "rate_hz": np.nan, "steady_error": 0.01}]
    rows += [{"method": "tustin", "rate_hz": rate, "steady_error": error} for rate, error in errors.items()]
    table = pd.DataFrame(rows).assign(run="corrected", amplitude=5.0, stable=1)
    assert lowest_rate(table, "corrected", "tustin") == 800.0
    table.loc[table["rate_hz"] == 800.0, "stable"] = 0
    assert lowest_rate(table, "corrected", "tustin") == 1600.0
    table.loc[table["rate_hz"] == 1600.0, "steady_error"] = np.nan
    assert np.isnan(lowest_rate(table, "corrected", "tustin"))


def test_an_unstable_loop_has_no_steady_error(design: Design, tables: Tables) -> None:
    rates = tables["rates"].copy()
    unstable = (rates["method"] == "exact") & rates["rate_hz"].notna()
    rates.loc[unstable, ["stable", "steady_error"]] = [0, 0.0973 * rates["amplitude"].iloc[0]]
    figure, caption = drawn("rates", design, tables | {"rates": rates})
    squares = [line for line in figure.axes[0].lines if line.get_marker() == "s"]
    assert len(squares) > 1
    assert np.isnan(np.concatenate([np.asarray(line.get_ydata(), float) for line in squares])).all()
    assert f"the highest is {hertz(rates['rate_hz'].max())} (held inputs)" in caption


def test_every_dot_of_the_comparison_is_within_its_panel_and_can_be_told(design: Design, tables: Tables) -> None:
    same = tables["compare"].assign(recovery_s=6.7, largest_control=66.8, refused=np.nan)
    figure, _ = drawn("anti_windups", design, tables | {"compare": same})
    for panel in figure.axes[2:]:
        dots = [line for line in panel.lines if len(line.get_xdata()) == 1]
        assert len(dots) > 3
        assert 0.95 * panel.get_ylim()[1] > 6.7
        sizes = [dot.get_markersize() for dot in dots]
        assert sizes == sorted(set(sizes), reverse=True), "what is behind is wider"


def test_where_nothing_recovers_the_campaign_says_so(design: Design, tables: Tables) -> None:
    campaign = tables["campaign"].copy()
    campaign.loc[campaign["run"] != "thesis", "recovery_s"] = np.nan
    figure, _ = drawn("campaign", design, tables | {"campaign": campaign})
    assert "no run recovers" in [text.get_text() for text in figure.axes[2].texts]


def test_a_forced_error_is_in_the_view_of_the_limits(design: Design, tables: Tables) -> None:
    rest = tables["limits_extended_summary"].assign(rest_lower=0.363, rest_upper=0.364, tail_none=245.0)
    figure, _ = drawn("limits", design, tables | {"limits_extended_summary": rest})
    assert figure.axes[0].get_ylim()[0] < 0.363


def test_a_campaign_says_what_became_of_the_plants(design: Design, tables: Tables) -> None:
    _, caption = drawn("campaign", design, tables)
    for part in (
        "40 plants drawn within W_a (seed 3)",
        "limits -5 to 9 mA and the rate limit 40 mA/s, for 21 s",
        "period's error is 0.05 cm",
    ):
        assert part in caption
