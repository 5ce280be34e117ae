"""The figures of data: the right lines in the named styles, honest captions, legible, robust against odd tables."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from itertools import combinations

import numpy as np
import pandas as pd
import pytest
from click.testing import CliRunner
from matplotlib.axes import Axes
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.text import Text

from identification.base.errors import InputError
from paper_figures import __main__ as command_line
from paper_figures.look import captions, panels, style
from paper_figures.thesis.figure_registry import figure_module
from paper_figures.thesis.figures import fig_2_12, fig_a_04, fig_a_05, fig_a_06, fig_a_09

Tables = dict[str, pd.DataFrame]

TIME_S = np.linspace(0.0, 12.0, 241)


def pid_tables() -> Tables:
    columns = {"time_s": TIME_S, "reference": np.full(len(TIME_S), 2.0)}
    for k, run in enumerate(("printed_none", "printed_back_calculation", "swapped_none", "swapped_back_calculation")):
        columns[f"output_{run}"] = 2.0 - 2.0 * np.exp(-TIME_S) * np.cos((k + 1) * TIME_S)
        columns[f"control_{run}"] = (9.0 - k) * np.exp(-TIME_S / 2)
        columns[f"saturated_{run}"] = np.clip(columns[f"control_{run}"], -3.0, 3.0)
    summary = {
        **{"step": 2.0, "back_calculation": 1.25, "limit": 3.0},
        **{"overshoot_printed_none": 41.0, "overshoot_printed_back_calculation": 6.5},
        **{"overshoot_swapped_none": 37.0, "overshoot_swapped_back_calculation": 1.75},
    }
    return {"pid": pd.DataFrame(columns), "pid_summary": pd.DataFrame([summary])}


def additive_error_tables(tests: int = 3) -> Tables:
    omega = np.linspace(40.0, 900.0, 60)
    rows = [
        pd.DataFrame({"test": test, "omega": omega, "error": test / omega, "bound": omega / 10, "plant": 5 / omega})
        for test in range(1, tests + 1)
    ]
    summary = {"tests": tests, "synthetic_tests": 2, "lines": 60 * tests}
    summary |= {"largest_ratio": 0.375, "largest_ratio_omega": 54.5}
    return {"additive_error": pd.concat(rows, ignore_index=True), "additive_error_summary": pd.DataFrame([summary])}


def f_gamma_tables(betas: tuple[float, ...] = (0.2, 0.05, 0.0125), chosen: float = 0.05) -> Tables:
    gamma = np.linspace(0.0, 60.0, 61)
    rows = [
        pd.DataFrame({"alpha": 0.1, "beta": beta, "gamma": gamma, "f": 4 - beta + np.abs(gamma - 20 - 400 * beta) / 20})
        for beta in betas
    ]
    summary = {"alpha": 0.1, "beta": chosen, "gamma": 40.0, "f": 3.95}
    summary |= {"beta_best": 0.0721, "gamma_best": 48.84, "f_best": 3.5279}
    return {"f_gamma": pd.concat(rows, ignore_index=True), "f_gamma_summary": pd.DataFrame([summary])}


def tracking_tables(name: str) -> Tables:
    columns = {"time_s": TIME_S, "reference": 5.0 * np.cos(1.5 * TIME_S)}
    rows = []
    for k, run in enumerate(("none", "thesis", "corrected", "none_pade", "thesis_pade")):
        columns[f"error_{run}"] = (5.0 - k) * np.exp(-TIME_S) + (2.5 if run.startswith("thesis") else 0.0)
        columns[f"output_{run}"] = columns["reference"] - columns[f"error_{run}"]
        columns[f"control_{run}"] = (12.0 + 10 * k) * np.exp(-TIME_S / 2) * np.cos(9 * TIME_S)
        columns[f"saturated_{run}"] = np.clip(columns[f"control_{run}"], -6.5, 6.5)
        rows.append(
            {
                **{"run": run, "limit": 6.5, "limit_is_given": 0, "required": 7.25, "last_saturation_s": 3.125 + k},
                **{"settling_s": 4.5 + k, "offset": -2.5 - k, "ripple": 0.625 + k},
                **{"peak_error_after_1s": 1.375 + k, "relative_error_percent": 62.5 + k},
                **{"guaranteed_sector": {"thesis": 0.0, "corrected": 0.875}.get(run, np.nan), "needed_sector": 0.9375},
                **{"largest_control": 123.5, "covered_control": 7.25, "covered": 0},
            }
        )
    return {name: pd.DataFrame(columns), f"{name}_summary": pd.DataFrame(rows)}


def limits_tables() -> Tables:
    tables = {}
    for kind, limit in (("extended", 8.0), ("delay_free", 4.0)):
        limits, start_s = np.array([2.0, 4.0, 6.0, 8.0, 10.0]), np.linspace(0.0, 8.0, 17)
        floor = np.maximum(0.0, 7.0 - limits)
        rows = {"limit": limits, "required": 7.0, "periodic_lower": floor, "periodic_upper": 1.01 * floor}
        rows |= {"settling_lower_s": 5 / limits, "settling_upper_s": 5.25 / limits}
        rest = {"limit": limit, "start_s": start_s, "rest_lower": np.maximum(0.0, 5.0 - 9 * start_s)}
        rest["rest_upper"] = rest["rest_lower"] + 0.03125
        for k, run in enumerate(("none", "thesis", "corrected"), start=2):
            rows[f"peak_{run}"] = 3 * k * np.maximum(1e-7, 7.0 - limits)
            rows[f"settling_{run}_s"] = (16.5 + k) / limits
            rows[f"ratio_{run}"] = 3.0 * k
            rest[f"tail_{run}"] = 5.0 * np.exp(-(start_s**2) / 4 / k)
        tables |= {f"limits_{kind}": pd.DataFrame(rows), f"limits_{kind}_summary": pd.DataFrame(rest)}
    return tables


def sampled_tables() -> Tables:
    time_s = np.linspace(0, 24, 481)
    columns, rows = {"time_s": time_s}, []
    for k, (run, least) in enumerate((("none", 0.0), ("thesis", 17.25), ("corrected", 0.0)), start=1):
        columns[f"error_{run}"] = least + 50 * np.exp(-time_s / k) * np.cos(4 * time_s)
        columns[f"error_{run}_drive"] = columns[f"error_{run}"] + 0.002 * np.sin(9 * time_s)
        rows.append((run, "continuous", np.nan, least + 1e-5, 2.25 * k))
        for order, method in ((1, "exact"), (2, "tustin")):
            rows += [(run, method, f, least + (40 / f) ** order, 2.5 * k) for f in (320.0, 1280.0, 5120.0)]
    facts = {"limit": 13.5, "quantum": 27 / 4096, "full_range_s": 0.0125, "root": 2 * np.pi * 160.0}
    facts |= {"shown_hz": 1280.0, "period_s": 4.25}
    summary = pd.DataFrame(rows, columns=["run", "method", "rate_hz", "steady_error", "settling_s"])
    return {"sampled": pd.DataFrame(columns), "sampled_summary": summary.assign(**facts)}


def hidden_modes_tables() -> Tables:
    time_s = np.geomspace(0.5, 5120, 400)
    columns = {"time_s": time_s, "drift_coprime": -0.002 - 0.001 * np.sin(time_s), "drift_thesis": -0.00125 * time_s}
    summary = {"run": ["coprime", "thesis"], "drift": [-0.00275, -6.125], "largest_drift": [0.003, 6.25]}
    facts = {"limit": 13.5, "resolution": 27 / 4096, "bits": 12, "rate_hz": 640.0, "duration_s": 5120.0}
    facts |= {"integrators": 1, "expected_drift": -6.5}
    return {"hidden_modes": pd.DataFrame(columns), "hidden_modes_summary": pd.DataFrame(summary).assign(**facts)}


def campaign_tables() -> Tables:
    """Of every run the last 30 plants of 120 diverge; with the thesis's anti-windup none recovers."""
    parts, distances, rows = [], [], []
    share = np.arange(1, 121) / 120
    for k, run in enumerate(("none", "thesis", "corrected"), start=1):
        values = np.where(share <= 0.75, share, np.nan)
        part = {"peak_error": 40 + 50 * k * values, "steady_error": 10 ** (k + 8 * values - 8)}
        part["recovery_s"] = 3 * k + 2 * values if run != "thesis" else np.nan
        parts.append(pd.DataFrame({"run": run, "share": share} | part))
        tenths = np.arange(10) / 10
        linear = np.where(tenths == 0.2, np.nan, 1 - tenths)  # no plant in the third bin
        distance = {"run": run, "from": tenths, "to": tenths + 0.1, "plants": np.where(tenths == 0.2, 0, 13)}
        distances.append(
            pd.DataFrame(
                distance
                | {"linear_stable": linear, "diverged": 0.25, "recovered": linear / k, "covered": 0.0}
                | {
                    "least_peak_error": 10.0 * k * linear,
                    "greatest_peak_error": np.where(tenths > 0.75, np.nan, 15 * k),
                }
            )
        )
        row = {
            "run": run,
            "plants": 120,
            "seed": 17,
            "lower_limit": -13.5,
            "limit": 13.5,
            "horizon_s": 21.25,
            "linear_stable": 0.625,
        }
        row |= {"diverged": 0.25, "recovered": 0.75 - k / 8, "steady_error_50": 10.0 ** (k - 4)}
        row |= {"covered": 0.0, "guaranteed_sector": 0.0}
        rows.append(row | {"recovery_50_s": 3 * k + 1 if run != "thesis" else np.nan})
    return {
        "campaign": pd.concat(parts, ignore_index=True),
        "campaign_summary": pd.DataFrame(rows),
        "campaign_distance": pd.concat(distances, ignore_index=True),
    }


