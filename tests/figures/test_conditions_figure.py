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
    np.testing.assert_array_equal(np.asarray(line.get_xdata()), [9.0, 10.0, 11.0])


def test_the_joint_panel_shows_computed_over_printed(tables: Tables) -> None:
    panel = fig_a_07.draw(tables).axes[4]
    dots = [np.asarray(line.get_ydata()) for line in panel.lines if line.get_marker() in ("o", "D")]
    dots = [values for values in dots if len(values)]
    assert len(dots) == 4
    for values in dots:
        np.testing.assert_allclose(values, [1.125, 0.5, 0.75])


def test_the_caption_says_the_numbers(tables: Tables) -> None:
    text = fig_a_07.caption(tables)
    for said in (
        "the nearest (L = 10.62, y(0) = 61.5) misses by 19 %",
        "misses by 75 %",
        "at the printed L = 10 the least error found over the unprinted conditions is 2.88 % of the amplitude",
        "no controller stays below 2.62 %",
    ):
        assert said in text, said


def test_the_keys_name_all_that_is_drawn(tables: Tables) -> None:
    keys = [text.get_text() for panel in fig_a_07.draw(tables).axes for text in panel.get_legend().get_texts()]
    for said in ("printed", "Pade", "Table 2.1", "needed to track", "found", "bound", "printed $L$"):
        assert said in keys


def test_a_search_without_result_is_said(tables: Tables) -> None:
    summary = tables["conditions_summary"]
    tables["conditions_summary"] = summary[summary["search"] != "together, converging"]
    assert "where the error converges, none was found" in fig_a_07.caption(tables)
    assert len(fig_a_07.draw(tables).axes) == 6


def test_a_summary_without_a_row_is_refused(tables: Tables) -> None:
    summary = tables["conditions_summary"]
    tables["conditions_summary"] = summary[summary["search"] != "weights"]
    with pytest.raises(InputError, match="no row with search weights"):
        fig_a_07.caption(tables)
