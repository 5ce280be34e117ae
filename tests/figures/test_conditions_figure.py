"""Figure A.7: its lines are the tables' columns, and its caption says the tables' numbers."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from made_up_conditions import made_up_conditions

from identification.base.errors import InputError
from paper_figures.look.style import LINES
from paper_figures.thesis.figures import fig_a_07

Tables = dict[str, pd.DataFrame]


@pytest.fixture
def tables() -> Tables:
    return made_up_conditions()


def test_lines_are_the_columns(tables: Tables) -> None:
    figure = fig_a_07.draw(tables)
    axes = figure.axes
    assert len(axes) == 6
    table = tables["conditions"]
    for panel, reading, kind in (
        (axes[0], "error_after_1s", "without anti-windup"),
        (axes[1], "desaturation_s", "without anti-windup"),
        (axes[2], "recovery_saturation_s", "thesis anti-windup"),
    ):
        part = table[(table["set"] == "implied") & (table["delay"] == "exact") & (table["initial_output"] == 0)]
        part = part[part["case"] == "extended"]
        broad = [
            line for line in panel.lines if line.get_color() == LINES[kind]["color"] and line.get_linewidth() == 1.8
        ]
        drawn = [line for line in broad if len(np.asarray(line.get_xdata()))]
        assert len(drawn) == 1
        np.testing.assert_array_equal(np.asarray(drawn[0].get_xdata()), part["limit"])
        np.testing.assert_array_equal(np.asarray(drawn[0].get_ydata()), part[reading])


def test_chapter_2_is_drawn_in_the_order_of_the_limits(tables: Tables) -> None:
    panel = fig_a_07.draw(tables).axes[5]
    (line,) = [
        line
        for line in panel.lines
        if line.get_color() == LINES["thesis anti-windup"]["color"] and len(np.asarray(line.get_xdata())) == 3
    ]
    np.testing.assert_array_equal(np.asarray(line.get_xdata()), [9.5, 10.0, 10.5])


def test_the_joint_panel_shows_computed_over_printed(tables: Tables) -> None:
    panel = fig_a_07.draw(tables).axes[4]
    dots = [np.asarray(line.get_ydata()) for line in panel.lines if line.get_marker() in ("o", "D")]
    assert len(dots) == 4
    for values in dots:
        np.testing.assert_allclose(values, 1.125)


def test_the_caption_says_the_numbers(tables: Tables) -> None:
    text = fig_a_07.caption(tables)
    for said in (
        "8.6 m after the first second comes at L = 19.31 (implied set) and L = 19.31 (Table 2.1)",
        "4 s as the last saturation comes at L from 12.5 to 13.5 (implied set)",
        "4.46 s as the last saturation comes at no L (5.46 at 12 is nearest, implied set)",
        "4.46 s as settling to an offset comes at no L (implied set) and no L (Table 2.1)",
        "From y(0) = r(0) = 50",
        "by more than 0.08 %",
        "misses by 19 %: 9.67 for 8.6 m, 4.5 for 4 s, 5.02 for 4.46 s",
        "misses by 75 %",
        "L = 10.62 and y(0) = 61.5 (implied set)",
        "the least error at L = 10 is 2.88 % of the amplitude (dot); no controller stays below 2.62 % (bar)",
        "0.098 % in the last period comes at L = 10.76 (implied set)",
    ):
        assert said in text, said


def test_a_search_without_result_is_said(tables: Tables) -> None:
    summary = tables["conditions_summary"]
    tables["conditions_summary"] = summary[summary["search"] != "together, converging"]
    assert "no point of the search has all three outcomes" in fig_a_07.caption(tables)
    assert len(fig_a_07.draw(tables).axes) == 6


def test_a_summary_without_a_row_is_refused(tables: Tables) -> None:
    summary = tables["conditions_summary"]
    tables["conditions_summary"] = summary[summary["search"] != "weights"]
    with pytest.raises(InputError, match="no row with search weights"):
        fig_a_07.caption(tables)