TABLES = {
    "campaign": campaign_tables,
    "hidden_modes": hidden_modes_tables,
    "limits_extended": limits_tables,
    "sampled": sampled_tables,
    "pid": pid_tables,
    "additive_error": additive_error_tables,
    "f_gamma": f_gamma_tables,
    "delay_free": lambda: tracking_tables("delay_free"),
    "extended": lambda: tracking_tables("extended"),
}

# For every panel over time, in the order of the letters: column -> entry of style.LINES.
RUN = {"none": "without anti-windup", "thesis": "thesis anti-windup", "corrected": "corrected anti-windup"}
WITHOUT, WITH = RUN["none"], RUN["thesis"]


def pid_panels(kind: str, line: str) -> list[dict[str, str]]:
    return [
        panel
        for gains in ("swapped", "printed")
        for panel in ({"reference": "reference", f"output_{gains}_{kind}": line}, {f"control_{gains}_{kind}": line})
    ]


def signals(signal: str, *runs: str) -> dict[str, str]:
    return {f"{signal}_{run}": RUN[run] for run in runs}


REFERENCE = {"reference": "reference"}
PANELS = {
    "fig_2_02": pid_panels("none", WITHOUT),
    "fig_2_03": pid_panels("back_calculation", WITH),
    "fig_2_04": [
        REFERENCE | {f"output_{gains}_none": WITHOUT, f"output_{gains}_back_calculation": WITH}
        for gains in ("swapped", "printed")
    ],
    "fig_2_12": [
        REFERENCE | signals("output", "thesis", "corrected"),
        signals("error", "thesis", "corrected"),
    ],
    "fig_2_13": [signals("control", "thesis"), signals("control", "corrected")],
    "fig_2_14": [REFERENCE | signals("output", "none"), signals("error", "none")],
    "fig_4_01": [REFERENCE | signals("output", "none"), signals("error", "none"), {}],
    "fig_4_02": [signals("control", "none"), signals("saturated", "none")],
    "fig_4_03": [
        *(REFERENCE | signals("output", "thesis"), signals("error", "thesis")),
        *(REFERENCE | signals("output", "corrected"), signals("error", "corrected"), {}),
    ],
    "fig_4_04": [signals("control", run) for run in ("thesis", "corrected") for _ in range(3)],
}
NAMES = [*PANELS, "fig_2_09", "fig_2_10", "fig_2_11", "fig_a_04", "fig_a_05", "fig_a_06", "fig_a_09"]
CONTROL_PANELS = [
    *(("fig_2_02", 1, "swapped_none"), ("fig_2_02", 3, "printed_none")),
    *(("fig_2_03", 1, "swapped_back_calculation"), ("fig_2_03", 3, "printed_back_calculation")),
    *(("fig_2_13", 0, "thesis"), ("fig_2_13", 1, "corrected")),
    *(("fig_4_04", letter, run) for run, letters in (("thesis", (1, 2)), ("corrected", (4, 5))) for letter in letters),
]

each_figure = pytest.mark.parametrize("name", NAMES)


def tables_of(name: str) -> Tables:
    return TABLES[figure_module(name).TABLES[0]]()


@cache
def drawn_once(name: str) -> Figure:
    """The figure of these tables, for tests that only look at it."""
    return figure_module(name).draw(tables_of(name))


def lettered(figure: Figure) -> list[Axes]:
    """The panels in the order of their letters."""
    return sorted(figure.axes, key=lambda panel: panel.texts[0].get_text())


def look(line: Line2D) -> tuple[object, ...]:
    return line.get_color(), line.get_linewidth(), line.is_dashed()


def shown(name: str, letter: int, table: pd.DataFrame) -> pd.DataFrame:
    """The rows that a panel shows."""
    return table[table["time_s"] <= lettered(drawn_once(name))[letter].get_xlim()[1]]


