"""Figure A.8: its lines and markers are the tables' numbers, and its caption says them."""

from __future__ import annotations

import numpy as np
import pytest
from made_up_comparison import made_up_comparison

from paper_figures.look.style import LINES
from paper_figures.thesis.figures import fig_a_08


def test_the_distances_are_those_of_the_runs() -> None:
    tables = made_up_comparison()
    start, pulse, *_ = fig_a_08.draw(tables).axes
    runs = tables["compare_runs"]
    for panel, begin in ((start, 0.0), (pulse, 16.0)):
        line = next(line for line in panel.lines if line.get_label() == "corrected")
        x, y = np.asarray(line.get_xdata(), dtype=float), np.asarray(line.get_ydata(), dtype=float)
        away = np.abs(runs["output_corrected"] - runs["output_unsaturated"]) / 40
        np.testing.assert_allclose(y, np.maximum(np.interp(begin + x, runs["time_s"], away), 1e-4), rtol=1e-3)
        assert "internal model" not in {line.get_label() for line in panel.lines}


def test_a_marker_says_recovery_control_and_guarantee() -> None:
    _, _, start, pulse = fig_a_08.draw(made_up_comparison()).axes
    for panel, scale in ((start, 1.0), (pulse, 0.5)):
        found = {(float(line.get_xdata()[0]), float(line.get_ydata()[0]), line.get_fillstyle()) for line in panel.lines}
        expected = {(3.0, 5.25, "none"), (9.0, 1.75, "full"), (12.0, 1.3125, "bottom")}
        assert found == {(scale * u, scale * recovery, style) for u, recovery, style in expected}
        colours = {str(line.get_color()) for line in panel.lines}
        assert LINES["conditioning"]["color"] in colours


@pytest.mark.parametrize(
    ("column", "said"),
    [
        ("recovery_s", "Never recovered: thesis anti-windup."),
        ("refused", "Not possible for this plant: internal model."),
        ("least_peak_error", "From 1.38 s on every controller leaves an error |r - y| of 2.62"),
    ],
)
def test_the_caption_says_the_numbers(column: str, said: str) -> None:
    tables = made_up_comparison()
    assert said in fig_a_08.caption(tables)
    tables["compare"][column] = None if column == "refused" else 7.5
    assert fig_a_08.caption(tables) != fig_a_08.caption(made_up_comparison())


def test_without_a_floor_no_error_is_forced() -> None:
    tables = made_up_comparison()
    tables["compare"]["least_peak_error"] *= 0
    assert "on no error is forced" in fig_a_08.caption(tables)