def lines_of(panel: Axes, values: pd.Series) -> list[Line2D]:
    return [
        line
        for line in panel.lines
        if len(line.get_ydata()) == len(values) and np.array_equal(line.get_ydata(), values)
    ]


def texts(figure: Figure) -> list[Text]:
    """All that is written: letters, keys, names of axes, and the numbers on them."""
    written: list[Text] = []
    for panel in figure.axes:
        legend = panel.get_legend()
        written += [*panel.texts, panel.xaxis.label, panel.yaxis.label, *(legend.get_texts() if legend else [])]
        for axis, (low, high) in ((panel.xaxis, panel.get_xlim()), (panel.yaxis, panel.get_ylim())):
            written += [
                tick.label1
                for tick in [*axis.get_major_ticks(), *axis.get_minor_ticks()]
                if tick.label1.get_visible() and low <= tick.get_loc() <= high
            ]
    return written


@pytest.mark.parametrize(("name", "letter"), [(name, k) for name, panels in PANELS.items() for k in range(len(panels))])
def test_panel_shows_its_signals_in_the_named_styles(name, letter):
    table = shown(name, letter, tables_of(name)[figure_module(name).TABLES[0]])
    panel = lettered(drawn_once(name))[letter]
    upon_band = {"linewidth": 0.9} if (name, letter) in [panel[:2] for panel in CONTROL_PANELS] else {}
    for column, kind in PANELS[name][letter].items():
        expected = look(Line2D([], [], **style.LINES[kind] | upon_band))
        assert [look(line) for line in lines_of(panel, table[column])] == [expected]
    for line in panel.lines[: len(PANELS[name][letter])]:
        np.testing.assert_array_equal(line.get_xdata(), table["time_s"])


@pytest.mark.parametrize("name", PANELS)
def test_panels_show_the_whole_run_but_for_the_enlarged_ones(name):
    """The controls swing at 9 rad/s, so that six cycles take 4.2 s; the differences decay as exp(-t)."""
    start, cycles, decay = 1.15 * 5.125, 6 * 2 * np.pi / 9, np.log(10)
    enlarged = {"fig_4_01": {2: decay}, "fig_4_03": {4: decay}}
    enlarged["fig_4_04"] = {1: start, 2: cycles, 4: start, 5: cycles}
    for k, panel in enumerate(lettered(drawn_once(name))):
        end = enlarged.get(name, {}).get(k, TIME_S[-1])
        assert panel.get_xlim() == pytest.approx((0.0, end), abs=2 * TIME_S[1])


@pytest.mark.parametrize("name", PANELS)
def test_panels_are_lettered_and_no_panel_is_left_over(name):
    letters = [panel.texts[0].get_text() for panel in lettered(drawn_once(name))]
    assert letters == [f"({letter})" for letter in "abcdef"[: len(PANELS[name])]]


@pytest.mark.parametrize(("name", "letter", "run"), CONTROL_PANELS)
def test_saturated_input_is_a_pale_band_below_the_control(name, letter, run):
    table = tables_of(name)[figure_module(name).TABLES[0]]
    table = shown(name, letter, table)
    panel = lettered(drawn_once(name))[letter]
    (control,), (saturated,) = (lines_of(panel, table[f"{signal}_{run}"]) for signal in ("control", "saturated"))
    assert saturated.get_linewidth() > 2 * control.get_linewidth()
    assert saturated.get_zorder() < control.get_zorder()
    assert saturated.get_color() == panels.paler(control.get_color(), 0.6)


@pytest.mark.parametrize("name", ["fig_2_02", "fig_2_03", "fig_2_13", "fig_4_02", "fig_4_04"])
def test_limits_of_the_tables_are_dotted(name):
    tables = tables_of(name)
    summary = tables[figure_module(name).TABLES[1]]
    summary["limit"] = 2.75
    dotted = look(Line2D([], [], **style.LINES["saturation limits"]))
    found = [
        {line.get_ydata()[0] for line in panel.lines if len(line.get_ydata()) == 2 and look(line) == dotted}
        for panel in lettered(figure_module(name).draw(tables))
    ]
    assert found == [{-2.75, 2.75} if "reference" not in signals else set() for signals in PANELS[name]]


@pytest.mark.parametrize(("name", "letter", "run"), [("fig_4_01", 2, "none"), ("fig_4_03", 4, "thesis")])
def test_pade_panel_shows_the_difference(name, letter, run):
    tables = tables_of(name)
    difference = tables["extended"][f"output_{run}"] - tables["extended"][f"output_{run}_pade"]
    (line,) = lettered(figure_module(name).draw(tables))[letter].lines
    np.testing.assert_array_equal(line.get_ydata(), shown(name, letter, tables["extended"].assign(d=difference))["d"])
    assert look(line) == look(Line2D([], [], **style.LINES["second-order Pade"]))
    assert f"at most {difference.abs().max():.3g}" in figure_module(name).caption(tables)


@pytest.mark.parametrize("tests", [1, 3, 9])
def test_every_test_has_its_errors(tests):
    tables = additive_error_tables(tests)
    table = tables["additive_error"]
    (panel,) = figure_module("fig_2_09").draw(tables).axes
    *errors, bound, ring, plant = panel.lines
    assert len(errors) == tests
    for number, line in enumerate(errors, start=1):
        rows = table[table["test"] == number]
        np.testing.assert_allclose(line.get_xydata(), np.column_stack([rows["omega"], 20 * np.log10(rows["error"])]))
        assert line.get_linestyle() == "None"
    np.testing.assert_allclose(bound.get_ydata(), 20 * np.log10(table["bound"][:60]))
    np.testing.assert_allclose(ring.get_xydata(), [[40.0, 20 * np.log10(tests / 40)]])  # error/bound is 10 test/omega^2
    omega, drawn = plant.get_data()
    np.testing.assert_allclose(drawn[omega > 70], 20 * np.log10(5 / omega[omega > 70]), atol=0.05)
    assert panel.get_xscale() == "log"
    assert (panel.get_xlabel(), panel.get_ylabel()) == (r"$\omega$ [rad/s]", "Magnitude [dB]")


def test_a_notch_between_two_lines_is_drawn_round():
    """|P| of one undamped zero at 500.4 rad/s, of which the lines beside it say how deep it is."""
    tables, omega = additive_error_tables(1), np.arange(100.0, 900.0)
    plant = np.abs(1 - (omega / 500.4) ** 2 + 0.02j * omega / 500.4)
    tables["additive_error"] = pd.DataFrame({"test": 1, "omega": omega, "error": 1e-3, "bound": 1.0, "plant": plant})
    *_, line = figure_module("fig_2_09").draw(tables).axes[0].lines
    at, drawn = line.get_data()
    exact = 20 * np.log10(np.abs(1 - (at / 500.4) ** 2 + 0.02j * at / 500.4))
    assert at.size > 2 * omega.size
    assert np.abs(drawn - exact).max() < 0.01


def test_largest_errors_survive_thinning():
    rng = np.random.default_rng(1)
    tables = additive_error_tables(1)
    omega = np.linspace(40.0, 900.0, 5000)
    error = rng.uniform(0.5, 1.0, 5000)
    error[[17, 4321]] = 7.0, 1e-4
    tables["additive_error"] = pd.DataFrame(
        {"test": 1, "omega": omega, "error": error, "bound": 10.0, "plant": 1.0}
    ).sample(frac=1, random_state=2)
    errors = figure_module("fig_2_09").draw(tables).axes[0].lines[0]
    assert len(errors.get_xdata()) <= panels.MOST_POINTS
    drawn = [tuple(point) for point in errors.get_xydata()]
    assert {(omega[17], 20 * np.log10(7.0)), (omega[4321], 20 * np.log10(1e-4))} <= set(drawn)


@pytest.mark.parametrize("above", [0, 2])
def test_caption_counts_the_lines_above_the_bound(above):
    tables = additive_error_tables()
    tables["additive_error"].loc[: above - 1, "error"] = 1e6
    caption = figure_module("fig_2_09").caption(tables)
    assert ("at every line" if above == 0 else "except at 2 lines") in caption
    assert "2 of the tests are SYNTHETIC" in caption
    tables["additive_error_summary"]["synthetic_tests"] = 0
    assert "SYNTHETIC" not in figure_module("fig_2_09").caption(tables)


@pytest.mark.parametrize(
    ("betas", "chosen"), [((0.05,), 0.05), ((0.2, 0.05, 0.0125), 0.05), (tuple(0.01 * k for k in range(1, 9)), 0.03)]
)
def test_each_beta_has_a_curve_with_its_least_value_and_the_chosen_one_leads(betas, chosen):
    tables = f_gamma_tables(betas, chosen)
    (panel,) = figure_module("fig_2_10").draw(tables).axes
    assert len(panel.lines) == 2 * len(betas)
    labels = [text.get_text() for text in panel.get_legend().get_texts()]
    assert labels[0] == rf"$\beta$ = {captions.fraction(chosen)} s (chosen)"
    assert sum("chosen" in label for label in labels) == 1
    assert look(panel.lines[0]) == look(Line2D([], [], **style.LINES["family 1"]))
    for curve, dot in zip(panel.lines[::2], panel.lines[1::2], strict=True):
        assert dot.get_ydata() == curve.get_ydata().min()
        assert dot.get_xdata() == curve.get_xdata()[curve.get_ydata().argmin()]


def test_enlargement_shows_the_chosen_beta_around_its_least_value():
    figure = figure_module("fig_2_11").draw(f_gamma_tables())
    curve, dot = figure.axes[0].lines
    np.testing.assert_array_equal(dot.get_xydata(), [[40.0, 3.95]])
    np.testing.assert_array_equal(curve.get_xdata(), np.arange(28.0, 53.0))
    assert "40" in figure.axes[0].get_legend().get_texts()[0].get_text()


# What a caption says, and where it stands in the tables.
SAID = {
    "fig_2_02": ["overshoot_swapped_none", "step", "limit"],
    "fig_2_03": ["overshoot_swapped_back_calculation", "overshoot_printed_back_calculation", "back_calculation"],
    "fig_2_04": ["overshoot_swapped_none", "overshoot_swapped_back_calculation"],
    "fig_2_09": ["tests", "synthetic_tests", "lines", "largest_ratio", "largest_ratio_omega"],
    "fig_2_10": ["alpha", "beta", "beta_best", "gamma_best", "f_best"],
    "fig_2_11": ["beta", "gamma", "f", "beta_best", "gamma_best", "f_best"],
    "fig_2_12": ["limit", "required", "offset", "ripple", "relative_error_percent"],
    "fig_2_13": ["limit", "last_saturation_s"],
    "fig_2_14": ["limit", "required", "last_saturation_s"],
    "fig_4_01": ["limit", "last_saturation_s", "peak_error_after_1s", "settling_s"],
    "fig_4_02": ["limit", "last_saturation_s"],
    "fig_4_03": ["limit", "offset", "settling_s"],
    "fig_4_04": ["limit", "last_saturation_s"],
    "fig_a_04": ["limit"],
    "fig_a_05": ["limit", "quantum", "full_range_s", "steady_error", "settling_s"],
    "fig_a_06": [
        *("plants", "seed", "limit", "linear_stable", "recovered", "recovery_50_s"),
    ],
    "fig_a_09": [
        *("limit", "resolution", "bits", "rate_hz", "duration_s"),
        *("drift", "largest_drift", "expected_drift"),
    ],
}


@pytest.mark.parametrize(("name", "column"), [(name, column) for name, columns in SAID.items() for column in columns])
def test_caption_says_what_the_summary_says(name, column):
    tables = tables_of(name)
    module = figure_module(name)
    before = module.caption(tables)
    summary = tables[module.TABLES[1]]
    summary[column] = summary[column] * 1.5
    assert module.caption(tables) != before


@pytest.mark.parametrize(
    ("table", "column"),
    [
        *(("limits_extended", f"settling_{name}") for name in ("upper_s", "none_s", "thesis_s", "corrected_s")),
        *(("limits_delay_free", f"peak_{run}") for run in ("none", "thesis", "corrected")),
        *(("limits_delay_free", column) for column in ("periodic_lower", "periodic_upper", "required")),
        ("limits_delay_free_summary", "limit"),
    ],
)
def test_caption_of_the_floor_says_what_the_tables_say(table, column):
    module, tables = figure_module("fig_a_04"), limits_tables()
    before = module.caption(tables)
    tables[table][column] *= 1.5
    assert module.caption(tables) != before


def test_caption_of_the_floor_names_what_never_settles_and_what_diverges():
    module, tables = figure_module("fig_a_04"), limits_tables()
    tables["limits_extended"][["settling_upper_s", "settling_none_s"]] = np.nan
    tables["limits_delay_free"].loc[1, "peak_none"] = np.nan
    caption = module.caption(tables)
    assert "never at best, never without anti-windup, after 2.44 s (thesis)" in caption
    assert "the loop without anti-windup diverges, leaves 27 (thesis)," in caption


@pytest.mark.parametrize(
    ("letter", "table", "along", "floor", "error"),
    [
        (0, "limits_extended_summary", "start_s", "rest", "tail"),
        (1, "limits_delay_free", "limit", "periodic", "peak"),
    ],
)
def test_floor_and_runs_are_drawn_in_the_named_styles(letter, table, along, floor, error):
    tables = limits_tables()
    rows = tables[table]
    panel = lettered(figure_module("fig_a_04").draw(tables))[letter]
    for run, kind in RUN.items():
        if letter == 0:
            assert [look(line) for line in lines_of(panel, rows[f"{error}_{run}"])] == [
                look(Line2D([], [], **style.LINES[kind]))
            ]
        else:  # nothing joins the limits that were computed
            ((x, y),) = (data for data in of_kind(panel, kind) if len(data[0]))
            np.testing.assert_array_equal(y[np.isin(x, rows[along])], rows[f"{error}_{run}"])
            assert np.isnan(y[~np.isin(x, rows[along])]).all()
            assert {line.get_linestyle() for line in panel.lines if line.get_color() == style.LINES[kind]["color"]} == {
                "None"
            }
    (best,) = (
        line
        for line in panel.lines
        if look(line) == look(Line2D([], [], **style.LINES["family 4"])) and len(line.get_xdata())
    )
    bottom, top = panel.get_ylim()
    at_rows = np.isin(best.get_xdata(), rows[along])
    np.testing.assert_array_equal(best.get_xdata()[at_rows], rows[along])
    assert at_rows.all() == (letter == 0)
    seen = rows[f"{floor}_upper"] > bottom
    np.testing.assert_array_equal(best.get_ydata()[at_rows][seen], rows[f"{floor}_upper"][seen])
    assert (best.get_ydata()[at_rows][~seen] < bottom).all()
    (grey,) = panel.collections
    edge = {tuple(point) for point in grey.get_paths()[0].vertices}
    forced = rows[rows[f"{floor}_lower"] > bottom]
    assert set(zip(forced[along], forced[f"{floor}_lower"], strict=True)) <= edge
    assert panel.get_yscale() == "log"
    assert top > rows[f"{error}_none"].max()


def test_the_floor_between_the_limits_holds_for_every_convex_error():
    """Of 1/L^2 less its value at the limit that tracking needs; ends that are 1 % off stay bounds."""
    limits = np.array([5.0, 5.5, 7.0, 8.0, 12.0])
    error = lambda limit: np.maximum(1 / limit**2 - 0.01, 0.0)  # noqa: E731
    ends = {"periodic_lower": 0.99 * error(limits), "periodic_upper": 1.01 * error(limits)}
    floor = fig_a_04._floor(pd.DataFrame({"limit": limits, "required": 10.0} | ends))
    assert set(limits) | {10.0} <= set(floor["limit"])
    assert (floor["periodic_lower"] <= error(floor["limit"])).all()
    assert (floor["periodic_upper"] >= error(floor["limit"])).all()
    inside = floor[floor["limit"].between(5.5, 8.0)]
    assert (inside["periodic_lower"] > 0.5 * inside["periodic_upper"]).all()


@pytest.mark.parametrize("row", [0, 4])
def test_floor_under_one_limit(row, as_pdf):
    """Below what tracking needs, and above, where the floor is zero."""
    module, tables = figure_module("fig_a_04"), limits_tables()
    for kind in ("extended", "delay_free"):
        tables[f"limits_{kind}"] = tables[f"limits_{kind}"].iloc[[row]]
    panel = lettered(module.draw(tables))[1]
    limit, peak = tables["limits_delay_free"][["limit", "peak_corrected"]].iloc[0]
    assert panel.get_xlim()[0] < limit < panel.get_xlim()[1]
    assert panel.get_ylim()[0] < peak < panel.get_ylim()[1]
    assert module.caption(tables)
    as_pdf(module.draw(tables))


@pytest.mark.parametrize("gone", [1e99, np.nan])
def test_floor_stays_legible_beside_a_run_that_diverges(gone, as_pdf):
    module, tables = figure_module("fig_a_04"), limits_tables()
    tables["limits_delay_free"]["peak_none"] = gone
    tables["limits_extended_summary"]["tail_none"] = gone
    figure = module.draw(tables)
    for panel, most in zip(lettered(figure), (5.0, 5.0), strict=True):
        assert 1e-3 < panel.get_ylim()[0] < most < panel.get_ylim()[1] < 1100.0
    assert module.caption(tables)
    as_pdf(figure)


def of_kind(panel: Axes, kind: str) -> list[tuple[np.ndarray, np.ndarray]]:
    """x and y of the lines that have the colour of an entry of style.LINES."""
    return [line.get_data() for line in panel.lines if line.get_color() == style.LINES[kind]["color"]]


def test_the_real_drive():
    tables = sampled_tables()
    table, summary = tables["sampled"], tables["sampled_summary"]
    over_time, over_rate = fig_a_05.draw(tables).axes
    for run in fig_a_05.RUNS:
        (tail,) = (y for _, y in of_kind(over_time, run.kind) if len(y))
        errors = np.abs(table[f"error_{run.name}_drive"].to_numpy())
        np.testing.assert_array_equal(tail, [errors[k:].max() for k in range(len(errors))])
        pale = panels.band(style.LINES[run.kind])["color"]
        (broad,) = (line for line in over_time.lines if line.get_color() == pale)
        errors = np.abs(table[f"error_{run.name}"].to_numpy())
        np.testing.assert_array_equal(broad.get_ydata(), [errors[k:].max() for k in range(len(errors))])
        for (x, y), method in zip(of_kind(over_rate, run.kind), ("tustin", "exact"), strict=True):
            rows = summary[(summary["run"] == run.name) & (summary["method"] == method)]
            np.testing.assert_array_equal(x, rows["rate_hz"])
            np.testing.assert_array_equal(y, rows["steady_error"])
        (broad,) = (line for line in over_rate.lines if line.get_color() == pale)
        rows = summary[(summary["run"] == run.name) & (summary["method"] == "continuous")]
        assert set(broad.get_ydata()) == set(rows["steady_error"])
    assert over_time.get_ylim() == over_rate.get_ylim()
    assert over_time.get_ylim()[0] < (40 / 5120) ** 2
    assert over_time.get_xlim() == (0.0, 24 - 4.25)
    caption = fig_a_05.caption(tables)
    for said in (
        "limits +-13.5 in 4096 steps, 12.5 ms across",
        "the drive at 1.28 kHz",
        "settles in 6.75 s and settles in 7.5 s",
        "at 0.32 kHz to 5.12 kHz: 0.125 to 0.00781 with held inputs, 0.0156 to 6.1e-05 with Tustin's rule",
        "17.3, stays.",
    ):
        assert said in caption
    assert "ivergent" not in caption


def test_a_drive_that_diverges_is_counted(as_pdf):
    tables = sampled_tables()
    summary = tables["sampled_summary"]
    gone = (summary["run"] == "thesis") & (summary["rate_hz"] == 320)
    summary.loc[gone, ["steady_error", "settling_s"]] = np.nan
    caption = fig_a_05.caption(tables)
    assert "Divergent runs, not drawn: 2." in caption
    as_pdf(fig_a_05.draw(tables))
    summary.loc[summary["rate_hz"].notna(), ["steady_error", "settling_s"]] = np.nan
    for run in ("none", "thesis", "corrected"):
        tables["sampled"][f"error_{run}_drive"] = np.nan
    tables["sampled"]["error_none"] = np.where(np.arange(481) < 300, 10.0 ** (np.arange(481) / 3), np.nan)
    figure = fig_a_05.draw(tables)
    assert 10 < figure.axes[0].get_ylim()[1] < 1e4
    assert "and does not settle within the run." in fig_a_05.caption(tables)
    assert "unbounded to unbounded with held inputs" in fig_a_05.caption(tables)
    as_pdf(figure)


def test_the_drift():
    tables = hidden_modes_tables()
    table = tables["hidden_modes"]
    plain, logarithmic = fig_a_09.draw(tables).axes
    for form, (kind, _) in fig_a_09.FORMS.items():
        for panel, shown in ((plain, table[f"drift_{form}"]), (logarithmic, table[f"drift_{form}"].abs())):
            ((x, y),) = of_kind(panel, kind)
            np.testing.assert_array_equal(x, table["time_s"])
            np.testing.assert_array_equal(y, shown)
    caption = fig_a_09.caption(tables)
    for said in (
        "at 0.64 kHz by Tustin's rule, in 5120 s",
        "to multiples of 0.00659 (1/2^12 of the range",
        "ends at -6.12 (at most 6.25); half a step makes -K (step/2) t = -6.5",
        "ends at -0.00275 (at most 0.003).",
    ):
        assert said in caption


@pytest.mark.parametrize(("integrators", "growth"), [(0, "(step/2) = -6.5"), (2, "(step/2) t^2/2 = -6.5")])
def test_the_drift_that_half_a_step_makes(integrators, growth):
    tables = hidden_modes_tables()
    tables["hidden_modes_summary"]["integrators"] = integrators
    (_, line), *_ = of_kind(fig_a_09.draw(tables).axes[0], "reference")
    np.testing.assert_allclose(line, -6.5 * (tables["hidden_modes"]["time_s"] / 5120) ** integrators)
    assert growth in fig_a_09.caption(tables)


def test_a_drift_that_diverges_is_not_drawn(as_pdf):
    tables = hidden_modes_tables()
    tables["hidden_modes"]["drift_thesis"] = np.nan
    summary = tables["hidden_modes_summary"]
    summary.loc[summary["run"] == "thesis", ["drift", "largest_drift"]] = np.nan
    summary["expected_drift"] = np.nan
    caption = fig_a_09.caption(tables)
    assert "between them. The loop diverges. The same" in caption
    figure = fig_a_09.draw(tables)
    assert not of_kind(figure.axes[0], "reference")
    as_pdf(figure)
    tables["hidden_modes"]["drift_coprime"] = np.nan
    as_pdf(fig_a_09.draw(tables))


def at(line: tuple[np.ndarray, np.ndarray], values: np.ndarray) -> np.ndarray:
    """What a line of steps shows right of each value."""
    x, y = line
    return y[np.searchsorted(x, values, side="right") - 1]


def test_the_campaign():
    tables = campaign_tables()
    table, distance = tables["campaign"], tables["campaign_distance"]
    peak, steady, recovery, over_distance = lettered(fig_a_06.draw(tables))
    for panel, measure in ((peak, "peak_error"), (steady, "steady_error"), (recovery, "recovery_s")):
        low, high = panel.get_xlim()
        for run in fig_a_06.RUNS:
            rows = table[table["run"] == run.name].dropna(subset=measure)
            (line,) = of_kind(panel, run.kind)
            assert line[0][[0, -1]].tolist() == [low, high]
            assert (np.diff(line[0]) >= 0).all()
            assert (np.diff(line[1]) >= 0).all()
            assert line[1][[0, -1]].tolist() == [0.0, 0.75 if len(rows) else 0.0]
            np.testing.assert_array_equal(at(line, rows[measure]), rows["share"])
    assert (peak.get_xscale(), steady.get_xscale(), recovery.get_xscale()) == ("linear", "log", "linear")
    assert peak.get_xlim()[0] < 40 + 50 / 120
    assert recovery.get_xlim()[0] == 0
    for run in fig_a_06.RUNS:
        (steps,) = (
            patch
            for patch in over_distance.patches
            if to_hex(patch.get_edgecolor()) == style.LINES[run.kind]["color"].lower()
        )
        rows = distance[distance["run"] == run.name]
        values, edges, least = steps.get_data()
        seen = rows["from"] < 0.75  # further away some diverge
        np.testing.assert_array_equal(values[seen], rows["greatest_peak_error"][seen])
        assert (values[~seen] > over_distance.get_ylim()[1]).all()
        np.testing.assert_array_equal(least, rows["least_peak_error"])
        np.testing.assert_array_equal(edges, np.append(rows["from"], 1.0))
    assert over_distance.get_ylim() == peak.get_xlim()
    caption = fig_a_06.caption(tables)
    for said in (
        "SYNTHETIC: the loop of chapter 4 with 120 plants drawn within W_a (seed 17), limits +-13.5",
        "+-0.12 with 95 % confidence",  # sqrt(log(40)/240)
        "without anti-windup 62.5 % (half within 4 s); thesis 50 %; corrected",
        "Without limits 62.5 % of the loops are stable.",
    ):
        assert said in caption


def test_a_campaign_in_which_nothing_recovers_and_all_diverges(as_pdf):
    tables = campaign_tables()
    measures = ["peak_error", "steady_error", "recovery_s"]
    tables["campaign"]["recovery_s"] = np.nan
    assert fig_a_06.caption(tables)
    as_pdf(fig_a_06.draw(tables))
    tables["campaign"][measures] = np.nan
    tables["campaign_summary"][["steady_error_50", "recovery_50_s"]] = np.nan
    assert fig_a_06.caption(tables)
    as_pdf(fig_a_06.draw(tables))


def test_a_campaign_of_equal_or_vanishing_errors(as_pdf):
    tables = campaign_tables()
    tables["campaign"]["peak_error"] = 50.0
    tables["campaign"]["steady_error"] = 0.0
    figure = fig_a_06.draw(tables)
    for panel in lettered(figure)[:2]:
        low, high = panel.get_xlim()
        assert low < high
    assert fig_a_06.caption(tables)
    as_pdf(figure)


@pytest.mark.parametrize("name", ["fig_2_13", "fig_4_01", "fig_4_02", "fig_4_03", "fig_4_04"])
def test_caption_says_whose_the_limits_are(name):
    tables = tables_of(name)
    module = figure_module(name)
    tables[module.TABLES[1]]["limit_is_given"] = 1
    caption = module.caption(tables)
    assert "given limits of +-6.5" in caption
    assert not [words for words in ("prints no limits", "chosen limits") if words in caption]


def test_a_run_that_diverges_is_drawn_as_far_as_it_goes_and_said_to_diverge():
    tables = tracking_tables("delay_free")
    gone = tables["delay_free"]["time_s"] > 2.0
    columns = [column for column in tables["delay_free"] if str(column).endswith("_none")]
    tables["delay_free"].loc[gone, columns] = np.nan
    module = figure_module("fig_2_14")
    assert "the control diverges, past 1e100 times the limits at about 2 s" in module.caption(tables)
    (line,) = lettered(module.draw(tables))[1].lines
    assert 1.5 < line.get_xdata()[np.isfinite(line.get_ydata())].max() <= 2.0


@each_figure
def test_caption_is_plain_and_names_the_figure_of_the_thesis(name):
    caption = figure_module(name).caption(tables_of(name))
    _, chapter, number = name.split("_")
    assert chapter == "a" or f"thesis Fig. {chapter}.{int(number)})" in caption
    assert caption.isascii()
    assert len(caption.split()) <= 90 or chapter == "a"
    assert "nan" not in caption
    assert not set("{}\n") & set(caption)


@pytest.mark.parametrize(
    ("limit", "required", "words"),
    [
        (10.0, 11.0547, "2.79 % of the amplitude: the text's tracking error of 0.098 % is beyond reach"),
        (10.0, 9.0, "0 % of the amplitude: the text's tracking error of 0.098 % is not ruled out"),
        (10.0, 10.01, "the text's tracking error of 0.098 % is not ruled out"),
    ],
)
def test_claimed_tracking_error_is_judged_by_what_an_integrator_can_follow(limit, required, words):
    assert words in fig_2_12.within_reach(limit, required)


PROMISED = {
    "With the corrected anti-windup the run is NOT covered by its guarantee, since the reference takes more than": {
        "needed_sector": np.inf
    },
    "is NOT covered by its guarantee: it needs the sector 0.938, 0.875 is guaranteed (|u| reaches 124, up to 7.25": {},
    "is covered by its guarantee: it needs the sector 0.938, 0.999 is": {**{"guaranteed_sector": 0.999, "covered": 1}},
    "never saturates and needs no guarantee": {"needed_sector": 0.0},
    "diverges, and no guarantee covers it": {"guaranteed_sector": np.nan},
}


@pytest.mark.parametrize(("said", "numbers"), PROMISED.items())
def test_it_is_said_whether_a_guarantee_covers_the_runs(said, numbers):
    summary = tables_of("fig_4_03")["extended_summary"]
    summary.loc[summary["run"] == "corrected", list(numbers)] = list(numbers.values())
    words = captions.promises(summary)
    assert said in words
    assert "with the thesis's it has no guarantee, since theta2 is not stable." in words


def test_captions_follow_the_data_not_the_thesis():
    tables = tables_of("fig_2_14")
    assert "the control does not grow" in figure_module("fig_2_14").caption(tables)
    tables["delay_free"]["control_none"] = np.exp(TIME_S)
    assert "the control grows" in figure_module("fig_2_14").caption(tables)
    tables["delay_free_summary"]["required"] = 1.0
    assert "is within the limits" in figure_module("fig_2_14").caption(tables)


@each_figure
def test_summary_without_settling_or_last_saturation(name):
    tables = tables_of(name)
    module = figure_module(name)
    summary = tables[module.TABLES[1]]
    for column in {"settling_s", "last_saturation_s"} & set(summary.columns):
        summary[column] = np.nan
    caption = module.caption(tables)
    assert "nan" not in caption
    if "last_saturation_s" in SAID[name]:
        assert "is saturated at the end of the run" in caption
    if "settling_s" in SAID[name]:
        assert "does not settle within the run" in caption
    assert module.draw(tables).axes


@pytest.mark.parametrize("huge", [1e6, 1e99])
@pytest.mark.parametrize("name", PANELS)
def test_divergent_signals_leave_the_panel_and_the_reference_stays_legible(name, huge, as_pdf):
    tables = tables_of(name)
    module = figure_module(name)
    table = tables[module.TABLES[0]]
    for column in table.columns.drop(["time_s", "reference"]):
        if not column.startswith("saturated"):
            table[column] *= huge ** (TIME_S / TIME_S[-1])
    figure = module.draw(tables)
    for panel in figure.axes:
        assert np.ptp(panel.yaxis.get_transform().transform(np.array(panel.get_ylim()))) < 500
    assert module.caption(tables)
    if huge > 1e9:
        as_pdf(figure)


@each_figure
def test_drawing_leaves_the_tables_as_they_are(name):
    tables = tables_of(name)
    module = figure_module(name)
    module.draw(tables)
    module.caption(tables)
    for table, before in tables_of(name).items():
        pd.testing.assert_frame_equal(tables[table], before)


@each_figure
def test_texts_and_keys_stand_clear_and_on_the_page(name, extents):
    figure = drawn_once(name)
    boxes = extents(figure, texts)
    assert len(boxes) > 5
    assert [(one, two) for (one, a), (two, b) in combinations(boxes, 2) if a.padded(-0.005).overlaps(b)] == []
    width, height = figure.get_size_inches()
    outside = [text for text, box in boxes if box.x0 < 0 or box.y0 < 0 or box.x1 > width or box.y1 > height]
    assert outside == []
    keys = [panel for panel in figure.axes if panel.get_legend()]
    assert keys
    for panel in keys:
        assert panel.get_legend().get_window_extent().y0 >= panel.get_window_extent().y1


@each_figure
def test_text_is_of_print_size_and_no_panel_has_a_title(name):
    figure = drawn_once(name)
    assert {text.get_fontsize() for text in texts(figure)} <= {8, 9}
    assert {panel.get_title() for panel in figure.axes} == {""}
    assert figure.get_size_inches()[0] in (style.COLUMN_WIDTH, style.FULL_WIDTH)


@pytest.mark.parametrize("name", PANELS)
def test_lowest_panels_name_the_time(name):
    figure = drawn_once(name)
    bottom = min(panel.get_position().y0 for panel in figure.axes)
    for panel in figure.axes:
        assert panel.get_xlabel() in ("", "Time $t$ [s]")
        assert panel.get_xlabel() or panel.get_position().y0 > bottom


def test_two_drawings_are_written_as_the_same_bytes_in_every_format(tmp_path):
    """With marks, clipped lines, a key; that each figure draws the same, tests/snapshots/test_figure_data.py holds."""
    module, tables, runs = figure_module("fig_2_09"), additive_error_tables(), []
    for folder in (tmp_path / "one", tmp_path / "two"):
        folder.mkdir()
        style.write(style.rendered(module.draw(tables), folder, "fig_2_09", module.caption(tables)))
        runs.append({path.name: path.read_bytes() for path in folder.iterdir()})
    assert set(runs[0]) == {f"fig_2_09.{kind}" for kind in ("pdf", "svg", "png", "txt")}
    assert runs[0] == runs[1]


@pytest.mark.parametrize("count", [10, 3000, 3001, 50000])
def test_envelope_keeps_ends_and_peaks(count):
    x = np.linspace(0.0, 3.0, count)
    y = np.sin(400 * x)
    y[[count // 3, count // 2]] = 9.0, -9.0
    thin_x, thin_y = panels.envelope(x, y)
    assert len(thin_x) <= max(3000, min(count, 3000))
    assert np.all(np.diff(thin_x) > 0)
    assert {(x[0], y[0]), (x[-1], y[-1]), (x[count // 3], 9.0), (x[count // 2], -9.0)} <= set(
        zip(thin_x, thin_y, strict=True)
    )


def test_long_lines_are_thinned_in_the_figure():
    time_s = np.linspace(0.0, 12.0, 20001)
    tables = tables_of("fig_2_14")
    short = tables["delay_free"]
    tables["delay_free"] = pd.DataFrame({column: np.interp(time_s, TIME_S, short[column]) for column in short})
    tables["delay_free"]["time_s"] = time_s
    tables["delay_free"].loc[777, "error_none"] = 40.0
    error = lettered(figure_module("fig_2_14").draw(tables))[1].lines[0]
    assert len(error.get_ydata()) <= panels.MOST_POINTS
    assert error.get_ydata().max() == 40.0


@pytest.mark.parametrize(
    ("values", "scale", "low", "high"),
    [
        ([-1.0, 3.0], 1.0, -1.24, 3.24),
        ([-1.0, 99.0], 1.0, -7.0, 105.0),
        ([-1.0, 1e9], 1.0, -1.66, 10.66),
        ([-1e9, np.inf, 1e9], 2.0, -22.4, 22.4),
        ([0.0, 0.0], 0.0, -1.0, 1.0),
        ([-4.0, -4.0], 4.0, -8.0, 0.0),
        ([np.nan], 1.0, -1.0, 1.0),
    ],
)
def test_view_shows_all_but_divergence(values, scale, low, high):
    assert panels.view([np.array(values)], scale) == pytest.approx((low, high))


@pytest.mark.parametrize(
    ("value", "words"), [(0.025, "1/40"), (1 / 3, "1/3"), (0.0328, "0.0328"), (2.0, "2"), (-0.5, "-0.5")]
)
def test_fractions_are_written_where_they_are_exact(value, words):
    assert captions.fraction(value) == words


@pytest.mark.parametrize(
    ("value", "low", "high"),
    [(1.39384603, "1.393", "1.394"), (0.125, "0.125", "0.125"), (9.9996, "9.999", "10"), (0.0, "0", "0")],
)
def test_bounds_are_rounded_so_that_they_stay_bounds(value, low, high):
    assert (captions.at_least(value, 4), captions.at_most(value, 4)) == (low, high)


def drawn(tmp_path, name: str, tables: Mapping[str, pd.DataFrame]):
    for table, rows in tables.items():
        rows.to_csv(tmp_path / f"{table}.csv", index=False)
    return CliRunner().invoke(command_line.main, ["draw", name, "--results", str(tmp_path), "--output", str(tmp_path)])


MISSING = [
    *(("fig_2_02", "pid", "output_printed_none"), ("fig_2_03", "pid_summary", "limit"), ("fig_2_04", "pid", "time_s")),
    *(("fig_2_09", "additive_error", "bound"), ("fig_2_09", "additive_error", "omega")),
    *(("fig_2_10", "f_gamma", "gamma"), ("fig_2_11", "f_gamma_summary", "f_best")),
    *(("fig_2_13", "delay_free", "saturated_corrected"), ("fig_4_01", "extended", "output_none_pade")),
    *(("fig_4_04", "extended_summary", "last_saturation_s"), ("fig_4_03", "extended_summary", "run")),
]


@pytest.mark.parametrize(("name", "table", "column"), MISSING)
def test_missing_column_is_one_sentence_with_its_file(name, table, column, tmp_path):
    tables = tables_of(name)
    tables[table] = tables[table].drop(columns=column)
    result = drawn(tmp_path, name, tables)
    assert result.exit_code == 2
    assert result.output == f"Error: {tmp_path / table}.csv: no column {column}, which {name} needs\n"
    assert not list(tmp_path.glob("fig_*"))


def test_key_error_that_is_no_column_is_not_called_one(tmp_path, monkeypatch):
    monkeypatch.delitem(style.LINES, "reference")
    result = drawn(tmp_path, "fig_2_14", tables_of("fig_2_14"))
    assert "fig_2_14 cannot be drawn from delay_free, delay_free_summary in" in result.output
    assert "'reference'" in result.output
    assert "no column" not in result.output


@pytest.mark.parametrize(
    ("damage", "said"),
    [
        (lambda table: table.assign(time_s="fast"), "'fast' in the column time_s; expected a number or nothing"),
        (lambda table: table.iloc[:1], "fig_2_14 cannot be drawn from delay_free, delay_free_summary in"),
        (lambda table: table.assign(time_s=np.nan), "cannot be drawn"),
    ],
)
def test_table_that_cannot_be_drawn_is_one_sentence(tmp_path, damage, said):
    tables = tables_of("fig_2_14")
    result = drawn(tmp_path, "fig_2_14", tables | {"delay_free": damage(tables["delay_free"])})
    assert (result.exit_code, result.output.count("\n")) == (2, 1)
    assert said in result.output
    assert not list(tmp_path.glob("fig_*"))


def test_table_without_rows_is_refused(tmp_path):
    tables = tables_of("fig_2_14")
    result = drawn(tmp_path, "fig_2_14", tables | {"delay_free": tables["delay_free"].iloc[:0]})
    assert result.exit_code == 2
    assert result.output.startswith(f"Error: {tmp_path / 'delay_free'}.csv: holds a header and no rows")


def test_summary_without_a_run_is_refused(tmp_path):
    tables = tables_of("fig_4_01")
    summary = tables["extended_summary"]
    result = drawn(tmp_path, "fig_4_01", tables | {"extended_summary": summary[summary["run"] != "none"]})
    assert result.exit_code == 2
    assert "no row whose run is none" in result.output
    with pytest.raises(InputError, match="whose run is other"):
        captions.of_run(summary, "other", "limit")
